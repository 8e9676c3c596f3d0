@vertex fn place(
    @builtin(vertex_index) i: u32, @builtin(instance_index) instance: u32
) -> @builtin(position) vec4f {
    let corner = vec2f(f32(i % 2u), f32(i % 3u));
    return vec4f(corner - 1.0 + 0.8 * f32(instance), 0.5, 1.0);
}
@fragment fn shade(@builtin(position) at: vec4f) -> @location(0) vec4f { return vec4f(0.5, at.xyz); }
