//! Spreads a coarse image over one of twice its size, to be added there: nine bilinear samples in a tent.
var coarse: texture_2d<f32>;
var smooth_sampler: sampler;

struct Twice {
    @location(0) fine: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Twice {
    let texel = 1.0 / vec2f(textureDimensions(coarse));
    var sum = vec3f(0.0);
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let weight = f32((2 - abs(x)) * (2 - abs(y))) / 16.0;
            let place = (0.5 * at.xy + vec2f(vec2i(x, y))) * texel;
            sum += weight * textureSampleLevel(coarse, smooth_sampler, place, 0.0).rgb;
        }
    }
    return Twice(vec4f(sum, 0.0));
}
