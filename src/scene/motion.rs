//! A scene at a time: where its nodes, lights and cameras are, and the box it stays in.

mod posed;

use super::{
    Column, PREVIOUS_TRANSFORM, Table,
    deform::{Deformed, Skinned},
    keyed::KeyedParam,
    model::{Bounds, Keyframe, Lens, Node, Scene},
    transforms::{NodeMatrix, Transforms},
};
use glam::{Mat3, Mat4, Quat, Vec2, Vec3};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A scene at a time, in world space.
#[derive(Debug, Clone, PartialEq)]
pub struct Pose {
    /// Seconds.
    pub time: f32,
    pub nodes: Transforms,
    /// For each of the scene's lights.
    pub lights: Vec<LightPose>,
    /// For each of the scene's cameras.
    pub cameras: Vec<CameraPose>,
    /// What is seen in place of any camera.
    pub view: Option<View>,
}

impl Pose {
    /// Whether nodes and lights are where they are in another pose: then the scene's tables are the same.
    pub fn same_tables(&self, other: &Pose) -> bool {
        self.nodes == other.nodes && self.lights == other.lights
    }
}

/// Where a light is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightPose {
    pub position: Vec3,
    /// Unit direction in which the light travels.
    pub direction: Vec3,
}

/// Where a camera is. The directions are units at right angles; the node's scale plays no part.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CameraPose {
    pub position: Vec3,
    pub forward: Vec3,
    pub up: Vec3,
}

/// A place and a lens.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct View {
    pub place: CameraPose,
    pub lens: Lens,
    /// How far the image's centre lies from the line of sight, to the right and up, in heights of the image (lens
    /// shift).
    #[serde(default)]
    pub shift: Vec2,
}

impl View {
    /// Looks from `position` along `forward`, whose length plays no part; `yfov` is the whole vertical angle in
    /// radians. What is nearer than a centimetre is not seen, and the scene's extent decides how far the view reaches.
    ///
    /// ```
    /// use glam::Vec3;
    /// use lightgraph::View;
    ///
    /// let view = View::perspective(Vec3::new(0.0, 1.0, 4.0), Vec3::NEG_Z, Vec3::Y, 0.8);
    /// assert_eq!(view.place.position.z, 4.0);
    /// ```
    pub fn perspective(position: Vec3, forward: Vec3, up: Vec3, yfov: f32) -> View {
        let forward = forward.normalize_or(Vec3::NEG_Z);
        let up = up.reject_from_normalized(forward).normalize_or(forward.any_orthonormal_vector());
        let place = CameraPose { position, forward, up };
        View { place, lens: Lens::Perspective { yfov, near: 0.01, far: None }, shift: Vec2::ZERO }
    }
}

/// A pose's distance from what the scene file says, in metres, world space: for whoever flies, drags or measures.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shift {
    /// Of all cameras.
    pub cameras: Vec3,
    /// Of all lights.
    pub lights: Vec3,
    /// Of single lights, by index, on top of `lights`.
    pub single_lights: Vec<(usize, Vec3)>,
    /// Of nodes, by index, with all that hangs from them; lights and cameras excepted.
    pub nodes: Vec<(usize, Vec3)>,
    /// Node to world, by index, in place of what the scene says. All that hangs from them follows, lights and cameras
    /// too.
    pub places: BTreeMap<usize, Mat4>,
    /// Takes the place of all cameras, the one made up for a scene without any included.
    pub view: Option<View>,
}

/// Angle from sample to sample of a turning node's sweep: between two, an arc leaves the hull of its ends by at most
/// 1 − cos 1° of its radius, which [`SWEEP_MARGIN`] covers.
const SWEEP_STEP: f32 = 2.0 * std::f32::consts::PI / 180.0;

/// Share of the swept box's diagonal added on every side when something turns.
const SWEEP_MARGIN: f32 = 2e-4;

/// Samples between two keyframes: two whole turns in steps of [`SWEEP_STEP`]. Faster spins pass the same angles again.
const MAX_SWEEP_SAMPLES: usize = 360;

/// Points of all transforms of a sweep, looked at one by one.
const MAX_SWEPT: usize = 1 << 20;

/// Points swept one by one; of larger meshes the corners of their box are.
const MAX_SWEPT_POINTS: usize = 4096;

/// Points of all transforms of all sweeps, after which one box goes round all that hangs from a node: what hangs from
/// many moving nodes is swept by each.
const MAX_SWEPT_OVERALL: usize = 1 << 26;

impl Scene {
    /// The scene at a time in seconds. A time that is not finite counts as 0.
    pub fn pose(&self, time: f32) -> Pose {
        let mut pose = self.pose_of_nodes(time, &BTreeMap::new());
        self.deform(&mut pose);
        pose
    }

    /// Appends the rows of vertices.
    fn deform(&self, pose: &mut Pose) {
        if self.deformed.is_empty() {
            return;
        }
        let mut all = Vec::with_capacity(pose.nodes.len() + self.geometry.owners.rows());
        all.extend_from_slice(&pose.nodes);
        let mut skins = Skinned::default();
        for deformed in self.deformed.iter() {
            let vertices = &self.geometry.vertices[deformed.vertices.clone()];
            deformed.pose(vertices, &pose.nodes, pose.time, &mut skins, &mut all);
        }
        pose.nodes = all.into();
    }

    fn pose_of_nodes(&self, time: f32, places: &BTreeMap<usize, Mat4>) -> Pose {
        let time = if time.is_finite() { time } else { 0.0 };
        let mut nodes: Vec<Mat4> = Vec::with_capacity(self.nodes.len());
        for (i, node) in self.nodes.iter().enumerate() {
            // Parents come first, so theirs are already there.
            let said = || {
                let local = local(node, time);
                node.parent.map_or(local, |p| nodes[p] * local)
            };
            let world = places.get(&i).copied().unwrap_or_else(said);
            nodes.push(world);
        }
        let forward = |m: &Mat4| (-m.z_axis.truncate()).try_normalize().unwrap_or(Vec3::NEG_Z);
        let lights = self.lights.iter().map(|light| {
            let m = &nodes[light.node];
            LightPose { position: m.w_axis.truncate(), direction: forward(m) }
        });
        let cameras = self.cameras.iter().map(|camera| {
            let m = &nodes[camera.node];
            let forward = forward(m);
            let up = m.y_axis.truncate();
            let up = (up - forward * up.dot(forward)).try_normalize().unwrap_or(forward.any_orthonormal_vector());
            CameraPose { position: m.w_axis.truncate(), forward, up }
        });
        Pose { time, lights: lights.collect(), cameras: cameras.collect(), nodes: nodes.into(), view: None }
    }

    /// The scene at a time, moved from where it says. Indices of nodes and lights that are not there are ignored.
    pub fn pose_shifted(&self, time: f32, shift: &Shift) -> Pose {
        let mut pose = self.pose_of_nodes(time, &shift.places);
        for (moved, by) in &shift.nodes {
            for (i, node) in pose.nodes.iter_mut().enumerate() {
                if self.hangs_from(i, *moved) {
                    node.w_axis += by.extend(0.0);
                }
            }
        }
        self.deform(&mut pose);
        // A skin's joints place its mesh; whoever moves the mesh means it all the same.
        for (moved, by) in &shift.nodes {
            let mut row = self.nodes.len();
            for deformed in self.deformed.iter() {
                let rows = row..row + deformed.vertices.len();
                row = rows.end;
                if self.hangs_from(deformed.node, *moved) && !self.hangs_from(deformed.anchor(), *moved) {
                    pose.nodes[rows].iter_mut().for_each(|m| m.w_axis += by.extend(0.0));
                }
            }
        }
        pose.lights.iter_mut().for_each(|l| l.position += shift.lights);
        for (moved, by) in &shift.single_lights {
            if let Some(light) = pose.lights.get_mut(*moved) {
                light.position += by;
            }
        }
        pose.cameras.iter_mut().for_each(|c| c.position += shift.cameras);
        pose.view = shift.view;
        pose
    }

    fn hangs_from(&self, node: usize, ancestor: usize) -> bool {
        let mut at = Some(node);
        while let Some(i) = at {
            if i == ancestor {
                return true;
            }
            at = self.nodes.get(i).and_then(|n| n.parent);
        }
        false
    }

    /// Seconds until everything that moves has moved once; 0 where nothing does.
    pub fn duration(&self) -> f32 {
        let keyed = self.nodes.iter().flat_map(|n| &n.motion).map(|k| k.time);
        let animated = self.nodes.iter().filter_map(|n| Some(n.animation.as_ref()?.period));
        let morphed = self.deformed.iter().map(Deformed::period);
        let params = self.params.iter().map(KeyedParam::period);
        keyed.chain(animated).chain(morphed).chain(params).fold(0.0, f32::max)
    }

    /// As [`Scene::moving`], and whether the vertices of its mesh move.
    pub(super) fn moving_shown(&self) -> Vec<bool> {
        let moving = self.moving();
        let mut shown = moving.clone();
        self.deformed.iter().filter(|d| d.moves(&moving)).for_each(|d| shown[d.node] = true);
        shown
    }

    /// For each node, whether its world transform changes with time.
    pub(super) fn moving(&self) -> Vec<bool> {
        let mut moving: Vec<bool> = vec![];
        for node in &self.nodes {
            let moves = node.motion.len() > 1 || node.motion.is_empty() && node.animation.is_some();
            moving.push(moves || node.parent.is_some_and(|p| moving[p]));
        }
        moving
    }

    /// The box round all geometry over all its motion: exact for what stands still or slides, and for what turns as
    /// near as the sampling of its sweep allows, from outside.
    pub(super) fn swept_bounds(&self) -> Bounds {
        let moving = self.moving();
        let still = self.pose(0.0).nodes;
        let mut bounds = Bounds::EMPTY;
        let mut points: Vec<Vec<Vec3>> = vec![vec![]; self.nodes.len()];
        for vertex in &self.geometry.vertices {
            let (node, position) = (vertex.node as usize, Vec3::from(vertex.position));
            // Those that skins and morph targets move are looked at below.
            if node >= moving.len() {
                continue;
            }
            if moving[node] {
                points[node].push(position);
            } else {
                bounds = bounds.union(Bounds::of([still[node].transform_point3(position)]));
            }
        }
        let all = |points: Vec<Vec3>| if points.is_empty() { vec![] } else { vec![Carried::of(points)] };
        let mut carried: Vec<Vec<Carried>> = points.into_iter().map(all).collect();
        for deformed in self.deformed.iter() {
            for (node, around) in deformed.boxes(&self.geometry.vertices[deformed.vertices.clone()]) {
                carried[node].push(Carried::of(around.corners().to_vec()));
            }
        }
        let bounds = bounds.union(self.posed(&mut carried));
        self.swept(carried).into_iter().fold(bounds, Bounds::union)
    }

    /// The boxes that points of nodes' spaces sweep in the world. Children come last, so that each node gets all that
    /// hangs from it before it carries that on.
    fn swept(&self, mut carried: Vec<Vec<Carried>>) -> Vec<Bounds> {
        let mut boxes = vec![];
        let mut left = MAX_SWEPT_OVERALL;
        for index in (0..self.nodes.len()).rev() {
            let (node, mut all) = (&self.nodes[index], std::mem::take(&mut carried[index]));
            if all.is_empty() {
                continue;
            }
            if left == 0 {
                all = vec![Carried::joined(&all)];
            }
            let mut above = node.parent;
            if node.moves() {
                let transforms = sweep(node);
                // The static way up to the next moving ancestor comes first, so that its rotation costs no tightness.
                let mut rise = Mat4::IDENTITY;
                while let Some(parent) = above.filter(|p| left > 0 && !self.nodes[*p].moves()) {
                    left -= 1;
                    rise = local(&self.nodes[parent], 0.0) * rise;
                    above = self.nodes[parent].parent;
                }
                let turned = node.animation.as_ref().is_some_and(|a| node.motion.is_empty() && a.turns());
                let turns = turned || node.motion.iter().any(|k| k.rotation.is_some());
                for one in &mut all {
                    left = left.saturating_sub(one.points.len().min(MAX_SWEPT_POINTS) * transforms.len());
                    one.sweep(&transforms, rise, turns);
                }
            } else {
                left = left.saturating_sub(8 * all.len());
                let local = local(node, 0.0);
                all.iter_mut().for_each(|one| one.way = local * one.way);
            }
            match above {
                Some(above) => carried[above].append(&mut all),
                None => boxes.extend(all.iter().map(Carried::bounds)),
            }
        }
        boxes
    }
}

/// Points on their way up to the world.
struct Carried {
    points: Vec<Vec3>,
    /// Into the space of the node that they have come to.
    way: Mat4,
    /// By how much the box round them is too small.
    margin: f32,
}

impl Carried {
    fn of(points: Vec<Vec3>) -> Carried {
        Carried { points, way: Mat4::IDENTITY, margin: 0.0 }
    }

    /// The corners of a box round all of these: it is looser where something turns.
    fn joined(all: &[Carried]) -> Carried {
        let round = all.iter().fold(Bounds::EMPTY, |round, one| round.union(one.tight()));
        let margin = all.iter().map(|one| one.margin).fold(0.0, f32::max);
        Carried { margin, ..Carried::of(round.corners().to_vec()) }
    }

    fn tight(&self) -> Bounds {
        Bounds::of(self.points.iter().map(|p| self.way.transform_point3(*p)))
    }

    fn bounds(&self) -> Bounds {
        let tight = self.tight();
        Bounds { min: tight.min - self.margin, max: tight.max + self.margin }
    }

    /// Makes the points the corners of the box that they sweep at these transforms, and then `rise`.
    fn sweep(&mut self, transforms: &[Mat4], rise: Mat4, turns: bool) {
        if self.points.len() > MAX_SWEPT_POINTS || self.points.len() * transforms.len() > MAX_SWEPT {
            *self = Carried { margin: self.margin, ..Carried::of(self.tight().corners().to_vec()) };
        }
        let bounds = transforms.iter().fold(Bounds::EMPTY, |bounds, local| {
            let way = rise * *local * self.way;
            bounds.union(Bounds::of(self.points.iter().map(|p| way.transform_point3(*p))))
        });
        let wider = if turns { bounds.diagonal() * SWEEP_MARGIN } else { 0.0 };
        *self = Carried { margin: self.margin + wider, ..Carried::of(bounds.corners().to_vec()) };
    }
}

/// The table of nodes: where they are, and where they were before.
pub(super) fn nodes(pose: &Pose, before: &Pose) -> Table {
    // Nodes of another scene were nowhere.
    let before = if before.nodes.len() == pose.nodes.len() { before } else { pose };
    let column = |of: &Pose, matrix| Column::Node { of: of.nodes.clone(), matrix };
    Table {
        name: "nodes",
        rows: pose.nodes.len(),
        since: None,
        columns: Arc::new([
            ("transform", column(pose, NodeMatrix::Transform)),
            ("inverse_transpose", column(pose, NodeMatrix::InverseTranspose)),
            (PREVIOUS_TRANSFORM, column(before, NodeMatrix::PreviousTransform)),
        ]),
    }
}

/// A node's transform into its parent's space.
fn local(node: &Node, time: f32) -> Mat4 {
    if let (true, Some(animation)) = (node.motion.is_empty(), &node.animation) {
        return animation.at(time);
    }
    let (translation, rotation) = keyed(&node.motion, time).unwrap_or((node.translation, Quat::IDENTITY));
    transform(node, translation, rotation)
}

fn transform(node: &Node, translation: Vec3, rotation: Quat) -> Mat4 {
    Mat4::from_mat3_translation(Mat3::from_quat(rotation) * node.linear, translation)
}

/// Translation and added rotation at a time; `None` without keyframes.
fn keyed(keys: &[Keyframe], time: f32) -> Option<(Vec3, Quat)> {
    let (first, last) = (keys.first()?, keys.last()?);
    let time = within(time, last.time);
    let next = keys.partition_point(|k| k.time <= time);
    let (Some(a), Some(b)) = (next.checked_sub(1).and_then(|i| keys.get(i)), keys.get(next)) else {
        let only = if next == 0 { first } else { last };
        return Some((only.translation, rotation(only.rotation)));
    };
    let share = (time - a.time) / (b.time - a.time);
    Some((a.translation.lerp(b.translation, share), between(a.rotation, b.rotation, share)))
}

/// The time since what repeats began anew.
pub(super) fn within(time: f32, period: f32) -> f32 {
    // In f64: after hours an f32 remainder would jump by frames.
    if period > 0.0 { f64::from(time).rem_euclid(f64::from(period)) as f32 } else { 0.0 }
}

fn rotation(turn: Option<(Vec3, f32)>) -> Quat {
    turn.map_or(Quat::IDENTITY, |(axis, angle)| Quat::from_axis_angle(axis, angle))
}

/// The rotation a share of the way from `a` to `b`: along the common axis where there is one, else the shortest way.
fn between(a: Option<(Vec3, f32)>, b: Option<(Vec3, f32)>, share: f32) -> Quat {
    let (axis, from, to) = match (a, b) {
        (None, None) => return Quat::IDENTITY,
        (Some((axis, from)), None) => (axis, from, 0.0),
        (None, Some((axis, to))) => (axis, 0.0, to),
        (Some((axis, from)), Some((other, to))) if axis.dot(other) > 0.999_999 => (axis, from, to),
        (a, b) => return rotation(a).slerp(rotation(b), share),
    };
    Quat::from_axis_angle(axis, from + (to - from) * share)
}

/// A moving node's transforms over its sweep: at its keyframes, and between turned ones in steps of a few degrees.
fn sweep(node: &Node) -> Vec<Mat4> {
    if let (true, Some(animation)) = (node.motion.is_empty(), &node.animation) {
        return animation.sweep();
    }
    let mut all: Vec<Mat4> =
        node.motion.iter().take(1).map(|k| transform(node, k.translation, rotation(k.rotation))).collect();
    for pair in node.motion.windows(2) {
        let [a, b] = [&pair[0], &pair[1]];
        let angle = |k: &Keyframe| k.rotation.map_or(0.0, |(_, angle)| angle);
        // About different axes the way is at most both angles long.
        let way = if same_axis(a, b) { (angle(b) - angle(a)).abs() } else { angle(a).abs() + angle(b).abs() };
        let steps = ((way / SWEEP_STEP).ceil() as usize).clamp(1, MAX_SWEEP_SAMPLES);
        all.extend((1..=steps).map(|i| {
            let share = i as f32 / steps as f32;
            transform(node, a.translation.lerp(b.translation, share), between(a.rotation, b.rotation, share))
        }));
    }
    all
}

fn same_axis(a: &Keyframe, b: &Keyframe) -> bool {
    a.rotation.zip(b.rotation).is_none_or(|((a, _), (b, _))| a.dot(b) > 0.999_999)
}

#[test]
fn a_box_round_what_motion_carries_holds_all_of_it() {
    let one = |x: f32, margin: f32| {
        let way = Mat4::from_rotation_translation(Quat::from_rotation_z(x), Vec3::X * x);
        Carried { way, margin, ..Carried::of(vec![Vec3::ZERO, Vec3::ONE]) }
    };
    let all = [one(0.0, 0.1), one(2.0, 0.0), one(-3.0, 0.2)];
    let round = Carried::joined(&all);
    assert_eq!((round.points.len(), round.margin), (8, 0.2));
    let (joined, each) = (round.bounds(), all.iter().map(Carried::bounds).fold(Bounds::EMPTY, Bounds::union));
    assert!(joined.min.cmple(each.min).all() && joined.max.cmpge(each.max).all(), "{joined:?} {each:?}");
}
