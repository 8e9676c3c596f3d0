//! An image darkened by how open its surfaces are, smoothed where depths agree.
var hdr: texture_2d<f32>;
var depth: texture_depth_2d;
var open: texture_2d<f32>;

struct Params {
    darkness: f32,
}
var<uniform> params: Params;

struct Image {
    @location(0) shaded: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Image {
    let pixel = vec2i(at.xy);
    let last = vec2i(textureDimensions(depth)) - 1;
    let here = textureLoad(depth, pixel, 0);
    var sum = 0.0;
    var weights = 0.0;
    for (var y = -2; y <= 2; y++) {
        for (var x = -2; x <= 2; x++) {
            let near = clamp(pixel + vec2i(x, y), vec2i(0), last);
            let apart = abs(textureLoad(depth, near, 0) - here) / max(1.0 - here, 1e-6);
            let weight = exp(-20.0 * apart);
            sum += weight * textureLoad(open, near, 0).r;
            weights += weight;
        }
    }
    let color = textureLoad(hdr, pixel, 0);
    return Image(vec4f(color.rgb * pow(sum / weights, params.darkness), color.a));
}
