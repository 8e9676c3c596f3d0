//! Numerical stability: the cases that matter most, and what the checks say of a graph that is wrong.

use crate::command::lightgraph;
use crate::device::gpu;
use crate::support::{Scratch, files, repository};
use lightgraph_cli::stress::{Cases, RowState, StressGraph, StressOptions, StressReport, run};
use std::fs;
use std::path::Path;

/// Divides by zero where `steps` exceeds 20.
const SHADER: &str = "
struct Params { steps: u32, weight: f32, other: u32 }
var<uniform> params: Params;
var color: texture_storage_2d<rgba32float, write>;
@compute @workgroup_size(8, 8)
fn fill(@builtin(global_invocation_id) id: vec3u) {
    let below = f32(max(20u, params.steps) - params.steps);
    let one = select(1.0, below, params.steps > 20u && id.x == 3u);
    textureStore(color, id.xy, vec4f(params.weight + f32(params.other)) / one);
}
";

const GRAPH: &str = r#"Graph(
    about: "Wrong beyond 20 steps.",
    params: {
        "steps": Uint(default: 4, min: 1, max: 64, about: "steps"),
        "weight": Float(default: 0.5, min: 0.25, max: 1, about: "weight"),
        "other": Uint(default: 2, min: 0, max: 9, about: "another"),
    },
    resources: {"color": Texture(format: Rgba32Float, size: "screen", min: 0)},
    passes: [Compute(name: "fill", shader: "fill.wgsl", over: "color")],
    outputs: {"color": "color"},
)"#;

/// A folder with that graph.
fn project(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    fs::create_dir_all(scratch.path().join("shaders")).unwrap();
    fs::write(scratch.path().join("wrong.ron"), GRAPH).unwrap();
    fs::write(scratch.path().join("shaders/fill.wgsl"), SHADER).unwrap();
    scratch
}

fn options(folder: &Path, filter: Option<&str>, seed: u64) -> StressOptions {
    StressOptions {
        seconds: None,
        seed,
        quick: true,
        filter: filter.map(String::from),
        cases: repository("tests/stress/cases.ron"),
        folder: folder.into(),
        program: env!("CARGO_BIN_EXE_lightgraph").into(),
        shaders: vec![],
    }
}

fn cases() -> Cases {
    Cases::read(&repository("tests/stress/cases.ron")).unwrap_or_else(|f| panic!("{f}"))
}

/// Of four graphs. Longer than other tests, a minute: it stands for a run of a quarter of an hour.
#[test]
fn no_case_fails() {
    let gpu = gpu();
    let scratch = Scratch::new("stress-four");
    let paths = ["uniform_grid", "direct", "indirect_shadow", "pathtrace"];
    let paths = paths.map(|name| repository(&format!("graphs/gi/{name}.ron")));
    let graphs = paths.map(|p| StressGraph::open(&p, &[]).unwrap_or_else(|f| panic!("{f}")));
    let options = options(scratch.path(), None, 1);
    let report = run(&gpu, &cases(), &graphs, &options, &mut |_| ()).unwrap_or_else(|f| panic!("{f}"));
    assert!(report.count(RowState::Passed) >= 60, "{}", report.table());
    assert_eq!(report.count(RowState::Failed), 0, "{}", report.table());
}

/// Of every graph that ships.
#[test]
#[ignore = "some minutes: random parameters of every graph; cargo test stress -- --ignored"]
fn the_cases_that_matter_most_hold() {
    let gpu = gpu();
    let scratch = Scratch::new("stress-quick");
    let open = |p: &std::path::PathBuf| StressGraph::open(p, &[]).unwrap_or_else(|f| panic!("{f}"));
    let graphs: Vec<StressGraph> = files("graphs/gi", &["ron"]).iter().map(open).collect();
    let options = options(scratch.path(), None, 1);
    let report = run(&gpu, &cases(), &graphs, &options, &mut |_| ()).unwrap_or_else(|f| panic!("{f}"));
    assert!(report.rows.len() > 60, "{} rows", report.rows.len());
    assert!(report.count(RowState::Failed) == 0, "{}", report.table());
    // What is not on this machine is said, here and in the report.
    for row in report.rows.iter().filter(|r| r.state == RowState::Absent) {
        println!("{}: absent: {}", row.case, row.notice);
    }
}

/// Random draws of the wrong graph, until one fails.
fn failing() -> (StressReport, Scratch) {
    let gpu = gpu();
    let scratch = project("stress-shrinks");
    let graphs = [StressGraph::open(&scratch.path().join("wrong.ron"), &[]).unwrap_or_else(|f| panic!("{f}"))];
    for seed in 1..40 {
        let options = options(scratch.path(), Some("random"), seed);
        let report = run(&gpu, &cases(), &graphs, &options, &mut |_| ()).unwrap_or_else(|f| panic!("{f}"));
        if report.count(RowState::Failed) > 0 {
            return (report, scratch);
        }
    }
    panic!("no draw of 39 exceeded 20 steps");
}

#[test]
fn a_failure_shrinks_to_what_causes_it_and_says_how_to_run_it_again() {
    let (report, scratch) = failing();
    let row = report.rows.iter().find(|r| r.state == RowState::Failed).unwrap();
    let steps: u32 =
        row.setting.strip_prefix("steps=").and_then(|s| s.parse().ok()).unwrap_or_else(|| panic!("{row:?}"));
    assert_eq!(steps, 21, "{}", row.setting);
    assert!(row.notice.contains("`fill` leaves numbers in `color`"), "{}", row.notice);
    assert!(row.notice.contains("texel (3, 0), layer 0"), "{}", row.notice);
    let command = row.notice.split("again with: lightgraph ").nth(1).unwrap();
    let args: Vec<&str> = command.split_whitespace().filter(|a| *a != "--out" && *a != "random.exr").collect();
    let out = scratch.path().join("again.exr").display().to_string();
    let output = lightgraph(&[args.as_slice(), &["--out", &out]].concat(), true);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("`fill` leaves numbers in `color`"), "{text}");
}

#[test]
fn the_command_writes_a_table_a_report_and_numbers() {
    let scratch = Scratch::new("stress-command");
    let out = scratch.path().display().to_string();
    let args = ["stress", "--graphs", "graphs/gi/direct.ron", "--quick", "--filter", "solid angles", "--out", &out];
    let output = lightgraph(&args, true);
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{text}");
    for word in ["case", "worst setting", "solid angles", "pass", "0 failed"] {
        assert!(text.contains(word), "`{word}` is missing in:\n{text}");
    }
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(scratch.path().join("results.json")).unwrap()).unwrap();
    let rows = json["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 1);
    assert!(rows.iter().all(|r| r["state"] == "passed" && r["error"].as_f64() <= Some(1e-6)), "{rows:?}");
    let page = fs::read_to_string(scratch.path().join("report.html")).unwrap();
    assert!(page.contains("solid angles") && !page.contains("http"), "the page needs other files");
}

#[test]
fn a_file_of_cases_with_a_slip_names_the_place() {
    let scratch = Scratch::new("stress-slip");
    let path = scratch.path().join("cases.ron");
    fs::write(&path, "(\n    cases: [\n        (nmae: \"a\"),\n    ],\n)").unwrap();
    let text = Cases::read(&path).err().map(|f| f.to_string()).unwrap_or_default();
    assert!(text.contains("cases.ron:3:") && text.contains("nmae"), "{text}");
}
