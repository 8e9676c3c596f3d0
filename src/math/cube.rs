//! Cube maps: faces, texels, directions and solid angles, in WebGPU's convention.
//!
//! Faces are in the order +X −X +Y −Y +Z −Z. A texel's column runs along [`Axes::right`], its row along [`Axes::down`];
//! seen from the centre, texel (0, 0) is on the upper left (WebGPU specification, "Texture View Creation", cube faces).

use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::PI;

/// Faces of a cube.
pub const FACES: u32 = 6;

/// The frame of a face: a point (u, v) of −1..1 on it lies in the direction `forward + u·right + v·down`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    pub forward: DVec3,
    pub right: DVec3,
    pub down: DVec3,
}

/// The frame of `face`, 0 to 5; higher numbers wrap.
pub fn axes(face: u32) -> Axes {
    let (forward, right, down) = match face % FACES {
        0 => (DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y),
        1 => (DVec3::NEG_X, DVec3::Z, DVec3::NEG_Y),
        2 => (DVec3::Y, DVec3::X, DVec3::Z),
        3 => (DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z),
        4 => (DVec3::Z, DVec3::X, DVec3::NEG_Y),
        _ => (DVec3::NEG_Z, DVec3::NEG_X, DVec3::NEG_Y),
    };
    Axes { forward, right, down }
}

/// Where a texel's surface is looked for and found, to the right of its centre and below it, in texels.
pub const BESIDE: [f64; 2] = [1.5 / 256.0, 1.0 / 256.0];

/// Unit direction through the centre of a texel (column, row) of a face of `edge`² texels.
pub fn direction(face: u32, texel: [u32; 2], edge: u32) -> DVec3 {
    through(face, texel, edge, [0.0; 2])
}

/// Unit direction through the place of a texel where its surface is: [`BESIDE`] its centre.
pub fn direction_beside(face: u32, texel: [u32; 2], edge: u32) -> DVec3 {
    through(face, texel, edge, BESIDE)
}

fn through(face: u32, texel: [u32; 2], edge: u32, beside: [f64; 2]) -> DVec3 {
    let axes = axes(face);
    let at = |i: usize| (2.0 * (f64::from(texel[i]) + beside[i]) + 1.0) / f64::from(edge) - 1.0;
    (axes.forward + axes.right * at(0) + axes.down * at(1)).normalize()
}

/// Face, and (u, v) of −1..1 on it, that a direction meets.
pub fn locate(direction: DVec3) -> (u32, [f64; 2]) {
    let size = direction.abs();
    let (axis, negative) = if size.x >= size.y && size.x >= size.z {
        (0, direction.x < 0.0)
    } else if size.y >= size.z {
        (2, direction.y < 0.0)
    } else {
        (4, direction.z < 0.0)
    };
    let face = axis + u32::from(negative);
    let axes = axes(face);
    let depth = direction.dot(axes.forward);
    (face, [direction.dot(axes.right) / depth, direction.dot(axes.down) / depth])
}

/// Exact solid angle of a texel (column, row) of a face of `edge`² texels, in steradians.
///
/// The rectangle from the face's centre to (x, y) covers atan(xy/√(x² + y² + 1)); a texel is the difference over its
/// corners, so all texels together cover 4π.
pub fn solid_angle(texel: [u32; 2], edge: u32) -> f64 {
    let at = |i: u32| 2.0 * f64::from(i) / f64::from(edge) - 1.0;
    let [x0, y0] = texel.map(at);
    let [x1, y1] = texel.map(|i| at(i + 1));
    let corner = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
    corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)
}

/// A place on a panorama, in 0..1 from its left and its top, of a direction: straight ahead (−Z) in the middle, +X to
/// the right of that, up at the top.
pub fn panorama_place(d: Vec3) -> Vec2 {
    let bearing = d.x.atan2(-d.z) / (2.0 * PI);
    let height = d.y.clamp(-1.0, 1.0).asin() / (PI);
    Vec2::new((bearing + 0.5).rem_euclid(1.0), 0.5 - height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn solid_angles_cover_the_sphere() {
        for edge in [1, 2, 3, 5, 16, 128] {
            let face: f64 = (0..edge * edge).map(|i| solid_angle([i % edge, i / edge], edge)).sum();
            assert!((6.0 * face - 4.0 * PI).abs() < 1e-11, "{edge}: {}", 6.0 * face);
        }
    }

    #[test]
    fn faces_follow_the_webgpu_convention() {
        // Upper left texel of a face, from the table of the specification.
        let corners = [
            (0, DVec3::new(1.0, 1.0, 1.0)),
            (1, DVec3::new(-1.0, 1.0, -1.0)),
            (2, DVec3::new(-1.0, 1.0, -1.0)),
            (3, DVec3::new(-1.0, -1.0, 1.0)),
            (4, DVec3::new(-1.0, 1.0, 1.0)),
            (5, DVec3::new(1.0, 1.0, -1.0)),
        ];
        for (face, corner) in corners {
            let a = axes(face);
            assert_eq!(a.forward - a.right - a.down, corner, "face {face}");
        }
    }

    #[test]
    fn locate_inverts_direction() {
        for face in 0..FACES {
            for i in 0..25 {
                let texel = [i % 5, i / 5];
                let (f, [u, v]) = locate(direction(face, texel, 5));
                let cell = [u, v].map(|t| ((t + 1.0) * 2.5) as u32);
                assert_eq!((f, cell), (face, texel));
            }
        }
    }

    #[test]
    fn a_panorama_has_straight_ahead_in_its_middle() {
        for (d, expected) in [
            (Vec3::NEG_Z, Vec2::new(0.5, 0.5)),
            (Vec3::X, Vec2::new(0.75, 0.5)),
            (Vec3::NEG_X, Vec2::new(0.25, 0.5)),
            (Vec3::Y, Vec2::new(0.5, 0.0)),
        ] {
            let found = panorama_place(d);
            assert!(
                (found.y - expected.y).abs() < 1e-6 && (d == Vec3::Y || (found.x - expected.x).abs() < 1e-6),
                "{d}: {found}"
            );
        }
    }
}
