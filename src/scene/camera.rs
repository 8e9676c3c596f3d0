//! The camera's matrices for a frame.

use super::{
    model::{Camera, Lens, Scene},
    motion::{CameraPose, Pose, View},
    room::FROM_FRONT,
};
use crate::{
    diag::{Checked, Diagnostic},
    value::{Type, Value, Values},
};
use glam::{Mat4, Vec2, Vec3};

/// What a frame adds to the values: the camera now and in the last frame, the clock, the pointer, what is shown.
/// Matrices are column-major, clip space z in 0..1 (wgpu's), y up.
pub const FRAME_VALUES: &[(&str, Type)] = &[
    ("camera_position", Type::Vec3),
    ("camera_near", Type::Float),
    ("camera_far", Type::Float),
    ("camera_view", Type::Mat4),
    ("camera_projection", Type::Mat4),
    ("camera_view_projection", Type::Mat4),
    ("camera_inverse_view_projection", Type::Mat4),
    ("camera_previous_position", Type::Vec3),
    ("camera_previous_near", Type::Float),
    ("camera_previous_far", Type::Float),
    ("camera_previous_view", Type::Mat4),
    ("camera_previous_projection", Type::Mat4),
    ("camera_previous_view_projection", Type::Mat4),
    ("camera_previous_inverse_view_projection", Type::Mat4),
    ("frame", Type::Uint),
    ("first_frame", Type::Bool),
    ("time", Type::Float),
    ("delta_time", Type::Float),
    ("jitter", Type::Vec2),
    ("pointer", Type::Vec2),
    ("buttons", Type::Uint),
    (CONTENT_HASH, Type::Uint),
];

/// The value that another scene, parameter or shader changes, and a camera or a clock does not.
pub const CONTENT_HASH: &str = "content_hash";

/// Whole vertical angle of the camera made up for a scene without one, in radians (60°).
const DEFAULT_YFOV: f32 = std::f32::consts::FRAC_PI_3;

/// Share of the way to the scene at which depth begins at the latest.
const BEFORE: f32 = 0.01;

/// Share of the way to the scene's farthest corner at which depth begins at the earliest: a nearer plane would leave
/// depths of 32 bits too few numbers to tell surfaces apart, and nobody sees what is so near in a scene so large.
const NEAREST: f32 = 1e-5;

impl Scene {
    /// The `camera_…` names of [`super::FRAME_VALUES`] for an image of `width` × `height`, and what the user should
    /// know: a camera's vertical angle holds and the aspect is the image's. Clip space has z in 0..1 and y up, so that
    /// row 0 of the image is its top.
    ///
    /// Without a name: the scene file's camera, else the first of the glTF, else one that frames the bounds.
    ///
    /// # Errors
    /// An unknown camera name, with the nearest; an image without pixels; numbers that make no usable matrix.
    pub fn camera_values(
        &self,
        pose: &Pose,
        camera: Option<&str>,
        width: u32,
        height: u32,
    ) -> Checked<(Values, Vec<Diagnostic>)> {
        if width == 0 || height == 0 {
            return Err(Diagnostic::error(format!("an image of {width}×{height} has no pixels")).into());
        }
        let aspect = width as f32 / height as f32;
        let (View { place, lens, shift }, name) = self.view(pose, camera, aspect)?;
        let mut notices = vec![];
        if name.is_none() && pose.view.is_none() {
            let d = Diagnostic::note(format!("{}: the scene has no camera; the view frames its bounds", self.name));
            notices.push(d.help("add a camera to the glTF"));
        }
        let (near, far) = self.depths(lens, place);
        let (view, projection) = (view(place), projection(lens, shift, (near, far), aspect));
        let (position, name) = (place.position, name.unwrap_or("default"));
        // In f64: with near and far four decades apart, an f32 product and inverse lose most of their digits.
        let (exact_view, exact_projection) = (view.as_dmat4(), projection.as_dmat4());
        let view_projection = (exact_projection * exact_view).as_mat4();
        let inverse = (exact_projection * exact_view).inverse().as_mat4();
        if !(view_projection.is_finite() && inverse.is_finite()) {
            let d =
                Diagnostic::error(format!("{}: camera \"{name}\" makes no usable view of {width}×{height}", self.name));
            return Err(d.help("check its angle, depths and position").into());
        }
        let values = [
            ("camera_position", Value::Vec3(position)),
            ("camera_near", Value::Float(near)),
            ("camera_far", Value::Float(far)),
            ("camera_view", Value::Mat4(view)),
            ("camera_projection", Value::Mat4(projection)),
            ("camera_view_projection", Value::Mat4(view_projection)),
            ("camera_inverse_view_projection", Value::Mat4(inverse)),
        ];
        Ok((values.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(), notices))
    }

    /// What is seen, and the name of the camera that sees it: the pose's own view, or the camera named (as in
    /// [`Scene::camera_values`]); without a name where neither is. `aspect` is width over height.
    ///
    /// # Errors
    /// An unknown camera name, with the nearest.
    pub fn view(&self, pose: &Pose, camera: Option<&str>, aspect: f32) -> Checked<(View, Option<&str>)> {
        let found = match camera {
            Some(name) => Some(self.find_camera(name)?),
            None => self.default_camera,
        };
        let chosen = found.and_then(|i| Some((self.cameras.get(i)?, *pose.cameras.get(i)?)));
        let (seen, name) = match chosen {
            Some((camera, place)) => (View { place, lens: camera.lens, shift: Vec2::ZERO }, Some(camera.name.as_str())),
            None => (self.framing(aspect), None),
        };
        Ok((pose.view.unwrap_or(seen), name))
    }

    /// Index of the camera called so (its node's name, or its own).
    ///
    /// # Errors
    /// No camera of that name: the nearest name, and all there are.
    pub fn find_camera(&self, name: &str) -> Checked<usize> {
        let named = |c: &Camera| c.name == name || c.alias.as_deref() == Some(name);
        self.cameras.iter().position(named).ok_or_else(|| {
            let known: Vec<&str> = self.cameras.iter().map(|c| c.name.as_str()).collect();
            let aliases = self.cameras.iter().filter_map(|c| c.alias.as_deref());
            let d = Diagnostic::error(format!("{}: there is no camera \"{name}\"", self.name));
            let d = d.nearest(name, known.iter().copied().chain(aliases));
            match known.len() {
                0 => d.help("the scene has no cameras"),
                _ => d.help(format!("the cameras are {}", known.join(", "))),
            }
            .into()
        })
    }

    /// Metres from the camera at which what it sees begins and ends.
    fn depths(&self, lens: Lens, place: CameraPose) -> (f32, f32) {
        match lens {
            // glTF's endless projection has no inverse at its far plane; a far plane behind everything draws the same.
            // So does a near plane just before everything, and depths of 32 bits tell more apart behind it.
            Lens::Perspective { near, far, .. } => {
                let reach = (self.bounds.farthest(place.position) * 1.01).max(near * 2.0);
                let far = far.unwrap_or(reach);
                let begins = self.bounds.first_along(place.forward) - place.position.dot(place.forward);
                (near.max(BEFORE * begins.min(far)).max(NEAREST * reach.min(far)), far)
            }
            Lens::Orthographic { near, far, .. } => (near, far),
        }
    }

    /// A camera from +Z, a little above, as near as the whole bounding sphere stays in the picture.
    fn framing(&self, aspect: f32) -> View {
        let radius = (self.bounds.diagonal() * 0.5).max(1e-3);
        let half_height = (DEFAULT_YFOV * 0.5).tan();
        let narrower = half_height.min(half_height * aspect).atan();
        let distance = radius / narrower.sin();
        let back = FROM_FRONT.normalize();
        let forward = -back;
        let up = (Vec3::Y - forward * Vec3::Y.dot(forward)).normalize();
        let place = CameraPose { position: self.bounds.center() + back * distance, forward, up };
        let near = (distance - radius).max(distance * 1e-3) * 0.9;
        let lens = Lens::Perspective { yfov: DEFAULT_YFOV, near, far: Some((distance + radius) * 1.01) };
        View { place, lens, shift: Vec2::ZERO }
    }
}

fn view(place: CameraPose) -> Mat4 {
    Mat4::look_to_rh(place.position, place.forward, place.up)
}

fn projection(lens: Lens, shift: Vec2, (near, far): (f32, f32), aspect: f32) -> Mat4 {
    let straight = match lens {
        Lens::Perspective { yfov, .. } => Mat4::perspective_rh(yfov, aspect, near, far),
        Lens::Orthographic { ymag, .. } => {
            let xmag = ymag * aspect;
            Mat4::orthographic_rh(-xmag, xmag, -ymag, ymag, near, far)
        }
    };
    // The image is two units high.
    let by = Vec2::new(shift.x / aspect, shift.y) * -2.0;
    if shift == Vec2::ZERO { straight } else { Mat4::from_translation(by.extend(0.0)) * straight }
}
