//! Halves an image: thirteen bilinear samples, as five overlapping squares.
var fine: texture_2d<f32>;
var smooth_sampler: sampler;

struct Half {
    @location(0) coarse: vec4f,
}

fn square(middle: vec2f, texel: vec2f, reach: f32) -> vec4f {
    var sum = vec4f(0.0);
    for (var i = 0u; i < 4u; i++) {
        let corner = vec2f(vec2u(i & 1u, i >> 1u)) * 2.0 - 1.0;
        sum += textureSampleLevel(fine, smooth_sampler, middle + corner * reach * texel, 0.0);
    }
    return 0.25 * sum;
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Half {
    let texel = 1.0 / vec2f(textureDimensions(fine));
    let middle = 2.0 * at.xy * texel;
    var sum = 0.5 * square(middle, texel, 1.0);
    for (var i = 0u; i < 4u; i++) {
        let corner = vec2f(vec2u(i & 1u, i >> 1u)) * 2.0 - 1.0;
        sum += 0.125 * square(middle + corner * texel, texel, 1.0);
    }
    return Half(vec4f(sum.rgb, 1.0));
}
