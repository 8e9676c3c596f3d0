//! `lightgraph test` and `lightgraph new` as a user meets them.

use crate::command::lightgraph;
use crate::support::{Scratch, repository};
use std::fs;
use std::path::Path;

/// A graph without a scene's help: one constant colour, given by a parameter.
const GRAPH: &str = r#"Graph(
    about: "One colour.",
    params: {"red": Float(default: 0.5, about: "red")},
    resources: {"color": Texture(format: Rgba32Float, size: "screen")},
    passes: [Screen(name: "fill", shader: "fill.wgsl")],
    outputs: {"color": "color"},
)"#;

const SHADER: &str = "var<uniform> red: f32;
struct Image { @location(0) color: vec4f }
@fragment fn fragment() -> Image { return Image(vec4f(red, 0.25, 0.125, 1.0)); }
";

/// A project with one graph and one test of these checks.
fn project(name: &str, checks: &str) -> Scratch {
    let scratch = Scratch::new(name);
    let at = |file: &str| scratch.path().join(file);
    fs::create_dir_all(at("tests/graphs")).unwrap();
    fs::create_dir_all(at("shaders")).unwrap();
    fs::write(at("fill.ron"), GRAPH).unwrap();
    fs::write(at("shaders/fill.wgsl"), SHADER).unwrap();
    fs::copy(repository("scenes/lambert_plane.glb"), at("plane.glb")).unwrap();
    let test = format!(
        "Test(about: \"One colour.\", graph: \"../../fill.ron\", scene: \"../../plane.glb\", size: (8, 4), checks: [{checks}])"
    );
    fs::write(at("tests/graphs/fill.ron"), test).unwrap();
    scratch
}

/// Runs `lightgraph test` on a project's tests; exit code and both streams.
fn test(project: &Path, more: &[&str], adapter: bool) -> (i32, String) {
    let at = |file: &str| project.join(file).display().to_string();
    let (tests, failures) = (at("tests/graphs"), at("out"));
    let mut args = vec!["test", tests.as_str(), "--failures", failures.as_str()];
    args.extend(more);
    let output = lightgraph(&args, adapter);
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(!text.contains("panicked"), "{text}");
    (output.status.code().unwrap_or(-1), text)
}

fn says(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "`{word}` is missing in:\n{text}");
    }
}

#[test]
fn a_change_is_told_shown_and_blessed() {
    let scratch = project("snapshot-change", r#"Plan(), Image(output: "color", max: 0.01, reason: "exact")"#);
    let at = |file: &str| scratch.path().join(file);
    let (code, text) = test(scratch.path(), &[], true);
    assert_eq!(code, 1, "{text}");
    says(&text, &["there is no reference", "--bless", "0 passed, 1 failed"]);
    let (code, text) = test(scratch.path(), &["--bless"], true);
    assert_eq!(code, 0, "{text}");
    says(&text, &["fill.plan.txt: new", "fill.color.exr: new, 8 × 4", "1 passed, 0 failed"]);
    assert_eq!(test(scratch.path(), &[], true).0, 0);

    fs::write(at("fill.ron"), GRAPH.replace("0.5", "0.75")).unwrap();
    let (report, junit) = (at("report").display().to_string(), at("junit.xml").display().to_string());
    let (code, text) = test(scratch.path(), &["--report", &report, "--junit", &junit], true);
    assert_eq!(code, 1, "{text}");
    says(&text, &["0.75", "max 0.2500 (allowed 0.01)", "the limit's reason: exact", "difference.png"]);
    assert!(at("out/fill/color.difference.png").is_file());
    let page = fs::read_to_string(at("report/index.html")).unwrap();
    assert_eq!(page.matches("data:image/png;base64,").count(), 5);
    assert!(fs::read_to_string(at("junit.xml")).unwrap().contains("<failure"));

    // Only what failed is written: a plan that is equal keeps its file as it is.
    let stamp = |file: &str| fs::metadata(at(file)).unwrap().modified().unwrap();
    fs::write(at("fill.ron"), GRAPH).unwrap();
    fs::write(at("shaders/fill.wgsl"), SHADER.replace("0.125", "0.5")).unwrap();
    let before = stamp("tests/graphs/fill.plan.txt");
    let (code, text) = test(scratch.path(), &["--bless=fill"], true);
    assert_eq!(code, 0, "{text}");
    says(&text, &["fill.color.exr: max 0.3750"]);
    assert!(!text.contains("plan.txt"), "{text}");
    assert_eq!(before, stamp("tests/graphs/fill.plan.txt"));

    // References that can't be read are replaced where that is meant.
    fs::write(at("tests/graphs/fill.color.exr"), "no image").unwrap();
    fs::write(at("tests/graphs/fill.plan.txt"), [0xff]).unwrap();
    assert_eq!(test(scratch.path(), &[], true).0, 1);
    assert_eq!(test(scratch.path(), &["--bless"], true).0, 0);
    assert_eq!(test(scratch.path(), &[], true).0, 0);
}

#[test]
fn without_an_adapter_plans_are_checked_and_the_rest_is_not_passed() {
    let both = project("snapshot-no-adapter", r#"Bytes(at_most: 512, reason: "8 × 4 texels"), Incremental()"#);
    let (code, text) = test(both.path(), &[], false);
    assert_eq!(code, 3, "{text}");
    says(&text, &["not run  fill", "incremental equals full", "apt install", "0 passed, 0 failed, 1 not run in full"]);
    let plan = project("snapshot-plan-only", r#"Bytes(at_most: 512, reason: "8 × 4 texels")"#);
    assert_eq!(test(plan.path(), &[], false).0, 0);
    let small = project("snapshot-plan-bad", r#"Bytes(at_most: 511, reason: "too few"), Incremental()"#);
    let (code, text) = test(small.path(), &[], false);
    assert_eq!(code, 1, "{text}");
    says(&text, &["512 bytes (allowed 511)"]);
}

#[test]
fn nothing_to_run_is_a_fault() {
    let scratch = project("snapshot-empty", "Incremental()");
    for (more, word) in [
        (vec!["--filter", "fil_"], "no test's name holds `fil_`"),
        (vec!["--shard", "2/2"], "shard 2/2 is empty"),
        (vec!["--bless=fil"], "did you mean `fill`?"),
    ] {
        let (code, text) = test(scratch.path(), &more, false);
        assert_eq!(code, 1, "{text}");
        says(&text, &[word]);
    }
    fs::remove_file(scratch.path().join("tests/graphs/fill.ron")).unwrap();
    let (code, text) = test(scratch.path(), &[], false);
    assert_eq!(code, 1, "{text}");
    says(&text, &["holds no tests"]);
}

#[test]
fn a_bad_test_file_shows_every_fault_and_fails_alone() {
    let checks =
        r#"Image(output: "color", rmse: -1, reason: "x"), Mean(output: "color", value: 1, tolerance: 0.1), Imge()"#;
    let scratch = project("snapshot-bad", checks);
    let good = fs::read_to_string(scratch.path().join("tests/graphs/fill.ron")).unwrap().replace(checks, "Plan()");
    fs::write(scratch.path().join("tests/graphs/good.ron"), good).unwrap();
    let (code, text) = test(scratch.path(), &["--bless"], false);
    assert_eq!(code, 1, "{text}");
    says(
        &text,
        &["can't be negative", "needs a field `reason`", "did you mean `Image`?", "fill.ron:1:", "1 passed, 1 failed"],
    );
}

#[test]
fn names_that_graph_and_scene_do_not_have_are_shown_in_the_test() {
    for (checks, word) in [
        (r#"Mean(output: "colr", value: 1, tolerance: 1, reason: "x")"#, "did you mean `color`?"),
        (
            r#"Times(output: "color", factor: 1, of: Run(params: {"rde": 1}), rmse: 1, reason: "x")"#,
            "did you mean `red`?",
        ),
        (r#"Steps(ran: ["fil"])"#, "there is no pass `fil`"),
        (r#"Mean(output: "color", value: 0.5, tolerance: 0.1, reason: "x")"#, "0.2917, expected 0.5 ± 10 %"),
    ] {
        let scratch = project("snapshot-names", checks);
        let (code, text) = test(scratch.path(), &[], true);
        assert_eq!(code, 1, "{text}");
        says(&text, &[word]);
    }
}

#[test]
fn a_new_project_passes_its_tests() {
    let scratch = Scratch::new("new-project");
    let folder = scratch.path().join("mine");
    let output = lightgraph(&["new", &folder.display().to_string()], false);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (code, text) = test(&folder, &[], true);
    assert_eq!(code, 0, "{text}");
    let again = lightgraph(&["new", &folder.display().to_string()], false);
    assert_eq!(again.status.code(), Some(2));
}

#[test]
fn a_test_that_hangs_fails_by_its_limit_and_the_run_goes_on() {
    let constant = r#"Mean(output: "color", value: 0.2917, tolerance: 0.01, reason: "a third of the colours' sum")"#;
    let scratch = project("snapshot-hangs", constant);
    let at = |file: &str| scratch.path().join(file);
    // Four thousand million steps, each of which needs the one before. Mesa's software driver ends a loop after 65,535,
    // so that it takes many pixels to keep it busy.
    let slow = "var<uniform> red: f32;
struct Image { @location(0) color: vec4f }
@fragment fn fragment() -> Image {
    var x = red;
    for (var i = 0u; i < 4000000000u; i++) { x = fract(sin(x) * 43758.5 + f32(i)); }
    return Image(vec4f(x));
}
";
    fs::write(at("shaders/slow.wgsl"), slow).unwrap();
    fs::write(at("slow.ron"), GRAPH.replace("fill.wgsl", "slow.wgsl")).unwrap();
    let good = fs::read_to_string(at("tests/graphs/fill.ron")).unwrap();
    let hangs = good.replace("fill.ron", "slow.ron").replace("size: (8, 4)", "time_limit: 1, size: (512, 512)");
    fs::write(at("tests/graphs/a_slow.ron"), hangs).unwrap();
    let junit = at("junit.xml").display().to_string();
    let (code, text) = test(scratch.path(), &["--junit", &junit], true);
    assert_eq!(code, 1, "{text}");
    says(
        &text,
        &["FAILED   a_slow", "time limit: error: it is not over after 1 s", "ok       fill", "1 passed, 1 failed"],
    );
    let junit = fs::read_to_string(at("junit.xml")).unwrap();
    assert!(junit.contains("name=\"a_slow\"") && junit.contains("<failure message=\"time limit\">"), "{junit}");

    // By itself it is given up too, and the process ends although the device goes on.
    let (graph, out) = (at("slow.ron").display().to_string(), at("never.exr").display().to_string());
    let output = lightgraph(&["render", &graph, "--size", "512x512", "--timeout", "1", "--out", &out], true);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    says(&text, &["`fill`: the device does not answer within 1 s", "--timeout SECONDS"]);
    assert!(!at("never.exr").exists());
}

#[test]
fn a_project_can_name_what_the_binary_carries() {
    let scratch = Scratch::new("new-project-builtin");
    let folder = scratch.path().join("mine");
    let output = lightgraph(&["new", &folder.display().to_string()], false);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let graph = folder.join("graphs/my_graph.ron");
    let text = fs::read_to_string(&graph).unwrap();
    fs::remove_dir_all(folder.join("shaders")).unwrap();
    fs::remove_dir_all(folder.join("graphs")).unwrap();
    fs::create_dir(folder.join("graphs")).unwrap();
    fs::write(&graph, text.replace("base: \"", "base: \"lightgraph:graphs/")).unwrap();
    let (code, text) = test(&folder, &[], true);
    assert_eq!(code, 0, "{text}");
    let output = lightgraph(&["check", "lightgraph:graphs/gi/phong.ron"], false);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let output = lightgraph(&["check", "lightgraph:graphs/gi/fong.ron"], false);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    says(&text, &["lightgraph comes with no `graphs/gi/fong.ron`", "did you mean `graphs/gi/phong.ron`?"]);
}

#[test]
fn a_new_project_has_settings_for_an_editor() {
    let scratch = Scratch::new("new-project-editor");
    let folder = scratch.path().join("mine");
    let output = lightgraph(&["new", &folder.display().to_string()], false);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json = |name: &str| -> serde_json::Value {
        let text = fs::read_to_string(folder.join(".vscode").join(name)).unwrap();
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    assert_eq!(json("settings.json")["files.associations"]["*.wgsl"], "wgsl");
    assert!(json("extensions.json")["recommendations"].is_array());
    let editors = [
        (".helix/languages.toml", "[language-server.lightgraph]"),
        (".nvim.lua", "vim.lsp.enable"),
        (".zed/settings.json", "\"lightgraph\""),
    ];
    for (name, word) in editors {
        assert!(fs::read_to_string(folder.join(name)).unwrap().contains(word), "{name}");
    }
    let tasks = json("tasks.json");
    for task in tasks["tasks"].as_array().unwrap() {
        assert_eq!(task["command"], "lightgraph");
        let args: Vec<&str> = task["args"].as_array().unwrap().iter().map(|a| a.as_str().unwrap()).collect();
        // Paths are those of the project, and each command knows its arguments.
        for file in args.iter().filter(|a| a.ends_with(".ron") || a.ends_with(".glb")) {
            assert!(folder.join(file).is_file(), "{file}");
        }
        use clap::Parser;
        let parsed =
            lightgraph_cli::commands::Cli::try_parse_from(std::iter::once("lightgraph").chain(args.iter().copied()));
        assert!(parsed.is_ok(), "{args:?}: {parsed:?}");
    }
}
