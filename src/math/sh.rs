//! Real orthonormal spherical harmonics, in the order and with the signs that the shaders use.
//!
//! Coefficients lie in the order (l, m) = (0,0) (1,−1) (1,0) (1,1) (2,−2) …, with Y₀₀ = 0.282095,
//! Y₁ = 0.488603·(y, z, x), Y₂ = 1.092548·xy, 1.092548·yz, 0.315392·(3z² − 1), 1.092548·xz, 0.546274·(x² − y²).
//! There is no Condon-Shortley sign.

use super::cube;
use glam::DVec3;
use std::f64::consts::PI;

/// Number of coefficients with l ≤ `order`.
pub fn count(order: usize) -> usize {
    (order + 1) * (order + 1)
}

/// Place of coefficient (`l`, `m`); `m` from −`l` to `l`.
pub fn index(l: usize, m: isize) -> usize {
    debug_assert!(m.unsigned_abs() <= l);
    (l * (l + 1)).wrapping_add_signed(m)
}

/// The degree l of the coefficient at place `index`.
pub fn degree(index: usize) -> usize {
    index.isqrt()
}

/// All basis functions with l ≤ `order` in the unit direction `d`.
///
/// The recurrence over l runs on normalised associated Legendre functions divided by sinᵐθ, and sinᵐθ·cos mφ,
/// sinᵐθ·sin mφ are the real and imaginary part of (x + iy)ᵐ, so nothing divides by zero at the poles
/// (Press et al., "Numerical Recipes", 3rd edition, section 6.7).
pub fn basis(order: usize, d: DVec3) -> Vec<f64> {
    let mut out = vec![0.0; count(order)];
    // (x + iy)^m
    let (mut re, mut im) = (1.0, 0.0);
    // The normalised function of l = m.
    let mut diagonal = (0.25 / PI).sqrt();
    for m in 0..=order {
        if m > 0 {
            let k = m as f64;
            diagonal *= ((2.0 * k + 1.0) / (2.0 * k)).sqrt();
            (re, im) = (re * d.x - im * d.y, re * d.y + im * d.x);
        }
        let (mut before, mut p) = (0.0, diagonal);
        for l in m..=order {
            if l > m {
                (before, p) = (p, scale(l, m) * (d.z * p - before));
                before /= scale(l, m);
            }
            if m == 0 {
                out[index(l, 0)] = p;
            } else {
                out[index(l, m as isize)] = std::f64::consts::SQRT_2 * p * re;
                out[index(l, -(m as isize))] = std::f64::consts::SQRT_2 * p * im;
            }
        }
    }
    out
}

/// √((4l² − 1)/(l² − m²)), the factor of the recurrence; l > m.
fn scale(l: usize, m: usize) -> f64 {
    let (l, m) = (l as f64, m as f64);
    ((4.0 * l * l - 1.0) / (l * l - m * m)).sqrt()
}

/// Coefficients with l ≤ `order` of `radiance`, sampled at the texel centres of a cube map of `edge`² texels a
/// face: L_lm = Σ L(ω)·[`factors`].
pub fn project(order: usize, edge: u32, radiance: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let mut out = vec![0.0; count(order)];
    for face in 0..cube::FACES {
        for y in 0..edge {
            for x in 0..edge {
                let light = radiance(cube::direction(face, [x, y], edge));
                for (sum, factor) in out.iter_mut().zip(factors(order, face, [x, y], edge)) {
                    *sum += light * factor;
                }
            }
        }
    }
    out
}

/// What a texel's light counts in each coefficient: Y_lm(ω)·A(ω) at its centre, with its exact solid angle.
///
/// For constant light the sum over all texels is then 0 for degrees 1 to 3, as the cube's symmetries ask. Degree 4
/// holds a function with these symmetries (x⁴ + y⁴ + z⁴ − 3/5), so from there on the factor is a sum over 4² parts of
/// the texel.
pub fn factors(order: usize, face: u32, texel: [u32; 2], edge: u32) -> Vec<f64> {
    let parts = |n: u32| {
        let mut out = vec![0.0; count(order)];
        for i in 0..n * n {
            let part = [texel[0] * n + i % n, texel[1] * n + i / n];
            let area = cube::solid_angle(part, edge * n);
            for (sum, y) in out.iter_mut().zip(basis(order, cube::direction(face, part, edge * n))) {
                *sum += y * area;
            }
        }
        out
    };
    let mut out = parts(1);
    if order >= 4 {
        out.splice(count(3).., parts(4).drain(count(3)..));
    }
    out
}

/// Σ_lm c_l·Y_lm(`d`)·L_lm: the light that a radially symmetric lobe of transfer factors `c` round the unit direction
/// `d` takes from `coefficients`. Degrees for which `transfer` has no factor count nothing.
pub fn convolve(coefficients: &[f64], transfer: &[f64], d: DVec3) -> f64 {
    let order = degree(coefficients.len().max(1) - 1);
    let terms = coefficients.iter().zip(basis(order, d)).enumerate();
    terms.map(|(i, (c, b))| c * b * transfer.get(degree(i)).copied().unwrap_or(0.0)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lobe;

    const DIRECTIONS: [DVec3; 4] =
        [DVec3::X, DVec3::NEG_Z, DVec3::new(0.6, -0.48, 0.64), DVec3::new(-0.36, 0.8, -0.48)];

    /// Gauss-Legendre nodes and weights on −1..1, by Newton's method.
    fn gauss(n: usize) -> Vec<(f64, f64)> {
        let node = |i: usize| {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..50 {
                let (mut p0, mut p1) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
                }
                slope = n as f64 * (x * p1 - p0) / (x * x - 1.0);
                x -= p1 / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        };
        (0..n).map(node).collect()
    }

    /// ∫ over the sphere, exact for polynomials up to degree 2n − 1.
    fn integrate(n: usize, mut f: impl FnMut(DVec3, f64)) {
        for (z, w) in gauss(n) {
            let turns = 2 * n;
            for i in 0..turns {
                let (sin, cos) = (2.0 * PI * (i as f64 + 0.5) / turns as f64).sin_cos();
                let r = (1.0 - z * z).sqrt();
                f(DVec3::new(r * cos, r * sin, z), w * 2.0 * PI / turns as f64);
            }
        }
    }

    #[test]
    fn basis_is_orthonormal_to_order_ten() {
        let n = count(10);
        let mut gram = vec![0.0; n * n];
        integrate(16, |d, w| {
            let y = basis(10, d);
            for i in 0..n {
                for j in 0..n {
                    gram[i * n + j] += w * y[i] * y[j];
                }
            }
        });
        for i in 0..n {
            for j in 0..n {
                let want = f64::from(u8::from(i == j));
                assert!((gram[i * n + j] - want).abs() < 1e-11, "<Y_{i}, Y_{j}> = {}", gram[i * n + j]);
            }
        }
    }

    #[test]
    fn basis_has_the_documented_order_and_signs() {
        for d in DIRECTIONS {
            let y = basis(2, d);
            let want = [
                0.282095,
                0.488603 * d.y,
                0.488603 * d.z,
                0.488603 * d.x,
                1.092548 * d.x * d.y,
                1.092548 * d.y * d.z,
                0.315392 * (3.0 * d.z * d.z - 1.0),
                1.092548 * d.x * d.z,
                0.546274 * (d.x * d.x - d.y * d.y),
            ];
            for (got, want) in y.iter().zip(want) {
                assert!((got - want).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn index_and_degree_agree() {
        let mut place = 0;
        for l in 0..=10_usize {
            for m in -(l as isize)..=l as isize {
                assert_eq!((index(l, m), degree(place)), (place, l));
                place += 1;
            }
        }
    }

    #[test]
    fn constant_radiance_has_one_coefficient() {
        for edge in [2, 3, 5, 16, 32] {
            let c = project(3, edge, |_| 1.5);
            assert!((c[0] - 1.5 * (4.0 * PI).sqrt()).abs() < 1e-12);
            // Degrees 1 to 3 hold no function that the cube's symmetries leave alone, so they cancel for any edge.
            assert!(c[1..].iter().all(|v| v.abs() < 1e-12), "{edge}: {c:?}");
            for n in DIRECTIONS {
                assert!((convolve(&c, &lobe::irradiance(2), n) - PI * 1.5).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn degree_four_residue_of_constant_radiance_is_negligible() {
        for (edge, limit) in [(4, 3e-4), (8, 7e-5), (16, 2e-5)] {
            let c = project(4, edge, |_| 1.0);
            for n in DIRECTIONS {
                let relative = convolve(&c, &lobe::irradiance(4), n) / PI - 1.0;
                assert!(relative.abs() < limit, "{edge}: {relative}");
            }
        }
    }

    #[test]
    fn linear_radiance_gives_its_closed_form() {
        let (a, b) = (2.0, DVec3::new(0.3, -0.7, 0.4));
        for edge in [2, 3, 16] {
            let c = project(1, edge, |d| a + b.dot(d));
            for n in DIRECTIONS {
                let want = PI * a + 2.0 * PI / 3.0 * b.dot(n);
                assert!((convolve(&c, &lobe::irradiance(1), n) - want).abs() < 1e-6, "{edge}");
            }
        }
    }
}
