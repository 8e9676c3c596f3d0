//! Primitives whose normals and triangles contradict each other.

use super::{Geometry, Primitive};
use glam::Vec3;

/// Share of its area whose normals point to the backs for a primitive to contradict itself.
const AGAINST: f64 = 0.9;

/// Volume by the area to the power of 3/2, both as [`Primitive::contradiction`] sums them up, from which on something
/// counts as closed: a ball has 0.2.
const SOLID: f64 = 0.02;

/// What is turned round of a primitive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turned {
    Nothing,
    Normals,
    Triangles,
}

impl Turned {
    /// What to say of it.
    pub(super) fn told(self) -> Option<&'static str> {
        match self {
            Turned::Nothing => None,
            Turned::Normals => Some("its normals point to the backs of its triangles; the normals are turned round"),
            Turned::Triangles => {
                Some("its triangles' fronts look inwards, its normals outwards; the triangles are turned round")
            }
        }
    }
}

impl Primitive<'_> {
    /// What is to be turned round where nearly all normals point to the backs of triangles, which would be black. Of
    /// what is closed that side is the front that looks outwards; else the order of corners says it, as glTF has it.
    pub(super) fn contradiction(&self) -> Turned {
        let Some(normals) = self.normals else { return Turned::Nothing };
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
            false => Turned::Nothing,
            true if volume < -SOLID * all.powf(1.5) => Turned::Triangles,
            true => Turned::Normals,
        }
    }
}

impl Geometry {
    /// Makes fronts of all backs.
    pub(in crate::internals::scene) fn turn_round(&mut self) {
        self.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|t| t.swap(1, 2));
        self.vertices.iter_mut().for_each(|v| v.normal = v.normal.map(|x| -x));
        self.more.tangents.iter_mut().for_each(|t| t[3] = -t[3]);
    }
}
