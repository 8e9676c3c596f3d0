//! Checks in shaders: `render`, `watch` and `test` show the line that does not hold and the invocation that says so.

use crate::command::lightgraph;
use crate::device;
use crate::support::{Scratch, repository};
use lightgraph::{Gpu, Project, Scene, Session, Settings};
use std::fs;

/// A compute pass fills, a screen pass shows; both check.
const GRAPH: &str = r#"Graph(
    about: "Numbers that are checked.",
    params: {"most": Float(default: 5.0, about: "the largest number allowed")},
    resources: {
        "numbers": Texture(format: R32Float, size: (8, 4)),
        "color": Texture(format: Rgba32Float, size: "screen"),
    },
    passes: [
        Compute(name: "count", shader: "count.wgsl", over: "numbers"),
        Screen(name: "show", shader: "show.wgsl", color: "color"),
    ],
    outputs: {"color": "color"},
)"#;

const COUNT: &str = r#"#import lightgraph::report::{check}
#import limits::{within}

var numbers: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 4) fn count(@builtin(global_invocation_id) id: vec3u) {
    let number = f32(id.x);
    within(number, id);
    check(number >= 0.0, id, #{HERE});
    textureStore(numbers, id.xy, vec4f(number));
}
"#;

const LIMITS: &str = r#"#define_import_path limits
#import lightgraph::report::{check}

var<uniform> most: f32;

fn within(number: f32, id: vec3u) {
    check(number <= most, id, #{HERE}); // the place that is shown
}
"#;

const SHOW: &str = r#"#import lightgraph::report as report

var numbers: texture_2d<f32>;
var<uniform> frame: u32;

@fragment fn show(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    report::check(frame != 1u || any(pixel != vec2u(3u, 2u)), vec3u(pixel, 0u), #{HERE});
    return textureLoad(numbers, pixel, 0);
}
"#;

fn project(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    let at = |file: &str| scratch.path().join(file);
    fs::create_dir_all(at("shaders")).unwrap();
    fs::write(at("graph.ron"), GRAPH).unwrap();
    for (file, text) in [("count", COUNT), ("limits", LIMITS), ("show", SHOW)] {
        fs::write(at(&format!("shaders/{file}.wgsl")), text).unwrap();
    }
    scratch
}

fn session(gpu: &Gpu, scratch: &Scratch, set: &[&str]) -> Session {
    let project = Project::open(&scratch.path().join("graph.ron"), &[]).unwrap_or_else(|f| panic!("{f}"));
    let params = project.params(&set.iter().map(ToString::to_string).collect::<Vec<_>>()).unwrap();
    let scene = Scene::load(&repository("scenes/lambert_plane.glb")).unwrap_or_else(|f| panic!("{f}")).scene;
    let settings = Settings { params, size: [8, 4], skip: true, ..Settings::default() };
    Session::new(gpu, &project, scene, settings).unwrap_or_else(|f| panic!("{f}"))
}

/// What the checks of a frame say, shown.
fn frame(gpu: &Gpu, session: &mut Session, index: u32) -> Vec<String> {
    let report = session.frame(gpu, index, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let failed = session.failed_checks(&report);
    failed.into_iter().map(|d| lightgraph::internals::diag::render(&[d])).collect()
}

#[test]
fn what_does_not_hold_is_shown_until_its_step_runs_again() {
    let gpu = &device::gpu();
    let scratch = project("checks-frames");
    let mut s = session(gpu, &scratch, &["most=7"]);
    assert_eq!(frame(gpu, &mut s, 0), Vec::<String>::new());
    let said = frame(gpu, &mut s, 1);
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("the shader of `show` does not hold: invocation (3, 2, 0)\n"), "{}", said[0]);
    assert!(said[0].contains("show.wgsl:8:5"), "{}", said[0]);
    assert_eq!(frame(gpu, &mut s, 2), Vec::<String>::new());

    // The same frame again: nothing runs, and what is shown stays wrong.
    let mut s = session(gpu, &scratch, &["most=7"]);
    frame(gpu, &mut s, 1);
    let report = s.frame(gpu, 1, 0.0).unwrap_or_else(|f| panic!("{f}"));
    assert!(report.steps.is_empty(), "{:?}", report.steps);
    assert_eq!(s.failed_checks(&report).len(), 1);

    // Columns 6 and 7 of four rows; the step is left out of the second frame, and what it made stays wrong.
    let mut s = session(gpu, &scratch, &["most=5"]);
    for index in [0, 2] {
        let said = frame(gpu, &mut s, index);
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].contains("the shader of `count` does not hold: invocation ("), "{}", said[0]);
        assert!(said[0].contains("the first of 8 to say so"), "{}", said[0]);
        assert!(said[0].contains("limits.wgsl:7:5") && said[0].contains("^^^^^"), "{}", said[0]);
    }
}

#[test]
fn commands_show_what_does_not_hold() {
    let _alone = device::gpu();
    let scratch = project("checks-commands");
    let at = |file: &str| scratch.path().join(file).display().to_string();
    let scene = repository("scenes/lambert_plane.glb").display().to_string();
    let (graph, out) = (at("graph.ron"), at("out.exr"));
    let render = ["render", &graph, "--scene", &scene, "--size", "8x4", "--out", &out, "--set"];
    let good = lightgraph(&[&render[..], &["most=7"]].concat(), true);
    assert_eq!(good.status.code(), Some(0), "{}", String::from_utf8_lossy(&good.stderr));
    let bad = lightgraph(&[&render[..], &["most=5"]].concat(), true);
    let said = String::from_utf8_lossy(&bad.stderr).into_owned();
    assert_eq!(bad.status.code(), Some(1), "{said}");
    assert!(said.contains("limits.wgsl:7:5"), "{said}");
    assert!(fs::metadata(&out).is_ok(), "the image is there to be looked at");

    let test = |most: &str| {
        let text = format!(
            "Test(about: \"Checked.\", graph: \"graph.ron\", scene: \"{scene}\", size: (8, 4), params: {{\"most\": {most}}}, \
             checks: [Incremental()])"
        );
        fs::write(at("test.ron"), text).unwrap();
        let output = lightgraph(&["test", &at("test.ron"), "--failures", &at("failures")], true);
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    assert_eq!(test("7").0, Some(0));
    let (code, said) = test("5");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("limits.wgsl:7:5"), "{said}");
}

#[test]
fn shaders_that_check_nothing_pay_nothing() {
    let scratch = project("checks-unused");
    let file = scratch.path().join("shaders/show.wgsl");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(
        &file,
        text.lines()
            .filter(|l| !l.contains("report"))
            .collect::<Vec<_>>()
            .join("\n")
            .replace("var<uniform> frame: u32;", ""),
    )
    .unwrap();
    let gpu = &device::gpu();
    let s = session(gpu, &scratch, &[]);
    let bound = |path: &str| {
        let shader = s.plan.shaders.iter().find(|s| s.path == path).unwrap();
        shader.interface.variables.iter().map(|v| v.name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(bound("show.wgsl"), ["numbers"]);
    assert_eq!(bound("count.wgsl"), ["most", "numbers", "shader_report"]);
}

/// A grid of which no probe sees a large part of the image would leave that part black without a word.
#[test]
fn probes_that_see_too_little_are_told() {
    let _alone = device::gpu();
    let scratch = Scratch::new("checks-blind");
    let out = scratch.path().join("out.exr").display().to_string();
    let told = |graph: &str, grid: &str| {
        let graph = repository(&format!("graphs/gi/{graph}.ron")).display().to_string();
        let scene = repository("scenes/street").display().to_string();
        let render = ["render", &graph, "--scene", &scene, "--size", "64x64", "--out", &out];
        let output = lightgraph(&[&render[..], &["--set", grid]].concat(), true);
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for graph in ["fast_grid_visible", "indirect_shadow"] {
        let (code, said) = told(graph, "grid=2,2,2");
        assert_eq!(code, Some(1), "{graph}: {said}");
        assert!(said.contains("no probe sees a tenth of the image"), "{graph}: {said}");
        let (code, said) = told(graph, "grid=4,4,4");
        assert_eq!(code, Some(0), "{graph}: {said}");
    }
}
