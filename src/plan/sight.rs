//! Whether what lies in a box can show in a view: by the view's frustum, by the centres of its texels, by the depths that it
//! holds. No device.

use crate::scene::Bounds;
use glam::{Mat4, Vec3, Vec4};
use std::ops::Range;

/// How far drawing may round a vertex, in texels: devices keep at least four bits of a texel's fraction.
const SNAP: f64 = 1.0 / 16.0;

/// What the entries of a matrix and the sums over them may be off by, relative to their sizes.
const ROUNDING: f64 = 1e-6;

/// What depths may be off by, in a range of 0 to 1.
const DEPTH_ROUNDING: f64 = 1e-5;

/// Whether a box meets what a view-projection matrix keeps. The twin of `meets` in `cull.wgsl`.
pub fn meets(view_projection: &Mat4, bounds: &Bounds) -> bool {
    meets_planes(&planes(view_projection), bounds)
}

/// The planes that a view-projection matrix keeps things between.
pub fn planes(view_projection: &Mat4) -> [Vec4; 6] {
    let rows = view_projection.transpose();
    let (x, y, z, w) = (rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis);
    [w + x, w - x, w + y, w - y, z, w - z]
}

/// Where the lines of sight of a view begin: a point (w above 0), or the direction to it (w 0). The twin of `eye_of` in
/// `cull.wgsl`.
pub fn eye(view_projection: &Mat4) -> Vec4 {
    let rows = view_projection.transpose();
    let (a, b, c) = (rows.x_axis, rows.y_axis, rows.w_axis);
    let [an, bn, cn] = [a, b, c].map(Vec4::truncate);
    let meet = a.w * bn.cross(cn) + b.w * cn.cross(an) + c.w * an.cross(bn);
    let eye = (-meet).extend(an.dot(bn.cross(cn)));
    // Depths fall towards it.
    if rows.z_axis.dot(eye) > 0.0 { -eye } else { eye }
}

/// As [`meets`], of a view whose planes are known.
pub fn meets_planes(planes: &[Vec4; 6], bounds: &Bounds) -> bool {
    if bounds.min.cmpgt(bounds.max).any() {
        return false;
    }
    let (middle, half) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min));
    !planes.iter().any(|plane| outside(*plane, middle, half))
}

fn outside(plane: Vec4, middle: Vec3, half: Vec3) -> bool {
    let normal = plane.truncate();
    let reach = normal.abs().dot(half);
    let size = normal.abs().dot(middle.abs()) + plane.w.abs();
    normal.dot(middle) + plane.w + reach < -1e-5 * (size + reach)
}

/// What a box may change of a view at most.
#[derive(Debug, Clone, PartialEq)]
pub struct Covered {
    pub columns: Range<u32>,
    pub rows: Range<u32>,
    /// The least depth of the box, 0 to 1.
    pub nearest: f64,
}

/// The texels of a view of `size` (width, height) whose centres a box may cover. `None`: it covers none, so nothing in it
/// shows. A box that reaches behind the eye may cover everything.
pub fn covered(view_projection: &Mat4, size: [u32; 2], bounds: &Bounds) -> Option<Covered> {
    if !meets(view_projection, bounds) {
        return None;
    }
    let whole = Covered { columns: 0..size[0], rows: 0..size[1], nearest: 0.0 };
    let rows = view_projection.transpose().to_cols_array_2d().map(|row| row.map(f64::from));
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in 0..8 {
        let side = |axis: usize| if corner >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        let at = [side(0).into(), side(1).into(), side(2).into(), 1.0];
        let clip = rows.map(|row| row.iter().zip(at).map(|(m, p)| m * p).sum::<f64>());
        let off = rows.map(|row| row.iter().zip(at).map(|(m, p): (&f64, f64)| (m * p).abs()).sum::<f64>() * ROUNDING);
        let w = [clip[3] - off[3], clip[3] + off[3]];
        if w[0].is_nan() || w[0] <= 0.0 {
            return Some(whole);
        }
        for axis in 0..3 {
            let (least, most) = (clip[axis] - off[axis], clip[axis] + off[axis]);
            low[axis] = low[axis].min(least / if least < 0.0 { w[0] } else { w[1] });
            high[axis] = high[axis].max(most / if most < 0.0 { w[1] } else { w[0] });
        }
    }
    if low.iter().chain(&high).any(|v| !v.is_finite()) {
        return Some(whole);
    }
    // Texel i has its centre at i + 0.5; rows begin at the top.
    let centres = |low: f64, high: f64, count: u32| {
        let at = |ndc: f64| (0.5 * ndc + 0.5) * f64::from(count) - 0.5;
        let first = (at(low) - SNAP).ceil().max(0.0);
        let end = (at(high) + SNAP).floor().min(f64::from(count) - 1.0) + 1.0;
        first as u32..end.max(0.0) as u32
    };
    let columns = centres(low[0], high[0], size[0]);
    let rows = centres(-high[1], -low[1], size[1]);
    (!columns.is_empty() && !rows.is_empty()).then_some(Covered { columns, rows, nearest: low[2].max(0.0) })
}

impl Covered {
    /// Whether all of it lies behind what the view shows; `depth` gives that by column and row, 0 near to 1 far.
    pub fn behind(&self, depth: impl Fn(u32, u32) -> f32) -> bool {
        let behind = |x: u32, y: u32| f64::from(depth(x, y)) + DEPTH_ROUNDING < self.nearest;
        self.rows.clone().all(|y| self.columns.clone().all(|x| behind(x, y)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxed(center: Vec3, half: f32) -> Bounds {
        Bounds { min: center - half, max: center + half }
    }

    /// A view of 90 degrees from (1, 2, 3) along +X, with places given from its eye: forward, right, up.
    fn view() -> (Mat4, impl Fn(f32, f32, f32) -> Vec3) {
        let view = Mat4::perspective_rh(std::f32::consts::FRAC_PI_2, 1.0, 0.1, 10.0)
            * Mat4::look_to_rh(Vec3::new(1.0, 2.0, 3.0), Vec3::X, Vec3::Y);
        (view, |forward, right, up| Vec3::new(1.0 + forward, 2.0 + up, 3.0 + right))
    }

    #[test]
    fn a_frustum_meets_what_lies_in_it_and_no_more_than_reaches_over_its_planes() {
        let (view, at) = view();
        for (center, half, expected) in [
            (at(5.0, 0.0, 0.0), 0.1, true),
            (at(-5.0, 0.0, 0.0), 0.1, false),
            (at(5.0, 0.0, 4.8), 0.1, true),
            (at(5.0, 0.0, 5.3), 0.1, false),
            (at(5.0, 0.0, 5.3), 0.2, true),
            (at(11.0, 0.0, 0.0), 0.5, false),
            (at(0.0, 0.0, 0.0), 0.05, false),
            (at(0.0, 0.0, 0.0), 20.0, true),
        ] {
            assert_eq!(meets(&view, &boxed(center, half)), expected, "{center} ± {half}");
        }
        assert!(!meets(&view, &Bounds::EMPTY));
        assert!(meets(&Mat4::NAN, &boxed(Vec3::ZERO, 1.0)), "what is not a number leaves nothing out");
    }

    #[test]
    fn a_box_covers_the_centres_of_the_texels_that_it_is_seen_through() {
        let (view, at) = view();
        // At a distance of 4 a view of 8 texels sees 8 metres: a metre a texel, centres at half metres from the middle.
        let texels = |center, half| covered(&view, [8, 8], &boxed(center, half)).map(|c| (c.columns, c.rows));
        assert_eq!(texels(at(4.0, 0.5, 2.5), 0.05), Some((4..5, 1..2)), "right of the middle, above it");
        assert_eq!(texels(at(4.0, -3.5, -0.5), 0.05), Some((0..1, 4..5)));
        assert_eq!(texels(at(4.0, 1.0, 1.0), 0.2), None, "between four centres");
        assert_eq!(texels(at(4.0, 1.0, 1.0), 0.6), Some((4..6, 2..4)));
        assert_eq!(texels(at(0.0, 0.0, 0.0), 0.2), Some((0..8, 0..8)), "the eye lies in it");
        assert_eq!(texels(at(-4.0, 0.5, 0.5), 0.05), None);
        let odd = covered(&Mat4::NAN, [8, 4], &boxed(Vec3::ZERO, 1.0)).map(|c| (c.columns, c.rows));
        assert_eq!(odd, Some((0..8, 0..4)), "what is not a number leaves nothing out");
    }

    #[test]
    fn what_lies_behind_all_that_shows_is_hidden() {
        let (view, at) = view();
        let depth_at = |distance: f32| {
            let clip = view * at(distance, 0.0, 0.0).extend(1.0);
            clip.z / clip.w
        };
        let far = covered(&view, [8, 8], &boxed(at(5.0, 0.5, 0.5), 0.5)).expect("it lies in sight");
        assert!((far.nearest as f32 - depth_at(4.5)).abs() < 1e-4);
        assert!(far.behind(|_, _| depth_at(4.0)));
        assert!(!far.behind(|_, _| depth_at(4.6)), "it begins before that");
        let hole = far.columns.start;
        assert!(!far.behind(|x, _| if x == hole { 1.0 } else { depth_at(4.0) }), "it shows through a hole");
    }
}
