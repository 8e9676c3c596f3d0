//! The light of a captured texel in 8 bytes.
//!
//! x: red, green; y: blue in the lower half, then an exponent. The colours are parts of 65,535 of the
//! power of two above the largest: rounding is off by 1.6e-5 of that at most. Light from 2^-63 to 2^64 fits.
#define_import_path lightgraph::packed_light

/// The bits of an f32's exponent for the least power of two that is kept, and for the largest.
const LEAST: u32 = 64u;
const LARGEST: u32 = 191u;

fn pack(light: vec3f) -> vec2u {
    let largest = max(light.r, max(light.g, light.b));
    // Of the power above: one more than that of the number itself.
    let exponent = clamp((bitcast<u32>(largest) >> 23u) + 1u, LEAST, LARGEST);
    let parts = light * bitcast<f32>((254u - exponent) << 23u);
    return vec2u(pack2x16unorm(parts.rg), pack2x16unorm(vec2f(parts.b, 0.0)) | exponent << 16u);
}

fn unpack(words: vec2u) -> vec3f {
    let power = bitcast<f32>((words.y >> 16u) << 23u);
    return power * vec3f(unpack2x16unorm(words.x), unpack2x16unorm(words.y).x);
}
