#import placed::seen

struct Out { @location(0) kept: vec4f }

@vertex fn place(@location(0) position: vec3f, @location(3) node: u32) -> @builtin(position) vec4f {
    return seen(position, node);
}
@fragment fn shade(@builtin(position) at: vec4f) -> Out { return Out(vec4f(at.x * 0.1, 0.1, 0.2, 1.0)); }
