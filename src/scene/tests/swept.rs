//! The box round what chains of moving nodes carry.

use super::fixture::Fixture;
use crate::scene::{Bounds, Scene};
use glam::{Quat, Vec3};
use serde_json::json;

/// Numbers from 0 to 1 that look random: after a seed, always the same.
fn random(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed.wrapping_mul(0x9e37_79b9) | 1;
    move || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (state >> 8) as f32 / (1 << 24) as f32
    }
}

/// A quad at each of so many nodes, one hanging from the other a metre above it.
fn chain(nodes: usize) -> Fixture {
    let mut f = Fixture::quad();
    f.json["nodes"] = json!([]);
    for i in 0..nodes {
        let mut node = json!({"name": format!("bone{i}"), "mesh": 0, "translation": [0, 1, 0]});
        if i + 1 < nodes {
            node["children"] = json!([i + 1]);
        }
        f.push("nodes", node);
    }
    f.json["animations"] = json!([{"channels": [], "samplers": []}]);
    f
}

fn animate<const N: usize>(f: &mut Fixture, node: usize, path: &str, kind: &str, times: &[f32], values: &[[f32; N]]) {
    let view = f.view(&times.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>());
    let times = json!({"bufferView": view, "componentType": 5126, "count": times.len(), "type": "SCALAR"});
    let (input, output) = (f.push("accessors", times), f.floats(values));
    let animation = &mut f.json["animations"][0];
    let samplers = animation["samplers"].as_array_mut().unwrap();
    samplers.push(json!({"input": input, "output": output, "interpolation": kind}));
    let channel = json!({"sampler": samplers.len() - 1, "target": {"node": node, "path": path}});
    animation["channels"].as_array_mut().unwrap().push(channel);
}

/// The box round all vertices at these times; at each, the scene's bounds must hold them.
#[track_caller]
fn reached(scene: &Scene, times: impl Iterator<Item = f32>) -> Bounds {
    let (low, high) = (scene.bounds.min - 1e-5, scene.bounds.max + 1e-5);
    times.fold(Bounds::EMPTY, |reached, time| {
        let pose = scene.pose(time);
        let place = |v: &crate::scene::Vertex| pose.nodes[v.node as usize].transform_point3(v.position.into());
        let now = Bounds::of(scene.geometry.vertices.iter().map(place));
        let inside = now.min.cmpge(low).all() && now.max.cmple(high).all();
        assert!(inside, "{now:?} at {time} leaves {:?}", scene.bounds);
        reached.union(now)
    })
}

/// How many times as large the bounds are as what is reached, along the axis where this is most.
fn looseness(scene: &Scene, reached: Bounds) -> f32 {
    ((scene.bounds.max - scene.bounds.min) / (reached.max - reached.min)).max_element()
}

#[test]
fn bounds_of_twelve_turning_bones_are_hardly_larger_than_what_they_reach() {
    let mut f = chain(12);
    let times = [0.0, 0.7, 1.1, 2.0];
    for bone in 0..12 {
        let (axis, way) = (Vec3::new(0.3, bone as f32 % 3.0 - 1.0, 1.0).normalize(), 0.4 + 0.03 * bone as f32);
        let turns = [0.0, way, -way, 0.0].map(|angle| Quat::from_axis_angle(axis, angle).to_array());
        animate(&mut f, bone, "rotation", "LINEAR", &times, &turns);
    }
    let scene = f.scene();
    let loose = looseness(&scene, reached(&scene, (0..2000).map(|i| i as f32 / 1000.0)));
    assert!(loose < 1.02, "{loose}");
    // The same where the scene file carries all of it on, at another pace.
    let path = r#"Scene(motion: {"stand": [(time: 0), (time: 3, translation: (4, 0, 0))]})"#;
    f.push("nodes", json!({"name": "stand", "children": [0]}));
    f.json["scenes"][0]["nodes"] = json!([12]);
    let scene = f.described(path).unwrap();
    let loose = looseness(&scene, reached(&scene, (0..6000).map(|i| i as f32 / 1000.0)));
    assert!(loose < 1.05, "{loose}");
}

#[test]
fn bounds_hold_chains_at_any_time_however_they_move() {
    for seed in 0..24 {
        let mut next = random(seed);
        let bones = 3 + seed as usize % 4;
        let mut f = chain(bones);
        for bone in 0..bones {
            for path in ["translation", "rotation", "scale"] {
                let kind = ["LINEAR", "STEP", "CUBICSPLINE"][(next() * 3.0) as usize % 3];
                // Some keyframes are very near to each other.
                let mut time = next() * 0.5;
                let times: Vec<f32> = (0..2 + (next() * 6.0) as usize)
                    .map(|_| {
                        time += if next() < 0.3 { 1e-3 } else { next() };
                        time
                    })
                    .collect();
                let each = if kind == "CUBICSPLINE" { 3 } else { 1 };
                let count = each * times.len();
                let mut signed = || 2.0 * next() - 1.0;
                let values: Vec<[f32; 4]> = (0..count).map(|_| std::array::from_fn(|_| signed())).collect();
                let three: Vec<[f32; 3]> = values.iter().map(|v| [v[0], v[1], v[2]]).collect();
                match path {
                    // Tangents of a spline of rotations that spin it round have no rotation along the way.
                    "rotation" if each == 3 => {
                        let part = |(i, v): (usize, &[f32; 4])| match i % 3 {
                            1 => Quat::from_array(*v).normalize().to_array(),
                            _ => v.map(|x| 0.2 * x),
                        };
                        let values: Vec<_> = values.iter().enumerate().map(part).collect();
                        animate(&mut f, bone, path, kind, &times, &values);
                    }
                    "rotation" => {
                        let values: Vec<_> =
                            values.iter().map(|v| Quat::from_array(*v).normalize().to_array()).collect();
                        animate(&mut f, bone, path, kind, &times, &values);
                    }
                    _ => animate(&mut f, bone, path, kind, &times, &three),
                }
            }
        }
        let turned = r#"Scene(motion: {
            "bone0": [(time: 0.2), (time: 1.3, rotation_degrees: (1, 2, 0, 900)), (time: 2.1, translation: (0, 3, 1))],
            "bone1": [(time: 0), (time: 2.1, translation: (1, 1, 1), rotation_degrees: (0, 0, 1, -720))],
            "bone2": [(time: 0), (time: 1.7, translation: (2, 0, 0))],
        })"#;
        for scene in [f.scene(), f.described(turned).unwrap()] {
            let duration = 3.0 * scene.duration();
            reached(&scene, (0..1500).map(|_| duration * next()).chain([-f32::MIN_POSITIVE]));
        }
    }
}

#[test]
fn bounds_hold_what_happens_between_two_keyframes_alone() {
    let mut f = chain(2);
    // A hop of a hundredth of a second, while the first has turned for another hundredth.
    let turns = [0.0, 0.0, 3.0, 0.0, 0.0].map(|angle| Quat::from_rotation_z(angle).to_array());
    animate(&mut f, 0, "rotation", "STEP", &[0.0, 0.615, 0.617, 0.627, 9.0], &turns);
    let places = [[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [5.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    animate(&mut f, 1, "translation", "LINEAR", &[0.0, 0.613, 0.618, 0.623], &places);
    let scene = f.scene();
    let reached = reached(&scene, (0..4000).map(|i| 0.61 + i as f32 * 5e-6));
    let most = reached.diagonal() * 2e-3;
    assert!(reached.min.x < -5.0 && scene.bounds.min.distance(reached.min) < most, "{:?}, {reached:?}", scene.bounds);
    assert!(scene.bounds.max.distance(reached.max) < most, "{:?}, {reached:?}", scene.bounds);
}

#[test]
fn bounds_of_too_many_keyframes_are_larger_but_hold() {
    let mut f = chain(40);
    let times: Vec<f32> = (0..20_000).map(|i| i as f32 * 1e-3).collect();
    for bone in 0..40 {
        let turn = |t: &f32| Quat::from_rotation_x((3.0 * t + bone as f32).sin()).to_array();
        let turns: Vec<_> = times.iter().map(turn).collect();
        animate(&mut f, bone, "rotation", "LINEAR", &times, &turns);
    }
    let start = std::time::Instant::now();
    let scene = f.scene();
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    reached(&scene, (0..200).map(|i| 0.0977 * i as f32));
}
