//! glTF's node animation, from bytes to poses.

use super::fixture::{Fixture, read_bytes};
use crate::diag::render;
use glam::{Quat, Vec3};
use serde_json::{Value, json};

/// A quad at a node that one channel moves: times 0 and 2 s.
fn animated(path: &str, interpolation: &str, output: impl FnOnce(&mut Fixture) -> usize) -> Fixture {
    let mut f = Fixture::quad();
    let input = scalars(&mut f, &[0.0, 2.0]);
    let output = output(&mut f);
    f.json["nodes"][0]["translation"] = json!([1, 0, 0]);
    f.json["animations"] = json!([{
        "name": "Go",
        "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}],
        "samplers": [{"input": input, "output": output, "interpolation": interpolation}],
    }]);
    f
}

fn scalars(f: &mut Fixture, values: &[f32]) -> usize {
    let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let view = f.view(&bytes);
    f.push("accessors", json!({"bufferView": view, "componentType": 5126, "count": values.len(), "type": "SCALAR"}))
}

fn corner(f: &Fixture, time: f32) -> Vec3 {
    let scene = f.scene();
    // The corner (1, 1, 0).
    scene.pose(time).nodes[0].transform_point3(Vec3::new(1.0, 1.0, 0.0))
}

fn close(found: Vec3, expected: Vec3) {
    assert!(found.distance(expected) < 1e-5, "{found}, not {expected}");
}

#[test]
fn translations_go_by_step_line_and_spline() {
    let (a, b) = ([0.0, 0.0, 0.0], [4.0, 0.0, 0.0]);
    let zero = [0.0; 3];
    for (kind, values, at_half) in [
        ("STEP", vec![a, b], 0.0),
        ("LINEAR", vec![a, b], 1.0),
        // Without slope at its ends: 3 t² - 2 t³ of the way.
        ("CUBICSPLINE", vec![zero, a, zero, zero, b, zero], 0.625),
    ] {
        let f = animated("translation", kind, |f| f.floats(&values));
        close(corner(&f, 0.0), Vec3::new(1.0, 1.0, 0.0));
        close(corner(&f, 0.5), Vec3::new(1.0 + at_half, 1.0, 0.0));
        // It begins anew after 2 s.
        close(corner(&f, 2.5), Vec3::new(1.0 + at_half, 1.0, 0.0));
        let bounds = f.scene().bounds;
        assert!(bounds.max.x >= 4.99 && bounds.min.x <= 0.01, "{kind}: {bounds:?}");
        assert_eq!(f.scene().duration(), 2.0);
    }
}

#[test]
fn rotations_and_scales_keep_what_the_node_says_of_the_rest() {
    let turn = Quat::from_rotation_z(2.0).to_array();
    let f = animated("rotation", "LINEAR", |f| f.floats(&[[0.0, 0.0, 0.0, 1.0], turn]));
    for time in [0.0_f32, 0.4, 1.0, 1.9] {
        close(corner(&f, time), Vec3::X + Quat::from_rotation_z(time) * Vec3::new(1.0, 1.0, 0.0));
    }
    let f = animated("scale", "LINEAR", |f| f.floats(&[[1.0, 1.0, 1.0], [3.0, 1.0, 1.0]]));
    close(corner(&f, 1.0), Vec3::new(3.0, 1.0, 0.0));
    assert_eq!(f.scene().facts()["moving_nodes"], crate::value::Value::Uint(1));
}

#[test]
fn a_scene_far_away_is_animated_where_it_is_moved_to() {
    let mut f = animated("translation", "LINEAR", |f| f.floats(&[[5000.0, 0.0, 0.0], [5002.0, 0.0, 0.0]]));
    f.json["nodes"][0]["translation"] = json!([5000, 0, 0]);
    let scene = f.scene();
    assert_ne!(scene.origin, Vec3::ZERO);
    let at = scene.pose(1.0).nodes[0].transform_point3(Vec3::ZERO) + scene.origin;
    close(at, Vec3::new(5001.0, 0.0, 0.0));
}

/// What is said of a scene that stands still.
fn left_out(f: &Fixture) -> String {
    let (scene, notices) = f.read().unwrap_or_else(|text| panic!("{text}"));
    let text = render(&notices);
    assert!(scene.nodes.iter().all(|n| n.animation.is_none()) && text.contains("; it is left out"), "{text}");
    text
}

#[test]
fn what_an_animation_says_wrongly_is_named() {
    let good = || animated("translation", "LINEAR", |f| f.floats(&[[0.0; 3], [1.0; 3]]));
    let with = |pointer: &str, value: Value| {
        let mut f = good();
        *f.json.pointer_mut(pointer).unwrap() = value;
        left_out(&f)
    };
    for (pointer, value, word) in [
        ("/animations/0/samplers/0/interpolation", json!("CUBICSPLINE"), "2 times and 2 values, 3 for each time"),
        ("/animations/0/samplers/0/interpolation", json!("SMOOTH"), "none of LINEAR, STEP and CUBICSPLINE"),
        ("/animations/0/channels/0/sampler", json!(7), "there is no sampler 7"),
        ("/animations/0/samplers/0/output", json!(99), "there is no accessor 99"),
        ("/animations/0/channels/0/target/path", json!("rotation"), "holds Vec3, not Vec4"),
        ("/animations/0/channels/0/target/path", json!("weights"), "its node shows no mesh with morph targets"),
    ] {
        let text = with(pointer, value);
        assert!(text.contains(word) && text.contains("animations[0] \"Go\", channels[0]"), "no `{word}` in:\n{text}");
    }
    let mut f = animated("translation", "LINEAR", |f| f.floats(&[[0.0; 3], [1.0; 3]]));
    let back = scalars(&mut f, &[1.0, 1.0]);
    f.json["animations"][0]["samplers"][0]["input"] = json!(back);
    assert!(left_out(&f).contains("must rise"));
    let f = animated("translation", "LINEAR", |f| f.floats(&[[0.0; 3], [f32::NAN, 0.0, 0.0]]));
    assert!(left_out(&f).contains("not usable"));
}

#[test]
fn what_is_left_out_of_animations_is_said() {
    let notices = |change: &dyn Fn(&mut Value)| {
        let mut f = animated("translation", "LINEAR", |f| f.floats(&[[0.0; 3], [1.0; 3]]));
        change(&mut f.json);
        render(&f.read().unwrap_or_else(|text| panic!("{text}")).1)
    };
    let text = notices(&|json| {
        let again = json["animations"][0].clone();
        json["animations"].as_array_mut().unwrap().push(again);
    });
    assert!(text.contains("the first of 2, \"Go\", moves the scene"), "{text}");
    let text = notices(&|json| {
        let again = json["animations"][0]["channels"][0].clone();
        json["animations"][0]["channels"].as_array_mut().unwrap().push(again);
    });
    assert!(text.contains("channels[1]: an earlier one moves the same; it is left out"), "{text}");
    let text = notices(&|json| {
        let channel = json["animations"][0]["channels"][0].clone();
        let path = |path: &str| {
            let mut channel = channel.clone();
            channel["target"]["path"] = json!(path);
            channel
        };
        json["animations"][0]["channels"] = json!([path("rotation"), path("scale")]);
        let output = json["animations"][0]["samplers"][0]["output"].as_u64().unwrap() as usize;
        let zeros = json!({"bufferView": 0, "componentType": 5121});
        json["accessors"][output] = json!({"componentType": 5121, "count": 60_000_000, "type": "SCALAR", "sparse": {
            "count": 1, "indices": zeros, "values": zeros,
        }});
    });
    let words = "with its 60000002 times and values the animation has more than 67108864; it is left out";
    assert!(text.contains("channels[0]: accessor 3 holds Scalar, not Vec4") && text.contains(words), "{text}");
    // As `KHR_animation_pointer` has them.
    let text = notices(&|json| {
        json["animations"][0]["channels"][0]["target"] = json!({"path": "pointer"});
    });
    assert!(text.contains("1 channels move no node; they are left out"), "{text}");
}

#[test]
fn lists_that_may_be_left_out_are_empty() {
    let mut f = Fixture::quad();
    f.json["scenes"] = json!([{"nodes": [0]}, {"name": "empty"}]);
    assert!(read_bytes(&f.glb()).is_ok());
}

#[test]
fn files_of_gltf_1_are_told_so() {
    for text in [r#"{"asset": {"version": "1.0"}, "scenes": {"a": {"nodes": []}}}"#, r#"{"scenes": {"a": {}}}"#] {
        let faults = read_bytes(text.as_bytes()).unwrap_err();
        assert!(faults.contains("version 1.0 is not glTF 2") && faults.contains("export"), "{faults}");
    }
}
