//! The light that particles left in each pixel.
var<storage, read> hits: array<u32>;
var<uniform> screen: vec2u;

struct Image {
    @location(0) color: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Image {
    let first = 3u * (u32(at.y) * screen.x + u32(at.x));
    let light = vec3f(f32(hits[first]), f32(hits[first + 1u]), f32(hits[first + 2u])) / 256.0;
    return Image(vec4f(0.35 * light, 1.0));
}
