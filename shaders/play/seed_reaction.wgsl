//! The first substance everywhere, with a few squares of the second one.

struct Out {
    @location(0) seeded: vec2f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Out {
    let cell = vec2i(at.xy) / 16;
    let seed = fract(sin(f32(cell.x * 127 + cell.y * 311)) * 43758.547);
    return Out(select(vec2f(1.0, 0.0), vec2f(0.5), seed > 0.9));
}
