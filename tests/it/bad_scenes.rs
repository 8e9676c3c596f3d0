//! Scenes with one fault each: refused with the reason, or rendered with a word about what is missing.

use crate::command::lightgraph;
use crate::support::{Scratch, repository};
use lightgraph::Scene;
use lightgraph::internals::diag::render;
use serde_json::{Value, json};
use std::path::PathBuf;

/// A quad in the plane z = 0, seen by a camera, lit by a light; with its one buffer beside it.
struct Quad {
    positions: Vec<[f32; 3]>,
    indices: Vec<u16>,
    gltf: Value,
}

impl Quad {
    fn new() -> Quad {
        let positions = vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
        let gltf = json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0, 1, 2]}],
            "nodes": [
                {"mesh": 0},
                {"camera": 0, "translation": [0, 0, 3]},
                {"translation": [0, 0, 2], "extensions": {"KHR_lights_punctual": {"light": 0}}},
            ],
            "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1, "zfar": 100}}],
            "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 5}]}},
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0}}],
            "buffers": [{"uri": "quad.bin", "byteLength": 60}],
            "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                 "min": [-1, -1, 0], "max": [1, 1, 0]},
                {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
            ],
        });
        Quad { positions, indices: vec![0, 1, 2, 0, 2, 3], gltf }
    }

    fn write(&self, scratch: &Scratch) -> PathBuf {
        let mut bytes: Vec<u8> = self.positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        bytes.extend(self.indices.iter().flat_map(|i| i.to_le_bytes()));
        std::fs::write(scratch.path().join("quad.bin"), bytes).unwrap();
        let path = scratch.path().join("quad.gltf");
        std::fs::write(&path, self.gltf.to_string()).unwrap();
        path
    }
}

/// Exit code 1, and words of the message, from the command itself.
fn refused(name: &str, quad: &Quad, words: &[&str]) {
    let scratch = Scratch::new(name);
    let path = quad.write(&scratch);
    refused_file(&path, words);
}

fn refused_file(path: &std::path::Path, words: &[&str]) {
    let output = lightgraph(&["check", "graphs/gi/direct.ron", "--scene", path.to_str().unwrap()], false);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.starts_with("error: "), "{text}");
    for word in words {
        assert!(text.contains(word), "no `{word}` in:\n{text}");
    }
}

/// Loads, with a notice that holds the words.
fn noticed(name: &str, quad: &Quad, words: &[&str]) {
    let scratch = Scratch::new(name);
    let loaded = Scene::load(&quad.write(&scratch)).unwrap_or_else(|faults| panic!("{faults}"));
    let text = render(&loaded.notices);
    for word in words {
        assert!(text.contains(word), "no `{word}` in:\n{text}");
    }
}

#[test]
fn a_sound_quad_loads_without_a_word() {
    let scratch = Scratch::new("quad-sound");
    let loaded = Scene::load(&Quad::new().write(&scratch)).unwrap_or_else(|faults| panic!("{faults}"));
    assert!(loaded.notices.is_empty(), "{}", render(&loaded.notices));
}

#[test]
fn a_truncated_glb_is_refused() {
    let scratch = Scratch::new("truncated-glb");
    let bytes = std::fs::read(repository("scenes/cornell.glb")).unwrap();
    for cut in [0, 3, 11, 19, 200, bytes.len() - 5] {
        let path = scratch.path().join("cut.glb");
        std::fs::write(&path, &bytes[..cut]).unwrap();
        refused_file(&path, &["cut.glb"]);
    }
}

#[test]
fn positions_that_are_no_numbers_are_refused() {
    for x in [f32::NAN, f32::INFINITY] {
        let mut quad = Quad::new();
        quad.positions[2][1] = x;
        refused(&format!("quad-{x}"), &quad, &["quad.gltf", "finite"]);
    }
}

#[test]
fn an_index_out_of_range_is_refused() {
    let mut quad = Quad::new();
    quad.indices[4] = 9;
    refused("quad-index", &quad, &["quad.gltf", "9", "4"]);
}

#[test]
fn a_mesh_without_area_is_refused_or_dropped_aloud() {
    let mut quad = Quad::new();
    for p in &mut quad.positions {
        p[1] = 0.0;
    }
    let scratch = Scratch::new("quad-flat");
    let path = quad.write(&scratch);
    let text = match Scene::load(&path) {
        Ok(loaded) => render(&loaded.notices),
        Err(faults) => faults.to_string(),
    };
    assert!(text.contains("area"), "{text}");
}

#[test]
fn an_empty_scene_is_refused() {
    let mut quad = Quad::new();
    quad.gltf["scenes"] = json!([{"nodes": [1, 2]}]);
    refused("quad-empty", &quad, &["quad.gltf", "no triangles", "help: "]);
}

#[test]
fn a_node_of_itself_is_refused() {
    let mut quad = Quad::new();
    quad.gltf["nodes"][0]["children"] = json!([0]);
    refused("quad-ring", &quad, &["quad.gltf"]);
}

#[test]
fn a_buffer_that_is_missing_or_short_is_refused() {
    let mut quad = Quad::new();
    quad.gltf["buffers"][0]["uri"] = json!("nothing.bin");
    refused("quad-no-buffer", &quad, &["nothing.bin"]);
    let mut quad = Quad::new();
    quad.indices.truncate(2);
    refused("quad-short-buffer", &quad, &["60 bytes", "52"]);
}

#[test]
fn a_buffer_outside_the_folder_is_refused() {
    let mut quad = Quad::new();
    quad.gltf["buffers"][0]["uri"] = json!("../../../../etc/hostname");
    refused("quad-outside", &quad, &["etc/hostname"]);
}

#[test]
fn a_missing_texture_is_told() {
    let mut quad = Quad::new();
    quad.gltf["images"] = json!([{"uri": "wood.png"}]);
    quad.gltf["textures"] = json!([{"source": 0}]);
    quad.gltf["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
    let scratch = Scratch::new("quad-texture");
    let text = match Scene::load(&quad.write(&scratch)) {
        Ok(loaded) => render(&loaded.notices),
        Err(faults) => faults.to_string(),
    };
    assert!(text.contains("wood.png"), "{text}");
}

#[test]
fn a_scene_without_light_is_told_so() {
    let mut quad = Quad::new();
    quad.gltf["scenes"] = json!([{"nodes": [0, 1]}]);
    noticed("quad-dark", &quad, &["no light", "KHR_lights_punctual"]);
}

#[test]
fn a_scene_without_camera_gets_one_and_says_so() {
    let mut quad = Quad::new();
    quad.gltf["scenes"] = json!([{"nodes": [0, 2]}]);
    let scratch = Scratch::new("quad-no-camera");
    let loaded = Scene::load(&quad.write(&scratch)).unwrap_or_else(|faults| panic!("{faults}"));
    let pose = loaded.scene.pose(0.0);
    let (values, mut notices) = loaded.scene.camera_values(&pose, None, 64, 64).unwrap_or_else(|f| panic!("{f}"));
    assert!(values.contains_key("camera_view_projection"));
    notices.extend(loaded.notices);
    assert!(render(&notices).contains("camera"), "{}", render(&notices));
}
