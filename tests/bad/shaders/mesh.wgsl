// The scene in white.
struct Targets {
    @location(0) color: vec4f,
}

@vertex
fn vertex(@location(0) position: vec3f) -> @builtin(position) vec4f {
    return vec4f(position, 1.0);
}

@fragment
fn fragment() -> Targets {
    return Targets(vec4f(1.0));
}
