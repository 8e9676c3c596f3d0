//! What lies under the pointer, and how far a drag moves it. Places in the image run from 0 to 1, from the top left.

use glam::{Vec2, Vec3};
use lightgraph::internals::scene::navigate::{height_at, right};
use lightgraph::internals::scene::{Lens, Pose};
use lightgraph::{Scene, View};

/// How far from a light's mark a click still takes it, in heights of the image.
const REACH: f32 = 0.03;

/// Something that can be dragged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Draggable {
    /// Index into the scene's lights.
    Light(usize),
    /// Index into the scene's nodes.
    Node(usize),
}

/// The thing under a place of the image, and the point of it that is seen there. Lights come first: their marks
/// lie on the image.
pub fn thing(scene: &Scene, pose: &Pose, view: View, aspect: f32, at: Vec2) -> Option<(Draggable, Vec3)> {
    let near = pose.lights.iter().enumerate().filter_map(|(i, light)| {
        let offset = (project(view, aspect, light.position)? - at) * Vec2::new(aspect, 1.0);
        (offset.length() <= REACH).then_some((offset.length(), i, light.position))
    });
    if let Some((_, light, point)) = near.min_by(|a, b| a.0.total_cmp(&b.0)) {
        return Some((Draggable::Light(light), point));
    }
    surface(scene, pose, view, aspect, at).map(|(node, point)| (Draggable::Node(node), point))
}

/// The node whose surface is seen at a place of the image, and the point there.
pub fn surface(scene: &Scene, pose: &Pose, view: View, aspect: f32, at: Vec2) -> Option<(usize, Vec3)> {
    let (from, to) = ray(view, aspect, at);
    let geometry = &scene.geometry;
    let mut nearest: Option<(f32, usize)> = None;
    for corners in geometry.indices.chunks_exact(3) {
        let mut points = [Vec3::ZERO; 3];
        let mut node = 0;
        for (point, index) in points.iter_mut().zip(corners) {
            let vertex = geometry.vertices.get(*index as usize)?;
            node = geometry.owners.node(vertex.node) as usize;
            *point = pose.nodes.get(vertex.node as usize)?.transform_point3(vertex.position.into());
        }
        if let Some(distance) = meets(from, to, points)
            && nearest.is_none_or(|n| distance < n.0)
        {
            nearest = Some((distance, node));
        }
    }
    nearest.map(|(distance, node)| (node, from + to * distance))
}

/// Where a point is seen; `None` behind the viewer.
pub fn project(view: View, aspect: f32, point: Vec3) -> Option<Vec2> {
    let offset = point - view.place.position;
    if offset.dot(view.place.forward) <= 1e-4 {
        return None;
    }
    let height = height_at(view, point);
    let at = Vec2::new(offset.dot(right(view.place)) / aspect, -offset.dot(view.place.up)) / height;
    Some(at + 0.5)
}

/// How far a thing at `point` moves, in metres, when the pointer goes `by` in the image: in the plane through the point
/// that faces the viewer.
pub fn drag(view: View, aspect: f32, point: Vec3, by: Vec2) -> Vec3 {
    let height = height_at(view, point);
    (right(view.place) * by.x * aspect - view.place.up * by.y) * height
}

/// Where the ray through a place of the image starts, and its unit direction.
fn ray(view: View, aspect: f32, at: Vec2) -> (Vec3, Vec3) {
    let place = view.place;
    let across = right(place) * (at.x - 0.5) * aspect - place.up * (at.y - 0.5);
    match view.lens {
        Lens::Perspective { yfov, .. } => {
            (place.position, (place.forward + across * 2.0 * (yfov * 0.5).tan()).normalize())
        }
        Lens::Orthographic { ymag, .. } => (place.position + across * 2.0 * ymag, place.forward),
    }
}

/// The distance at which a ray meets a triangle from either side (Möller and Trumbore, 1997).
fn meets(from: Vec3, to: Vec3, [a, b, c]: [Vec3; 3]) -> Option<f32> {
    let (ab, ac) = (b - a, c - a);
    let p = to.cross(ac);
    let determinant = ab.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let offset = from - a;
    let u = offset.dot(p) / determinant;
    let q = offset.cross(ab);
    let v = to.dot(q) / determinant;
    let distance = ac.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 1e-4).then_some(distance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightgraph::Scene;
    use lightgraph::internals::scene::Shift;

    fn hall() -> (Scene, View) {
        let path = crate::repository("scenes/hall");
        let scene = Scene::load(&path).unwrap_or_else(|f| panic!("{f}")).scene;
        let view = scene.view(&scene.pose(0.0), None, 1.5).unwrap().0;
        (scene, view)
    }

    #[test]
    fn a_point_on_a_surface_is_seen_where_the_ray_went() {
        let (scene, view) = hall();
        let pose = scene.pose(0.0);
        for i in 0..25 {
            let at = Vec2::new(0.1 + 0.2 * (i % 5) as f32, 0.1 + 0.2 * (i / 5) as f32);
            let (_, point) = surface(&scene, &pose, view, 1.5, at).expect("the hall is closed");
            let seen = project(view, 1.5, point).unwrap();
            assert!((seen - at).length() < 1e-4, "{at} and {seen}");
        }
    }

    #[test]
    fn the_projection_is_the_one_that_shaders_get() {
        let (scene, view) = hall();
        let pose = scene.pose(0.0);
        let values = scene.camera_values(&pose, None, 150, 100).unwrap().0;
        let Some(lightgraph::internals::value::Value::Mat4(m)) = values.get("camera_view_projection") else { panic!() };
        let (_, point) = surface(&scene, &pose, view, 1.5, Vec2::new(0.3, 0.7)).unwrap();
        let clip = m.project_point3(point);
        let at = Vec2::new(clip.x * 0.5 + 0.5, 0.5 - clip.y * 0.5);
        assert!((at - Vec2::new(0.3, 0.7)).length() < 1e-4, "{at}");
    }

    #[test]
    fn a_dragged_light_follows_the_pointer() {
        let (scene, view) = hall();
        let pose = scene.pose(0.0);
        let light = pose.lights[0].position;
        let Some(at) = project(view, 1.5, light) else { panic!("the lamp is in front of the camera") };
        assert_eq!(thing(&scene, &pose, view, 1.5, at), Some((Draggable::Light(0), light)));
        let by = Vec2::new(0.1, -0.05);
        let shift = Shift { single_lights: vec![(0, drag(view, 1.5, light, by))], ..Shift::default() };
        let moved = scene.pose_shifted(0.0, &shift).lights[0].position;
        assert!((project(view, 1.5, moved).unwrap() - at - by).length() < 1e-4);
    }

    #[test]
    fn what_is_behind_is_not_seen() {
        let (_, view) = hall();
        assert_eq!(project(view, 1.0, view.place.position - view.place.forward), None);
    }

    #[test]
    fn a_ray_along_a_triangle_misses_it() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(meets(Vec3::new(-1.0, 0.2, 0.0), Vec3::X, triangle), None);
        assert_eq!(meets(Vec3::new(0.2, 0.2, 2.0), Vec3::NEG_Z, triangle), Some(2.0));
        assert_eq!(meets(Vec3::new(0.2, 0.2, -2.0), Vec3::NEG_Z, triangle), None);
    }
}
