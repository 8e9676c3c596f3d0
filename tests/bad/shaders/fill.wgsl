// A whole target in one colour.
struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Targets {
    return Targets(vec4f(1.0));
}
