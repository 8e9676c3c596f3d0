// Writes depth of its own.
struct Targets {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fragment() -> Targets {
    return Targets(vec4f(1.0), 0.5);
}
