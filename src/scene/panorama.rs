//! Panoramas: pictures of everything around a point, twice as wide as high.

use super::environment::{Environment, LARGEST_EDGE};
use crate::diag::{Checked, Diagnostic};
use crate::files;
use crate::image::decode::{Decoded, Numbers, decode};
use crate::image::{Image, exr::read_exr};
use crate::math::cube::panorama_place;
use glam::{Quat, Vec2, Vec3};
use std::path::Path;

/// Radiance by place on the picture, in rows from the top.
pub(super) struct Panorama {
    width: u32,
    height: u32,
    pixels: Vec<Vec3>,
}

/// As many pixels as 400 MB hold: 8192 by 4096.
const MAX_PIXELS: u64 = 1 << 25;

/// As many bytes as a Radiance file of so many pixels takes, with room for its head.
const MAX_BYTES: u64 = 1 << 28;

/// Reads a panorama. Numbers that are not finite, or negative, count as 0.
///
/// # Errors
/// A file that can't be read, is too large, of another kind, or not twice as wide as high.
pub(super) fn read(path: &Path) -> Result<Panorama, String> {
    let shown = path.display();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let image = match extension.as_str() {
        "exr" => read_exr(path)
            .map_err(|faults| faults.0.iter().map(|d| d.message.as_str()).collect::<Vec<_>>().join("; "))?,
        "hdr" => {
            let bytes = files::read(path, MAX_BYTES).map_err(|e| format!("can't read {shown}: {e}"))?;
            let Decoded { image, numbers } = decode(path, &bytes, MAX_PIXELS).map_err(|d| d.message)?;
            if numbers != Numbers::Floats {
                return Err(format!("{shown} is no Radiance picture (.hdr)"));
            }
            image
        }
        _ => return Err(format!("{shown}: an environment is a .hdr or .exr panorama")),
    };
    let Image { width, height, .. } = image;
    let pixels = image.rgb().map(Vec3::from).collect();
    Panorama::new(width, height, pixels).map_err(|why| format!("{shown} {why}"))
}

impl Environment {
    /// Light by direction as a picture has it: its middle is seen towards −Z, its upper edge is up.
    ///
    /// # Errors
    /// As of a panorama's file.
    pub fn panorama(image: &Image) -> Checked<Environment> {
        let pixels = image.rgb().map(Vec3::from).collect();
        let made = Panorama::new(image.width, image.height, pixels).map_err(|why| format!("the panorama {why}"));
        Ok(made.map_err(Diagnostic::error)?.environment(0.0, 1.0))
    }
}

impl Panorama {
    fn new(width: u32, height: u32, pixels: Vec<Vec3>) -> Result<Panorama, String> {
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            return Err(format!("has {width}×{height} pixels, more than {MAX_PIXELS}; make it smaller"));
        }
        if width != height.saturating_mul(2) || pixels.is_empty() || pixels.len() != (width * height) as usize {
            return Err(format!("has {width}×{height} pixels: a panorama of all directions is twice as wide as high"));
        }
        let sound = |x: f32| if x.is_finite() { x.max(0.0) } else { 0.0 };
        let pixels = pixels.into_iter().map(|p| Vec3::new(sound(p.x), sound(p.y), sound(p.z))).collect();
        Ok(Panorama { width, height, pixels })
    }

    /// Turned by an angle in radians towards the east, and made stronger.
    pub fn environment(&self, rotation: f32, strength: f32) -> Environment {
        let count = self.width * self.height;
        let edge = count.isqrt().next_power_of_two().clamp(1, LARGEST_EDGE);
        // Enough directions that no pixel is left out.
        let side = (1.5 * (count as f32).sqrt() / edge as f32).ceil().clamp(2.0, 6.0) as u32;
        let back = Quat::from_rotation_y(rotation);
        Environment::from_fn(edge, side, |d| strength * self.at(panorama_place(back * d)))
    }

    /// Between the centres of four pixels.
    fn at(&self, place: Vec2) -> Vec3 {
        let at = place * Vec2::new(self.width as f32, self.height as f32) - 0.5;
        let (low, share) = (at.floor(), at - at.floor());
        let pixel = |dx: i32, dy: i32| {
            let x = (low.x as i32 + dx).rem_euclid(self.width as i32);
            let y = (low.y as i32 + dy).clamp(0, self.height as i32 - 1);
            self.pixels[y as usize * self.width as usize + x as usize]
        };
        let (above, below) = (pixel(0, 0).lerp(pixel(1, 0), share.x), pixel(0, 1).lerp(pixel(1, 1), share.x));
        above.lerp(below, share.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(of: impl Fn(u32, u32) -> Vec3) -> Panorama {
        let (width, height) = (64, 32);
        let pixels = (0..width * height).map(|i| of(i % width, i / width)).collect();
        Panorama { width, height, pixels }
    }

    #[test]
    fn a_uniform_picture_is_a_uniform_environment() {
        let e = picture(|_, _| Vec3::new(1.0, 2.0, 3.0)).environment(0.7, 2.0);
        assert!((e.mean() - Vec3::new(2.0, 4.0, 6.0)).length() < 1e-5, "{}", e.mean());
    }

    #[test]
    fn a_bright_pixel_gives_its_solid_angle_of_light() {
        let e = picture(|x, y| if (x, y) == (40, 10) { Vec3::splat(1e4) } else { Vec3::ZERO }).environment(0.0, 1.0);
        let height = (10.5_f32 / 32.0 * std::f32::consts::PI).sin();
        let angle = height * (std::f32::consts::PI / 32.0).powi(2);
        let expected = 1e4 * angle / (4.0 * std::f32::consts::PI);
        assert!((e.mean().x / expected - 1.0).abs() < 0.02, "{} not {expected}", e.mean().x);
    }

    #[test]
    fn a_rotation_turns_the_middle_to_the_east() {
        let e = picture(|x, _| if (31..33).contains(&x) { Vec3::X } else { Vec3::ZERO });
        let turn = std::f32::consts::FRAC_PI_2;
        let back = Quat::from_rotation_y(turn);
        assert!(e.at(panorama_place(back * Vec3::X)).x > 0.9);
        assert!(e.at(panorama_place(back * Vec3::NEG_Z)).x < 0.1);
    }
}
