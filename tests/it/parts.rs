//! Draws of a part of the scene: by materials, by nodes.

use crate::{device, support};
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph;
use lightgraph::internals::shader::Library;
use lightgraph::{Checked, Gpu, Project, Scene, Session, Settings};
use std::path::Path;
use std::sync::Arc;

const SHADER: &str = "struct Camera { camera_view_projection: mat4x4f }
var<uniform> camera: Camera;
struct Node { transform: mat4x4f }
var<storage, read> nodes: array<Node>;
@vertex fn place(@location(0) position: vec3f, @location(1) node: u32) -> @builtin(position) vec4f {
    return camera.camera_view_projection * nodes[node].transform * vec4f(position, 1.0);
}
@fragment fn shade() -> @location(0) f32 { return 1.0; }";

/// The pixels that a draw with these fields covers.
fn covered(gpu: &Gpu, fields: &str) -> Checked<Vec<bool>> {
    let text = format!(
        "Graph(params: {{\"most\": Float(default: 0.7)}}, resources: {{\"hit\": Texture(format: R32Float, size: \"screen\")}},
         passes: [Draw(name: \"some\", shader: \"some.wgsl\", color: \"hit\", cull: None, {fields})],
         outputs: {{\"hit\": \"hit\"}})"
    );
    let source = Source::new("parts.ron", text);
    let read = |_: &Path| -> Checked<Arc<Source>> { Ok(source.clone()) };
    let graph = graph::load(Path::new("parts.ron"), &read)?;
    let files = [("some.wgsl".to_string(), Source::new("some.wgsl", SHADER))].into_iter().collect();
    let project = Project { graph, texts: Library { files, ..Library::default() } };
    let scene = Scene::load(&support::repository("scenes/cornell_point.gltf"))?.scene;
    let settings = Settings { size: [32, 32], skip: true, verify: true, ..Settings::default() };
    let mut session = Session::new(gpu, &project, scene, settings)?;
    session.frame(gpu, 0, 0.0)?;
    Ok(session.image(gpu, "hit")?.data.iter().map(|x| *x > 0.0).collect())
}

fn count(pixels: &[bool]) -> usize {
    pixels.iter().filter(|p| **p).count()
}

#[test]
fn materials_and_nodes_choose_what_is_drawn() {
    let gpu = device::gpu();
    let draw = |fields: &str| covered(&gpu, fields).unwrap_or_else(|f| panic!("{f}"));
    let all = draw("");
    // Red and green walls, and what is white.
    let (dull, white) = (draw("materials: \"base_color.x <= most\""), draw("materials: \"base_color.x > most\""));
    let both: Vec<bool> = dull.iter().zip(&white).map(|(a, b)| *a || *b).collect();
    assert_eq!(both, all);
    assert!(count(&dull) > 0 && count(&dull) < count(&all), "{} of {}", count(&dull), count(&all));
    let walls = draw("nodes: [\"left\", \"right\"]");
    assert_eq!(walls, dull);
    assert_eq!(count(&draw("nodes: [\"left\"], materials: \"base_color.x > most\"")), 0);
    assert_eq!(draw("nodes: [\"left\", \"right\"], tolerance: 0.01"), walls);
}

#[test]
fn nodes_that_the_scene_lacks_are_faults() {
    let told = covered(&device::gpu(), "nodes: [\"shrt\", \"tall\"]").unwrap_err().to_string();
    assert!(told.contains("has no node `shrt`") && told.contains("did you mean `short`?"), "{told}");
}
