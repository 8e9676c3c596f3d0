#import made::made

@fragment fn shade(@builtin(position) at: vec4f) -> @location(0) vec4f { return made(at.xy) * 2.0; }
