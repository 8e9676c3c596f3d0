//! Gathers, at each pixel, those near it whose circles reach it.
var hdr: texture_2d<f32>;
var circles: texture_2d<f32>;

struct Params {
    widest: f32,
    samples: u32,
}
var<uniform> params: Params;

struct Image {
    @location(0) spread: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Image {
    let last = vec2f(textureDimensions(hdr)) - 1.0;
    let here = textureLoad(circles, vec2u(at.xy), 0).xy;
    var sum = textureLoad(hdr, vec2u(at.xy), 0).rgb;
    var weights = 1.0;
    for (var i = 0u; i < params.samples; i++) {
        let radius = params.widest * sqrt((f32(i) + 0.5) / f32(params.samples));
        let angle = 2.3999632 * f32(i);
        let near = vec2u(clamp(at.xy + radius * vec2f(cos(angle), sin(angle)), vec2f(0.0), last));
        let there = textureLoad(circles, near, 0).xy;
        // What lies behind is spread no further than what is before it.
        let circle = select(there.x, min(there.x, here.x), there.y > here.y);
        let weight = smoothstep(radius - 1.0, radius + 1.0, circle);
        sum += weight * textureLoad(hdr, near, 0).rgb;
        weights += weight;
    }
    return Image(vec4f(sum / weights, 1.0));
}
