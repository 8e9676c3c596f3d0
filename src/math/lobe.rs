//! Transfer factors of radially symmetric lobes: how much of each degree of the incoming light a surface reflects.
//!
//! A lobe ρ(θ) = f·cosθ round a central direction C (Lambert: the normal; Phong: the mirror direction) reflects
//! L = Σ_lm c_l·Y_lm(C)·L_lm with c_l = √(4π/(2l + 1))·ρ̂_l, ρ̂_l = 2π∫ρ(θ)·Y_l0(θ)·sinθ dθ
//! (Ramamoorthi and Hanrahan, "A Signal-Processing Framework for Inverse Rendering", 2001).

use std::f64::consts::PI;

/// Factors for l = 0 to `order` that turn coefficients of radiance into irradiance: π, 2π/3, π/4, 0, −π/24, …
pub fn irradiance(order: usize) -> Vec<f64> {
    let factor = |l: usize| match l {
        0 => PI,
        1 => 2.0 * PI / 3.0,
        l if l % 2 == 1 => 0.0,
        l => {
            // 2π·(−1)^(l/2 − 1)/((l + 2)(l − 1)) · l!/(2^l·((l/2)!)²); the last is a product of (2i − 1)/(2i).
            let half = l / 2;
            let central: f64 = (1..=half).map(|i| (2 * i - 1) as f64 / (2 * i) as f64).product();
            let sign = if half % 2 == 1 { 1.0 } else { -1.0 };
            sign * 2.0 * PI / ((l + 2) as f64 * (l - 1) as f64) * central
        }
    };
    (0..=order).map(factor).collect()
}

/// Factors for l = 0 to `order` of a Lambert surface of the given albedo: albedo/π times those of [`irradiance`].
pub fn lambert(order: usize, albedo: f64) -> Vec<f64> {
    irradiance(order).into_iter().map(|a| a * albedo / PI).collect()
}

/// Factors for l = 0 to `order` of the Phong lobe f·cosθ = k·(n + 1)/(2π)·cosⁿα round the mirror direction, with
/// `strength` k and exponent `shininess` n. The order of use grows like √n.
///
/// c_l = c_{l−2}·(n − l + 2)/(n + l + 1), from c₀ = k and c₁ = k·(n + 1)/(n + 2).
pub fn phong(order: usize, strength: f64, shininess: f64) -> Vec<f64> {
    let n = shininess;
    let mut factors = vec![strength, strength * (n + 1.0) / (n + 2.0)];
    for l in 2..=order {
        let k = l as f64;
        factors.push(factors[l - 2] * (n - k + 2.0) / (n + k + 1.0));
    }
    factors.truncate(order + 1);
    factors
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2π ∫₀¹ ρ(c)·P_l(c) dc with P_l the Legendre polynomial, by Simpson's rule: c_l without the square roots.
    fn quadrature(l: usize, lobe: impl Fn(f64) -> f64) -> f64 {
        let legendre = |x: f64| {
            let (mut p0, mut p1) = (1.0, x);
            for k in 1..l {
                let k = k as f64;
                (p0, p1) = (p1, ((2.0 * k + 1.0) * x * p1 - k * p0) / (k + 1.0));
            }
            if l == 0 { 1.0 } else { p1 }
        };
        let steps = 20_000;
        let term = |i: usize| {
            let weight = if i == 0 || i == steps { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
            let x = i as f64 / steps as f64;
            weight * lobe(x) * legendre(x)
        };
        2.0 * PI * (0..=steps).map(term).sum::<f64>() / (3 * steps) as f64
    }

    #[test]
    fn irradiance_factors_are_the_known_ones() {
        let want = [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0, 0.0, PI / 64.0];
        for (l, (got, want)) in irradiance(6).into_iter().zip(want).enumerate() {
            assert!((got - want).abs() < 1e-15, "{l}: {got}");
            assert!((quadrature(l, |c| c) - want).abs() < 1e-9, "{l}");
        }
    }

    #[test]
    fn phong_factors_are_the_lobe_integrals() {
        for n in [1.0, 2.0, 5.5, 20.0, 80.0] {
            for (l, got) in phong(8, 0.4, n).into_iter().enumerate() {
                let want = quadrature(l, |c| 0.4 * (n + 1.0) / (2.0 * PI) * c.powf(n));
                assert!((got - want).abs() < 1e-6, "n = {n}, l = {l}: {got} and {want}");
            }
        }
    }

    #[test]
    fn phong_of_exponent_one_is_lambert() {
        for (p, d) in phong(6, 0.7, 1.0).into_iter().zip(lambert(6, 0.7)) {
            assert!((p - d).abs() < 1e-15);
        }
    }

    #[test]
    fn order_zero_has_one_factor() {
        assert_eq!(phong(0, 0.5, 10.0), [0.5]);
        assert_eq!(lambert(0, 0.5), [0.5]);
    }
}
