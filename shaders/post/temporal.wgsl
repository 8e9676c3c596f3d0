//! Mixes last frame's image into this one's, from where each surface was seen then, held to the colours round the
//! pixel.
var hdr: texture_2d<f32>;
var depth: texture_depth_2d;
var last_image: texture_2d<f32>;
var smooth_sampler: sampler;

struct Params {
    camera_inverse_view_projection: mat4x4f,
    camera_previous_view_projection: mat4x4f,
    kept: f32,
}
var<uniform> params: Params;

struct Image {
    @location(0) filtered: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Image {
    let pixel = vec2i(at.xy);
    let size = vec2f(textureDimensions(hdr));
    let last = vec2i(size) - 1;
    let color = textureLoad(hdr, pixel, 0).rgb;
    var low = color;
    var high = color;
    for (var i = 0; i < 9; i++) {
        let near = textureLoad(hdr, clamp(pixel + vec2i(i % 3 - 1, i / 3 - 1), vec2i(0), last), 0).rgb;
        low = min(low, near);
        high = max(high, near);
    }
    let clip = vec2f(2.0, -2.0) * at.xy / size + vec2f(-1.0, 1.0);
    let world = params.camera_inverse_view_projection * vec4f(clip, textureLoad(depth, pixel, 0), 1.0);
    let before = params.camera_previous_view_projection * (world / world.w);
    let seen = vec2f(0.5, -0.5) * before.xy / before.w + 0.5;
    let inside = before.w > 0.0 && all(seen > vec2f(0.0)) && all(seen < vec2f(1.0));
    let kept = textureSampleLevel(last_image, smooth_sampler, seen, 0.0);
    // Before the first frame the image is transparent.
    let known = inside && kept.a > 0.5;
    return Image(vec4f(select(color, mix(color, clamp(kept.rgb, low, high), params.kept), known), 1.0));
}
