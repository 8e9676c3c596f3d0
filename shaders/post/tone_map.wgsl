//! Exposes an image and maps its luminance to what a display shows: linear below, bent above.
var hdr: texture_2d<f32>;
#if AUTOMATIC == true
var logarithms: texture_2d<f32>;
var total: texture_2d<f32>;
#endif

struct Params {
    key: f32,
    stops: f32,
    white: f32,
}
var<uniform> params: Params;

struct Image {
    @location(0) mapped: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Image {
    var exposure = exp2(params.stops);
#if AUTOMATIC == true
    let counted = textureDimensions(logarithms);
    let mean = exp2(textureLoad(total, vec2u(0u), 0).r / f32(counted.x * counted.y));
    exposure *= params.key / mean;
#endif
    let color = exposure * textureLoad(hdr, vec2u(at.xy), 0).rgb;
    let luminance = dot(color, vec3f(0.2126, 0.7152, 0.0722));
    let bent = luminance * (1.0 + luminance / (params.white * params.white)) / (1.0 + luminance);
    return Image(vec4f(color * bent / max(luminance, 1e-6), 1.0));
}
