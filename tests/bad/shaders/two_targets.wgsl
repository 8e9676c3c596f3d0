// Two targets at once.
struct Targets {
    @location(0) color: vec4f,
    @location(1) extra: vec4f,
}

@fragment
fn fragment() -> Targets {
    return Targets(vec4f(1.0), vec4f(0.0));
}
