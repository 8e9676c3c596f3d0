//! Two substances as colours.
var field: texture_2d<f32>;

struct Image {
    @location(0) color: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Image {
    let there = textureLoad(field, vec2u(at.xy), 0).xy;
    let edge = smoothstep(0.1, 0.35, there.y);
    return Image(vec4f(mix(vec3f(0.02, 0.03, 0.06), vec3f(0.95, 0.6, 0.25), edge) + 0.3 * there.y, 1.0));
}
