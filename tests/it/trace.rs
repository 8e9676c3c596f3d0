//! Traces of runs are what ui.perfetto.dev and chrome://tracing open; captures hold what a pass read and wrote.

use crate::device;
use crate::support::{Scratch, command};
use serde_json::Value;

fn number(event: &Value, key: &str) -> f64 {
    event[key].as_f64().unwrap_or_else(|| panic!("no `{key}` in {event}"))
}

#[test]
fn a_trace_holds_the_stages_of_the_host_and_the_steps_of_the_device() {
    let _alone = device::gpu();
    let scratch = Scratch::new("trace");
    let file = scratch.path().join("trace.json");
    let run = command()
        .args(["render", "graphs/gi/direct.ron", "--scene", "scenes/lambert_plane", "--size", "32x24"])
        .args(["--frames", "3", "--no-skip", "--out"])
        .arg(scratch.path().join("out.exr"))
        .arg("--trace")
        .arg(&file)
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let trace: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let events = trace["traceEvents"].as_array().unwrap();
    for event in events {
        // The trace-event format: a name, a phase, a process, and a track, by which viewers sort.
        assert!(event["name"].is_string() && event["pid"].is_number() && event["tid"].is_number(), "{event}");
        match event["ph"].as_str().unwrap() {
            "X" => assert!(number(event, "ts") >= 0.0 && number(event, "dur") >= 0.0, "{event}"),
            "b" | "e" => assert!(event["id"].is_string() && number(event, "ts") >= 0.0, "{event}"),
            "M" => assert!(event["args"]["name"].is_string(), "{event}"),
            other => panic!("phase `{other}`"),
        }
    }
    let spans = |track: u64| events.iter().filter(move |e| e["ph"] == "X" && e["tid"] == track).collect::<Vec<_>>();
    let named = |track: u64, name: &str| spans(track).iter().filter(|e| e["name"] == name).count();
    for (name, count) in [("graph", 1), ("scene", 1), ("plan", 1), ("compose", 1), ("frame 0", 1), ("frame 2", 1)] {
        assert_eq!(named(1, name), count, "{name}");
    }
    for name in ["record", "submit", "wait"] {
        assert_eq!(named(1, name), 3, "{name}");
    }
    for step in ["surface", "direct_light"] {
        assert_eq!(named(2, step), 3, "{step}");
    }
    let why = spans(2).iter().filter(|e| e["args"]["why"].is_string()).count();
    assert!(why > 0, "no step says why it ran");
    for track in [1, 2] {
        nested(&spans(track));
    }
}

/// Spans of one track lie in each other or apart, or viewers misread them.
fn nested(spans: &[&Value]) {
    let rounding = 0.01;
    let mut sorted: Vec<(f64, f64)> =
        spans.iter().map(|e| (number(e, "ts"), number(e, "ts") + number(e, "dur"))).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
    let mut open: Vec<(f64, f64)> = vec![];
    for span in sorted {
        while open.last().is_some_and(|o| o.1 <= span.0 + rounding) {
            open.pop();
        }
        if let Some(around) = open.last() {
            assert!(span.1 <= around.1 + rounding, "{span:?} begins in {around:?} and ends behind it");
        }
        open.push(span);
    }
}

#[test]
fn a_capture_holds_what_a_pass_found_and_what_it_left() {
    let _alone = device::gpu();
    let scratch = Scratch::new("capture");
    let out = scratch.path().join("out.exr");
    let run = |pass: &str, folder: &str| {
        let mut command = command();
        command.args(["render", "graphs/gi/direct.ron", "--scene", "scenes/lambert_plane", "--size", "32x24"]);
        command.args(["--frames", "2", "--out"]).arg(&out);
        command.arg("--capture").arg(format!("{pass}={}", scratch.path().join(folder).display())).output().unwrap()
    };
    let done = run("direct_light", "captured");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let folder = scratch.path().join("captured");
    let image = |file: &str| {
        let path = folder.join(file);
        lightgraph::internals::image::exr::read_exr(&path).unwrap_or_else(|f| panic!("{f}"))
    };
    let rendered = lightgraph::internals::image::exr::read_exr(&out).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(image("outputs/direct.exr").data, rendered.data, "the pass makes the image");
    let albedo = image("inputs/surface_albedo.exr");
    assert_eq!((albedo.width, albedo.height), (32, 24));
    assert!(albedo.data.iter().any(|x| *x > 0.0), "it is read after the pass that writes it");
    // What the pass has not written yet is what the frame before left, and stands among the outputs alone.
    assert!(!folder.join("inputs/direct.exr").exists());
    let uniforms = std::fs::read_to_string(folder.join("uniforms.txt")).unwrap();
    assert!(uniforms.contains("bias = 1.5"), "{uniforms}");
    let unknown = run("direct_lihgt", "none");
    let told = String::from_utf8_lossy(&unknown.stderr);
    assert!(unknown.status.code() == Some(1) && told.contains("did you mean `direct_light`?"), "{told}");
}
