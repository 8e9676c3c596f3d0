//! Vertices that move by more than their node: by the joints of a skin, by morph targets, or by both.
//!
//! Each has a row of its own in the table `nodes`, behind the rows of nodes. What places vertices in the world, drawn
//! or traced, places these too.
//!
//! Source: glTF 2.0 specification, sections 3.7.2.2 ("Morph Targets") and 3.7.3 ("Skins").

use super::{animation::Weights, geometry::Vertex, model::Bounds};
use glam::{Mat3, Mat4, Quat, Vec3};
use rustc_hash::FxHashMap;
use std::{collections::BTreeMap, ops::Range, sync::Arc};

/// By skin: what its joints do to vertices.
pub(super) type Skinned = FxHashMap<usize, Vec<Mat4>>;

/// The vertices of one mesh at one node.
#[derive(Debug, Clone, PartialEq)]
pub struct Deformed {
    /// The node that shows them.
    pub node: usize,
    /// Their places in the geometry.
    pub vertices: Range<usize>,
    pub(super) skin: Option<Skin>,
    pub(super) morph: Option<Morph>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Skin {
    /// Which of the document's it is: meshes share them.
    pub index: usize,
    /// Nodes, and what brings vertices into their spaces.
    pub joints: Arc<[(usize, Mat4)]>,
    /// By vertex: where its influences end.
    pub ends: Vec<u32>,
    /// Joints with their shares, which add up to 1 for each vertex.
    pub influences: Vec<(u16, f32)>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Morph {
    /// Where nothing moves them.
    pub rest: Vec<f32>,
    pub weights: Option<Weights>,
    pub targets: Vec<MorphTarget>,
}

/// What a morph target moves: vertices, counted from the first, with their displacements and those of their normals.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct MorphTarget {
    pub moved: Vec<(u32, Vec3, Vec3)>,
}

impl Skin {
    fn of(&self, vertex: usize) -> &[(u16, f32)] {
        let start = vertex.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.influences[start as usize..self.ends[vertex] as usize]
    }
}

impl Morph {
    fn at(&self, time: f32) -> Vec<f32> {
        self.weights.as_ref().map_or_else(|| self.rest.clone(), |weights| weights.at(time))
    }

    /// Displacements of positions and normals, by vertex.
    fn displaced(&self, count: usize, time: f32) -> Vec<[Vec3; 2]> {
        let mut all = vec![[Vec3::ZERO; 2]; count];
        for (target, weight) in self.targets.iter().zip(self.at(time)).filter(|(_, weight)| *weight != 0.0) {
            for (vertex, position, normal) in &target.moved {
                let of = &mut all[*vertex as usize];
                of[0] += weight * *position;
                of[1] += weight * *normal;
            }
        }
        all
    }

    /// Boxes round the displacements of positions over all time.
    fn reach(&self, count: usize) -> Vec<Bounds> {
        let mut all = vec![Bounds { min: Vec3::ZERO, max: Vec3::ZERO }; count];
        let ranges: Vec<[f32; 2]> = match &self.weights {
            Some(weights) => weights.ranges().collect(),
            None => self.rest.iter().map(|w| [*w; 2]).collect(),
        };
        for (target, [low, high]) in self.targets.iter().zip(ranges) {
            for (vertex, position, _) in &target.moved {
                let (a, b, of) = (low * *position, high * *position, &mut all[*vertex as usize]);
                *of = Bounds { min: of.min + a.min(b), max: of.max + a.max(b) };
            }
        }
        all
    }
}

impl Deformed {
    /// Appends the rows of its vertices, which are `all`, at the transforms of nodes. `skins`: what is known of skins
    /// there.
    pub(super) fn pose(&self, all: &[Vertex], nodes: &[Mat4], time: f32, skins: &mut Skinned, rows: &mut Vec<Mat4>) {
        let joints = self.skin.as_ref().map(|skin| {
            let moved = || skin.joints.iter().map(|(node, bind)| nodes[*node] * *bind).collect();
            &*skins.entry(skin.index).or_insert_with(moved)
        });
        let own = nodes[self.node];
        let moved = self.morph.as_ref().map(|m| m.displaced(all.len(), time));
        rows.extend(all.iter().enumerate().map(|(i, vertex)| {
            let placed = match (&self.skin, joints) {
                (Some(skin), Some(joints)) => blend(skin.of(i), joints),
                _ => own,
            };
            match moved.as_ref().map(|moved| moved[i]) {
                Some([position, normal]) if position != Vec3::ZERO || normal != Vec3::ZERO => {
                    placed * displacing(vertex, position, normal)
                }
                _ => placed,
            }
        }));
    }

    /// Whether time changes where its vertices are, given for each node whether time moves it.
    pub(super) fn moves(&self, moving: &[bool]) -> bool {
        let placed = match &self.skin {
            Some(skin) => skin.joints.iter().any(|(node, _)| moving[*node]),
            None => moving[self.node],
        };
        placed || self.period() > 0.0
    }

    /// Seconds after which its morph targets begin anew; 0 where they stand still.
    pub(super) fn period(&self) -> f32 {
        let weights = self.morph.as_ref().and_then(|m| m.weights.as_ref());
        weights.map_or(0.0, |weights| weights.period)
    }

    /// The boxes in the spaces of nodes that hold its vertices, `all`, at all times: a vertex is never outside of those
    /// of its joints.
    pub(super) fn boxes(&self, all: &[Vertex]) -> Vec<(usize, Bounds)> {
        let reach = self.morph.as_ref().map(|m| m.reach(all.len()));
        let round = |i: usize, bind: &Mat4| {
            let position = Vec3::from(all[i].position);
            match &reach {
                Some(reach) => {
                    let around = Bounds { min: position + reach[i].min, max: position + reach[i].max };
                    Bounds::of(around.corners().map(|p| bind.transform_point3(p)))
                }
                None => Bounds::of([bind.transform_point3(position)]),
            }
        };
        let Some(skin) = &self.skin else {
            let whole = (0..all.len()).fold(Bounds::EMPTY, |b, i| b.union(round(i, &Mat4::IDENTITY)));
            return vec![(self.node, whole)];
        };
        let mut boxes: BTreeMap<u16, Bounds> = BTreeMap::new();
        for i in 0..all.len() {
            for (joint, _) in skin.of(i) {
                let of = boxes.entry(*joint).or_insert(Bounds::EMPTY);
                *of = of.union(round(i, &skin.joints[usize::from(*joint)].1));
            }
        }
        boxes.into_iter().map(|(joint, of)| (skin.joints[usize::from(joint)].0, of)).collect()
    }

    /// A node that its vertices hang from.
    pub(super) fn anchor(&self) -> usize {
        self.skin.as_ref().and_then(|s| s.joints.first()).map_or(self.node, |(node, _)| *node)
    }
}

fn blend(influences: &[(u16, f32)], joints: &[Mat4]) -> Mat4 {
    match influences {
        [(joint, _)] => joints[usize::from(*joint)],
        all => all.iter().fold(Mat4::ZERO, |sum, (joint, share)| sum + joints[usize::from(*joint)] * *share),
    }
}

/// What moves a vertex by a displacement and turns its normal by that of the normal; it turns the tangent with it.
fn displacing(vertex: &Vertex, position: Vec3, normal: Vec3) -> Mat4 {
    let (from, at) = (Vec3::from(vertex.normal), Vec3::from(vertex.position));
    let to = (from + normal).try_normalize().unwrap_or(from);
    let turn = if to == from { Mat3::IDENTITY } else { Mat3::from_quat(Quat::from_rotation_arc(from, to)) };
    Mat4::from_mat3_translation(turn, at + position - turn * at)
}

/// Whose the rows of the table `nodes` are that stand behind those of nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Owners {
    /// How many rows nodes have.
    nodes: u32,
    /// Nodes that follow on each other, and where the rows of their vertices end.
    runs: Vec<(u32, u32)>,
}

impl Owners {
    pub(super) fn of(nodes: usize) -> Owners {
        Owners { nodes: nodes as u32, runs: vec![] }
    }

    /// Another row of a node's vertices.
    pub(super) fn add(&mut self, node: u32) -> u32 {
        let row = self.nodes + self.rows() as u32;
        match self.runs.last_mut() {
            Some((last, end)) if *last == node => *end = row + 1,
            _ => self.runs.push((node, row + 1)),
        }
        row
    }

    /// How many rows there are behind those of nodes.
    pub fn rows(&self) -> usize {
        self.runs.last().map_or(0, |(_, end)| (*end - self.nodes) as usize)
    }

    /// The node that a row belongs to.
    pub fn node(&self, row: u32) -> u32 {
        if row < self.nodes {
            return row;
        }
        let run = self.runs.partition_point(|(_, end)| *end <= row);
        self.runs.get(run).map_or(row, |(node, _)| *node)
    }

    /// Makes room for one more node, and returns the first row that this moves by one; `None`: it moves none.
    pub(super) fn shift(&mut self) -> Option<u32> {
        let first = self.nodes;
        self.nodes += 1;
        self.runs.iter_mut().for_each(|(_, end)| *end += 1);
        (!self.runs.is_empty()).then_some(first)
    }

    /// For each node, whether its row or one of its vertices' is other than before, by bits.
    pub(super) fn changed(&self, before: &[Mat4], now: &[Mat4]) -> Vec<bool> {
        let nodes = now.len() - self.rows().min(now.len());
        let differs = |row: usize| before.get(row).map(bytemuck::bytes_of) != now.get(row).map(bytemuck::bytes_of);
        let mut changed: Vec<bool> = (0..nodes).map(differs).collect();
        let mut row = nodes;
        for (node, end) in &self.runs {
            let any = (row..*end as usize).any(differs);
            row = *end as usize;
            if let Some(changed) = changed.get_mut(*node as usize) {
                *changed |= any;
            }
        }
        changed
    }
}
