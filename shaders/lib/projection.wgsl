//! What a texel of a cube counts in each coefficient: its share of a projection.
//!
//! With LEAST_SQUARES the shares are (YᵀAY)⁻¹YᵀA, with Y the harmonics at the centres of all texels and A their solid
//! angles: of all light in the harmonics, that which differs least from what the texels hold. Light that is in the
//! harmonics is found again to rounding, however coarse the cube. Without, they are YᵀA, a plain integral.
//!
//! DERINGING damps ringing: it takes from the higher degrees, and sharpness with it (Sloan, "Stupid Spherical Harmonics
//! Tricks", 2008). 0 none, 1 Hann, 2 Lanczos; of the width ORDER + 1.
#define_import_path lightgraph::projection
#import lightgraph::cube::{direction, solid_angle}
#import lightgraph::sh::{COUNT, ORDER, basis}

#ifdef LEAST_SQUARES
/// (YᵀAY)⁻¹, row by row.
var<storage, read> inverse_gram: array<f32>;
#endif

/// What the window leaves of a degree.
fn window(degree: u32) -> f32 {
    let angle = 3.14159265359 * f32(degree) / f32(ORDER + 1u);
#if DERINGING == 1
    return 0.5 + 0.5 * cos(angle);
#else if DERINGING == 2
    return select(sin(angle) / max(angle, 1e-20), 1.0, degree == 0u);
#else
    return 1.0;
#endif
}

/// The shares of a texel of a face of `edge`² texels in every coefficient.
fn factors(face: u32, texel: vec2u, edge: u32) -> array<f32, COUNT> {
    var y = basis(direction(face, texel, edge));
    let area = solid_angle(texel, edge);
    var shares: array<f32, COUNT>;
#ifdef LEAST_SQUARES
    for (var k = 0u; k < COUNT; k++) {
        for (var j = 0u; j < COUNT; j++) {
            shares[k] += inverse_gram[k * COUNT + j] * y[j] * area;
        }
    }
#else
    for (var k = 0u; k < COUNT; k++) {
        shares[k] = y[k] * area;
    }
#if SH_ORDER >= 4
    // Sums over texel centres cancel for constant light up to degree 3, as the cube's symmetries ask. Degree 4 holds a
    // function with these symmetries (x⁴ + y⁴ + z⁴ - 3/5), so from there on the share is a finer sum within the texel.
    for (var k = 16u; k < COUNT; k++) {
        shares[k] = 0.0;
    }
    for (var i = 0u; i < 16u; i++) {
        let part = texel * 4u + vec2u(i % 4u, i / 4u);
        var finer = basis(direction(face, part, edge * 4u));
        let part_area = solid_angle(part, edge * 4u);
        for (var k = 16u; k < COUNT; k++) {
            shares[k] += finer[k] * part_area;
        }
    }
#endif
#endif
    for (var l = 0u; l <= ORDER; l++) {
        let left = window(l);
        for (var k = l * l; k < (l + 1u) * (l + 1u); k++) {
            shares[k] *= left;
        }
    }
    return shares;
}
