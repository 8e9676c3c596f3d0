//! 1 a texel to the right, 10 a texel down.
struct Ramp {
    @location(0) ramp: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Ramp {
    let texel = floor(at.xy);
    return Ramp(vec4f(texel.x + 10.0 * texel.y));
}
