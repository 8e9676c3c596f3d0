//! The views that shadow maps are drawn from.

use super::{
    Column, Table,
    clusters::{Cluster, triangles, widened},
    model::{Bounds, LightKind, Scene},
    motion::{LightPose, Pose},
    pieces::Pieces,
};
use glam::{Mat4, Vec3};
use std::sync::Arc;

/// One shadow map's view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LightView {
    /// Row of the `lights` table.
    pub light: u32,
    pub view_projection: Mat4,
    /// Depths along the view's axis that map to 0 and 1, in metres.
    pub near: f32,
    pub far: f32,
}

/// Half the widest angle of a spot's view. A perspective view can't cover a half space; at 85° its texels are
/// already 130 times denser at the rim than in the middle.
pub(super) const WIDEST_HALF_ANGLE: f32 = 85.0 * std::f32::consts::PI / 180.0;

/// A spot's view is this much wider than its cone (as tangents), so that texels and their neighbours at the cone's
/// edge lie inside: a texel and a half of a map of 128.
const SPOT_MARGIN: f32 = 1.025;

/// Nearest plane over farthest when geometry touches the light. Depth then still resolves 2000 · 2⁻²⁴ of the far
/// distance, a tenth of a millimetre a metre.
const LEAST_NEAR: f32 = 1.0 / 2000.0;

/// The faces of a point light, in the order of its views: direction and up. They are a cube map's as seen from outside:
/// left and right exchanged.
const FACES: [(Vec3, Vec3); 6] = [
    (Vec3::X, Vec3::Y),
    (Vec3::NEG_X, Vec3::Y),
    (Vec3::Y, Vec3::NEG_Z),
    (Vec3::NEG_Y, Vec3::Z),
    (Vec3::Z, Vec3::Y),
    (Vec3::NEG_Z, Vec3::Y),
];

/// The surfaces of a scene at a pose, in parts with boxes round them.
pub(super) struct Surfaces<'a, C> {
    pub parts: &'a [Cluster],
    /// By part.
    pub boxes: &'a Pieces<Bounds>,
    /// A triangle's corners in world space, by its place in the scene's indices.
    pub corners: C,
}

impl<C: Fn(usize) -> [Vec3; 3]> Surfaces<'_, C> {
    /// The distance from a point to the nearest surface, or `most` where that is less. Only what lies in boxes nearer
    /// than the best so far is looked at, the nearest box first.
    fn nearest(&self, point: Vec3, most: f32) -> f32 {
        let ways: Vec<f32> = self.boxes.iter().map(|b| widened(b).nearest(point)).collect();
        let first = (0..ways.len()).min_by(|a, b| ways[*a].total_cmp(&ways[*b]));
        first.into_iter().chain(0..ways.len()).fold(most, |best, part| match self.parts.get(part) {
            Some(part_of) if ways[part] < best => {
                let corners = triangles(part_of).map(&self.corners);
                corners.map(|t| distance_to_triangle(point, t)).fold(best, f32::min)
            }
            _ => best,
        })
    }
}

/// All views at a pose, in the order of the lights.
pub(super) fn light_views<C: Fn(usize) -> [Vec3; 3]>(
    scene: &Scene,
    pose: &Pose,
    surfaces: &Surfaces<'_, C>,
) -> Vec<LightView> {
    let mut views = vec![];
    for (row, (light, at)) in scene.lights.iter().zip(&pose.lights).enumerate() {
        let light_row = row as u32;
        let view = |view_projection, near, far| LightView { light: light_row, view_projection, near, far };
        match light.kind {
            LightKind::Point => {
                // A cube's corner lies 1/√3 of its distance along the face's axis.
                let (near, far) = depths(scene, at, light.range, 3.0_f32.sqrt().recip(), surfaces);
                let projection = Mat4::perspective_rh(std::f32::consts::FRAC_PI_2, 1.0, near, far);
                views.extend(
                    FACES.map(|(direction, up)| {
                        view(projection * Mat4::look_to_rh(at.position, direction, up), near, far)
                    }),
                );
            }
            LightKind::Spot => {
                let tan = light.outer.min(WIDEST_HALF_ANGLE).tan() * SPOT_MARGIN;
                // The picture is a square round the cone: its corner lies √2 farther out than its edge.
                let corner = (1.0 + 2.0 * tan * tan).sqrt().recip();
                let (near, far) = depths(scene, at, light.range, corner, surfaces);
                let projection = Mat4::perspective_rh(2.0 * tan.atan(), 1.0, near, far);
                views.push(view(projection * Mat4::look_to_rh(at.position, at.direction, up(at.direction)), near, far));
            }
            LightKind::Directional => {
                let (view_projection, near, far) = sun(&scene.bounds, at.direction);
                views.push(view(view_projection, near, far));
            }
        }
    }
    views
}

/// The table of these views.
pub(super) fn light_view_table(views: &[LightView], all: Bounds) -> Table {
    Table {
        name: "light_views",
        rows: views.len(),
        since: None,
        columns: Arc::new([
            ("light", Column::Uint(views.iter().map(|v| v.light).collect())),
            ("view_projection", Column::Mat4(views.iter().map(|v| v.view_projection).collect())),
            ("near", Column::Float(views.iter().map(|v| v.near).collect())),
            ("far", Column::Float(views.iter().map(|v| v.far).collect())),
            ("lower", Column::Vec3(Pieces::repeat(all.min, views.len()))),
            ("upper", Column::Vec3(Pieces::repeat(all.max, views.len()))),
        ]),
    }
}

/// Near and far planes of a view from a light's position. `corner` is the least cosine between the view's axis
/// and a direction inside it: what is `d` away lies at least `d · corner` deep.
fn depths<C: Fn(usize) -> [Vec3; 3]>(
    scene: &Scene,
    at: &LightPose,
    range: f32,
    corner: f32,
    surfaces: &Surfaces<'_, C>,
) -> (f32, f32) {
    let reach = scene.bounds.farthest(at.position) * 1.001;
    // Past its range a light gives nothing, so there is nothing to shadow.
    let far = if range > 0.0 { reach.min(range) } else { reach }.max(1e-4);
    let near = (surfaces.nearest(at.position, far) * corner * 0.99).clamp(far * LEAST_NEAR, far * 0.5);
    (near, far)
}

/// An orthographic view along `direction` that holds the whole box.
fn sun(bounds: &Bounds, direction: Vec3) -> (Mat4, f32, f32) {
    let turn = Mat4::look_to_rh(Vec3::ZERO, direction, up(direction));
    let seen = Bounds::of(bounds.corners().map(|c| turn.transform_point3(c)));
    let pad = (bounds.diagonal() * 0.01).max(1e-4);
    // View space looks down −z: the nearest corner has the largest z. The eye stands two pads before it.
    let eye = seen.max.z + 2.0 * pad;
    let (near, far) = (pad, eye - seen.min.z + pad);
    let back = Mat4::from_translation(Vec3::new(0.0, 0.0, -eye));
    let (low, high) = (seen.min - pad, seen.max + pad);
    (Mat4::orthographic_rh(low.x, high.x, low.y, high.y, near, far) * back * turn, near, far)
}

fn up(direction: Vec3) -> Vec3 {
    if direction.y.abs() < 0.99 { Vec3::Y } else { Vec3::Z }
}

/// Distance from a point to the nearest point of a triangle. Source: Ericson, "Real-Time Collision Detection", section
/// 5.1.5.
fn distance_to_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let (ab, ac) = (b - a, c - a);
    let (ap, bp, cp) = (p - a, p - b, p - c);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    let nearest = if d1 <= 0.0 && d2 <= 0.0 {
        a
    } else if d3 >= 0.0 && d4 <= d3 {
        b
    } else if d6 >= 0.0 && d5 <= d6 {
        c
    } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        a + ab * (d1 / (d1 - d3))
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        a + ac * (d2 / (d2 - d6))
    } else if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))
    } else {
        let sum = va + vb + vc;
        a + ab * (vb / sum) + ac * (vc / sum)
    };
    p.distance(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::clusters::bounds;

    #[test]
    fn the_distance_to_a_triangle_is_to_its_face_edge_or_corner() {
        let t = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for (p, expected) in [
            (Vec3::new(0.2, 0.2, 3.0), 3.0),
            (Vec3::new(-3.0, -4.0, 0.0), 5.0),
            (Vec3::new(0.5, -2.0, 0.0), 2.0),
            (Vec3::new(1.0, 1.0, 0.0), 0.5_f32.sqrt()),
            (Vec3::new(4.0, 0.0, 4.0), 5.0),
            (Vec3::new(0.0, 3.0, 0.0), 2.0),
            (Vec3::new(-1.0, 0.5, 0.0), 1.0),
        ] {
            let found = distance_to_triangle(p, t);
            assert!((found - expected).abs() < 1e-5, "{p}: {found}, not {expected}");
        }
    }

    #[test]
    fn the_nearest_of_many_triangles_is_found_by_their_boxes() {
        let corner = |i: usize, axis: usize| {
            let turn = 0.37 * (7 * i + axis) as f32;
            Vec3::new(turn.sin(), (1.3 * turn).cos(), (1.7 * turn).sin()) * 5.0 + Vec3::AXES[axis] * 0.3
        };
        let corners = |i: usize| [0, 1, 2].map(|axis| corner(i, axis));
        let parts: Vec<Cluster> = (0..25).map(|i| Cluster { first: 12 * i, count: 12, node: 0 }).collect();
        let boxes: Pieces<Bounds> = parts.iter().map(|c| bounds(c, |i| corners(i / 3)[i % 3])).collect();
        let surfaces = Surfaces { parts: &parts, boxes: &boxes, corners };
        for p in [Vec3::ZERO, Vec3::new(4.0, -1.0, 2.0), corners(31)[1], Vec3::new(0.0, 90.0, 0.0)] {
            let all = (0..100).map(|i| distance_to_triangle(p, corners(i))).fold(f32::INFINITY, f32::min);
            assert_eq!(surfaces.nearest(p, f32::INFINITY), all, "{p}");
            assert_eq!(surfaces.nearest(p, 0.5 * all), 0.5 * all, "{p}");
        }
    }

    #[test]
    fn a_sun_s_view_holds_the_box_whatever_its_direction() {
        let bounds = Bounds { min: Vec3::new(-3.0, 0.0, 1.0), max: Vec3::new(2.0, 4.0, 1.5) };
        for direction in [Vec3::NEG_Y, Vec3::Y, Vec3::X, Vec3::new(1.0, -2.0, 0.5).normalize()] {
            let (m, near, far) = sun(&bounds, direction);
            assert!(0.0 < near && near < far);
            for corner in bounds.corners() {
                let p = m.project_point3(corner);
                assert!(p.x.abs() < 1.0 && p.y.abs() < 1.0 && p.z > 0.0 && p.z < 1.0, "{direction}: {corner} at {p}");
            }
            let depth = |p: Vec3| m.project_point3(p).z;
            assert!(depth(bounds.center()) < depth(bounds.center() + direction * 0.1), "depth grows with the light");
        }
    }
}
