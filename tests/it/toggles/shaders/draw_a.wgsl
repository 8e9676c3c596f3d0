#import made::made
#import placed::seen

@vertex fn place(@location(0) position: vec3f, @location(3) node: u32) -> @builtin(position) vec4f {
    return seen(position, node);
}
@fragment fn shade(@builtin(position) at: vec4f) -> @location(0) vec4f { return made(at.xy) * 1.0; }
