//! Looks the colours of an image up in a table, in the values of sRGB that a display gets: trilinear between its
//! entries.
#import lightgraph::srgb::{decode, encode}

var hdr: texture_2d<f32>;
var table: texture_3d<f32>;
var smooth_sampler: sampler;

struct Params {
    share: f32,
}
var<uniform> params: Params;

struct Image {
    @location(0) graded: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Image {
    let color = textureLoad(hdr, vec2u(at.xy), 0).rgb;
    let shown = encode(clamp(color, vec3f(0.0), vec3f(1.0)));
    // Entries stand at the centres of texels, the first and the last included.
    let edge = vec3f(textureDimensions(table));
    let found = decode(textureSampleLevel(table, smooth_sampler, (shown * (edge - 1.0) + 0.5) / edge, 0.0).rgb);
    // What is brighter than a display can show stays so much brighter.
    let beyond = max(color - 1.0, vec3f(0.0));
    return Image(vec4f(mix(color, found + beyond, params.share), 1.0));
}
