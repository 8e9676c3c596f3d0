//! glTF's node animation: translation, rotation and scale over time.
//!
//! Source: glTF 2.0 specification, section 3.11 and appendix C ("Animation Sampler Interpolation Modes").

use super::{
    document::{Document, place},
    geometry::MAX_COORDINATE,
    import::Placed,
};
use crate::diag::Diagnostic;
use glam::{Mat3, Mat4, Quat, Vec3, Vec4};
use gltf::json::{
    animation::{Animation as RawAnimation, Channel, Interpolation, Property},
    validation::Checked,
};
use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

/// How a node moves by its file's animation.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    translation: Option<Track>,
    /// Quaternions: x, y, z, w.
    rotation: Option<Track>,
    scale: Option<Track>,
    /// What holds where there is no track.
    rest: (Vec3, Quat, Vec3),
    /// Seconds after which it begins anew; 0 for what stands still.
    pub period: f32,
}

/// Values over time; of quaternions all four numbers, of vectors three. A clone shares them.
#[derive(Debug, Clone, PartialEq)]
struct Track {
    /// Rising, at least one.
    times: Arc<[f32]>,
    /// As many as times; of splines three a time: the tangent that it comes in with, the value, the tangent that it
    /// leaves with.
    values: Arc<[Vec4]>,
    /// Added to each value, but to no tangent.
    shift: Vec4,
    interpolation: Interpolation,
}

/// Steps from one keyframe to the next in which a sweep is looked at: a quarter turn in steps of 5°, which leaves the
/// hull of two by 0.1 % of the radius.
const STEPS: usize = 18;

/// Transforms of a sweep at most.
const MOST_STEPS: usize = 4096;

/// Times and values of all channels together, at most: many may have the same ones.
const MOST_KEYS: usize = 1 << 26;

impl Animation {
    /// The node's transform into its parent's space.
    pub(super) fn at(&self, time: f32) -> Mat4 {
        self.within(wrapped(time, self.period))
    }

    fn within(&self, time: f32) -> Mat4 {
        let vector =
            |track: &Option<Track>, rest: Vec3| track.as_ref().map_or(rest, |t| t.at(time, Vec4::lerp).truncate());
        let slerp = |a: Vec4, b: Vec4, share: f32| Vec4::from(unit(a).slerp(unit(b), share));
        let (translation, rotation, scale) = self.rest;
        let rotation = self.rotation.as_ref().map_or(rotation, |t| unit(t.at(time, slerp)));
        let linear = Mat3::from_quat(rotation) * Mat3::from_diagonal(vector(&self.scale, scale));
        Mat4::from_mat3_translation(linear, vector(&self.translation, translation))
    }

    /// The keyframes of each of its tracks, one after the other.
    pub(super) fn times(&self) -> impl Iterator<Item = f32> {
        let tracks = [&self.translation, &self.rotation, &self.scale];
        tracks.into_iter().flatten().flat_map(|t| t.times.iter().copied())
    }

    /// Its transforms at keyframes and between them: what a box round all of it is made from.
    pub(super) fn sweep(&self) -> Vec<Mat4> {
        let mut times: Vec<f32> = self.times().collect();
        times.sort_by(f32::total_cmp);
        times.dedup();
        let steps = (MOST_STEPS / times.len().max(1)).clamp(1, STEPS);
        let between = |pair: &[f32]| {
            let (from, to) = (pair[0], pair[1]);
            (1..=steps).map(move |i| from + (to - from) * i as f32 / steps as f32).collect::<Vec<_>>()
        };
        let first = times.first().copied();
        first.into_iter().chain(times.windows(2).flat_map(between)).map(|time| self.within(time)).collect()
    }

    pub(super) fn turns(&self) -> bool {
        self.rotation.is_some()
    }

    /// Moves all of it, in the parent's space.
    pub(super) fn shift(&mut self, by: Vec3) {
        self.rest.0 += by;
        if let Some(track) = &mut self.translation {
            track.shift += by.extend(0.0);
        }
    }
}

/// How the weights of morph targets change.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// By target, the weight in x.
    tracks: Arc<[Track]>,
    pub(super) period: f32,
}

impl Weights {
    pub(super) fn at(&self, time: f32) -> Vec<f32> {
        let time = wrapped(time, self.period);
        self.tracks.iter().map(|t| t.at(time, Vec4::lerp).x).collect()
    }

    /// The least and the largest of each.
    pub(super) fn ranges(&self) -> impl Iterator<Item = [f32; 2]> {
        self.tracks.iter().map(|track| track.reached().fold([f32::MAX, f32::MIN], |[l, h], x| [l.min(x), h.max(x)]))
    }
}

fn wrapped(time: f32, period: f32) -> f32 {
    // In f64: after hours an f32 remainder would jump by frames.
    let (time, period) = (f64::from(time), f64::from(period));
    if period > 0.0 { time.rem_euclid(period) as f32 } else { 0.0 }
}

impl Track {
    /// Numbers in x between which all lie: the values, and of splines the control points of their curves.
    fn reached(&self) -> impl Iterator<Item = f32> {
        let spline = self.interpolation == Interpolation::CubicSpline;
        let (first, step) = if spline { (1, 3) } else { (0, 1) };
        let values = self.values.iter().skip(first).step_by(step).map(|v| v.x);
        let between = self.times.windows(2).enumerate().filter(move |_| spline).flat_map(|(key, pair)| {
            let third = (pair[1] - pair[0]) / 3.0;
            let x = |i: usize| self.values[i].x;
            [x(3 * key + 1) + third * x(3 * key + 2), x(3 * key + 4) - third * x(3 * key + 3)]
        });
        values.chain(between)
    }

    /// The value at a time; before the first keyframe that of the first, after the last that of the last.
    fn at(&self, time: f32, lerp: impl Fn(Vec4, Vec4, f32) -> Vec4) -> Vec4 {
        let spline = self.interpolation == Interpolation::CubicSpline;
        let value = |key: usize| self.values[if spline { 3 * key + 1 } else { key }] + self.shift;
        let next = self.times.partition_point(|t| *t <= time);
        if next == 0 || next == self.times.len() {
            return value(next.saturating_sub(1));
        }
        let (before, after) = (next - 1, next);
        let span = self.times[after] - self.times[before];
        let t = (time - self.times[before]) / span;
        match self.interpolation {
            Interpolation::Step => value(before),
            Interpolation::Linear => lerp(value(before), value(after), t),
            Interpolation::CubicSpline => {
                let (t2, t3) = (t * t, t * t * t);
                let (leaving, arriving) = (self.values[3 * before + 2], self.values[3 * after]);
                (2.0 * t3 - 3.0 * t2 + 1.0) * value(before)
                    + span * (t3 - 2.0 * t2 + t) * leaving
                    + (3.0 * t2 - 2.0 * t3) * value(after)
                    + span * (t3 - t2) * arriving
            }
        }
    }
}

pub(super) fn unit(q: Vec4) -> Quat {
    Quat::from_vec4(q.try_normalize().unwrap_or(Vec4::W))
}

/// Gives the nodes the first animation of a document, and says what is left out.
pub(super) fn animate(document: &Document<'_>, placed: &mut [Placed], faults: &mut Vec<Diagnostic>) {
    let all = &document.root.animations;
    let Some(first) = all.first().filter(|_| document.complete()) else { return };
    if all.len() > 1 {
        let name = first.name.as_deref().unwrap_or("animations[0]");
        let d = document.warning("animations", format!("the first of {}, \"{name}\", moves the scene", all.len()));
        faults.push(d.help("the others are left out"));
    }
    let rows: BTreeMap<usize, usize> =
        placed.iter().enumerate().filter(|(_, p)| !p.copy).map(|(row, p)| (p.index, row)).collect();
    let mut samplers = Samplers { document, animation: first, left: MOST_KEYS, read: BTreeMap::new() };
    let (mut period, mut moved, mut seen) = (0.0_f32, vec![], BTreeSet::new());
    for (i, channel) in first.channels.iter().enumerate() {
        // A node of another scene moves nothing here.
        let Some(row) = rows.get(&channel.target.node.value()) else { continue };
        let tracks = match channel.target.path {
            Checked::Valid(property) if !seen.insert((*row, property as u8)) => {
                Err("an earlier one moves the same".into())
            }
            Checked::Valid(property) => samplers.tracks(channel, property).map(|tracks| (property, tracks)),
            Checked::Invalid => Err("what it moves is not known".into()),
        };
        match tracks {
            Ok((property, tracks)) => {
                let end = tracks.first().and_then(|t| t.times.last());
                period = period.max(end.copied().unwrap_or(0.0));
                moved.push((*row, property, tracks));
            }
            Err(why) => {
                let at = format!("{}, channels[{i}]", place("animations", 0, first.name.as_deref()));
                faults.push(document.warning(at, format!("{why}; it is left out")));
            }
        }
    }
    for (row, property, tracks) in moved {
        if property == Property::MorphTargetWeights {
            placed[row].weights = Some(Weights { tracks, period });
            continue;
        }
        let track = tracks.first().cloned();
        let raw = &document.root.nodes[placed[row].index];
        let node = &mut placed[row].node;
        let animation = node.animation.get_or_insert_with(|| Animation {
            translation: None,
            rotation: None,
            scale: None,
            rest: (
                node.translation,
                unit(Vec4::from(raw.rotation.unwrap_or_default().0)),
                Vec3::from(raw.scale.unwrap_or([1.0; 3])),
            ),
            period,
        });
        match property {
            Property::Translation => animation.translation = track,
            Property::Rotation => animation.rotation = track,
            Property::Scale | Property::MorphTargetWeights => animation.scale = track,
        }
    }
}

/// An animation's samplers. Channels that use one alike share what is read of it.
struct Samplers<'d> {
    document: &'d Document<'d>,
    animation: &'d RawAnimation,
    /// How many more times and values channels may have.
    left: usize,
    read: BTreeMap<(usize, Sampled), Arc<[Track]>>,
}

/// What the values of a sampler are.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Sampled {
    Vectors,
    Quaternions,
    /// Of so many morph targets.
    Weights(usize),
}

impl Samplers<'_> {
    /// The track of a channel, or those of a mesh's morph targets.
    fn tracks(&mut self, channel: &Channel, property: Property) -> Result<Arc<[Track]>, String> {
        let (document, index) = (self.document, channel.sampler.value());
        let sampler = self.animation.samplers.get(index).ok_or_else(|| format!("there is no sampler {index}"))?;
        let Checked::Valid(interpolation) = sampler.interpolation else {
            return Err("its interpolation is none of LINEAR, STEP and CUBICSPLINE".into());
        };
        let (input, output) = (sampler.input.value(), sampler.output.value());
        let keys = document.count(input).saturating_add(document.count(output));
        let over = || format!("with its {keys} times and values the animation has more than {MOST_KEYS}");
        self.left = self.left.checked_sub(keys).ok_or_else(over)?;
        let shape = match property {
            Property::Translation | Property::Scale => Sampled::Vectors,
            Property::Rotation => Sampled::Quaternions,
            Property::MorphTargetWeights => Sampled::Weights(targets(document, channel)?),
        };
        if let Some(found) = self.read.get(&(index, shape)) {
            return Ok(found.clone());
        }
        let times: Arc<[f32]> = document.floats::<1>(input)?.iter().map(|[t]| t).collect();
        let checked = |values| checked(times.clone(), values, interpolation);
        let tracks = match shape {
            Sampled::Vectors => {
                let all = document.floats::<3>(output)?;
                [checked(all.iter().map(|v| Vec3::from(v).extend(0.0)).collect())?].into()
            }
            Sampled::Quaternions => [checked(document.floats::<4>(output)?.iter().map(Vec4::from).collect())?].into(),
            Sampled::Weights(targets) => {
                let all = document.floats::<1>(output)?;
                if !all.len().is_multiple_of(targets) {
                    return Err(format!("it has {} values for {targets} morph targets", all.len()));
                }
                let of = |target| (target..all.len()).step_by(targets).map(|i| Vec4::X * all.get(i)[0]).collect();
                (0..targets).map(|target| checked(of(target))).collect::<Result<_, String>>()?
            }
        };
        Ok(self.read.entry((index, shape)).or_insert(tracks).clone())
    }
}

/// How many morph targets the mesh of a channel's node has: at least one.
fn targets(document: &Document<'_>, channel: &Channel) -> Result<usize, String> {
    let node = document.root.nodes.get(channel.target.node.value());
    let mesh = node.and_then(|n| document.root.meshes.get(n.mesh?.value()));
    let targets = mesh.and_then(|m| m.primitives.first()?.targets.as_ref().map(Vec::len)).unwrap_or(0);
    if targets == 0 { Err("its node shows no mesh with morph targets".into()) } else { Ok(targets) }
}

fn checked(times: Arc<[f32]>, values: Arc<[Vec4]>, interpolation: Interpolation) -> Result<Track, String> {
    let each = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    if times.is_empty() || values.len() != each * times.len() {
        return Err(format!("it has {} times and {} values, {each} for each time", times.len(), values.len()));
    }
    let rising = times.windows(2).all(|w| w[0] < w[1]);
    if !(rising && times.iter().all(|t| (0.0..MAX_COORDINATE).contains(t))) {
        return Err("its times must not be negative, and must rise".into());
    }
    match values.iter().all(|v| v.abs().cmple(Vec4::splat(MAX_COORDINATE)).all()) {
        true => Ok(Track { times, values, shift: Vec4::ZERO, interpolation }),
        false => Err("it holds a number that is not usable".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(times: &[f32], values: Vec<Vec4>, interpolation: Interpolation) -> Track {
        checked(times.into(), values.into(), interpolation).unwrap()
    }

    fn turning(interpolation: Interpolation, values: Vec<Vec4>) -> Animation {
        let rotation = track(&[0.0, 2.0], values, interpolation);
        let rest = (Vec3::new(1.0, 2.0, 3.0), Quat::IDENTITY, Vec3::splat(2.0));
        Animation { translation: None, rotation: Some(rotation), scale: None, rest, period: 2.0 }
    }

    #[test]
    fn each_way_between_keyframes_is_as_specified() {
        let (a, b) = (Vec4::new(0.0, 0.0, 0.0, 0.0), Vec4::new(4.0, 8.0, 0.0, 0.0));
        let track = |interpolation, values| track(&[1.0, 3.0], values, interpolation);
        let step = track(Interpolation::Step, vec![a, b]);
        let linear = track(Interpolation::Linear, vec![a, b]);
        // A spline without slope at its ends; one with the slope of the straight line is that line.
        let slope = (b - a) / 2.0;
        let eased = track(Interpolation::CubicSpline, vec![Vec4::ZERO, a, Vec4::ZERO, Vec4::ZERO, b, Vec4::ZERO]);
        let straight = track(Interpolation::CubicSpline, vec![slope, a, slope, slope, b, slope]);
        for (time, steps, lines, eases) in
            [(0.0, 0.0, 0.0, 0.0), (1.5, 0.0, 1.0, 0.625), (2.0, 0.0, 2.0, 2.0), (9.0, 4.0, 4.0, 4.0)]
        {
            let x = |t: &Track| t.at(time, Vec4::lerp).x;
            assert_eq!([x(&step), x(&linear), x(&eased)], [steps, lines, eases], "{time}");
            assert!((x(&straight) - lines).abs() < 1e-5, "{time}");
        }
    }

    #[test]
    fn rotations_go_the_shortest_way_and_begin_anew() {
        let quarter = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
        // The same rotation with the other sign: the way must not go round the back.
        let found = turning(Interpolation::Linear, vec![Vec4::W, -Vec4::from(quarter)]);
        for (time, angle) in [(0.0_f32, 0.0_f32), (1.0, 45.0), (3.0, 45.0)] {
            let expected = Mat3::from_rotation_y(angle.to_radians()) * 2.0;
            let m = found.at(time);
            assert!(Mat3::from_mat4(m).abs_diff_eq(expected, 1e-5), "{time}: {m}");
            assert_eq!(m.w_axis.truncate(), Vec3::new(1.0, 2.0, 3.0));
        }
    }

    #[test]
    fn a_sweep_holds_what_turns() {
        let half = Quat::from_rotation_y(3.0);
        let found = turning(Interpolation::Linear, vec![Vec4::W, Vec4::from(half)]);
        let sweep = found.sweep();
        for i in 0..100 {
            let at = found.at(i as f32 / 50.0).transform_point3(Vec3::X);
            let near = sweep.iter().map(|m| m.transform_point3(Vec3::X).distance(at)).fold(f32::INFINITY, f32::min);
            assert!(near < 0.2, "{i}: {near}");
        }
    }
}
