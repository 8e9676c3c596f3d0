//! Primitives whose normals and triangles contradict each other.

use super::{Geometry, Primitive};
use glam::Vec3;

/// Share of its area whose normals point to the backs for a primitive to contradict itself.
const AGAINST: f64 = 0.9;

/// Volume by the area to the power of 3/2, both as [`Primitive::contradiction`] sums them up, from which on something
/// counts as closed: a ball has 0.2.
const SOLID: f64 = 0.02;

/// What of a primitive is flipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flipped {
    Nothing,
    Normals,
    Triangles,
}

impl Flipped {
    /// What the user should know of it.
    pub(super) fn notice(self) -> Option<&'static str> {
        match self {
            Flipped::Nothing => None,
            Flipped::Normals => Some("its normals point to the backs of its triangles; the normals are flipped"),
            Flipped::Triangles => {
                Some("its triangles' fronts look inwards, its normals outwards; the triangles are flipped")
            }
        }
    }
}

impl Primitive<'_> {
    /// Decides what to flip where nearly all normals point to the backs of triangles, which would be black. The front
    /// of a closed primitive is its outside; of others it follows from the order of corners, as glTF has it.
    pub(super) fn contradiction(&self) -> Flipped {
        let Some(normals) = self.normals else { return Flipped::Nothing };
        let origin = self.positions.iter().next().map_or(Vec3::ZERO, Vec3::from);
        let (mut all, mut against, mut volume) = (0.0, 0.0, 0.0);
        for triangle in self.triangles.iter() {
            let [a, b, c] = self.corners(triangle).map(|p| (p - origin).as_dvec3());
            let across = (b - a).cross(c - a);
            let given: Vec3 = triangle.iter().map(|i| Vec3::from(normals.get(*i as usize))).sum();
            let area = across.length();
            all += area;
            against += if across.dot(given.as_dvec3()) < 0.0 { area } else { 0.0 };
            volume += a.dot(across);
        }
        match against > AGAINST * all {
            false => Flipped::Nothing,
            true if volume < -SOLID * all.powf(1.5) => Flipped::Triangles,
            true => Flipped::Normals,
        }
    }
}

impl Geometry {
    /// Flips all triangles.
    pub(in crate::internals::scene) fn flip(&mut self) {
        self.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|t| t.swap(1, 2));
        self.vertices.iter_mut().for_each(|v| v.normal = v.normal.map(|x| -x));
        self.more.tangents.iter_mut().for_each(|t| t[3] = -t[3]);
    }
}
