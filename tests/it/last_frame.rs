//! What shaders know of the last frame, of time and of the pointer.

use crate::{device, support};
use glam::{Vec2, Vec3};
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph;
use lightgraph::internals::session::Pointer;
use lightgraph::internals::shader::Library;
use lightgraph::{Checked, Gpu, Project, Scene, Session, Settings};
use std::path::Path;
use std::sync::Arc;

const GRAPH: &str = r#"Graph(
    resources: {"now": Buffer(stride: 16, count: 5), "places": Buffer(stride: 16, count: 2)},
    passes: [
        Compute(name: "tell", shader: "tell.wgsl", over: (1, 1, 1)),
        Compute(name: "place", shader: "place.wgsl", over: (1, 1, 1)),
    ],
    outputs: {"now": "now", "places": "places"},
)"#;

const TELL: &str = "struct Values {
    camera_position: vec3f, camera_previous_position: vec3f, camera_near: f32, camera_far: f32, time: f32, delta_time: f32,
    jitter: vec2f, pointer: vec2f, buttons: u32, first_frame: u32, camera_view_projection: mat4x4f, camera_previous_view_projection: mat4x4f,
}
var<uniform> values: Values;
var<storage, read_write> now: array<vec4f>;
@compute @workgroup_size(1) fn tell() {
    let same = all(values.camera_view_projection[3] == values.camera_previous_view_projection[3]);
    now[0] = vec4f(values.camera_position, f32(same));
    now[1] = vec4f(values.camera_previous_position, values.delta_time);
    now[2] = vec4f(values.jitter, values.pointer);
    now[3] = vec4f(values.camera_near, values.camera_far, values.time, f32(values.buttons));
    now[4] = vec4f(f32(values.first_frame));
}";

const PLACE: &str = "struct Node { previous_transform: mat4x4f, transform: mat4x4f }
var<storage, read> nodes: array<Node>;
var<storage, read_write> places: array<vec4f>;
@compute @workgroup_size(1) fn place() {
    places[0] = nodes[0].transform[3];
    places[1] = nodes[0].previous_transform[3];
}";

/// What a graph holds of the frames since its history began.
const COUNTS: &str = r#"Graph(
    resources: {"count": Texture(format: R32Float, size: "screen", members: 2, history: true)},
    passes: [
        For(name: "i", count: 2, passes: [
            Screen(name: "count_on", shader: "count.wgsl", bind: {"before": "count[i]", "after": "count[1 - i]"}),
        ]),
    ],
    outputs: {"count": "count[0]"},
)"#;

const COUNT: &str = "var before: texture_2d<f32>;
struct Values { first_frame: u32, i: u32 }
var<uniform> values: Values;
struct Out { @location(0) after: f32 }
@fragment fn count(@builtin(position) at: vec4f) -> Out {
    let seed = select(0.0, 100.0, values.first_frame != 0u && values.i == 0u);
    return Out(textureLoad(before, vec2u(at.xy), 0).r + seed + 1.0);
}";

/// As [`COUNTS`], begun by a pass of its own; `later` is 1 in all frames but the first.
const BEGUN: &str = r#"Graph(
    resources: {
        "count": Texture(format: R32Float, size: "screen", members: 2, history: true),
        "later": Texture(format: R32Float, size: "screen", history: true),
    },
    passes: [
        Clear(name: "begin", when: "first_frame && screen.x > 0", target: "count[0]", value: 100),
        For(name: "i", count: 2, passes: [
            Screen(name: "add", shader: "add.wgsl", bind: {"before": "count[i]", "after": "count[1 - i]"}),
        ]),
        Clear(name: "go_on", when: "!first_frame", target: "later", value: 1),
    ],
    outputs: {"count": "count[0]", "later": "later"},
)"#;

const ADD: &str = "var before: texture_2d<f32>;
struct Out { @location(0) after: f32 }
@fragment fn add(@builtin(position) at: vec4f) -> Out {
    return Out(textureLoad(before, vec2u(at.xy), 0).r + 1.0);
}";

fn session(gpu: &Gpu) -> Session {
    after(gpu, GRAPH, [16, 12], None)
}

/// A session of one of the graphs, in the place of another.
fn after(gpu: &Gpu, graph: &str, size: [u32; 2], previous: Option<&Session>) -> Session {
    let source = Source::new("last.ron", graph);
    let read = |_: &Path| -> Checked<Arc<Source>> { Ok(source.clone()) };
    let graph = graph::load(Path::new("last.ron"), &read).unwrap_or_else(|f| panic!("{f}"));
    let texts = [("tell.wgsl", TELL), ("place.wgsl", PLACE), ("count.wgsl", COUNT), ("add.wgsl", ADD)];
    let files = texts.map(|(path, text)| (path.to_string(), Source::new(path, text))).into_iter().collect();
    let project = Project { graph, texts: Library { files, ..Library::default() } };
    let scene = Scene::load(&support::repository("scenes/cornell_point.gltf")).unwrap_or_else(|f| panic!("{f}")).scene;
    let settings = Settings { size, skip: true, verify: true, ..Settings::default() };
    Session::after(gpu, &project, scene, settings, previous).unwrap_or_else(|f| panic!("{f}"))
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
    assert_eq!(now[4][0], 1.0, "the first frame says so");

    let (now, places) = frame(1, 1.25, Vec3::X * 0.5);
    assert_eq!(now[0][0], x + 0.5);
    assert_eq!((now[1], now[0][3]), ([x, y, z, 0.25], 0.0));
    assert_eq!(places[0][0], places[1][0] + 0.5);
    assert_eq!(now[2][2], 1.0);
    assert_eq!(now[4][0], 0.0);

    let (now, places) = frame(2, 1.25, Vec3::X * 0.5);
    assert_eq!((now[1], now[0][3]), ([x + 0.5, y, z, 0.0], 1.0), "what stands still is where it was");
    assert_eq!(places[0], places[1]);
}

#[test]
fn the_first_frame_is_where_history_begins() {
    let gpu = device::gpu();
    let count = |s: &mut Session, index: u32| {
        s.frame(&gpu, index, 0.0).unwrap_or_else(|f| panic!("{f}"));
        s.image(&gpu, "count").unwrap_or_else(|f| panic!("{f}")).data[0]
    };
    let mut first = after(&gpu, COUNTS, [16, 12], None);
    assert_eq!([count(&mut first, 0), count(&mut first, 1)], [102.0, 104.0]);
    let mut same = after(&gpu, COUNTS, [16, 12], Some(&first));
    assert_eq!(count(&mut same, 2), 106.0, "history comes over");
    let mut larger = after(&gpu, COUNTS, [20, 12], Some(&same));
    assert_eq!([count(&mut larger, 3), count(&mut larger, 4)], [102.0, 104.0], "another size begins anew");
}

#[test]
fn passes_of_first_frames_begin_history() {
    let gpu = device::gpu();
    let frame = |s: &mut Session, index: u32| {
        s.frame(&gpu, index, 0.0).unwrap_or_else(|f| panic!("{f}"));
        ["count", "later"].map(|output| s.image(&gpu, output).unwrap_or_else(|f| panic!("{f}")).data[0])
    };
    let mut first = after(&gpu, BEGUN, [16, 12], None);
    let frames = [0, 1, 2].map(|index| frame(&mut first, index));
    assert_eq!(frames, [[102.0, 0.0], [104.0, 1.0], [106.0, 1.0]]);
    let mut larger = after(&gpu, BEGUN, [20, 12], Some(&first));
    assert_eq!([3, 4].map(|index| frame(&mut larger, index)), [[102.0, 0.0], [104.0, 1.0]]);
}
