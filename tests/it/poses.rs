//! Where animations, skins and morph targets put vertices, against three.js: see `peers/make_poses.py`.

use crate::support::repository;
use glam::Vec3;
use lightgraph::Scene;
use lightgraph::internals::scene;
use serde::Deserialize;
use std::path::Path;

/// Of a model's size.
const TOLERANCE: f32 = 1e-4;

#[derive(Deserialize)]
struct Poses {
    renderer: String,
    models: Vec<Model>,
}

#[derive(Deserialize)]
struct Model {
    /// From the root of the repository, or absolute.
    model: String,
    times: Vec<f32>,
    vertices: Vec<Stated>,
}

/// A vertex as its mesh has it, and where it is at each time.
#[derive(Deserialize)]
struct Stated {
    rest: [f32; 3],
    at: Vec<[f32; 3]>,
}

/// How far the farthest vertex of a model is from where it is stated to be, in shares of the size.
fn farthest(model: &Model) -> f32 {
    let scene = Scene::load(&repository(&model.model)).unwrap_or_else(|f| panic!("{f}")).scene;
    let size = (scene.bounds.max - scene.bounds.min).length();
    let poses: Vec<_> = model.times.iter().map(|time| scene.pose(*time)).collect();
    let mut worst: f32 = 0.0;
    for stated in &model.vertices {
        // Where several vertices rest at a place, one of them is meant.
        let off = |v: &&scene::Vertex| {
            let each = poses.iter().zip(&stated.at).map(|(pose, at)| {
                pose.nodes[v.node as usize].transform_point3(v.position.into()).distance(Vec3::from(*at) - scene.origin)
            });
            each.fold(0.0, f32::max)
        };
        let resting = scene.geometry.vertices.iter().filter(|v| v.position == stated.rest);
        let least = resting.map(|v| off(&v)).reduce(f32::min);
        worst =
            worst.max(least.unwrap_or_else(|| panic!("{}: no vertex rests at {:?}", model.model, stated.rest)) / size);
    }
    worst
}

fn hold(path: &Path) {
    let text = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let poses: Poses = serde_json::from_slice(&text).unwrap();
    assert!(!poses.models.is_empty());
    for model in &poses.models {
        assert!(model.vertices.len() >= 100 && model.times.len() == 5, "{}", model.model);
        let off = farthest(model);
        println!("{}: {off:.1e} of the size off {}", model.model, poses.renderer);
        assert!(off <= TOLERANCE, "{}: {off:.1e} of the size off {}", model.model, poses.renderer);
    }
}

#[test]
fn vertices_are_where_three_puts_them() {
    hold(&repository("tests/references/poses.json"));
}

#[test]
#[ignore = "needs models of one's own: `peers/run.sh make_poses.py MODEL.glb…` after `make peers`"]
fn vertices_of_other_models_are_where_three_puts_them() {
    hold(&repository("target/peers/poses.json"));
}
