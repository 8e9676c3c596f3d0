//! The light of a clear sky by the place of the sun.
//!
//! Source: Preetham, Shirley, Smits, "A Practical Analytic Model for Daylight", SIGGRAPH 1999, appendix A.2. The sun
//! itself is a light of its own.

use glam::{DMat3, DVec3, DVec4, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// A clear sky and the ground below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sky {
    /// Unit, towards the sun.
    pub sun: Vec3,
    /// Illuminance of a surface that faces the sun, lx: the sky is as bright as goes with it.
    pub sun_lux: f32,
    /// Haze, 2 (clear) to 10.
    pub turbidity: f32,
    /// Share of the light that the ground reflects, by colour.
    pub ground: Vec3,
}

/// Turbidities that the model was fitted to.
pub const TURBIDITY: [f32; 2] = [1.9, 10.0];

/// Least height of the sun in degrees: below, the model has no light.
pub const LOWEST_SUN: f32 = 1.0;

/// Distribution coefficients A to E of Y, x and y: the factor of the turbidity, and the constant.
const DISTRIBUTION: [[(f64, f64); 5]; 3] = [
    [(0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)],
    [(-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)],
    [(-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)],
];

/// Of x and y at the zenith: rows for T², T, 1, columns for the cube of the sun's angle from the zenith down to 1.
const ZENITH: [[[f64; 4]; 3]; 2] = [
    [[0.00166, -0.00375, 0.00209, 0.0], [-0.02903, 0.06377, -0.03202, 0.00394], [0.11693, -0.21196, 0.06052, 0.25886]],
    [[0.00275, -0.00610, 0.00317, 0.0], [-0.04214, 0.08970, -0.04153, 0.00516], [0.15346, -0.26756, 0.06670, 0.26688]],
];

/// A sky made ready to be asked.
pub struct Model {
    sun: DVec3,
    zenith_angle: f64,
    /// By Y, x, y.
    coefficients: [[f64; 5]; 3],
    /// Of Y (cd/m²), x, y at the zenith.
    zenith: [f64; 3],
    scale: f64,
    ground: DVec3,
}

impl Sky {
    pub fn model(&self) -> Model {
        let turbidity = f64::from(self.turbidity);
        // The model has no light from a sun at or below the horizon.
        let least = f64::from(LOWEST_SUN).to_radians();
        let height = f64::from(self.sun.y.clamp(-1.0, 1.0)).asin().clamp(least, FRAC_PI_2);
        let flat = DVec3::new(self.sun.x.into(), 0.0, self.sun.z.into()).try_normalize().unwrap_or(DVec3::NEG_Z);
        let zenith_angle = FRAC_PI_2 - height;
        let coefficients = DISTRIBUTION.map(|row| row.map(|(factor, constant)| factor * turbidity + constant));
        let chi = (4.0 / 9.0 - turbidity / 120.0) * (PI - 2.0 * zenith_angle);
        let luminance = 1000.0 * ((4.0453 * turbidity - 4.9710) * chi.tan() - 0.2155 * turbidity + 2.4192);
        let angles = DVec4::new(zenith_angle.powi(3), zenith_angle.powi(2), zenith_angle, 1.0);
        let chromaticity = |rows: [[f64; 4]; 3]| {
            let [square, linear, constant] = rows.map(|row| DVec4::from(row).dot(angles));
            turbidity * turbidity * square + turbidity * linear + constant
        };
        let mut model = Model {
            sun: (flat * height.cos()).with_y(height.sin()),
            zenith_angle,
            coefficients,
            zenith: [luminance.max(0.0), chromaticity(ZENITH[0]), chromaticity(ZENITH[1])],
            scale: f64::from(self.sun_lux) / sun_illuminance(height),
            ground: DVec3::ZERO,
        };
        let light = model.irradiance() + f64::from(self.sun_lux) * height.sin();
        model.ground = self.ground.as_dvec3() / PI * light;
        model
    }
}

/// Illuminance of a surface that faces the sun through a clear sky, lx: 127.5 klx outside of the atmosphere, lost by
/// 0.21 an air mass (Illuminating Engineering Society, RP-21, "Calculation of Daylight Availability", 1984).
fn sun_illuminance(height: f64) -> f64 {
    127_500.0 * (-0.21 / height.sin()).exp()
}

impl Model {
    /// Radiance from a unit direction, linear sRGB primaries.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let d = direction.as_dvec3();
        if d.y < 0.0 { self.ground.as_vec3() } else { self.above(d).as_vec3() }
    }

    fn above(&self, d: DVec3) -> DVec3 {
        // At the horizon itself the model's distribution has a pole.
        let cosine = d.y.max(0.01);
        let gamma = d.dot(self.sun).clamp(-1.0, 1.0).acos();
        let value = |i: usize| {
            let c = &self.coefficients[i];
            let here = perez(c, cosine, gamma);
            self.zenith[i] * here / perez(c, 1.0, self.zenith_angle)
        };
        rgb(value(0) * self.scale, value(1), value(2))
    }

    /// Of the sky without the sun, on flat ground.
    fn irradiance(&self) -> DVec3 {
        const RINGS: u32 = 24;
        const STEPS: u32 = 48;
        let mut sum = DVec3::ZERO;
        for ring in 0..RINGS {
            // Equal shares of the cosine's square: every direction counts alike.
            let cosine = ((f64::from(ring) + 0.5) / f64::from(RINGS)).sqrt();
            let across = (1.0 - cosine * cosine).sqrt();
            for step in 0..STEPS {
                let (sine, along) = (2.0 * PI * (f64::from(step) + 0.5) / f64::from(STEPS)).sin_cos();
                sum += self.above(DVec3::new(across * along, cosine, across * sine));
            }
        }
        sum * PI / f64::from(RINGS * STEPS)
    }
}

/// The formula of Perez et al. for the distribution of light over the sky.
fn perez([a, b, c, d, e]: &[f64; 5], cosine: f64, gamma: f64) -> f64 {
    (1.0 + a * (b / cosine).exp()) * (1.0 + c * (d * gamma).exp() + e * gamma.cos().powi(2))
}

/// CIE xyY to linear sRGB (IEC 61966-2-1); what lies outside of it is cut off.
fn rgb(luminance: f64, x: f64, y: f64) -> DVec3 {
    let tristimulus = DVec3::new(x / y, 1.0, (1.0 - x - y) / y) * luminance;
    let m = DMat3::from_cols(
        DVec3::new(3.2406, -0.9689, 0.0557),
        DVec3::new(-1.5372, 1.8758, -0.2040),
        DVec3::new(-0.4986, 0.0415, 1.0570),
    );
    (m * tristimulus).max(DVec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(height: f32, turbidity: f32) -> Model {
        let (y, x) = height.to_radians().sin_cos();
        Sky { sun: Vec3::new(x, y, 0.0), sun_lux: 80_000.0, turbidity, ground: Vec3::splat(0.2) }.model()
    }

    #[test]
    fn a_clear_sky_gives_a_tenth_to_a_third_of_the_sun_s_light() {
        // Measured clear skies give 10 to 20 klx on flat ground at such heights of the sun.
        for height in [25.0, 45.0, 65.0] {
            let e = sky(height, 2.5).irradiance();
            let luminance = DVec3::new(0.2126, 0.7152, 0.0722).dot(e);
            assert!((6_000.0..30_000.0).contains(&luminance), "{height}: {luminance}");
        }
    }

    #[test]
    fn the_sky_is_blue_away_from_the_sun_and_brightest_near_it() {
        let model = sky(40.0, 2.5);
        let away = model.radiance(Vec3::new(-0.6, 0.8, 0.0));
        assert!(away.z > 1.3 * away.x, "{away}");
        let near = model.radiance(Vec3::new(0.77, 0.64, 0.0).normalize());
        assert!(near.element_sum() > 3.0 * away.element_sum(), "{near} {away}");
    }

    #[test]
    fn every_direction_of_every_sky_has_a_finite_light() {
        for height in [-20.0, 0.0, 1.0, 10.0, 60.0, 90.0] {
            for turbidity in TURBIDITY {
                let model = sky(height, turbidity);
                for i in 0..200 {
                    let y = i as f32 / 100.0 - 1.0;
                    let found = model.radiance(Vec3::new((1.0 - y * y).max(0.0).sqrt(), y, 0.0));
                    assert!(found.is_finite() && found.min_element() >= 0.0, "{height} {turbidity} {y}: {found}");
                }
            }
        }
    }
}
