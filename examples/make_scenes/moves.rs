//! What moves in every way that glTF knows: a skinned and morphed stalk on nodes with scales of their own, a ball of
//! two morph targets, and a box on a chain of nodes.

use crate::glb::GlbBuilder;
use crate::mesh::TriangleMesh;
use crate::shapes::{ellipsoid, standing_block, tube};
use glam::{DQuat, DVec3, EulerRot};
use serde_json::json;

/// Keyframes of all samplers, in seconds; the last is the animation's length.
const TIMES: [f32; 4] = [0.0, 0.7, 1.5, 2.4];

pub fn moves() -> GlbBuilder {
    let mut d = GlbBuilder::new();
    let stone = d.matte("stone", [0.5, 0.5, 0.5]);
    let leaf = d.matte("leaf", [0.2, 0.5, 0.15]);
    let clay = d.matte("clay", [0.6, 0.35, 0.2]);
    let mut ground = TriangleMesh::new();
    let p = DVec3::new;
    ground.quad([p(-4.0, -1.5, 3.0), p(4.0, -1.5, 3.0), p(4.0, -1.5, -3.0), p(-4.0, -1.5, -3.0)]);
    d.fixture("ground", &ground, stone);
    d.sun("sun", p(2.0, 4.0, 3.0), [3.0; 3]);
    d.camera("front", p(0.0, 1.0, 8.0), p(0.0, 0.4, 0.0), 40.0);

    let mut samplers = vec![];
    let mut channels = vec![];
    let times = d.times(&TIMES);
    let mut drive = |node: usize, path: &str, interpolation: &str, output: usize| {
        let sampler = samplers.len();
        samplers.push(json!({ "input": times, "output": output, "interpolation": interpolation }));
        channels.push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
    };

    // Joints first, so that the stalk's node is no parent of theirs.
    let tip = d.node(json!({ "name": "tip", "translation": [0.0, 1.0, 0.0], "scale": [1.0, 1.25, 0.8] }), None);
    let middle = d.node(json!({ "name": "middle", "translation": [0.0, 1.0, 0.1], "children": [tip] }), None);
    let foot = d.node(
        json!({ "name": "foot", "translation": [-1.5, -1.0, 0.0], "scale": [1.1, 0.9, 1.0], "children": [middle] }),
        None,
    );
    let stalk = tube(&(0..=16).map(|i| (p(0.0, f64::from(i) / 8.0, 0.0), 0.2)).collect::<Vec<_>>(), 10, false);
    let stalk = d.mesh_with("stalk", &stalk, leaf, |d, positions, primitive| {
        // Of the three joints the two that are nearest.
        let share = |at: &[f32; 3]| (at[1].clamp(0.0, 2.0), at[1] > 1.0);
        let joints: Vec<[u8; 4]> =
            positions.iter().map(|p| if share(p).1 { [1, 2, 0, 0] } else { [0, 1, 0, 0] }).collect();
        let weights: Vec<[f32; 4]> = positions
            .iter()
            .map(|p| {
                let up = share(p).0 - if share(p).1 { 1.0 } else { 0.0 };
                [1.0 - up, up, 0.0, 0.0]
            })
            .collect();
        let swell: Vec<[f32; 3]> = positions.iter().map(|p| [p[0] * p[1], 0.0, p[2] * p[1]]).collect();
        primitive["attributes"]["JOINTS_0"] = json!(d.bytes(&joints));
        primitive["attributes"]["WEIGHTS_0"] = json!(d.floats(&weights));
        primitive["targets"] = json!([{ "POSITION": d.places(&swell) }]);
    });
    d.words_of(stalk)["weights"] = json!([0.25]);
    let binds: Vec<[f32; 16]> = [0.0, 1.0, 2.0].map(|y: f32| shift(-y)).to_vec();
    let binds = d.floats(&binds);
    let skin = d.skin(json!({ "joints": [foot, middle, tip], "inverseBindMatrices": binds }));
    let stalk = d.node(json!({ "name": "stalk", "skin": skin }), Some(stalk));
    let bend = turns(&[[0.0, 0.0, 0.0], [0.3, 0.0, 0.9], [-0.4, 0.5, 0.2], [0.1, -0.2, -0.6]]);
    let bend = d.floats(&splined(&bend, 0.4));
    drive(middle, "rotation", "CUBICSPLINE", bend);
    let twist = d.floats(&turns(&[[0.0, 0.0, 0.0], [0.0, 1.2, 0.0], [0.5, 2.8, 0.0], [0.0, 3.6, 0.4]]));
    drive(tip, "rotation", "LINEAR", twist);
    let weights = d.floats(&[[0.25f32], [1.0], [0.0], [0.6]]);
    drive(stalk, "weights", "LINEAR", weights);

    let ball = ellipsoid(DVec3::ZERO, DVec3::splat(0.5), 16, 8);
    let ball = d.mesh_with("ball", &ball, clay, |d, positions, primitive| {
        let flat: Vec<[f32; 3]> = positions.iter().map(|p| [0.4 * p[0], -0.7 * p[1], 0.4 * p[2]]).collect();
        let lean: Vec<[f32; 3]> = positions.iter().map(|p| [p[1] * p[1], 0.0, 0.3 * p[0]]).collect();
        primitive["targets"] = json!([{ "POSITION": d.places(&flat) }, { "POSITION": d.places(&lean) }]);
    });
    let ball = d.node(json!({ "name": "ball", "translation": [0.5, 0.0, 0.0] }), Some(ball));
    let values = [[0.0f32, 1.0], [1.0, 0.3], [0.2, 0.0], [0.7, 0.8]];
    // Of every keyframe the tangent in, the value, the tangent out; of each two numbers.
    let values: Vec<[f32; 1]> =
        values.iter().flat_map(|v| [[0.5, -0.5], *v, [-0.3, 0.6]]).flatten().map(|x| [x]).collect();
    let values = d.floats(&values);
    drive(ball, "weights", "CUBICSPLINE", values);

    let block = standing_block(0.0, 0.0, p(0.5, 0.7, 0.3));
    let block = d.mesh("block", &[(&block, clay)]);
    let hand = d
        .node(json!({ "name": "hand", "translation": [0.9, 0.0, 0.0], "rotation": [0.0, 0.0, 0.6, 0.8] }), Some(block));
    let arm = d.node(json!({ "name": "arm", "translation": [1.5, 0.2, 0.0], "children": [hand] }), None);
    let places = d.floats(&[[1.5f32, 0.2, 0.0], [1.6, 0.8, 0.4], [1.2, 0.1, -0.5], [1.7, 0.4, 0.2]]);
    drive(arm, "translation", "STEP", places);
    let spins = d.floats(&turns(&[[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.0, 0.4, 4.4], [0.3, 0.0, 6.0]]));
    drive(arm, "rotation", "LINEAR", spins);
    let sizes = d.floats(&[[1.0f32, 1.0, 1.0], [1.5, 0.5, 1.0], [0.6, 0.6, 2.0], [1.0, 1.4, 0.7]]);
    drive(hand, "scale", "LINEAR", sizes);

    d.animation(json!({ "name": "all", "samplers": samplers, "channels": channels }));
    d
}

/// The matrix that moves up.
fn shift(up: f32) -> [f32; 16] {
    let mut m = [0.0; 16];
    (m[0], m[5], m[10], m[13], m[15]) = (1.0, 1.0, 1.0, up, 1.0);
    m
}

/// Quaternions of turns about X, Y and Z, in steps that systems agree on.
fn turns(angles: &[[f64; 3]]) -> Vec<[f32; 4]> {
    let turn = |[x, y, z]: &[f64; 3]| DQuat::from_euler(EulerRot::XYZ, *x, *y, *z).to_array();
    angles.iter().map(|a| turn(a).map(|c| ((c * 1e6).round() / 1e6) as f32)).collect()
}

/// Values with tangents in and out.
fn splined(values: &[[f32; 4]], tangent: f32) -> Vec<[f32; 4]> {
    values.iter().flat_map(|v| [[tangent, 0.1, -tangent, 0.0], *v, [0.0, -tangent, 0.2, 0.1]]).collect()
}
