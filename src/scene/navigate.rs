//! A view that moves: round a point, along the image, through the room. +Y is up.

use super::{CameraPose, Lens, View};
use glam::{Quat, Vec2, Vec3};

/// How near the zenith a view may turn, in radians: straight up there would be no horizon.
const ZENITH: f32 = 0.01;

/// Turns the view round a point, as if the point's surroundings were dragged by `by` (radians, x to the right and y
/// down).
pub fn orbit(view: View, pivot: Vec3, by: Vec2) -> View {
    let turn = turn(view.place, -by);
    moved(view, pivot + turn * (view.place.position - pivot), turn)
}

/// Turns the view where it stands, to where the pointer went (radians, x to the right and y down).
pub fn look(view: View, by: Vec2) -> View {
    let turn = turn(view.place, -by);
    moved(view, view.place.position, turn)
}

/// Slides the view so that a point at the pivot's depth follows the pointer; `by` is in heights of the image, x to the
/// right and y down.
pub fn pan(view: View, pivot: Vec3, by: Vec2) -> View {
    let height = height_at(view, pivot);
    let right = right(view.place);
    let position = view.place.position + (right * -by.x + view.place.up * by.y) * height;
    View { place: CameraPose { position, ..view.place }, ..view }
}

/// Goes nearer to the pivot (positive) or away. A step is a tenth of the way.
pub fn zoom(view: View, pivot: Vec3, steps: f32) -> View {
    let factor = 0.9f32.powf(steps);
    if let Lens::Orthographic { ymag, near, far } = view.lens {
        return View { lens: Lens::Orthographic { ymag: ymag * factor, near, far }, ..view };
    }
    let position = pivot + (view.place.position - pivot) * factor;
    View { place: CameraPose { position, ..view.place }, ..view }
}

/// Flies by metres: to the right, upwards, ahead.
pub fn fly(view: View, by: Vec3) -> View {
    let CameraPose { position, forward, .. } = view.place;
    let position = position + right(view.place) * by.x + Vec3::Y * by.y + forward * by.z;
    View { place: CameraPose { position, ..view.place }, ..view }
}

/// The height of the image in metres at the depth of a point.
pub fn height_at(view: View, point: Vec3) -> f32 {
    match view.lens {
        Lens::Perspective { yfov, .. } => {
            let depth = (point - view.place.position).dot(view.place.forward).max(1e-3);
            2.0 * depth * (yfov * 0.5).tan()
        }
        Lens::Orthographic { ymag, .. } => 2.0 * ymag,
    }
}

pub fn right(place: CameraPose) -> Vec3 {
    place.forward.cross(place.up)
}

/// A turn about the vertical and then the horizontal axis, stopped short of the zenith.
fn turn(place: CameraPose, by: Vec2) -> Quat {
    let pitch = place.forward.y.clamp(-1.0, 1.0).asin();
    let most = std::f32::consts::FRAC_PI_2 - ZENITH;
    let tilt = (pitch + by.y).clamp(-most.max(pitch.abs()), most.max(pitch.abs())) - pitch;
    Quat::from_rotation_y(by.x) * Quat::from_axis_angle(right(place).normalize(), tilt)
}

fn moved(view: View, position: Vec3, turn: Quat) -> View {
    let forward = (turn * view.place.forward).normalize();
    let up = turn * view.place.up;
    // Rounding must not add up over a long drag.
    let up = (up - forward * up.dot(forward)).normalize();
    View { place: CameraPose { position, forward, up }, ..view }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        let forward = Vec3::new(0.0, -0.6, -0.8);
        let place = CameraPose { position: Vec3::new(0.0, 3.0, 4.0), forward, up: Vec3::new(0.0, 0.8, -0.6) };
        View { place, lens: Lens::Perspective { yfov: 1.0, near: 0.1, far: None }, shift: Vec2::ZERO }
    }

    fn sound(v: View) {
        assert!((v.place.forward.length() - 1.0).abs() < 1e-5);
        assert!((v.place.up.length() - 1.0).abs() < 1e-5);
        assert!(v.place.forward.dot(v.place.up).abs() < 1e-5);
        assert!(right(v.place).y.abs() < 1e-4, "the horizon is level: {v:?}");
    }

    #[test]
    fn an_orbit_keeps_the_distance_and_sees_the_pivot_where_it_was() {
        let mut v = view();
        for i in 0..500 {
            v = orbit(v, Vec3::ZERO, Vec2::new(0.03, if i % 7 < 3 { 0.05 } else { -0.02 }));
            sound(v);
        }
        assert!((v.place.position.length() - 5.0).abs() < 1e-3);
        let to_pivot = -v.place.position.normalize();
        assert!(v.place.forward.dot(to_pivot) > 0.9999, "{v:?}");
    }

    #[test]
    fn no_drag_turns_over_the_top() {
        for by in [10.0, -10.0] {
            let v = orbit(view(), Vec3::ZERO, Vec2::new(0.0, by));
            sound(v);
            assert!(v.place.up.y > 0.0, "{v:?}");
            let v = look(view(), Vec2::new(0.3, by));
            sound(v);
            assert!(v.place.up.y > 0.0, "{v:?}");
        }
    }

    #[test]
    fn dragging_right_brings_what_was_on_the_left() {
        let v = orbit(view(), Vec3::ZERO, Vec2::new(0.1, 0.0));
        assert!(v.place.position.x < 0.0, "the view went left: {v:?}");
        let v = pan(view(), Vec3::ZERO, Vec2::new(0.1, 0.0));
        assert!(v.place.position.x < 0.0, "{v:?}");
    }

    #[test]
    fn a_pan_by_the_height_of_the_image_moves_by_that_height() {
        let by = height_at(view(), Vec3::ZERO);
        assert!((by - 2.0 * 5.0 * 0.5f32.tan()).abs() < 1e-4);
        let v = pan(view(), Vec3::ZERO, Vec2::new(0.0, 1.0));
        assert!(((v.place.position - view().place.position).length() - by).abs() < 1e-4);
    }

    #[test]
    fn steps_in_and_out_cancel() {
        let v = zoom(zoom(view(), Vec3::ONE, 7.0), Vec3::ONE, -7.0);
        assert!((v.place.position - view().place.position).length() < 1e-4);
        let near = zoom(view(), Vec3::ZERO, 1.0);
        assert!((near.place.position.length() - 4.5).abs() < 1e-5);
    }

    #[test]
    fn flying_ahead_goes_where_the_view_looks() {
        let v = fly(view(), Vec3::new(0.0, 0.0, 5.0));
        assert!(v.place.position.length() < 1e-5, "{v:?}");
        let v = fly(view(), Vec3::new(2.0, 1.0, 0.0));
        assert!((v.place.position - Vec3::new(2.0, 4.0, 4.0)).length() < 1e-5, "{v:?}");
    }
}
