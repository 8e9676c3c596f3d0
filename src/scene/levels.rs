//! Simplified triangles: as few as stay within a tolerance of the surfaces that they stand for. They are made when a
//! plan asks for them.

use super::{
    Geometry, Scene, Vertex,
    clusters::{Cluster, clustered},
};
use crate::content::hash;
use glam::{Mat3, Mat4};
use meshoptimizer_rs::{Attributes, Positions, SimplifyOptions, SimplifySettings, Workspace, simplify_with_attributes};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// How much a turn of the shading normal counts beside a move of the surface: 1 takes a turn of 60 degrees for a move
/// over the whole mesh.
const NORMAL_WEIGHT: f32 = 0.5;

/// What a draw takes of a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Taken {
    /// How far surfaces may move, metres; 0: none moves.
    pub tolerance: f32,
    /// By material: whether its triangles are drawn. `None`: all are.
    pub materials: Option<Vec<bool>>,
    /// By node: the same.
    pub nodes: Option<Vec<bool>>,
}

impl Taken {
    /// The same for what takes the same.
    pub fn key(&self) -> u128 {
        hash(&(self.tolerance.to_bits(), &self.materials, &self.nodes))
    }

    fn takes(&self, node: u32, material: u32) -> bool {
        let all = |mask: &Option<Vec<bool>>, i: u32| mask.as_ref().is_none_or(|m| m.get(i as usize) == Some(&true));
        all(&self.materials, material) && all(&self.nodes, node)
    }
}

/// The triangles that a draw takes of a scene, between vertices of the scene.
#[derive(Debug, PartialEq)]
pub struct Level {
    pub taken: Taken,
    /// How far one moved at most, metres, as the simplifier measures it: by the root of mean squared distances to
    /// planes.
    pub error: f32,
    /// As [`Geometry::indices`].
    pub indices: Vec<u32>,
    /// As [`Geometry::one_sided`].
    pub one_sided: u32,
    /// As [`Geometry::clusters`], by place in its own indices.
    pub clusters: Vec<Cluster>,
}

impl Level {
    /// How many of the clusters belong to single-sided materials; they come first.
    pub fn one_sided_clusters(&self) -> usize {
        self.clusters.iter().take_while(|c| c.first < self.one_sided).count()
    }
}

/// The levels of a scene that were asked for. They follow from the rest of the scene: any two are equal, and a copy
/// begins empty.
#[derive(Debug, Default)]
pub struct Levels(Mutex<Vec<Arc<Level>>>);

impl Clone for Levels {
    fn clone(&self) -> Levels {
        Levels::default()
    }
}

impl PartialEq for Levels {
    fn eq(&self, _: &Levels) -> bool {
        true
    }
}

impl Scene {
    /// Its triangles within a tolerance in metres, made once.
    pub fn level(&self, tolerance: f32) -> Arc<Level> {
        self.part(&Taken { tolerance, ..Taken::default() })
    }

    /// Some of its triangles, made once.
    pub fn part(&self, taken: &Taken) -> Arc<Level> {
        let mut made = self.levels.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(level) = made.iter().find(|l| l.taken == *taken) {
            return level.clone();
        }
        let level = Arc::new(simplified(&self.geometry, &self.pose(0.0).nodes, taken));
        made.push(level.clone());
        level
    }
}

/// Triangles that are simplified together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct LevelPart {
    double_sided: bool,
    node: u32,
    material: u32,
}

/// What belongs to one node and one material is simplified by itself, and its open edges stay where they are: nothing
/// comes apart.
fn simplified(geometry: &Geometry, nodes: &[Mat4], taken: &Taken) -> Level {
    let Geometry { vertices, indices, one_sided, .. } = geometry;
    let mut parts: BTreeMap<LevelPart, Vec<u32>> = BTreeMap::new();
    for (i, triangle) in indices.chunks_exact(3).enumerate() {
        let Vertex { node, material, .. } = vertices[triangle[0] as usize];
        let node = geometry.owners.node(node);
        if !taken.takes(node, material) {
            continue;
        }
        let double_sided = 3 * i as u32 >= *one_sided;
        parts.entry(LevelPart { double_sided, node, material }).or_default().extend(triangle);
    }
    let (mut fewer, mut front, mut error) = (vec![], 0, 0.0f32);
    for (part, indices) in &parts {
        let scale = nodes.get(part.node as usize).map_or(1.0, largest_scale);
        let (left, moved) = match taken.tolerance {
            0.0 => (indices.clone(), 0.0),
            tolerance => simplify(vertices, indices, tolerance / scale),
        };
        error = error.max(moved * scale);
        fewer.extend(left);
        if !part.double_sided {
            front = fewer.len() as u32;
        }
    }
    let (indices, clusters) = clustered(geometry, &fewer, front, nodes);
    Level { taken: taken.clone(), error, indices, one_sided: front, clusters }
}

/// By how much a transform lengthens at most, or a little more.
fn largest_scale(transform: &Mat4) -> f32 {
    let m = Mat3::from_mat4(*transform);
    let squares = m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared();
    let longest = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
    // Axes that stay at right angles lengthen by the longest of them.
    let right = [m.x_axis.dot(m.y_axis), m.x_axis.dot(m.z_axis), m.y_axis.dot(m.z_axis)];
    let skewed = right.iter().any(|d| d.abs() > 1e-4 * squares);
    let scale = if skewed { squares.sqrt() } else { longest };
    if scale > 0.0 { scale } else { 1.0 }
}

/// Fewer triangles, and how far they lie off. What can't be simplified stays as it is.
fn simplify(vertices: &[Vertex], indices: &[u32], tolerance: f32) -> (Vec<u32>, f32) {
    // The vertices in use alone: a scene's other ones cost time.
    let mut used: Vec<u32> = indices.to_vec();
    used.sort_unstable();
    used.dedup();
    let local: Vec<u32> = indices.iter().map(|i| used.partition_point(|u| u < i) as u32).collect();
    let of = |i: &u32| &vertices[*i as usize];
    let positions: Vec<[f32; 3]> = used.iter().map(|i| of(i).position).collect();
    let normals: Vec<f32> = used.iter().flat_map(|i| of(i).normal).collect();
    let settings = SimplifySettings {
        target_index_count: 0,
        target_error: tolerance,
        options: SimplifyOptions::LOCK_BORDER | SimplifyOptions::ERROR_ABSOLUTE,
    };
    let weights = [NORMAL_WEIGHT; 3];
    let made = Attributes::from_interleaved(&normals, used.len(), 3, 3, 0).and_then(|normals| {
        let positions = Positions::from_packed(&positions);
        simplify_with_attributes(&local, positions, normals, &weights, None, settings, &mut Workspace::default())
    });
    match made {
        Ok(made) => (made.indices.iter().map(|i| used[*i as usize]).collect(), made.error),
        Err(_) => (indices.to_vec(), 0.0),
    }
}
