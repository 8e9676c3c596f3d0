//! Reflection of light in spherical harmonics by Lambert and Phong lobes.
//!
//! A lobe round a direction C reflects the sum over (l, m) of c_l * Y_lm(C) * L_lm
//! (Ramamoorthi and Hanrahan, "A Signal-Processing Framework for Inverse Rendering", 2001).
#define_import_path lightgraph::brdf
#import lightgraph::sh::{COUNT, ORDER, basis}

/// A Lambert surface's c_l: 1, 2/3, 1/4, 0, -1/24: c_l = c_(l-2) * (3 - l)/(l + 2) from l = 2 on. The next, 1/64, and
/// all after it count as 0: what they would add to an image is not seen, and the more harmonics there are, the more it
/// costs.
fn lambert_factor(l: u32) -> f32 {
    let low = select(2.0 / 3.0, 1.0, l == 0u);
    let even = select(-1.0 / 24.0, 0.25, l == 2u);
    return select(select(0.0, even, l == 2u || l == 4u), low, l < 2u);
}

/// Weights of the coefficients in the radiance that a Lambert surface of albedo 1 reflects.
fn lambert_weights(normal: vec3f) -> array<f32, COUNT> {
    var w = basis(normal);
    for (var l = 1u; l <= ORDER; l++) {
        for (var k = l * l; k < (l + 1u) * (l + 1u); k++) {
            w[k] *= lambert_factor(l);
        }
    }
    return w;
}

/// Weights of the coefficients in the radiance that a Phong lobe of strength 1 reflects from round `mirror`.
/// Factors c_l = c_(l-2) * (n - l + 2)/(n + l + 1), from c_0 = 1 and c_1 = (n + 1)/(n + 2).
fn phong_weights(mirror: vec3f, shininess: f32) -> array<f32, COUNT> {
    let n = shininess;
    var w = basis(mirror);
    var before = vec2f(1.0, 1.0);
    for (var l = 1u; l <= ORDER; l++) {
        let degree = f32(l);
        let c = select(before.x * (n - degree + 2.0) / (n + degree + 1.0), (n + 1.0) / (n + 2.0), l == 1u);
        before = vec2f(before.y, c);
        for (var k = l * l; k < (l + 1u) * (l + 1u); k++) {
            w[k] *= c;
        }
    }
    return w;
}
