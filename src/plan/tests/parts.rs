//! What draws ask for of a scene.

use super::super::draw::{asked_parts, parts};
use super::*;
use crate::scene::Scene;

/// The tolerances of what the draws of a graph ask for, which have these fields.
fn tolerances(draws: &[&str]) -> Vec<f32> {
    let draw = |(i, fields): (usize, &&str)| {
        format!("Draw(name: \"d{i}\", shader: \"mesh.wgsl\", color: \"color\", depth: \"depth\", {fields}),")
    };
    let passes: String = draws.iter().enumerate().map(draw).collect();
    let texture = |name: &str, format: &str| format!("\"{name}\": Texture(format: {format}, size: 8),");
    let resources = texture("color", "Rgba16Float") + &texture("depth", "Depth32Float");
    let sample = sample(&resources, &passes, "\"color\": \"color\"");
    let request = Request {
        graph: &sample.graph,
        texts: &sample.texts,
        params: &Values::new(),
        facts: &sample_facts(true),
        screen: [8, 8],
        outputs: None,
        choices: &FIRST,
        levels: &[],
        limits: &wgpu_types::Limits::default(),
        features: wgpu_types::Features::empty(),
    };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/lambert_plane.glb");
    let scene = Scene::load(&path).unwrap_or_else(|f| panic!("{f}")).scene;
    let parts = parts(&asked_parts(&request), &scene).unwrap_or_else(|f| panic!("{f}"));
    parts.iter().map(|level| level.taken.tolerance).collect()
}

#[test]
fn each_part_that_a_running_draw_asks_for_is_there_once_the_finest_first() {
    assert_eq!(tolerances(&[""]), [0.0; 0], "a draw that asks for nothing takes the scene as it is");
    assert_eq!(tolerances(&["tolerance: 0"]), [0.0; 0]);
    let draws = ["tolerance: 2", "tolerance: 0.5", "", "tolerance: 2", "tolerance: 8, when: \"false\""];
    assert_eq!(tolerances(&draws), [0.5, 2.0]);
    // What is no number of metres is the plan's to say.
    assert_eq!(tolerances(&["tolerance: -1", "tolerance: 1"]), [1.0]);
}
