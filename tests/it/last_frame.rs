//! What shaders know of the last frame, of time and of the pointer.

use crate::{device, support};
use glam::{Vec2, Vec3};
use lightgraph::diag::{Checked, Source};
use lightgraph::gpu::Gpu;
use lightgraph::graph;
use lightgraph::scene;
use lightgraph::session::{Pointer, Project, Session, Settings};
use lightgraph::shader::Library;
use std::path::Path;
use std::sync::Arc;

const GRAPH: &str = r#"Graph(
    resources: {"now": Buffer(stride: 16, count: 4), "places": Buffer(stride: 16, count: 2)},
    passes: [
        Compute(name: "tell", shader: "tell.wgsl", over: (1, 1, 1)),
        Compute(name: "place", shader: "place.wgsl", over: (1, 1, 1)),
    ],
    outputs: {"now": "now", "places": "places"},
)"#;

const TELL: &str = "struct Values {
    camera_position: vec3f, camera_previous_position: vec3f, camera_near: f32, camera_far: f32, time: f32, delta_time: f32,
    jitter: vec2f, pointer: vec2f, buttons: u32, camera_view_projection: mat4x4f, camera_previous_view_projection: mat4x4f,
}
var<uniform> values: Values;
var<storage, read_write> now: array<vec4f>;
@compute @workgroup_size(1) fn tell() {
    let same = all(values.camera_view_projection[3] == values.camera_previous_view_projection[3]);
    now[0] = vec4f(values.camera_position, f32(same));
    now[1] = vec4f(values.camera_previous_position, values.delta_time);
    now[2] = vec4f(values.jitter, values.pointer);
    now[3] = vec4f(values.camera_near, values.camera_far, values.time, f32(values.buttons));
}";

const PLACE: &str = "struct Node { previous_transform: mat4x4f, transform: mat4x4f }
var<storage, read> nodes: array<Node>;
var<storage, read_write> places: array<vec4f>;
@compute @workgroup_size(1) fn place() {
    places[0] = nodes[0].transform[3];
    places[1] = nodes[0].previous_transform[3];
}";

fn session(gpu: &Gpu) -> Session {
    let source = Source::new("last.ron", GRAPH);
    let read = |_: &Path| -> Checked<Arc<Source>> { Ok(source.clone()) };
    let graph = graph::load(Path::new("last.ron"), &read).unwrap_or_else(|f| panic!("{f}"));
    let texts = [("tell.wgsl", TELL), ("place.wgsl", PLACE)];
    let files = texts.map(|(path, text)| (path.to_string(), Source::new(path, text))).into_iter().collect();
    let project = Project { graph, texts: Library { files, ..Library::default() } };
    let scene = scene::load(&support::repository("scenes/cornell_point.gltf")).unwrap_or_else(|f| panic!("{f}")).scene;
    let settings = Settings { size: [16, 12], skip: true, verify: true, ..Settings::default() };
    Session::new(gpu, &project, scene, settings).unwrap_or_else(|f| panic!("{f}"))
}

/// The rows of an output after a frame.
fn rows(gpu: &Gpu, s: &Session, output: &str) -> Vec<[f32; 4]> {
    let words = s.words(gpu, output).unwrap_or_else(|f| panic!("{f}"));
    words.as_chunks().0.iter().map(|row: &[u32; 4]| row.map(f32::from_bits)).collect()
}

#[test]
fn the_last_frame_is_one_frame_behind() {
    let gpu = device::gpu();
    let mut s = session(&gpu);
    let mut frame = |index: u32, time: f32, by: Vec3| {
        (s.shift.cameras, s.shift.nodes) = (by, vec![(0, by)]);
        s.pointer = Pointer { at: Vec2::new(index as f32, 2.0), buttons: 5 };
        s.frame(&gpu, index, time).unwrap_or_else(|f| panic!("{f}"));
        (rows(&gpu, &s, "now"), rows(&gpu, &s, "places"))
    };
    let (now, places) = frame(0, 1.0, Vec3::ZERO);
    let [x, y, z, same] = now[0];
    assert_eq!((now[1], same), ([x, y, z, 0.0], 1.0), "the first frame stands for the one before it");
    assert_eq!(places[0], places[1]);
    assert_eq!(now[2], [0.0, 1.0 / 3.0 - 0.5, 0.0, 2.0]);
    assert!(now[3][0] > 0.0 && now[3][1] > now[3][0], "near and far: {:?}", now[3]);
    assert_eq!(now[3][2..], [1.0, 5.0]);

    let (now, places) = frame(1, 1.25, Vec3::X * 0.5);
    assert_eq!(now[0][0], x + 0.5);
    assert_eq!((now[1], now[0][3]), ([x, y, z, 0.25], 0.0));
    assert_eq!(places[0][0], places[1][0] + 0.5);
    assert_eq!(now[2][2], 1.0);

    let (now, places) = frame(2, 1.25, Vec3::X * 0.5);
    assert_eq!((now[1], now[0][3]), ([x + 0.5, y, z, 0.0], 1.0), "what stands still is where it was");
    assert_eq!(places[0], places[1]);
}
