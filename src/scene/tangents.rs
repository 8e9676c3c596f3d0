//! Tangents of surfaces with normal maps, where a file gives none: by the algorithm that the maps were made for.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec3, Vec4};

/// A corner of a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub position: [f32; 3],
    /// Unit.
    pub normal: [f32; 3],
    pub uv: [f32; 2],
}

struct FaceCorners<'a> {
    corners: &'a [[Corner; 3]],
    made: Vec<[[f32; 4]; 3]>,
}

impl Geometry for FaceCorners<'_> {
    fn num_faces(&self) -> usize {
        self.corners.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.corners[face][corner].position
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.corners[face][corner].normal
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.corners[face][corner].uv
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(tangent) = tangent {
            let [x, y, z, side] = tangent.tangent_encoded();
            // The algorithm was made for images whose v points up, as maps of normals have it; glTF's v points down.
            self.made[face][corner] = [x, y, z, -side];
        }
    }
}

/// Tangents of the corners of triangles, with the side of the third axis in w.
pub(super) fn made(corners: &[[Corner; 3]]) -> Vec<[[f32; 4]; 3]> {
    let mut all = FaceCorners { corners, made: vec![[[1.0, 0.0, 0.0, 1.0]; 3]; corners.len()] };
    // It fails where there is nothing to do; what it left out keeps an axis, and `beside` stands it on the normal.
    let _ = generate_tangents(&mut all);
    all.made
}

/// A tangent at right angles to a unit normal, of unit length.
pub(super) fn beside(tangent: [f32; 4], normal: Vec3) -> [f32; 4] {
    let tangent = Vec4::from(tangent);
    let along = tangent.truncate() - normal * normal.dot(tangent.truncate());
    let along = along.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
    along.extend(if tangent.w < 0.0 { -1.0 } else { 1.0 }).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tangent_points_where_u_grows_and_its_side_tells_mirrored_images() {
        let corner = |x: f32, y: f32, mirror: f32| Corner {
            position: [x, y, 0.0],
            normal: [0.0, 0.0, 1.0],
            uv: [mirror * x, -y],
        };
        for mirror in [1.0, -1.0] {
            let triangle = [corner(0.0, 0.0, mirror), corner(1.0, 0.0, mirror), corner(0.0, 1.0, mirror)];
            for tangent in made(&[triangle])[0] {
                // An image's v points down. A normal map's green points up in it: so does the third axis.
                assert_eq!(tangent, [mirror, 0.0, 0.0, mirror]);
            }
        }
        assert!(made(&[]).is_empty());
    }

    #[test]
    fn what_has_no_tangent_gets_one_beside_the_normal() {
        for tangent in [[0.0; 4], [0.0, 0.0, 1.0, -1.0], [f32::NAN, 0.0, 0.0, 1.0]] {
            let [x, y, z, w] = beside(tangent, Vec3::Z);
            assert!((x * x + y * y - 1.0).abs() < 1e-6 && z == 0.0 && w.abs() == 1.0, "{tangent:?}");
        }
    }
}
