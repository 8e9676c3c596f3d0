//! The light of a captured texel in 8 bytes, with a number below 512 beside it.
//!
//! x: red, green; y: blue in the lower half, then 7 bits of an exponent, then the number. The colours are parts of 65,535 of the
//! power of two above the largest: rounding is off by 1.6e-5 of that at most. Light from 2^-63 to 2^64 fits.
#define_import_path lightgraph::packed_light

struct Lit {
    light: vec3f,
    number: u32,
}

/// The bits of an f32's exponent for the least power of two that is kept.
const LEAST: u32 = 64u;

fn pack(light: vec3f, number: u32) -> vec2u {
    let largest = max(light.r, max(light.g, light.b));
    // Of the power above: one more than that of the number itself.
    let exponent = clamp((bitcast<u32>(largest) >> 23u) + 1u, LEAST, LEAST + 127u);
    let parts = light * bitcast<f32>((254u - exponent) << 23u);
    // As `pack2x16unorm` does, through signed numbers: software drivers turn floats into unsigned ones one by one.
    let steps = vec3u(vec3i(round(65535.0 * saturate(parts))));
    return vec2u(steps.r | steps.g << 16u, steps.b | (exponent - LEAST) << 16u | number << 23u);
}

fn unpack(words: vec2u) -> Lit {
    let power = bitcast<f32>(((words.y >> 16u & 127u) + LEAST) << 23u);
    return Lit(power * vec3f(unpack2x16unorm(words.x), unpack2x16unorm(words.y).x), words.y >> 23u);
}
