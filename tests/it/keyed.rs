//! Keyframes of parameters in the scene file.

use crate::{device, support};
use lightgraph::internals::diag::{Source, render};
use lightgraph::internals::graph;
use lightgraph::internals::shader::Library;
use lightgraph::internals::value::Value;
use lightgraph::{Checked, Gpu, Project, Scene, Session, Settings};
use std::path::Path;
use std::sync::Arc;

/// `count` is the last frame's plus one, so that lost history shows.
const GRAPH: &str = r#"Graph(
    params: {
        "level": Float(default: 0.25, min: 0.0, max: 1.0, about: "red"),
        "width": Uint(default: 4, min: 1, max: 64, about: "columns"),
    },
    resources: {
        "color": Texture(format: Rgba32Float, size: ("width", 2)),
        "count": Texture(format: R32Float, size: (1, 1), history: true),
        "counted": Texture(format: R32Float, size: (1, 1), history: true),
    },
    passes: [
        Screen(name: "paint", shader: "paint.wgsl", color: "color"),
        Screen(name: "count_on", shader: "count.wgsl", bind: {"before": "count", "after": "counted"}),
        Copy(name: "keep", from: "counted", to: "count"),
    ],
    outputs: {"color": "color", "count": "count"},
)"#;

const PAINT: &str = "var<uniform> level: f32;
@fragment fn paint() -> @location(0) vec4f { return vec4f(level, 0.0, 0.0, 1.0); }";

const COUNT: &str = "var before: texture_2d<f32>;
var<uniform> time: f32;
struct Out { @location(0) after: f32 }
@fragment fn count() -> Out { return Out(textureLoad(before, vec2u(0), 0).r + select(1.0, 0.0, time < 0.0)); }";

fn project() -> Project {
    let source = Source::new("keyed.ron", GRAPH);
    let read = |_: &Path| -> Checked<Arc<Source>> { Ok(source.clone()) };
    let graph = graph::load(Path::new("keyed.ron"), &read).unwrap_or_else(|f| panic!("{f}"));
    let texts = [("paint.wgsl", PAINT), ("count.wgsl", COUNT)];
    let files = texts.map(|(path, text)| (path.to_string(), Source::new(path, text))).into_iter().collect();
    Project { graph, texts: Library { files, ..Library::default() } }
}

fn scene(params: &str) -> Scene {
    let glb = std::fs::read(support::repository("scenes/cornell.glb")).unwrap();
    let text = format!("Scene(params: {params})");
    Scene::from_bytes(&glb, "cornell", Some(&text)).unwrap_or_else(|f| panic!("{f}")).scene
}

fn session(gpu: &Gpu, params: &str, settings: Settings) -> Checked<Session> {
    Session::new(gpu, &project(), scene(params), Settings { size: [16, 12], skip: true, verify: true, ..settings })
}

/// Red, and the columns, after a frame at a time.
fn shown(gpu: &Gpu, session: &mut Session, (frame, time): (u32, f32)) -> (f32, u32) {
    session.retime(gpu, &project(), time).unwrap_or_else(|f| panic!("{f}"));
    session.frame(gpu, frame, time).unwrap_or_else(|f| panic!("{f}"));
    let image = session.image(gpu, "color").unwrap_or_else(|f| panic!("{f}"));
    (image.data[0], image.width)
}

const KEYS: &str = r#"{
    "level": [(time: 0, value: "0.5"), (time: 2, value: "1.0")],
    "width": [(time: 0, value: "4"), (time: 1, value: "8"), (time: 2, value: "6")],
}"#;

#[test]
fn parameters_go_from_keyframe_to_keyframe_and_history_goes_on() {
    let gpu = device::gpu();
    let mut session = session(&gpu, KEYS, Settings::default()).unwrap_or_else(|f| panic!("{f}"));
    let times = [0.0, 0.5, 1.0, 1.5, 2.0, 0.5];
    let found: Vec<_> = (0..).zip(times).map(|frame| shown(&gpu, &mut session, frame)).collect();
    assert_eq!(found, [(0.5, 4), (0.625, 4), (0.75, 8), (0.875, 8), (0.5, 4), (0.625, 4)]);
    let count = session.image(&gpu, "count").unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(count.data[0], 6.0);
    // Nothing changed: nothing runs that need not.
    assert!(!session.retime(&gpu, &project(), 0.5).unwrap());
}

#[test]
fn what_is_given_goes_before_keyframes_and_faults_have_their_place() {
    let gpu = device::gpu();
    let given = Settings { params: [("level".to_string(), Value::Float(0.125))].into(), ..Settings::default() };
    let mut with = session(&gpu, KEYS, given).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(shown(&gpu, &mut with, (0, 1.0)), (0.125, 8));

    let other = session(&gpu, r#"{"levle": [(time: 0, value: "1")]}"#, Settings::default());
    let notices = other.unwrap_or_else(|f| panic!("{f}")).notices;
    let note = notices.iter().find(|n| n.message.contains("`levle`")).map(|n| render(std::slice::from_ref(n))).unwrap();
    assert!(note.contains("did you mean `level`?") && note.contains("cornell.ron:1"), "{note}");

    for (keys, message) in [
        (r#"{"level": [(time: 0, value: "red")]}"#, "`level`: `red` is not a f32"),
        (r#"{"level": [(time: 0, value: "0.5"), (time: 1, value: "2")]}"#, "above the maximum 1"),
        (r#"{"width": [(time: 0, value: "1.5")]}"#, "`width`: `1.5` is not a u32"),
    ] {
        let faults = session(&gpu, keys, Settings::default()).err().map(|f| f.to_string()).unwrap_or_default();
        assert!(faults.contains(message) && faults.contains("cornell.ron:1"), "{faults}");
    }
}
