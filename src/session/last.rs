//! Computes the values that a frame brings to a plan, some of them from the previous frame.

use super::Settings;
use crate::diag::{Checked, Diagnostic};
use crate::scene::{Pose, Scene, Shift};
use crate::value::{Value, Values};
use glam::Vec2;

/// Where the host program has the pointer, for shaders that read `pointer` and `buttons`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pointer {
    /// In pixels from the top left of the image.
    pub at: Vec2,
    /// Pressed ones, a bit each: 1 the first, 2 the second, 4 the middle one.
    pub buttons: u32,
}

/// The last frame of a session, or of the one that it took the place of.
#[derive(Debug, Clone, Default)]
pub(super) struct Last {
    pub index: u32,
    pub time: f32,
    pub shift: Shift,
    /// Its values; none before the first frame.
    pub values: Values,
    /// Some history begins anew with the next frame.
    pub begins: bool,
}

impl Last {
    /// The values of a frame that comes next, and what the user should know.
    ///
    /// # Errors
    /// As [`Scene::camera_values`].
    pub fn next(
        &self,
        (scene, settings): (&Scene, &Settings),
        (pose, pointer): (&Pose, Pointer),
        index: u32,
    ) -> Checked<(Values, Vec<Diagnostic>)> {
        let [width, height] = settings.size;
        let (mut values, notices) = scene.camera_values(pose, settings.camera.as_deref(), width, height)?;
        let first = self.values.is_empty();
        let before = previous(if first { &values } else { &self.values });
        values.extend(before);
        let passed = if first { 0.0 } else { (pose.time - self.time).max(0.0) };
        let own = [
            ("frame", Value::Uint(index)),
            ("first_frame", Value::Bool(first || self.begins)),
            ("time", Value::Float(pose.time)),
            ("delta_time", Value::Float(passed)),
            ("jitter", Value::Vec2(jitter(index))),
            ("pointer", Value::Vec2(pointer.at)),
            ("buttons", Value::Uint(pointer.buttons)),
        ];
        values.extend(own.map(|(name, value)| (name.to_owned(), value)));
        Ok((values, notices))
    }
}

/// Begins the names of the last frame's values.
const PREVIOUS: &str = "camera_previous_";

/// What the camera's values were in the last frame, from all the values of that one.
fn previous(values: &Values) -> Values {
    let own = |name: &str| name.strip_prefix("camera_").filter(|_| !name.starts_with(PREVIOUS)).map(str::to_owned);
    values.iter().filter_map(|(name, v)| Some((format!("{PREVIOUS}{}", own(name)?), *v))).collect()
}

/// Where in its pixel a frame looks through, from its centre: -0.5 to 0.5 along x and y. The first 16 points of
/// Halton's sequence to the bases 2 and 3, over and over.
fn jitter(frame: u32) -> Vec2 {
    let at = |base: u32| {
        let (mut n, mut share, mut sum) = (frame % 16 + 1, 1.0, 0.0);
        while n > 0 {
            share /= base as f32;
            sum += share * (n % base) as f32;
            n /= base;
        }
        sum - 0.5
    };
    Vec2::new(at(2), at(3))
}
