//! Views of cameras and lights.

use super::fixture::{Fixture, QUAD};
use crate::{
    diag::render,
    scene::{FRAME_VALUES, Lens, Scene, View},
    value::{Value, Values},
};
use glam::{Mat4, Vec2, Vec3};
use serde_json::json;

/// A cube from −1 to 1 on every axis.
fn cube() -> Fixture {
    let mut f = Fixture::new();
    let white = f.material(json!({"name": "white", "doubleSided": true}));
    for (axis, side) in [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0), (2, -1.0), (2, 1.0)] {
        let corners = QUAD.map(|[u, v, _]| {
            let mut p = [0.0; 3];
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, 2.0 * u - 1.0, 2.0 * v - 1.0);
            p
        });
        f.wall("side", corners, white);
    }
    f
}

fn with_camera(name: &str, lens: serde_json::Value) -> Fixture {
    let mut f = cube();
    let camera = f.push("cameras", lens);
    f.node(json!({"name": name, "camera": camera, "translation": [0, 0, 5]}));
    f
}

fn perspective() -> serde_json::Value {
    json!({"name": "lens", "type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.5, "aspectRatio": 9.0}})
}

fn values(scene: &Scene, camera: Option<&str>, width: u32, height: u32) -> Values {
    scene.camera_values(&scene.pose(0.0), camera, width, height).unwrap().0
}

fn matrix(values: &Values, name: &str) -> Mat4 {
    match values[name] {
        Value::Mat4(m) => m,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_camera_s_vertical_angle_holds_and_the_aspect_is_the_image_s() {
    let scene = with_camera("eye", perspective()).scene();
    let values = values(&scene, None, 200, 100);
    let named: Vec<&str> = values.keys().map(String::as_str).collect();
    let mut stated: Vec<&str> = FRAME_VALUES.iter().map(|v| v.0).filter(|n| n.starts_with("camera_")).collect();
    // Those of the last frame are this one's, a frame later.
    stated.retain(|n| !n.starts_with("camera_previous_"));
    stated.sort_unstable();
    assert_eq!(named, stated);
    assert_eq!(values["camera_position"], Value::Vec3(Vec3::new(0.0, 0.0, 5.0)));
    let m = matrix(&values, "camera_view_projection");
    let tan = 0.5_f32.tan();
    // Four metres in front: the top of the picture, and its right edge at twice the height.
    let top = m.project_point3(Vec3::new(0.0, 4.0 * tan, 1.0));
    assert!((top.y - 1.0).abs() < 1e-5 && top.x.abs() < 1e-6, "{top}");
    let right = m.project_point3(Vec3::new(8.0 * tan, 0.0, 1.0));
    assert!((right.x - 1.0).abs() < 1e-5, "{right}");
    // Depth runs from 0 at znear to below 1 at the farthest corner.
    assert!(m.project_point3(Vec3::new(0.0, 0.0, 4.5)).z.abs() < 1e-5);
    let far = m.project_point3(Vec3::new(1.0, 1.0, -1.0)).z;
    assert!(far > 0.9 && far < 1.0, "{far}");
    let inverse = matrix(&values, "camera_inverse_view_projection");
    assert!((inverse * m).abs_diff_eq(Mat4::IDENTITY, 1e-4));
}

#[test]
fn depth_begins_a_little_before_the_scene_for_a_camera_far_away() {
    let scene = cube().scene();
    let seen = |away: f32, near: f32| {
        let mut pose = scene.pose(0.0);
        let view = View::perspective(Vec3::new(0.0, 0.0, 1.0 + away), Vec3::NEG_Z, Vec3::Y, 0.8);
        pose.view = Some(View { lens: Lens::Perspective { yfov: 0.8, near, far: None }, ..view });
        scene.camera_values(&pose, None, 64, 64).unwrap().0["camera_near"]
    };
    assert_eq!(seen(1000.0, 0.05), Value::Float(10.0));
    assert_eq!(seen(1000.0, 20.0), Value::Float(20.0));
    // Within the scene it is the camera's own.
    assert_eq!(seen(-0.5, 0.05), Value::Float(0.05));
    // But not so near that depths could not tell apart what is far.
    let Value::Float(near) = seen(-0.5, 1e-9) else { panic!("a number") };
    assert!((1e-5..5e-5).contains(&near), "{near}");
}

#[test]
fn an_orthographic_camera_keeps_its_height() {
    let lens = json!({"type": "orthographic", "orthographic": {"xmag": 9, "ymag": 2, "znear": 1, "zfar": 11}});
    let scene = with_camera("plan", lens).scene();
    let m = matrix(&values(&scene, Some("plan"), 300, 100), "camera_view_projection");
    let p = m.project_point3(Vec3::new(6.0, 2.0, 4.0));
    assert!(p.distance(Vec3::new(1.0, 1.0, 0.0)) < 1e-5, "{p}");
    assert!((m.project_point3(Vec3::new(0.0, 0.0, -6.0)).z - 1.0).abs() < 1e-5);
}

#[test]
fn cameras_are_found_by_their_node_s_or_their_own_name() {
    let scene = with_camera("eye", perspective()).scene();
    assert_eq!(scene.find_camera("eye"), Ok(0));
    assert_eq!(scene.find_camera("lens"), Ok(0));
    let text = render(&scene.find_camera("eyes").unwrap_err().0);
    assert!(text.contains("there is no camera \"eyes\"") && text.contains("did you mean `eye`?"), "{text}");
}

#[test]
fn a_scene_without_a_camera_is_framed_with_a_notice() {
    let scene = cube().scene();
    for (width, height) in [(100, 100), (400, 100), (100, 400), (1, 8000)] {
        let (values, notices) = scene.camera_values(&scene.pose(0.0), None, width, height).unwrap();
        assert!(render(&notices).contains("the scene has no camera"), "{notices:?}");
        let m = matrix(&values, "camera_view_projection");
        for corner in scene.bounds.corners() {
            let p = m.project_point3(corner);
            assert!(p.x.abs() < 1.0 && p.y.abs() < 1.0 && p.z > 0.0 && p.z < 1.0, "{width}×{height}: {corner} at {p}");
        }
    }
    assert!(scene.camera_values(&scene.pose(0.0), Some("eye"), 9, 9).is_err());
    let text = render(&scene.camera_values(&scene.pose(0.0), None, 0, 9).unwrap_err().0);
    assert!(text.contains("0×9 has no pixels"), "{text}");
}

/// View-projections with near and far, of a scene with one light.
fn light_views(node: serde_json::Value, light: serde_json::Value) -> Vec<(Mat4, f32, f32)> {
    let mut f = cube();
    f.light(node, light);
    let scene = f.scene();
    let tables = scene.tables(&scene.pose(0.0));
    let table = &tables[3];
    let float = |column: usize, row| match table.columns[column].1.get(row) {
        Some(Value::Float(v)) => v,
        other => panic!("{other:?}"),
    };
    (0..table.rows)
        .map(|row| match table.columns[1].1.get(row) {
            Some(Value::Mat4(m)) => (m, float(2, row), float(3, row)),
            other => panic!("{other:?}"),
        })
        .collect()
}

#[test]
fn a_point_light_s_six_views_share_out_all_directions() {
    let views = light_views(json!({"translation": [0.5, 0, 0]}), json!({"type": "point"}));
    let light = Vec3::new(0.5, 0.0, 0.0);
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    for (i, (m, near, far)) in views.iter().enumerate() {
        let ahead = m.project_point3(light + axes[i] * 0.4);
        assert!(ahead.truncate().length() < 1e-6, "view {i}");
        // The nearest wall is 0.5 away; what touches it at a view's corner lies 0.5/√3 deep.
        assert!(*near > 0.28 && *near < 0.5 / 3.0_f32.sqrt(), "{near}");
        assert!(*far > 1.5_f32.hypot(2.0_f32.sqrt()) && *far < 2.1, "{far}");
        assert!((m.project_point3(light + axes[i] * *near).z).abs() < 1e-5);
        assert!((m.project_point3(light + axes[i] * *far).z - 1.0).abs() < 1e-5);
    }
    for i in 0..1000 {
        // Fibonacci's spiral: directions spread evenly.
        let (y, turn) = (1.0 - (2.0 * i as f32 + 1.0) / 1000.0, i as f32 * 2.399_963);
        let r = (1.0 - y * y).sqrt();
        let p = light + Vec3::new(r * turn.cos(), y, r * turn.sin()) * 0.49;
        let holds = |m: &Mat4| {
            let c = *m * p.extend(1.0);
            c.w > 0.0 && c.x.abs() <= c.w * 1.0001 && c.y.abs() <= c.w * 1.0001 && c.z >= 0.0 && c.z <= c.w
        };
        assert!(views.iter().any(|(m, ..)| holds(m)), "{p} is in no view");
    }
}

#[test]
fn a_spot_s_view_holds_its_cone_with_a_margin() {
    for outer in [0.1_f32, 0.6, 1.2] {
        let spot = json!({"type": "spot", "spot": {"outerConeAngle": outer}});
        let views = light_views(json!({"translation": [0, 0, 0.5], "rotation": [0, 0.6, 0, 0.8]}), spot);
        assert_eq!(views.len(), 1);
        let (m, near, far) = views[0];
        let turn = glam::Quat::from_xyzw(0.0, 0.6, 0.0, 0.8);
        let light = Vec3::new(0.0, 0.0, 0.5);
        for i in 0..16 {
            let around = i as f32 * std::f32::consts::TAU / 16.0;
            let edge = Vec3::new(outer.sin() * around.cos(), outer.sin() * around.sin(), -outer.cos());
            let p = m.project_point3(light + turn * edge * 0.499);
            let reach = p.x.abs().max(p.y.abs());
            assert!(reach < 0.98 && p.z > 0.0 && p.z < 1.0, "cone {outer}: {p}");
        }
        let ahead = m.project_point3(light + turn * Vec3::NEG_Z * 0.499);
        assert!(ahead.truncate().length() < 1e-5, "{ahead}");
        assert!(near >= far / 2000.0 && near < 0.5, "{near} {far}");
    }
}

#[test]
fn a_light_on_a_surface_or_with_a_range_has_sound_depths() {
    let on_wall = light_views(json!({"translation": [1, 0, 0]}), json!({"type": "point"}));
    let (_, near, far) = on_wall[0];
    assert!((near - far / 2000.0).abs() < 1e-6, "{near} {far}");
    let ranged = light_views(json!({}), json!({"type": "point", "range": 1.25}));
    assert_eq!(ranged[0].2, 1.25);
    let outside = light_views(json!({"translation": [0, 100, 0]}), json!({"type": "point"}));
    assert!(outside[0].1 > 50.0 && outside[0].2 < 102.0, "{outside:?}");
}

#[test]
fn a_half_space_spot_is_a_notice() {
    let mut f = cube();
    let spot = json!({"type": "spot", "spot": {"outerConeAngle": std::f32::consts::FRAC_PI_2}});
    f.light(json!({"name": "wide"}), spot);
    let (scene, notices) = f.read().unwrap();
    assert!(render(&notices).contains("too wide for one shadow view"), "{notices:?}");
    let tables = scene.tables(&scene.pose(0.0));
    let Some(Value::Mat4(m)) = tables[3].columns[1].1.get(0) else { panic!() };
    assert!(m.is_finite());
}

#[test]
fn a_scene_without_light_is_a_notice() {
    let (_, notices) = cube().read().unwrap();
    assert!(render(&notices).contains("the scene has no light"), "{notices:?}");
}

#[test]
fn a_shifted_lens_moves_the_image_and_nothing_else() {
    let scene = with_camera("eye", perspective()).scene();
    let mut pose = scene.pose(0.0);
    let (straight, _) = scene.view(&pose, None, 2.0).unwrap();
    let shift = Vec2::new(0.25, -0.5);
    pose.view = Some(View { shift, ..straight });
    let (shifted, _) = scene.camera_values(&pose, None, 200, 100).unwrap();
    let before = matrix(&values(&scene, None, 200, 100), "camera_view_projection");
    let after = matrix(&shifted, "camera_view_projection");
    for point in [Vec3::ZERO, Vec3::new(0.5, -0.25, 1.0), Vec3::new(-1.0, 1.0, -1.0)] {
        // Clip space is two heights high, and as wide as the aspect says.
        let expected = before.project_point3(point) - Vec3::new(shift.x / 2.0, shift.y, 0.0) * 2.0;
        assert!((after.project_point3(point) - expected).length() < 1e-5, "{point}");
    }
    let inverse = matrix(&shifted, "camera_inverse_view_projection");
    assert!((inverse * after - Mat4::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-4));
}
