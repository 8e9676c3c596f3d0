// Writes integers.
struct Targets {
    @location(0) color: vec4u,
}

@fragment
fn fragment() -> Targets {
    return Targets(vec4u(1u));
}
