//! Boxes round what hangs from chains of nodes that move together, such as a character's bones: the whole chain is
//! posed at many times, where a box round what each node sweeps would be turned by the next, and grow.

use super::{
    super::model::{Bounds, Node, Scene},
    Carried, MAX_SWEPT, MAX_SWEPT_POINTS, local,
};
use glam::{Mat3, Mat4, Vec3};
use std::{
    collections::{BTreeMap, BTreeSet},
    f32::consts::FRAC_PI_2,
};

/// Share of the box's diagonal by which what moves may leave the hull of two poses next to each other; the box is made
/// larger by what it is.
const BULGE: f32 = 1e-3;

/// Points of all poses, looked at one by one. What takes more is swept node by node.
const MAX_POSED: usize = 1 << 25;

/// A node's transform at a time takes as long as so many points.
const LIKE_POINTS: usize = 8;

/// Times of keyframes of a chain before those that are the same count once, and after.
const MAX_TIMES: usize = 1 << 18;

/// Poses that show how large all of it is.
const FIRST_LOOKS: usize = 32;

/// Times looked at in a piece of time.
const LOOKS: usize = 5;

/// What a node hangs from, itself included.
#[derive(Clone, Copy, Default)]
struct Ancestry {
    /// The moving node next to it, and its period.
    last: Option<(usize, f32)>,
    /// How many nodes of this period move it, up to the first of another one.
    length: usize,
    /// This first of another one.
    above: Option<usize>,
}

impl Scene {
    /// Takes from `carried` what hangs from several moving nodes of the same period, or from one that the glTF moves,
    /// and returns the box that it stays in. Where nodes of another period carry it on, it leaves them the box's
    /// corners. What would take too long stays as it is.
    pub(super) fn posed(&self, carried: &mut [Vec<Carried>]) -> Bounds {
        let mut chains: Vec<Ancestry> = Vec::with_capacity(self.nodes.len());
        for (index, node) in self.nodes.iter().enumerate() {
            let up = node.parent.map_or(Ancestry::default(), |p| chains[p]);
            chains.push(match (period(node), up.last) {
                (None, _) => up,
                (Some(own), Some((_, same))) if own == same => {
                    Ancestry { last: Some((index, own)), length: up.length + 1, ..up }
                }
                (Some(own), _) => {
                    Ancestry { last: Some((index, own)), length: 1, above: up.last.map(|(above, _)| above) }
                }
            });
        }
        // By what carries them on, and the bits of their period.
        let mut groups: BTreeMap<(Option<usize>, u32), BTreeSet<usize>> = BTreeMap::new();
        let group = |index: usize| {
            let Ancestry { last, length, above } = chains[index];
            // What one node alone moves in lines and turns is swept more exactly.
            let (moving, period) = last?;
            (length > 1 || self.nodes[moving].motion.is_empty()).then_some((above, period.to_bits()))
        };
        for index in (0..carried.len()).filter(|i| !carried[*i].is_empty()) {
            if let Some(key) = group(index) {
                groups.entry(key).or_default().insert(index);
            }
        }
        let (mut bounds, mut left) = (Bounds::EMPTY, MAX_POSED);
        // What later nodes carry on hangs from earlier ones.
        while let Some(((above, period), holders)) = groups.pop_last() {
            let rig = Rig::of(self, (above, f32::from_bits(period)), &holders, carried, &mut left);
            let Some(found) = rig.and_then(|rig| rig.bounds(&mut left)) else { continue };
            holders.iter().for_each(|holder| carried[*holder].clear());
            match above {
                Some(above) => {
                    carried[above].push(Carried::of(found.corners().to_vec()));
                    if let Some(key) = group(above) {
                        groups.entry(key).or_default().insert(above);
                    }
                }
                None => bounds = bounds.union(found),
            }
        }
        bounds
    }
}

/// Seconds after which a node's own motion begins anew; `None` where it stands still.
fn period(node: &Node) -> Option<f32> {
    let period = match node.motion.as_slice() {
        [] => node.animation.as_ref()?.period,
        [_] => return None,
        [.., last] => last.time,
    };
    (period > 0.0).then_some(period)
}

/// Nodes that move together.
struct Rig<'s> {
    /// With the place of the parent in this list, which is an earlier one. Those without hang from the space that all
    /// is posed in.
    links: Vec<(&'s Node, Option<usize>)>,
    /// Points in the spaces of nodes, by their place in the list.
    loads: Vec<(usize, Vec<Vec3>)>,
    /// Rising, from 0 to the period: between two, each node moves smoothly.
    times: Vec<f32>,
}

impl<'s> Rig<'s> {
    /// What moves `holders` with a period, up to the node above; `None` where it would take more looks than are left.
    fn of(
        scene: &'s Scene,
        (above, period): (Option<usize>, f32),
        holders: &BTreeSet<usize>,
        carried: &[Vec<Carried>],
        left: &mut usize,
    ) -> Option<Rig<'s>> {
        let mut all = BTreeSet::new();
        for holder in holders {
            let mut at = Some(*holder);
            while let Some(index) = at.filter(|index| Some(*index) != above && all.insert(*index)) {
                *left = left.checked_sub(LIKE_POINTS)?;
                at = scene.nodes[index].parent;
            }
        }
        let all: Vec<usize> = all.into_iter().collect();
        let place = |index: usize| all.binary_search(&index).ok();
        let links: Vec<_> = all.iter().map(|i| (&scene.nodes[*i], scene.nodes[*i].parent.and_then(place))).collect();
        let mut times = vec![0.0, period];
        for (node, _) in &links {
            add_times(node, period, &mut times, left)?;
        }
        in_order(&mut times);
        let load = |holder: &usize| {
            let all = carried[*holder].iter().flat_map(|one| one.points.iter().copied());
            let mut points: Vec<Vec3> = all.collect();
            if points.len() > MAX_SWEPT_POINTS || points.len() * times.len() * LOOKS > MAX_SWEPT {
                points = Bounds::of(points).corners().to_vec();
            }
            Some((place(*holder)?, points))
        };
        let loads = holders.iter().map(load).collect::<Option<_>>()?;
        Some(Rig { links, loads, times })
    }

    /// The box round all of it at all times; `None` where it would take more looks than are left.
    fn bounds(&self, left: &mut usize) -> Option<Bounds> {
        let cost = LIKE_POINTS * self.links.len() + self.loads.iter().map(|(_, points)| points.len()).sum::<usize>();
        if self.times.len().checked_mul(LOOKS * cost)? > *left {
            return None;
        }
        // Right before 0 a time is rounded to the end of the period, which is in no piece below.
        let mut bounds = self.posed(&self.locals(-f32::MIN_POSITIVE), Bounds::EMPTY);
        for time in self.times.iter().step_by(self.times.len().div_ceil(FIRST_LOOKS)) {
            bounds = self.posed(&self.locals(*time), bounds);
        }
        let far: Vec<f32> = self.loads.iter().map(|(_, p)| p.iter().map(|p| p.length()).fold(0.0, f32::max)).collect();
        let mut bulge = 0.0_f32;
        // A piece ends right before the keyframe at which the next begins: there, nodes may jump.
        let pieces = self.times.windows(2).map(|pair| (pair[0], pair[1].next_down()));
        let mut pieces: Vec<(f32, f32)> = pieces.rev().collect();
        while let Some((from, to)) = pieces.pop() {
            *left = left.checked_sub(LOOKS * cost)?;
            let quarter = (to - from) / 4.0;
            let looks: [f32; LOOKS] = std::array::from_fn(|i| if i == 4 { to } else { from + quarter * i as f32 });
            let locals = looks.map(|time| self.locals(time));
            // Two poses a quarter apart, and a curve of this acceleration between them.
            let trajectory = self.trajectory(&locals, &far);
            let leaves = Some(trajectory.bend / (16.0 * 8.0)).filter(|leaves| leaves.is_finite())?;
            // Rounding looks like acceleration, however short the piece is.
            let most = BULGE * bounds.diagonal() + 8.0 * f32::EPSILON * trajectory.far;
            // Where there is no time between those looked at, nothing is missed.
            let apart = from + quarter > from;
            if apart && leaves > most {
                let parts = (leaves / most).sqrt().ceil().clamp(2.0, 16.0) as usize;
                let at = |i: usize| if i == parts { to } else { from + (to - from) * i as f32 / parts as f32 };
                pieces.extend((0..parts).rev().map(|i| (at(i), at(i + 1))));
                continue;
            }
            if apart {
                bulge = bulge.max(leaves);
            }
            bounds = locals.iter().fold(bounds, |bounds, locals| self.posed(locals, bounds));
        }
        Some(Bounds { min: bounds.min - bulge, max: bounds.max + bulge })
    }

    fn locals(&self, time: f32) -> Vec<Mat4> {
        self.links.iter().map(|(node, _)| local(node, time)).collect()
    }

    /// The box round the points where these transforms into parents' spaces bring them, and another box.
    fn posed(&self, locals: &[Mat4], bounds: Bounds) -> Bounds {
        let mut ways: Vec<Mat4> = Vec::with_capacity(locals.len());
        for (local, (_, parent)) in locals.iter().zip(&self.links) {
            ways.push(parent.map_or(*local, |parent| ways[parent] * *local));
        }
        self.loads.iter().fold(bounds, |bounds, (link, points)| {
            bounds.union(Bounds::of(points.iter().map(|p| ways[*link].transform_point3(*p))))
        })
    }

    /// Trajectory of all points over a piece of time, which is one unit, from transforms at its quarters.
    /// `far`: how far the points are from their nodes.
    fn trajectory(&self, locals: &[Vec<Mat4>; LOOKS], far: &[f32]) -> Trajectory {
        let mut carried = vec![None; self.links.len()];
        for ((link, _), far) in self.loads.iter().zip(far) {
            carried[*link] = Some(Trajectory { far: *far, ..Trajectory::default() });
        }
        let mut most = Trajectory::default();
        for (index, (_, parent)) in self.links.iter().enumerate().rev() {
            let Some(below) = carried[index] else { continue };
            let trajectory = below.carried_by(locals.each_ref().map(|all| all[index]));
            let above = parent.map_or(&mut most, |parent| carried[parent].get_or_insert_default());
            *above = above.max(trajectory);
        }
        most
    }
}

/// Bounds of where points are over a piece of time: the lengths of their places, velocities and accelerations.
#[derive(Clone, Copy, Default)]
struct Trajectory {
    far: f32,
    speed: f32,
    bend: f32,
}

impl Trajectory {
    fn max(self, other: Trajectory) -> Trajectory {
        let most = |a: f32, b: f32| if a.is_nan() || a > b { a } else { b };
        Trajectory {
            far: most(self.far, other.far),
            speed: most(self.speed, other.speed),
            bend: most(self.bend, other.bend),
        }
    }

    /// In the space of the parent of a node with these transforms at the quarters of the time: derivatives of
    /// `translation + linear · place`.
    fn carried_by(self, quarters: [Mat4; LOOKS]) -> Trajectory {
        let slides = trajectory(quarters.map(|m| m.w_axis.truncate()), Vec3::length);
        let turns = trajectory(quarters.map(Mat3::from_mat4), stretch);
        Trajectory {
            far: slides.far + turns.far * self.far,
            speed: slides.speed + turns.speed * self.far + turns.far * self.speed,
            bend: slides.bend + turns.bend * self.far + 2.0 * turns.speed * self.speed + turns.far * self.bend,
        }
    }
}

/// How large something gets over time, and its derivatives, from what it is at the quarters.
fn trajectory<T>(at: [T; LOOKS], length: impl Fn(T) -> f32) -> Trajectory
where
    T: Copy + std::ops::Sub<Output = T> + std::ops::Mul<f32, Output = T>,
{
    let most = |all: &[T]| all.iter().map(|one| length(*one)).fold(0.0, f32::max);
    let first: [T; 4] = std::array::from_fn(|i| (at[i + 1] - at[i]) * 4.0);
    let second: [T; 3] = std::array::from_fn(|i| (first[i + 1] - first[i]) * 4.0);
    // Of cubic curves the second derivative is a straight line: it is largest at the ends, half as far from the last
    // two as these are from each other.
    let [a, b, c] = second;
    let bend = most(&[a, c, a * 2.0 - b, c * 2.0 - b]);
    // Between two of them it is off the straight line by no more than its second derivative tells.
    Trajectory { far: most(&at) + bend / (16.0 * 8.0), speed: most(&first) + bend / 8.0, bend }
}

/// A bound of how much longer a matrix makes vectors: exact for a rotation of scales.
fn stretch(m: Mat3) -> f32 {
    let squared = m.transpose() * m;
    let rows = [squared.x_axis, squared.y_axis, squared.z_axis].map(|row| row.abs().element_sum());
    rows.into_iter().fold(0.0, f32::max).sqrt()
}

fn in_order(times: &mut Vec<f32>) {
    times.sort_by(f32::total_cmp);
    times.dedup();
}

/// Adds a node's times of keyframes; `None` where there are too many.
fn add_times(node: &Node, period: f32, times: &mut Vec<f32>, left: &mut usize) -> Option<()> {
    for pair in node.motion.windows(2) {
        let turn = |i: usize| pair[i].rotation.map_or(0.0, |(_, angle)| angle.abs());
        // More than half a turn looks like less, and is looked at in parts.
        let parts = ((turn(0) + turn(1)) / FRAC_PI_2).ceil().max(1.0) as usize;
        *left = left.checked_sub(parts)?;
        let span = (pair[1].time - pair[0].time) / parts as f32;
        times.extend((0..parts).map(|i| pair[0].time + span * i as f32));
    }
    if let (true, Some(animation)) = (node.motion.is_empty(), &node.animation) {
        for time in animation.times() {
            *left = left.checked_sub(1)?;
            times.push(time);
        }
    }
    times.retain(|time| (0.0..=period).contains(time));
    if times.len() > MAX_TIMES {
        in_order(times);
    }
    (times.len() <= MAX_TIMES).then_some(())
}
