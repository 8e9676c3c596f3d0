//! Poses over time, and the bounds they stay in.

use super::fixture::Fixture;
use crate::scene::{Bounds, Column, Level, MOVED, PREVIOUS_TRANSFORM, Pose, Scene, Shift, Table, Tables};
use glam::{Mat4, Quat, Vec3};
use serde_json::json;
use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

fn near(a: Vec3, b: Vec3) -> bool {
    a.distance(b) < 1e-5
}

/// The image of a point of the quad's node at a time.
fn at(scene: &Scene, time: f32, point: Vec3) -> Vec3 {
    scene.pose(time).nodes[0].transform_point3(point)
}

#[test]
fn keyframes_are_linear_and_loop() {
    let scene = Fixture::quad()
        .described(
            r#"Scene(motion: {"quad": [
                (time: 1, translation: (0, 0, 0)), (time: 2, translation: (4, 0, 0)), (time: 4, translation: (4, 2, 0)),
            ]})"#,
        )
        .unwrap();
    for (time, expected) in [
        (0.0, Vec3::ZERO),
        (1.0, Vec3::ZERO),
        (1.25, Vec3::X),
        (2.0, 4.0 * Vec3::X),
        (3.0, Vec3::new(4.0, 1.0, 0.0)),
        (4.0, Vec3::ZERO),
        (5.25, Vec3::X),
        (-1.0, Vec3::new(4.0, 1.0, 0.0)),
        (4001.25, Vec3::X),
        (f32::NAN, Vec3::ZERO),
        (f32::INFINITY, Vec3::ZERO),
    ] {
        let found = at(&scene, time, Vec3::ZERO);
        assert!(near(found, expected), "at {time}: {found}, not {expected}");
    }
    assert_eq!(scene.bounds, Bounds { min: Vec3::ZERO, max: Vec3::new(5.0, 3.0, 0.0) });
}

#[test]
fn a_turn_adds_to_the_node_s_own_rotation_and_may_go_all_the_way_round() {
    let mut f = Fixture::quad();
    // A quarter turn about Y: the quad's X points down −Z.
    let quarter = Quat::from_rotation_y(FRAC_PI_2);
    f.json["nodes"][0]["rotation"] = json!(quarter.to_array());
    f.json["nodes"][0]["translation"] = json!([10, 0, 0]);
    let scene =
        f.described(r#"Scene(motion: {"quad": [(time: 0), (time: 4, rotation_degrees: (0, 2, 0, 360))]})"#).unwrap();
    for (time, expected) in [(0.0, Vec3::NEG_Z), (1.0, Vec3::NEG_X), (2.0, Vec3::Z), (3.0, Vec3::X)] {
        let found = at(&scene, time, Vec3::X) - Vec3::X * 10.0;
        assert!(near(found, expected), "at {time}: {found}, not {expected}");
    }
    // The sweep of the quad is a cylinder of radius and height 1 round the node.
    let Bounds { min, max } = scene.bounds;
    let (low, high) = (Vec3::new(9.0, 0.0, -1.0), Vec3::new(11.0, 1.0, 1.0));
    assert!(min.cmple(low).all() && max.cmpge(high).all(), "{min} {max}");
    assert!(min.distance(low) < 2e-3 && max.distance(high) < 2e-3, "{min} {max}");
}

#[test]
fn turns_about_different_axes_go_the_shortest_way() {
    let scene = Fixture::quad()
        .described(
            r#"Scene(motion: {"quad": [
                (time: 0, rotation_degrees: (1, 0, 0, 90)), (time: 2, rotation_degrees: (0, 1, 0, 90)), (time: 9),
            ]})"#,
        )
        .unwrap();
    assert!(near(at(&scene, 0.0, Vec3::Y), Vec3::Z));
    assert!(near(at(&scene, 2.0, Vec3::X), Vec3::NEG_Z));
    let half = scene.pose(1.0).nodes[0].to_scale_rotation_translation().1;
    let ends = [Quat::from_rotation_x(FRAC_PI_2), Quat::from_rotation_y(FRAC_PI_2)];
    assert!((half.angle_between(ends[0]) - half.angle_between(ends[1])).abs() < 1e-3);
}

#[test]
fn children_lights_and_cameras_move_with_their_parents_inside_the_bounds() {
    let mut f = Fixture::quad();
    let camera = f.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}));
    f.push("nodes", json!({"name": "seat", "camera": camera, "translation": [0, 2, 0], "scale": [3, 3, 3]}));
    f.push("nodes", json!({"name": "arm", "mesh": 0, "translation": [2, 0, 0], "rotation": [0, 0, 0.6, 0.8]}));
    f.json["nodes"][0]["children"] = json!([1, 2]);
    f.light(json!({}), json!({"name": "sun", "type": "directional"}));
    let scene = f
        .described(
            r#"Scene(motion: {
                "quad": [(time: 0), (time: 2, translation: (0, 0, 3), rotation_degrees: (0, 1, 0, 180))],
                "arm": [(time: 0), (time: 0.7, rotation_degrees: (1, 1, 0, 360))],
                "sun": [(time: 0), (time: 8, rotation_degrees: (1, 0, 0, -90))],
            })"#,
        )
        .unwrap();
    assert_eq!(scene.moving(), [true, true, true, true]);
    let pose = scene.pose(2.0 - 1e-6);
    assert!(pose.cameras[0].position.distance(Vec3::new(0.0, 2.0, 3.0)) < 1e-4, "{:?}", pose.cameras[0]);
    assert!(pose.cameras[0].forward.distance(Vec3::Z) < 1e-4);
    assert!(near(pose.cameras[0].up, Vec3::Y));
    let sun = scene.pose(7.999_999).lights[0].direction;
    assert!(sun.distance(Vec3::NEG_Y) < 1e-4, "{sun}");
    for i in 0..500 {
        let pose = scene.pose(i as f32 * 0.031);
        for vertex in &scene.geometry.vertices {
            let p = pose.nodes[vertex.node as usize].transform_point3(vertex.position.into());
            let inside = p.cmpge(scene.bounds.min - 1e-5).all() && p.cmple(scene.bounds.max + 1e-5).all();
            assert!(inside, "{p} at {} leaves {:?}", pose.time, scene.bounds);
        }
    }
}

#[test]
fn a_node_that_is_placed_takes_along_what_hangs_from_it() {
    let mut f = Fixture::quad();
    let lamp = json!({"name": "lamp", "translation": [0, 1, 0]});
    let lamp = f.light(lamp, json!({"type": "spot", "intensity": 1, "spot": {}}));
    f.json["nodes"][0]["children"] = json!([lamp]);
    f.json["scenes"][0]["nodes"] = json!([0]);
    let scene = f.scene();
    let turned = Mat4::from_rotation_translation(Quat::from_rotation_z(FRAC_PI_2), Vec3::new(3.0, 0.0, 0.0));
    let shift = Shift { places: [(0, turned), (99, Mat4::IDENTITY)].into(), ..Shift::default() };
    let pose = scene.pose_shifted(0.0, &shift);
    assert!(near(pose.nodes[0].transform_point3(Vec3::X), Vec3::new(3.0, 1.0, 0.0)));
    assert!(near(pose.lights[0].position, Vec3::new(2.0, 0.0, 0.0)), "{}", pose.lights[0].position);
    // The tables after it are those made anew.
    let earlier = scene.tables_after(scene.pose(0.0), |_| true, vec![], None);
    check_after(&scene, &[], earlier, &pose, "placed");
}

#[test]
fn a_light_s_own_name_moves_its_node_but_not_twice() {
    let mut f = Fixture::quad();
    f.light(json!({"name": "holder"}), json!({"name": "lamp", "type": "point"}));
    let scene = f.described(r#"Scene(motion: {"lamp": [(time: 0, translation: (0, 7, 0))]})"#).unwrap();
    assert!(near(scene.pose(0.0).lights[0].position, 7.0 * Vec3::Y));
    let ron = r#"Scene(motion: {"lamp": [(time: 0)], "holder": [(time: 0)]})"#;
    let text = f.described(ron).unwrap_err();
    assert!(text.contains("\"holder\" moves a node that moves already"), "{text}");
}

#[test]
fn motion_out_of_range_is_a_fault() {
    let mut f = Fixture::quad();
    f.json["nodes"][0]["scale"] = json!([1e6, 1e6, 1e6]);
    f.push("nodes", json!({"name": "far", "mesh": 0}));
    f.json["nodes"][0]["children"] = json!([1]);
    let text = f.described(r#"Scene(motion: {"far": [(time: 0, translation: (0, 1e8, 0))]})"#).unwrap_err();
    assert!(text.contains("too far to compute with"), "{text}");
}

#[test]
fn tables_that_a_move_leaves_alone_are_those_of_before() {
    let mut f = Fixture::quad();
    f.light(json!({"name": "lamp", "translation": [0, 0, 2]}), json!({"type": "point", "intensity": 1}));
    let scene = f.scene();
    let earlier = scene.tables_after(scene.pose(0.0), |_| true, vec![], None);
    let lights = scene.pose_shifted(0.0, &Shift { lights: Vec3::X, ..Shift::default() });
    let mut nodes = scene.pose(0.0);
    nodes.nodes[0] = Mat4::from_translation(Vec3::Y);
    for (pose, expected) in [
        (&earlier.pose, vec![]),
        (&lights, vec!["lights", "light_views"]),
        (&nodes, vec!["nodes", "light_views", "triangles", "bvh", "clusters", "emitters"]),
    ] {
        let found = scene.tables_after(pose.clone(), |name| name != MOVED, vec![], Some(&earlier)).list;
        let anew = scene.tables_named(pose, |name| name != MOVED);
        assert!(found.iter().zip(&anew).all(|(a, b)| alike(a, b)), "what is kept is what would be made");
        let kept = |t: &Table| earlier.list.iter().any(|e| e.is_clone(t));
        assert_eq!(found.iter().filter(|t| !kept(t)).map(|t| t.name).collect::<Vec<_>>(), expected);
    }
}

#[test]
fn boxes_lie_round_what_moved_where_it_was_and_where_it_is() {
    let mut f = Fixture::quad();
    f.push("nodes", json!({"name": "other", "mesh": 0, "translation": [0, 0, 0.5]}));
    f.json["nodes"][0]["children"] = json!([1]);
    let scene = f.scene();
    let boxes = |tables: &Tables| {
        let moved = tables.list.iter().find(|t| t.name == MOVED).expect("it is asked for");
        let (Some(Column::Vec3(lower)), Some(Column::Vec3(upper))) = (moved.column("lower"), moved.column("upper"))
        else {
            panic!("corners of boxes")
        };
        let both = lower.iter().zip(upper.iter()).filter(|(l, u)| l.x <= u.x);
        both.map(|(l, u)| (*l, *u)).collect::<Vec<(Vec3, Vec3)>>()
    };
    let after = |pose: &Pose, earlier: Option<&Tables>| scene.tables_after(pose.clone(), |_| true, vec![], earlier);
    let start = scene.pose(0.0);
    let first = after(&start, None);
    assert!(boxes(&first)[0].0.x < -1e20 && first.settles(), "nothing is known of before");
    let still = after(&start, Some(&first));
    assert!(boxes(&still).is_empty() && !still.settles());
    // Within the box round everything, which stays as it is.
    let mut pose = start.clone();
    pose.nodes[1] = Mat4::from_scale_rotation_translation(Vec3::new(0.5, 0.5, 1.0), Default::default(), Vec3::Z * 0.5);
    let moved = after(&pose, Some(&still));
    let found = boxes(&moved);
    let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 1e-4;
    assert_eq!(found.len(), 2);
    assert!(near(found[0].0, Vec3::Z * 0.5) && near(found[0].1, Vec3::new(1.0, 1.0, 0.5)), "{found:?}");
    assert!(near(found[1].0, Vec3::Z * 0.5) && near(found[1].1, Vec3::splat(0.5)), "{found:?}");
    assert!(boxes(&after(&pose, Some(&moved))).is_empty());
    // Beyond that box everything may change.
    pose.nodes[1] = Mat4::from_translation(Vec3::Y * 9.0);
    assert!(boxes(&after(&pose, Some(&moved)))[0].0.x < -1e20);
}

#[test]
fn rows_that_differ_are_those_of_what_moved() {
    let mut f = Fixture::quad();
    f.push("nodes", json!({"name": "other", "mesh": 0, "translation": [0, 0, 3]}));
    f.json["nodes"][0]["children"] = json!([1]);
    let scene = f.scene();
    let earlier = scene.tables_after(scene.pose(0.0), |_| true, vec![], None);
    let mut pose = scene.pose(0.0);
    pose.nodes[1] = Mat4::from_translation(Vec3::Y);
    let found = scene.tables_after(pose.clone(), |_| true, vec![], Some(&earlier)).list;
    let anew = scene.tables(&pose);
    let same = found.iter().zip(&anew).all(|(a, b)| alike(a, b));
    assert!(same, "the order does not depend on the way");
    for (now, then) in found.iter().zip(&earlier.list) {
        let ranges = now.differs(then).expect("it has as many rows");
        let content = |t: &Table, row: usize| t.columns.iter().map(|(_, c)| c.get(row)).collect::<Vec<_>>();
        let others = (0..now.rows).filter(|row| !ranges.iter().any(|some| some.contains(row)));
        others.for_each(|row| assert_eq!(content(now, row), content(then, row), "row {row} of {}", now.name));
        if now.name == "triangles" {
            assert_eq!(ranges.iter().map(|some| some.len()).sum::<usize>(), 2, "{ranges:?}");
        }
    }
}

/// Whether a table is the same after others as made anew, but for what tells of these others: what moved, and where
/// nodes were.
pub(super) fn alike(a: &Table, b: &Table) -> bool {
    let rest = |t: &Table| {
        let columns = t.columns.iter().filter(|(name, _)| *name != PREVIOUS_TRANSFORM).cloned().collect();
        Table { columns, ..t.clone() }
    };
    a.name == MOVED || rest(a) == rest(b)
}

/// Checks that tables made after others are those that are made anew, and that what they say differs is all that does.
fn check_after(scene: &Scene, levels: &[Arc<Level>], earlier: Tables, pose: &Pose, what: &str) -> Tables {
    let anew = scene.tables_after(pose.clone(), |_| true, levels.to_vec(), None).list;
    let found = scene.tables_after(pose.clone(), |_| true, levels.to_vec(), Some(&earlier));
    for ((now, then), anew) in found.list.iter().zip(&earlier.list).zip(&anew) {
        assert!(alike(now, anew), "{what}: {}", now.name);
        let plain = |t: &Table| Table { since: None, columns: t.columns.to_vec().into(), ..t.clone() };
        let (told, all) = (now.differs(then), plain(now).differs(&plain(then)).expect("as many rows"));
        let told = told.expect("as many rows");
        let within = all.iter().flat_map(|rows| rows.clone()).all(|row| told.iter().any(|rows| rows.contains(&row)));
        assert!(within, "{what}: {} differs in {all:?}, not only in {told:?}", now.name);
    }
    found
}

#[test]
fn tables_after_any_node_of_a_scene_has_moved_are_those_made_anew() {
    let scene =
        crate::scene::Scene::load(std::path::Path::new("scenes/hall.ron")).unwrap_or_else(|f| panic!("{f}")).scene;
    let levels = [scene.level(0.02)];
    let mut tables = scene.tables_after(scene.pose(0.0), |_| true, levels.to_vec(), None);
    for node in 0..scene.nodes.len() {
        // A little, out through the box round everything, and back: other nodes stay where the last round left them.
        for by in [Vec3::X * 0.02, Vec3::new(0.0, 9.0, 0.0), Vec3::new(0.0, -8.99, 0.0)] {
            let mut pose = tables.pose.clone();
            pose.nodes[node] = Mat4::from_translation(by) * pose.nodes[node];
            tables = check_after(&scene, &levels, tables, &pose, &format!("node {node} by {by}"));
        }
    }
    let whole = scene.pose_shifted(0.0, &Shift { nodes: vec![(0, Vec3::Y)], lights: Vec3::X, ..Shift::default() });
    check_after(&scene, &levels, tables, &whole, "back, and the lights");
}

#[test]
fn rows_are_told_apart_by_their_bits() {
    let table = |x: f32| Table {
        name: "nodes",
        rows: 2,
        since: None,
        columns: std::sync::Arc::new([("x", crate::scene::Column::Float([1.0, x].into_iter().collect()))]),
    };
    let second = 1..2;
    assert_eq!(table(-0.0).differs(&table(0.0)), Some(vec![second]));
    assert_eq!(table(f32::NAN).differs(&table(f32::NAN)), Some(vec![]));
}
