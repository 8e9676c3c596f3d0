//! What programs that show a scene of their own say of it, in the coordinates of its file: where nodes are, from where
//! it is seen.

use super::{
    model::{Lens, Scene},
    motion::{CameraPose, View},
};
use crate::diag::{Checked, Diagnostic};
use glam::{Mat4, Vec2, Vec3, Vec4};
use std::collections::{BTreeMap, HashMap};

/// A camera that looks from one place to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    pub eye: Vec3,
    pub target: Vec3,
    pub up: Vec3,
    pub extent: Extent,
    /// Metres from the eye; `None`: as the scene's size has it.
    pub near: Option<f32>,
    pub far: Option<f32>,
    /// How far the image's centre lies from `target`, to the right and up, in heights of the image.
    pub shift: Vec2,
}

/// How much a camera sees from top to bottom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Extent {
    /// The whole vertical angle, in degrees.
    Angle(f32),
    /// Half the height of a flat image, in metres.
    Flat(f32),
}

/// What nothing is seen nearer than where a camera does not say: a share of the scene's size.
const NEAR: f32 = 1e-3;

impl Scene {
    /// `places` with nodes, by name, where matrices (node to world, column by column) say: for
    /// [`super::Shift::places`].
    ///
    /// # Errors
    /// The first node that is not there, or whose matrix can't place it.
    pub fn placed<'a>(
        &self,
        mut places: BTreeMap<usize, Mat4>,
        all: impl IntoIterator<Item = (&'a str, [f32; 16])>,
    ) -> Checked<BTreeMap<usize, Mat4>> {
        let known: HashMap<&str, usize> =
            self.nodes.iter().enumerate().rev().map(|(i, n)| (n.name.as_str(), i)).collect();
        let said = self.pose(0.0).nodes;
        for (name, matrix) in all {
            let Some(&node) = known.get(name) else {
                let d = Diagnostic::error(format!("{}: there is no node \"{name}\"", self.name));
                return Err(d.nearest(name, known.keys().copied()).into());
            };
            let mut matrix = Mat4::from_cols_array(&matrix);
            if !matrix.is_finite() || matrix.row(3) != Vec4::W {
                let d = Diagnostic::error(format!("\"{name}\" can't be placed by {matrix}"));
                return Err(d.help("give finite numbers, and (0, 0, 0, 1) as the last row").into());
            }
            matrix.w_axis -= self.origin.extend(0.0);
            if matrix.determinant() * said[node].determinant() < 0.0 {
                let d = Diagnostic::error(format!("\"{name}\" can't be placed by a matrix that mirrors it"));
                return Err(d.help("give the scene anew, with this matrix").into());
            }
            places.insert(node, matrix);
        }
        Ok(places)
    }

    /// What a camera sees.
    ///
    /// # Errors
    /// Numbers that make no view.
    pub fn look(&self, Look { eye, target, up, extent, near, far, shift }: Look) -> Checked<View> {
        let origin = self.origin;
        let forward = (target - eye).try_normalize();
        let wrong = |what: String, help: &str| Err(Diagnostic::error(what).help(help).into());
        let Some(forward) = forward.filter(|f| f.is_finite() && eye.is_finite()) else {
            return wrong(format!("a camera at {eye} can't look at {target}"), "give two different places, in metres");
        };
        let Some(up) = (up - forward * up.dot(forward)).try_normalize().filter(|up| up.is_finite()) else {
            return wrong(
                format!("`up` = {up} points where the camera looks"),
                "give a direction across the line of sight, such as up=(0, 0, -1) for a look down",
            );
        };
        let near = near.unwrap_or((self.bounds.diagonal() * NEAR).max(1e-5));
        let ahead = |far: f32| near.is_finite() && far.is_finite() && far > near;
        if !(near > 0.0 && ahead(far.unwrap_or(near * 2.0))) {
            return wrong(
                format!("a camera sees from {near} m to {far:?} m"),
                "`near` must be above 0, and `far` beyond it",
            );
        }
        let lens = match extent {
            Extent::Angle(angle) if angle > 0.0 && angle < 180.0 => {
                Lens::Perspective { yfov: angle.to_radians(), near, far }
            }
            Extent::Flat(half) if half > 0.0 && half.is_finite() => {
                let far = far.unwrap_or_else(|| self.bounds.farthest(eye - origin).max(near) * 1.01 + near);
                Lens::Orthographic { ymag: half, near, far }
            }
            Extent::Angle(wrong_extent) | Extent::Flat(wrong_extent) => {
                return wrong(format!("a camera's extent of {wrong_extent}"), "`fov` lies between 0 and 180 degrees");
            }
        };
        if !shift.is_finite() {
            return wrong(format!("a lens shift of {shift}"), "give two finite numbers, in heights of the image");
        }
        Ok(View { place: CameraPose { position: eye - origin, forward, up }, lens, shift })
    }
}
