//! An image and what glows of it.
var hdr: texture_2d<f32>;
var glow: texture_2d<f32>;
var smooth_sampler: sampler;

struct Params {
    strength: f32,
    levels: u32,
}
var<uniform> params: Params;

struct Image {
    @location(0) result: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Image {
    let color = textureLoad(hdr, vec2u(at.xy), 0);
    let place = at.xy / vec2f(textureDimensions(hdr));
    let spread = textureSampleLevel(glow, smooth_sampler, place, 0.0).rgb / f32(params.levels);
    return Image(vec4f(color.rgb + params.strength * spread, color.a));
}
