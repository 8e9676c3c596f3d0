//! Triangles under construction, and the welded arrays a glTF primitive is made of.

use glam::{DAffine3, DVec2, DVec3};
use std::collections::BTreeMap;

/// Faces that meet at less than this angle (45 degrees) are shaded as one smooth surface.
const SMOOTH_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Coordinates are kept on a grid of a millionth: far below what shows, far above the last digit of `sin`, on which
/// systems differ.
const GRID: f64 = 1e6;

/// A corner of a triangle: position in metres and texture coordinate (0, 0 at the image's upper left).
#[derive(Debug, Clone, Copy)]
struct MeshVertex {
    position: DVec3,
    uv: DVec2,
}

/// Loose triangles, counter-clockwise seen from the front.
#[derive(Debug, Clone, Default)]
pub struct TriangleMesh {
    triangles: Vec<[MeshVertex; 3]>,
}

impl TriangleMesh {
    pub fn new() -> TriangleMesh {
        TriangleMesh::default()
    }

    /// Adds a triangle; one that has no area is left out.
    pub fn triangle(&mut self, corners: [DVec3; 3]) {
        self.push(corners, [DVec2::ZERO; 3]);
    }

    /// Adds a quadrilateral, its corners counter-clockwise from the lower left; it carries the whole of a texture.
    pub fn quad(&mut self, [a, b, c, d]: [DVec3; 4]) {
        let [ta, tb, tc, td] = [DVec2::new(0.0, 1.0), DVec2::new(1.0, 1.0), DVec2::new(1.0, 0.0), DVec2::new(0.0, 0.0)];
        self.push([a, b, c], [ta, tb, tc]);
        self.push([a, c, d], [ta, tc, td]);
    }

    fn push(&mut self, positions: [DVec3; 3], uvs: [DVec2; 3]) {
        let positions = positions.map(snap);
        let [a, b, c] = positions;
        if (b - a).cross(c - a).length_squared() > 0.0 {
            self.triangles.push(std::array::from_fn(|i| MeshVertex { position: positions[i], uv: uvs[i] }));
        }
    }

    /// Adds the triangles of another mesh.
    pub fn add(&mut self, other: TriangleMesh) {
        self.triangles.extend(other.triangles);
    }

    /// The same, moved. A mirror image keeps its front outside.
    pub fn transformed(self, transform: DAffine3) -> TriangleMesh {
        let mirrored = transform.matrix3.determinant() < 0.0;
        let mut out = TriangleMesh::new();
        for corners in self.triangles {
            let mut corners =
                corners.map(|c| MeshVertex { position: transform.transform_point3(c.position), uv: c.uv });
            if mirrored {
                corners.swap(1, 2);
            }
            out.push(corners.map(|c| c.position), corners.map(|c| c.uv));
        }
        out
    }

    pub fn moved(self, by: DVec3) -> TriangleMesh {
        self.transformed(DAffine3::from_translation(by))
    }

    /// The same, seen from behind: a solid becomes a room.
    pub fn inside_out(mut self) -> TriangleMesh {
        for corners in &mut self.triangles {
            corners.swap(1, 2);
        }
        self
    }

    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Shared vertices with normals, smooth over gentle edges. `textured` says whether the coordinates matter.
    pub fn weld(&self, textured: bool) -> Welded {
        let face_normals: Vec<DVec3> = self.triangles.iter().map(area_normal).collect();
        let mut faces_at: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
        for (face, corners) in self.triangles.iter().enumerate() {
            for corner in corners {
                faces_at.entry(key(corner.position)).or_default().push(face);
            }
        }
        let smooth = |face: usize, corner: &MeshVertex| -> DVec3 {
            let own = face_normals[face].normalize();
            let around = &faces_at[&key(corner.position)];
            let near = around.iter().map(|&f| face_normals[f]).filter(|n| n.normalize().dot(own) > SMOOTH_COSINE);
            snap(near.sum::<DVec3>().normalize())
        };
        let normals: Vec<[DVec3; 3]> =
            (0..self.triangles.len()).map(|f| std::array::from_fn(|i| smooth(f, &self.triangles[f][i]))).collect();
        let flat = normals.iter().zip(&face_normals).all(|(n, f)| n.iter().all(|n| n.dot(f.normalize()) > 0.999_999));

        let mut out = Welded { flat, ..Welded::default() };
        let mut seen = BTreeMap::new();
        for (corners, normals) in self.triangles.iter().zip(&normals) {
            for (corner, normal) in corners.iter().zip(normals) {
                let uv = if textured { corner.uv } else { DVec2::ZERO };
                let normal = if flat { DVec3::ZERO } else { *normal };
                let identity = (key(corner.position), key(normal), key(uv.extend(0.0)));
                let index = *seen.entry(identity).or_insert_with(|| {
                    out.positions.push(corner.position.as_vec3().to_array());
                    out.normals.push(normal.as_vec3().to_array());
                    out.uvs.push(uv.as_vec2().to_array());
                    out.positions.len() - 1
                });
                out.indices.push(index);
            }
        }
        out
    }
}

/// Arrays of one length, and three indices a triangle.
#[derive(Debug, Default)]
pub struct Welded {
    pub positions: Vec<[f32; 3]>,
    /// Meaningless when `flat`.
    pub normals: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub indices: Vec<usize>,
    /// Every face is its own plane: a reader's flat normals serve.
    pub flat: bool,
}

fn area_normal([a, b, c]: &[MeshVertex; 3]) -> DVec3 {
    (b.position - a.position).cross(c.position - a.position)
}

/// Adding zero turns -0 into 0, so that both are one vertex.
fn snap(v: DVec3) -> DVec3 {
    (v * GRID).round() / GRID + DVec3::ZERO
}

fn key(v: DVec3) -> [i64; 3] {
    (v * GRID).round().to_array().map(|x| x as i64)
}
