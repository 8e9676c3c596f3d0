//! Panes that light goes through: first frames, and what paths make of them.

use crate::device::Shot;
use crate::support::Scratch;
use crate::traced::{FLOOR, Quad, WALL, around, ceiling, compared, lit_by};
use lightgraph::Image;
use lightgraph::internals::image::metrics::Metrics;
use serde_json::{Value, json};
use std::path::Path;

/// Matte quads and a pane of this material under an even sky, seen from above: the scene's path.
fn under_the_sky(matte: &[Quad], pane: Quad, material: Value, folder: &Path) -> String {
    let file = lit_by(&[pane], matte, 1.9, folder);
    let mut scene: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    scene["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.7, 0.7, 0.7, 1.0]);
    scene["materials"][1] = material;
    scene["extensionsUsed"] = json!(["KHR_materials_transmission"]);
    std::fs::write(&file, scene.to_string()).unwrap();
    let file = folder.join("pane.ron");
    std::fs::write(&file, r#"Scene(gltf: "lit.gltf", environment: Constant(radiance: (1, 1, 1)))"#).unwrap();
    file.display().to_string()
}

fn by_paths(scene: &str, output: &str, set: &str) -> Image {
    let [expected] = Shot { set, ..Shot::new("graphs/gi/pathtrace.ron", scene, 48) }.render_frames(32, [output]);
    expected
}

/// An output of `final_gather` after so many frames, against that of paths.
fn against(expected: &Image, scene: &str, output: &str, frames: u32) -> Metrics {
    let [found] = Shot::new("graphs/gi/final_gather.ron", scene, 48).render_frames(frames, [output]);
    let metrics = compared(&found, expected, None);
    println!("{output}, {frames} frames: bias {:+.3} %, rmse {:.3} %", metrics.bias_percent, metrics.rmse_percent);
    metrics
}

/// A pane closes a window in the roof. The first frame leaves the pane out. Paths in later frames count what it takes
/// of the light. While the pane was opaque, the room was dark.
#[test]
fn a_pane_lets_the_sky_through() {
    let folder = Scratch::new("pane");
    let roof = ceiling([-2.0, 0.25], [-2.0, -0.25], 2.0);
    let room: Vec<Quad> = std::iter::once(FLOOR).chain(around(WALL)).chain(around(roof)).collect();
    let glass = json!({
        "doubleSided": true, "pbrMetallicRoughness": {"metallicFactor": 0},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}
    });
    let scene = under_the_sky(&room, ceiling([-0.25, 0.25], [-0.25, 0.25], 2.0), glass, folder.path());
    let expected = by_paths(&scene, "direct", "samples=64 bounces=0");
    for (frames, at_most) in [(1, 15.0), (32, 3.0)] {
        let metrics = against(&expected, &scene, "direct", frames);
        assert!(metrics.mean_reference > 5e-3, "the floor is lit");
        assert!(metrics.bias_percent.abs() <= at_most, "{frames} frames: {metrics:?}");
    }
}

/// Four walls light a pane with the sky behind it. Frames that add up left the pane's indirect light out.
#[test]
fn a_pane_before_the_sky_shows_what_lights_it() {
    let folder = Scratch::new("before");
    let walls: Vec<Quad> = around(WALL).collect();
    let thin = json!({
        "doubleSided": true, "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.7, 0.7, 0.7, 0.4]}
    });
    let scene = under_the_sky(&walls, ceiling([-1.0, 1.0], [-1.0, 1.0], 0.5), thin, folder.path());
    let metrics = against(&by_paths(&scene, "indirect", "samples=16"), &scene, "indirect", 16);
    assert!(metrics.mean_reference > 5e-3, "the pane is lit");
    assert!(metrics.bias_percent.abs() <= 3.0 && metrics.rmse_percent <= 20.0, "{metrics:?}");
}

/// The first frame takes a pane of alpha 0.6 for opaque. Paths have four fifths of the second frame, which had half of
/// the first before.
#[test]
fn the_second_frame_shows_what_stands_behind_a_pane() {
    let folder = Scratch::new("behind");
    let room: Vec<Quad> = std::iter::once(FLOOR).chain(around(WALL)).collect();
    let tinted = json!({
        "doubleSided": true, "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.1, 0.1, 0.1, 0.6]}
    });
    let scene = under_the_sky(&room, ceiling([-1.0, 1.0], [-1.0, 1.0], 0.5), tinted, folder.path());
    let set = "samples=64 bounces=0";
    let expected = by_paths(&scene, "direct", set);
    let first = against(&expected, &scene, "direct", 1);
    let second = against(&expected, &scene, "direct", 2);
    assert!(second.rmse_percent <= 20.0 && second.bias_percent.abs() <= 6.0, "{first:?}, then {second:?}");
}
