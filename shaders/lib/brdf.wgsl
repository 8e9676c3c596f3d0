//! Reflection of light in spherical harmonics by Lambert and Phong lobes.
//!
//! A lobe round a direction C reflects the sum over (l, m) of c_l * Y_lm(C) * L_lm
//! (Ramamoorthi and Hanrahan, "A Signal-Processing Framework for Inverse Rendering", 2001).
#define_import_path lightgraph::brdf
#import lightgraph::sh::{COUNT, basis}

/// Weights of the coefficients in the radiance that a Lambert surface of albedo 1 reflects.
/// Factors c_l: 1, 2/3, 1/4, 0, -1/24.
fn lambert_weights(normal: vec3f) -> array<f32, COUNT> {
    var w = basis(normal);
    for (var k = 1u; k < COUNT; k++) {
        // Degrees 1, 2, 3 and 4 begin at k = 1, 4, 9 and 16.
        let even = select(0.25, select(0.0, -1.0 / 24.0, k >= 16u), k >= 9u);
        w[k] *= select(even, 2.0 / 3.0, k < 4u);
    }
    return w;
}

/// Weights of the coefficients in the radiance that a Phong lobe of strength 1 reflects from round `mirror`.
/// Factors c_l = c_(l-2) * (n - l + 2)/(n + l + 1), from c_0 = 1 and c_1 = (n + 1)/(n + 2).
fn phong_weights(mirror: vec3f, shininess: f32) -> array<f32, COUNT> {
    let n = shininess;
    let one = (n + 1.0) / (n + 2.0);
    let two = n / (n + 3.0);
    let three = one * (n - 1.0) / (n + 4.0);
    let four = two * (n - 2.0) / (n + 5.0);
    var w = basis(mirror);
    for (var k = 1u; k < COUNT; k++) {
        let high = select(two, select(three, four, k >= 16u), k >= 9u);
        w[k] *= select(high, one, k < 4u);
    }
    return w;
}
