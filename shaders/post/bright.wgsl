//! What of an image glows, at half its size.
var hdr: texture_2d<f32>;
var<uniform> threshold: f32;

struct Half {
    @location(0) bright: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Half {
    let corner = 2u * vec2u(at.xy);
    let last = textureDimensions(hdr) - 1u;
    var sum = vec4f(0.0);
    for (var i = 0u; i < 4u; i++) {
        let color = textureLoad(hdr, min(corner + vec2u(i & 1u, i >> 1u), last), 0).rgb;
        let luminance = dot(color, vec3f(0.2126, 0.7152, 0.0722));
        // Weighed by luminance, so that one very bright texel does not flicker.
        let share = max(luminance - threshold, 0.0) / max(luminance, 1e-6);
        sum += vec4f(color * share, 1.0) / (1.0 + luminance);
    }
    return Half(vec4f(sum.rgb / sum.a, 1.0));
}
