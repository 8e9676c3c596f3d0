//! glTF files built in memory for tests.

use crate::{
    diag::{Diagnostic, Source, render},
    scene::{
        Additions, Scene, description,
        load::{Besides, read},
    },
};
use serde_json::{Value, json};
use std::path::Path;

/// A glTF under construction: JSON, and the bytes of its one buffer.
pub(super) struct Fixture {
    pub json: Value,
    pub bytes: Vec<u8>,
}

/// A unit quad in the plane z = 0 that faces +Z.
pub(super) const QUAD: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
pub(super) const QUAD_INDICES: [u16; 6] = [0, 1, 2, 0, 2, 3];

impl Fixture {
    /// Nothing but a version.
    pub fn new() -> Fixture {
        let lights = json!({"KHR_lights_punctual": {"lights": []}});
        let mut json =
            json!({"asset": {"version": "2.0"}, "extensions": lights, "scene": 0, "scenes": [{"nodes": []}]});
        for key in ["nodes", "meshes", "materials", "cameras", "accessors", "bufferViews"] {
            json[key] = json!([]);
        }
        Fixture { json, bytes: vec![] }
    }

    /// A single quad at a node called `quad`, white, without normals.
    pub fn quad() -> Fixture {
        let mut f = Fixture::new();
        let position = f.floats(&QUAD);
        let indices = f.shorts(&QUAD_INDICES);
        f.material(json!({"name": "white"}));
        f.mesh(json!({"attributes": {"POSITION": position}, "indices": indices, "material": 0}));
        f.node(json!({"name": "quad", "mesh": 0}));
        f
    }

    /// Appends to an array of the JSON; returns the index.
    pub fn push(&mut self, key: &str, value: Value) -> usize {
        let list = self.json[key].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Appends a node that is a root of the scene.
    pub fn node(&mut self, value: Value) -> usize {
        let index = self.push("nodes", value);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(index));
        index
    }

    pub fn material(&mut self, value: Value) -> usize {
        self.push("materials", value)
    }

    pub fn mesh(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({"name": "mesh", "primitives": [primitive]}))
    }

    /// Appends a flat quad at the origin's node: corners counter-clockwise as seen from its front.
    pub fn wall(&mut self, name: &str, corners: [[f32; 3]; 4], material: usize) {
        let position = self.floats(&corners);
        let indices = self.shorts(&QUAD_INDICES);
        let mesh = self.mesh(json!({"attributes": {"POSITION": position}, "indices": indices, "material": material}));
        self.node(json!({"name": name, "mesh": mesh}));
    }

    /// Appends a light and a root node of its name with it.
    pub fn light(&mut self, mut node: Value, light: Value) -> usize {
        let lights = self.json["extensions"]["KHR_lights_punctual"]["lights"].as_array_mut().unwrap();
        lights.push(light);
        node["extensions"] = json!({"KHR_lights_punctual": {"light": lights.len() - 1}});
        self.node(node)
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let shape = format!("VEC{N}");
        self.push("accessors", json!({"bufferView": view, "componentType": 5126, "count": values.len(), "type": shape}))
    }

    pub fn shorts(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5123, "count": values.len(), "type": "SCALAR"}),
        )
    }

    /// As a GLB.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if json.get("buffers").is_none() {
            json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        }
        let mut text = serde_json::to_vec(&json).unwrap();
        text.resize(text.len().next_multiple_of(4), b' ');
        let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
        let total = 12 + 8 + text.len() + 8 + self.bytes.len();
        let parts: [&[u8]; 9] = [
            b"glTF",
            &word(2),
            &word(total),
            &word(text.len()),
            b"JSON",
            &text,
            &word(self.bytes.len()),
            b"BIN\0",
            &self.bytes,
        ];
        parts.concat()
    }

    /// The scene with its notices, or the faults as text.
    pub fn read(&self) -> Result<(Scene, Vec<Diagnostic>), String> {
        read_bytes(&self.glb())
    }

    /// The scene of a sound fixture.
    pub fn scene(&self) -> Scene {
        self.read().unwrap().0
    }

    /// The scene with what is made up for it, and the notices.
    pub fn completed(&self) -> (Scene, Vec<Diagnostic>) {
        let mut faults = vec![];
        let besides = Besides { description: None, additions: Some(&Additions::default()) };
        let scene = read(self.glb().into(), "test.glb", "test", Some(Path::new("")), besides, &mut vec![], &mut faults);
        (scene.unwrap_or_else(|| panic!("{}", render(&faults))), faults)
    }

    /// The scene with a scene RON, or the faults as text.
    pub fn described(&self, ron: &str) -> Result<Scene, String> {
        let mut faults = vec![];
        let description = description::parse(&Source::new("test.ron", ron), &mut faults);
        let besides = Besides { description: Some(&description), additions: None };
        let scene = read(self.glb().into(), "test.glb", "test", Some(Path::new("")), besides, &mut vec![], &mut faults);
        scene.ok_or_else(|| render(&faults))
    }

    /// The faults of a bad fixture, as text.
    pub fn faults(&self) -> String {
        match self.read() {
            Ok(_) => panic!("no fault was found"),
            Err(text) => text,
        }
    }
}

/// The scene with its notices, or the faults as text.
pub(super) fn read_bytes(bytes: &[u8]) -> Result<(Scene, Vec<Diagnostic>), String> {
    let mut faults = vec![];
    let besides = Besides { description: None, additions: None };
    match read(bytes.into(), "test.glb", "test", Some(Path::new("")), besides, &mut vec![], &mut faults) {
        Some(scene) => Ok((scene, faults)),
        None => Err(render(&faults)),
    }
}
