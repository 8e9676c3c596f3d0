//! Skins, morph targets and instances, from bytes to poses and tables.

use super::fixture::{Fixture, QUAD};
use crate::{
    scene::{MOVED, Scene, Shift},
    value::Value,
};
use glam::{DMat4, DQuat, DVec3, Mat4, Quat, Vec3};
use serde_json::{Value as Json, json};

const TIMES: [f32; 5] = [0.0, 0.3, 1.0, 1.7, 2.5];

fn scalars(f: &mut Fixture, values: &[f32]) -> usize {
    let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let view = f.view(&bytes);
    f.push("accessors", json!({"bufferView": view, "componentType": 5126, "count": values.len(), "type": "SCALAR"}))
}

fn matrices(f: &mut Fixture, values: &[Mat4]) -> usize {
    let values: Vec<[f32; 16]> = values.iter().map(Mat4::to_cols_array).collect();
    let accessor = f.floats(&values);
    f.json["accessors"][accessor]["type"] = json!("MAT4");
    accessor
}

fn bytes(f: &mut Fixture, values: &[[u8; 4]]) -> usize {
    let view = f.view(values.as_flattened());
    f.push("accessors", json!({"bufferView": view, "componentType": 5121, "count": values.len(), "type": "VEC4"}))
}

fn attribute(f: &mut Fixture, name: &str, accessor: usize) {
    f.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
}

/// Adds an animation of one channel from 0 to 2 s.
fn animate(f: &mut Fixture, node: usize, path: &str, interpolation: &str, output: usize) {
    let input = scalars(f, &[0.0, 2.0]);
    if f.json.get("animations").is_none() {
        f.json["animations"] = json!([{"channels": [], "samplers": []}]);
    }
    let animation = &mut f.json["animations"][0];
    let samplers = animation["samplers"].as_array_mut().unwrap();
    samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
    let sampler = samplers.len() - 1;
    let channel = json!({"sampler": sampler, "target": {"node": node, "path": path}});
    animation["channels"].as_array_mut().unwrap().push(channel);
}

/// How much each corner of the quad follows the second joint.
const SHARES: [f32; 4] = [0.0, 0.25, 0.625, 1.0];
/// How far the second joint turns in 2 s.
const TURN: f32 = 1.2;

/// The quad with two joints: nodes 1 and, below it, 2, which turns about Z.
fn skinned() -> Fixture {
    let mut f = Fixture::quad();
    let joints = bytes(&mut f, &[[0, 1, 0, 0]; 4]);
    let weights = f.floats(&SHARES.map(|s| [1.0 - s, s, 0.0, 0.0]));
    attribute(&mut f, "JOINTS_0", joints);
    attribute(&mut f, "WEIGHTS_0", weights);
    f.node(json!({"name": "lower", "translation": [0, -1, 0], "children": [2]}));
    f.push("nodes", json!({"name": "upper", "translation": [0, 1.5, 0], "scale": [1, 2, 1]}));
    let binds =
        matrices(&mut f, &[Mat4::from_translation(Vec3::Y), Mat4::from_translation(Vec3::new(0.0, -0.5, 0.25))]);
    f.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": binds}]);
    f.json["nodes"][0]["skin"] = json!(0);
    // Of no account: joints alone place a skinned mesh.
    f.json["nodes"][0]["translation"] = json!([9, 9, 9]);
    let output = f.floats(&[Quat::IDENTITY, Quat::from_rotation_z(TURN)].map(|q| q.to_array()));
    animate(&mut f, 2, "rotation", "LINEAR", output);
    f
}

/// What the joints of `skinned` make of a corner of the quad.
fn bent(corner: usize, time: f32) -> DVec3 {
    let (p, share) = (Vec3::from(QUAD[corner]).as_dvec3(), f64::from(SHARES[corner]));
    let turn = DQuat::from_rotation_z(f64::from(TURN) * f64::from(time.rem_euclid(2.0)) / 2.0);
    let lower = DMat4::from_translation(-DVec3::Y);
    let above = DMat4::from_scale_rotation_translation(DVec3::new(1.0, 2.0, 1.0), turn, DVec3::Y * 1.5);
    let joints = [
        lower * DMat4::from_translation(DVec3::Y),
        lower * above * DMat4::from_translation(DVec3::new(0.0, -0.5, 0.25)),
    ];
    (1.0 - share) * joints[0].transform_point3(p) + share * joints[1].transform_point3(p)
}

/// Checks where all vertices are at five times, by the corner of the quad that they were, and that the bounds hold
/// them.
fn hold(scene: &Scene, expected: impl Fn(usize, f32) -> DVec3) {
    for time in TIMES {
        let pose = scene.pose(time);
        for vertex in &scene.geometry.vertices {
            let corner = QUAD.iter().position(|q| *q == vertex.position).unwrap();
            let found = pose.nodes[vertex.node as usize].transform_point3(vertex.position.into());
            let expected = expected(corner, time).as_vec3();
            assert!(found.distance(expected) < 1e-5, "corner {corner} at {time}: {found}, not {expected}");
            let (low, high) = (scene.bounds.min - 1e-5, scene.bounds.max + 1e-5);
            assert!(found.cmpge(low).all() && found.cmple(high).all(), "{found} leaves {:?}", scene.bounds);
        }
    }
}

#[test]
fn a_skin_s_joints_blend_where_vertices_are() {
    let scene = skinned().scene();
    hold(&scene, bent);
    assert_eq!(scene.duration(), 2.0);
    assert_eq!(scene.facts()["moving_nodes"], Value::Uint(2), "the joint, and the node of the mesh");
}

#[test]
fn eight_influences_count_and_their_sum_is_made_one() {
    let mut f = skinned();
    let zeros = bytes(&mut f, &[[0; 4]; 4]);
    let ones = bytes(&mut f, &[[1; 4]; 4]);
    // Of eight half are those of the first joint. All together are twice what they should be.
    let first = f.floats(&SHARES.map(|s| [(1.0 - s) / 2.0; 4]));
    let second = f.floats(&SHARES.map(|s| [s / 2.0; 4]));
    for (name, accessor) in [("JOINTS_0", zeros), ("JOINTS_1", ones), ("WEIGHTS_0", first), ("WEIGHTS_1", second)] {
        attribute(&mut f, name, accessor);
    }
    hold(&f.scene(), bent);
}

#[test]
fn what_reads_triangles_sees_them_where_joints_have_brought_them() {
    let scene = skinned().scene();
    let mut earlier = scene.tables_after(scene.pose(0.0), |_| true, vec![], None);
    for time in TIMES {
        let pose = scene.pose(time);
        let later = scene.tables_after(pose.clone(), |_| true, vec![], Some(&earlier));
        let anew = scene.tables_after(pose, |_| true, vec![], None);
        for (found, anew) in later.list.iter().zip(&anew.list) {
            assert!(super::motion::alike(found, anew), "{} at {time}", found.name);
        }
        let triangles = later.list.iter().find(|t| t.name == "triangles").unwrap();
        let corners = triangles.column("a").unwrap();
        for row in 0..scene.geometry.indices.len() / 3 {
            let Some(Value::Vec3(a)) = corners.get(row) else { panic!("a corner") };
            assert!((0..4).any(|c| bent(c, time).as_vec3().distance(a) < 1e-5), "{a} at {time}");
        }
        earlier = later;
    }
}

#[test]
fn whoever_moves_a_skinned_mesh_or_its_joints_moves_its_vertices_once() {
    let scene = skinned().scene();
    for nodes in [vec![(0, Vec3::X)], vec![(1, Vec3::X)]] {
        let pose = scene.pose_shifted(0.3, &Shift { nodes, ..Shift::default() });
        for vertex in &scene.geometry.vertices {
            let corner = QUAD.iter().position(|q| *q == vertex.position).unwrap();
            let found = pose.nodes[vertex.node as usize].transform_point3(vertex.position.into());
            assert!(found.distance(bent(corner, 0.3).as_vec3() + Vec3::X) < 1e-5, "{found}");
        }
    }
}

#[test]
fn a_camera_that_is_added_leaves_skins_as_they_are() {
    let scene = skinned().described(r#"Scene(cameras: {"here": (at: (0, 0, 5), look_at: (0, 0, 0))})"#).unwrap();
    assert_eq!(scene.nodes.len(), 4);
    hold(&scene, bent);
}

#[test]
fn mirroring_joints_keep_fronts_in_front() {
    for across in [1.0, -1.0] {
        let mut f = skinned();
        f.json["nodes"][1]["scale"] = json!([across, 1, 1]);
        // The mesh's own node is of no account in this either.
        f.json["nodes"][0]["scale"] = json!([1, -1, 1]);
        let scene = f.scene();
        let pose = scene.pose(0.0);
        let (vertices, indices) = (&scene.geometry.vertices, &scene.geometry.indices);
        let place = |i: u32| {
            let v = &vertices[i as usize];
            pose.nodes[v.node as usize].transform_point3(v.position.into())
        };
        for t in indices.as_chunks::<3>().0 {
            let [a, b, c] = t.map(place);
            assert!((b - a).cross(c - a).z > 0.0, "{across}");
        }
    }
}

/// Displacements of two targets.
const TARGETS: [[[f32; 3]; 4]; 2] = [
    [[0.0, 0.0, 1.0], [0.5, 0.0, 0.0], [0.0; 3], [0.0, -0.5, 0.0]],
    [[0.0; 3], [0.0, 0.0, 2.0], [1.0, 1.0, 1.0], [0.0; 3]],
];

fn morphed() -> Fixture {
    let mut f = Fixture::quad();
    let targets: Vec<Json> = TARGETS.iter().map(|t| json!({"POSITION": f.floats(t)})).collect();
    f.json["meshes"][0]["primitives"][0]["targets"] = json!(targets);
    f
}

fn displaced(corner: usize, weights: [f64; 2]) -> DVec3 {
    let p = |v: [f32; 3]| Vec3::from(v).as_dvec3();
    p(QUAD[corner]) + weights[0] * p(TARGETS[0][corner]) + weights[1] * p(TARGETS[1][corner])
}

#[test]
fn morph_targets_rest_at_the_mesh_s_weights_or_the_node_s_own() {
    hold(&morphed().scene(), |corner, _| displaced(corner, [0.0; 2]));
    let mut f = morphed();
    f.json["meshes"][0]["weights"] = json!([0.5, -1.0]);
    hold(&f.scene(), |corner, _| displaced(corner, [0.5, -1.0]));
    f.json["nodes"][0]["weights"] = json!([0.0, 2.0]);
    hold(&f.scene(), |corner, _| displaced(corner, [0.0, 2.0]));
}

#[test]
fn weights_go_by_step_line_and_spline() {
    // Times 0 and 2 s: weights (0, 1) and (2, −1). Of the spline, in-slopes, values and out-slopes of a keyframe: the
    // first leaves 0 with a slope of 3.
    let spline = [0.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 2.0, -1.0, 0.0, 0.0];
    let line = [0.0, 1.0, 2.0, -1.0];
    for (kind, values) in [("STEP", line.as_slice()), ("LINEAR", &line), ("CUBICSPLINE", &spline)] {
        let mut f = morphed();
        let output = scalars(&mut f, values);
        animate(&mut f, 0, "weights", kind, output);
        let scene = f.scene();
        hold(&scene, |corner, time| {
            let time = f64::from(time.rem_euclid(2.0));
            let t = time / 2.0;
            let smooth = 3.0 * t * t - 2.0 * t * t * t;
            let weights = match kind {
                "STEP" => [0.0, 1.0],
                "LINEAR" => [2.0 * t, 1.0 - 2.0 * t],
                _ => [2.0 * smooth + 2.0 * 3.0 * (t * t * t - 2.0 * t * t + t), 1.0 - 2.0 * smooth],
            };
            displaced(corner, weights)
        });
        assert_eq!(scene.duration(), 2.0);
    }
}

#[test]
fn normals_follow_joints_and_targets() {
    // Given ones by what targets say, those of triangles by the triangles.
    for given in [true, false] {
        let mut f = skinned();
        let (position, normal) =
            (f.floats(&[[0.0; 3], [0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]), f.floats(&[[0.0, -1.0, 0.0]; 4]));
        f.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": position, "NORMAL": normal}]);
        f.json["nodes"][0]["weights"] = json!([1.0]);
        let mut turned = Vec3::new(0.0, -1.0, 1.0);
        if given {
            let normals = f.floats(&[[0.0, 0.0, 1.0]; 4]);
            attribute(&mut f, "NORMAL", normals);
        } else {
            turned = turned.normalize();
        }
        // One joint, turned by a quarter about Y: Z to X.
        f.json["nodes"][1]["rotation"] = json!(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2).to_array());
        let (joints, weights) = (bytes(&mut f, &[[0; 4]; 4]), f.floats(&[[1.0, 0.0, 0.0, 0.0]; 4]));
        attribute(&mut f, "JOINTS_0", joints);
        attribute(&mut f, "WEIGHTS_0", weights);
        let scene = f.scene();
        let tables = scene.tables(&scene.pose(0.0));
        let nodes = tables.iter().find(|t| t.name == "nodes").unwrap();
        assert_eq!(nodes.rows, scene.nodes.len() + scene.geometry.vertices.len());
        let turns = nodes.column("inverse_transpose").unwrap();
        for v in &scene.geometry.vertices {
            let Some(Value::Mat4(turn)) = turns.get(v.node as usize) else { panic!("a matrix") };
            let found = (turn * Vec3::from(v.normal).extend(0.0)).truncate().normalize();
            let expected = Vec3::new(turned.z, turned.y, 0.0).normalize();
            assert!(found.distance(expected) < 1e-5, "{given}: {found}, not {expected}");
        }
    }
}

/// Four instances at a node that stands at (1, 0, 0).
fn instanced() -> Fixture {
    let mut f = Fixture::quad();
    let translation = f.floats(&[[0.0; 3], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0], [-5.0, 0.0, 0.0]]);
    let half = Quat::from_rotation_z(std::f32::consts::PI).to_array();
    let rotation = f.floats(&[[0.0, 0.0, 0.0, 1.0], half, [0.0, 0.0, 0.0, 1.0], half]);
    let scale = f.floats(&[[1.0; 3], [2.0; 3], [-1.0, 1.0, 1.0], [1.0, 2.0, 3.0]]);
    let attributes = json!({"TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale});
    f.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
    f.json["nodes"][0]["translation"] = json!([1, 0, 0]);
    f.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    f
}

#[test]
fn instances_stand_where_their_attributes_place_them() {
    let scene = instanced().scene();
    assert_eq!((scene.nodes.len(), scene.geometry.indices.len()), (5, 24));
    let pose = scene.pose(0.0);
    let expected: [fn(Vec3) -> Vec3; 4] = [
        |p| p,
        |p| Vec3::new(-2.0 * p.x, 3.0 - 2.0 * p.y, p.z),
        |p| Vec3::new(-p.x, p.y, 4.0),
        |p| Vec3::new(-5.0 - p.x, -2.0 * p.y, p.z),
    ];
    for vertex in &scene.geometry.vertices {
        let found = pose.nodes[vertex.node as usize].transform_point3(vertex.position.into());
        let expected = Vec3::X + expected[vertex.node as usize - 1](vertex.position.into());
        assert!(found.distance(expected) < 1e-5, "{found}, not {expected}");
    }
}

#[test]
fn instances_move_with_their_node_and_repeat_neither_lights_nor_children() {
    let mut f = instanced();
    let output = f.floats(&[[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
    animate(&mut f, 0, "translation", "LINEAR", output);
    f.push("nodes", json!({"name": "child", "mesh": 0}));
    f.json["nodes"][0]["children"] = json!([1]);
    f.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([{"type": "point"}]);
    f.json["nodes"][0]["extensions"]["KHR_lights_punctual"] = json!({"light": 0});
    let scene = f.scene();
    assert_eq!((scene.nodes.len(), scene.lights.len(), scene.geometry.indices.len()), (6, 1, 30));
    let corner = |time: f32| scene.pose(time).nodes[1].transform_point3(Vec3::ZERO);
    assert!(corner(1.0).distance(corner(0.0) + Vec3::X) < 1e-5);
}

#[test]
fn what_skins_targets_and_instances_say_wrongly_is_named() {
    let check = |mut f: Fixture, change: &dyn Fn(&mut Fixture), word: &str| {
        change(&mut f);
        let text = f.faults();
        assert!(text.contains(word), "no `{word}` in:\n{text}");
    };
    let primitive = |f: &mut Fixture, key: &str, value: Json| f.json["meshes"][0]["primitives"][0][key] = value;
    type Change = fn(&mut Fixture);
    let cases: [(Change, &str); 9] = [
        (|f| f.json["nodes"][0]["skin"] = json!(3), "nodes[0] \"quad\": there is no skin 3"),
        (|f| f.json["skins"][0]["joints"] = json!([]), "skins[0] has 0 joints"),
        (|f| f.json["skins"][0]["joints"] = json!([1, 9]), "skins[0]: joint 9 is no node of the scene"),
        (|f| f.json["skins"][0]["joints"] = json!([1]), "a vertex follows joint 1; its skin has 1"),
        (|f| f.json["skins"][0]["joints"] = json!([1, 2, 2]), "skins[0] has 3 joints and 2 inverseBindMatrices"),
        (
            |f| f.json["skins"][0]["inverseBindMatrices"] = json!(0),
            "inverseBindMatrices: accessor 0 holds Vec3, not Mat4",
        ),
        (
            |f| {
                let negative = f.floats(&[[-1.0, 2.0, 0.0, 0.0]; 4]);
                attribute(f, "WEIGHTS_0", negative);
            },
            "WEIGHTS_0 of vertex 0 is [-1.0, 2.0, 0.0, 0.0], no usable shares",
        ),
        (
            |f| {
                let few = f.floats(&[[1.0, 0.0, 0.0, 0.0]; 3]);
                attribute(f, "WEIGHTS_0", few);
            },
            "4 of JOINTS_0 and 3 of WEIGHTS_0, but 4 of POSITION",
        ),
        (
            |f| {
                let alone = f.floats(&[[1.0, 0.0, 0.0, 0.0]; 4]);
                attribute(f, "WEIGHTS_1", alone);
            },
            "it has only one of JOINTS_1 and WEIGHTS_1",
        ),
    ];
    for (change, word) in cases {
        check(skinned(), &change, word);
    }
    check(morphed(), &|f| f.json["nodes"][0]["weights"] = json!([1e30]), "a weight of its morph targets");
    check(
        morphed(),
        &|f| primitive(f, "targets", json!([{"POSITION": 77}])),
        "targets[0] POSITION: there is no accessor 77",
    );
    check(
        morphed(),
        &|f| {
            let few = f.floats(&[[1.0; 3]; 2]);
            primitive(f, "targets", json!([{"POSITION": few}]));
        },
        "2 of POSITION in targets[0], but 4 of POSITION",
    );
    let many = |f: &mut Fixture| {
        let view = f.view(&[0; 12]);
        f.json["accessors"][0] = json!({"componentType": 5126, "count": 1 << 20, "type": "VEC3", "sparse": {
            "count": 1, "indices": {"bufferView": view, "componentType": 5121}, "values": {"bufferView": view},
        }});
        primitive(f, "targets", json!(vec![json!({"POSITION": 0}); 33]));
    };
    check(morphed(), &many, "33 morph targets of 1048576 vertices; at most 33554432 displacements fit");
    let mut f = morphed();
    let output = scalars(&mut f, &[0.0, 1.0, 2.0]);
    animate(&mut f, 0, "weights", "LINEAR", output);
    let (_, notices) = f.read().unwrap_or_else(|text| panic!("{text}"));
    let text = crate::diag::render(&notices);
    assert!(text.contains("it has 3 values for 2 morph targets") && text.contains("it is left out"), "{text}");
    check(
        instanced(),
        &|f| {
            let two = f.floats(&[[1.0; 3]; 2]);
            f.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = json!(two);
        },
        "nodes[0] \"quad\": EXT_mesh_gpu_instancing: its attributes differ in their counts",
    );
    let none = |f: &mut Fixture| f.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = json!({});
    check(instanced(), &none, "none of TRANSLATION, ROTATION and SCALE");
}

#[test]
fn influences_beyond_eight_are_left_out_aloud() {
    let mut f = skinned();
    let (joints, weights) = (bytes(&mut f, &[[0; 4]; 4]), f.floats(&[[0.0; 4]; 4]));
    for set in 1..3 {
        attribute(&mut f, &format!("JOINTS_{set}"), joints);
        attribute(&mut f, &format!("WEIGHTS_{set}"), weights);
    }
    let notices = crate::diag::render(&f.read().unwrap().1);
    assert!(notices.contains("JOINTS_2 is left out"), "{notices}");
}

#[test]
#[ignore = "a measurement: run with --release -- --ignored --nocapture"]
fn sixty_poses_of_twenty_thousand_vertices() {
    let (wide, high) = (200, 100);
    let mut f = skinned();
    let places =
        || (0..high).flat_map(|y| (0..wide).map(move |x| [x as f32 / wide as f32, y as f32 / high as f32, 0.0]));
    let quads = (0..high - 1).flat_map(|y| (0..wide - 1).map(move |x| (y * wide + x) as u16));
    let indices: Vec<u16> = quads.flat_map(|i| [i, i + 1, i + 201, i, i + 201, i + 200]).collect();
    let position = f.floats(&places().collect::<Vec<_>>());
    let normal = f.floats(&vec![[0.0, 0.0, 1.0]; wide * high]);
    let joints = bytes(&mut f, &vec![[0, 1, 0, 1]; wide * high]);
    let weights = f.floats(&places().map(|[_, y, _]| [1.0 - y, y, 0.5, 0.5]).collect::<Vec<_>>());
    let indices = f.shorts(&indices);
    let attributes = json!({"POSITION": position, "NORMAL": normal, "JOINTS_0": joints, "WEIGHTS_0": weights});
    f.json["meshes"][0]["primitives"][0] = json!({"attributes": attributes, "indices": indices, "material": 0});
    let scene = f.scene();
    assert_eq!(scene.geometry.vertices.len(), wide * high);
    for (what, named) in
        [("poses", &["nodes"][..]), ("with what rays need", &["nodes", "triangles", "bvh", "clusters", MOVED])]
    {
        let wanted = |name: &str| named.contains(&name);
        let mut earlier = scene.tables_after(scene.pose(0.0), wanted, vec![], None);
        let start = std::time::Instant::now();
        for frame in 1..=60 {
            earlier = scene.tables_after(scene.pose(frame as f32 / 60.0), wanted, vec![], Some(&earlier));
        }
        println!("{what}: {:.2} ms each", start.elapsed().as_secs_f64() * 1e3 / 60.0);
    }
}
