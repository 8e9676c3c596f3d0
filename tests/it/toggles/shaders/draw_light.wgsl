#import placed::lit

@vertex fn place(
    @location(0) position: vec3f, @location(3) node: u32, @builtin(instance_index) light: u32
) -> @builtin(position) vec4f {
    return lit(light, position, node);
}
@fragment fn shade(@builtin(position) at: vec4f) -> @location(0) vec4f { return vec4f(at.z, 0.5, at.xy); }
