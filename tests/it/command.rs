//! The `lightgraph` command as a user meets it: exit codes, messages, files.

use crate::support::{Scratch, repository};
use std::path::Path;
use std::process::Output;

/// Runs `lightgraph` in the repository. `adapter: false` hides every driver.
pub fn lightgraph(args: &[&str], adapter: bool) -> Output {
    let mut command = crate::support::command();
    command.args(args);
    if !adapter {
        // Both names of the loader's variable, the old and the new.
        let nowhere = repository("tests/no-such-driver.json");
        command.env("VK_ICD_FILENAMES", &nowhere).env("VK_DRIVER_FILES", &nowhere);
    }
    command.output().unwrap_or_else(|e| panic!("can't start lightgraph: {e}"))
}

/// As [`lightgraph`], with an adapter and variables of the environment.
pub fn lightgraph_with(args: &[&str], variables: &[(&str, &Path)]) -> Output {
    let mut command = crate::support::command();
    command.args(args).envs(variables.iter().copied());
    command.output().unwrap_or_else(|e| panic!("can't start lightgraph: {e}"))
}

/// Exit code, and both streams as one text.
fn run(args: &[&str], adapter: bool) -> (i32, String) {
    let output = lightgraph(args, adapter);
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let code = output.status.code().unwrap_or_else(|| panic!("{args:?} was killed: {text}"));
    assert!(!text.contains("panicked"), "{args:?}\n{text}");
    (code, text)
}

/// Runs without an adapter; the exit code and words that the streams must hold.
fn expect(args: &[&str], code: i32, words: &[&str]) {
    let (found, text) = run(args, false);
    assert_eq!(found, code, "{args:?}\n{text}");
    for word in words {
        assert!(text.contains(word), "{args:?} doesn't say `{word}`:\n{text}");
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn check_and_plan_need_no_adapter() {
    expect(&["check", "graphs/gi/direct.ron", "graphs/gi/uniform_grid.ron"], 0, &["no faults"]);
    expect(&["plan", "graphs/gi/uniform_grid.ron"], 0, &[]);
    expect(&["plan", "graphs/gi/direct.ron", "--scene", "scenes/room_spot.gltf"], 0, &[]);
}

#[test]
fn faults_are_shown_with_place_caret_and_remedy() {
    let bad = "tests/bad/name_unknown.ron";
    expect(&["check", bad], 1, &["unknown name `gird`", "name_unknown.ron:", "^^^^", "help: did you mean `grid`?"]);
    expect(&["check", "tests/bad/wgsl_in_an_import.ron"], 1, &["lib/typed.wgsl:4:9"]);
    expect(&["plan", bad], 1, &["unknown name `gird`"]);
    expect(&["check", "graphs/gi/direct.ron", bad], 1, &["direct.ron: no faults", "unknown name `gird`"]);
    expect(&["check", "graphs/no_such_graph.ron"], 1, &["no_such_graph.ron"]);
    expect(&["check", "graphs/gi/direct.ron", "--set", "bais=2"], 2, &["did you mean `bias`?"]);
    expect(&["check", "graphs/gi/direct.ron", "--scene", "scenes/no_such_scene"], 1, &["no_such_scene"]);
    expect(&["plan", "graphs/gi/direct.ron", "--output", "colour"], 1, &["did you mean `color`?"]);
}

#[test]
fn wrong_usage_is_told_from_faults() {
    let graph = "graphs/gi/direct.ron";
    let scene = ["--scene", "scenes/lambert_plane.glb"];
    expect(&[], 2, &["Usage"]);
    expect(&["rendr"], 2, &["render"]);
    expect(&["check"], 2, &["GRAPH"]);
    expect(&["render", graph, scene[0], scene[1], "--size", "0x4", "--out", "a.exr"], 2, &["WIDTHxHEIGHT"]);
    expect(&["render", graph, scene[0], scene[1], "--frames", "0", "--out", "a.exr"], 2, &["--frames"]);
    expect(&["render", graph, scene[0], scene[1]], 2, &["nothing to write", "--out"]);
    expect(&["render", graph, scene[0], scene[1], "--out", "a.jpg"], 2, &[".exr, .png or .npy"]);
    expect(&["render", graph, scene[0], scene[1], "--output", "color"], 2, &["NAME=FILE"]);
    expect(&["--help"], 0, &["render", "check", "plan"]);
    expect(&["--version"], 0, &[env!("CARGO_PKG_VERSION")]);
}

#[test]
fn render_without_an_adapter_says_what_to_install() {
    let scratch = Scratch::new("no-adapter");
    let out = scratch.path().join("a.exr");
    let args = ["render", "graphs/gi/direct.ron", "--scene", "scenes/lambert_plane.glb", "--size", "16x16", "--out"];
    let args: Vec<&str> = args.into_iter().chain(out.to_str()).collect();
    expect(&args, 3, &["adapter", "help:"]);
    assert_eq!(names(scratch.path()), Vec::<String>::new());
}

/// `render` of the smallest sound thing, with more arguments.
fn render(more: &[&str]) -> (i32, String) {
    let mut args = vec!["render", "graphs/gi/direct.ron", "--scene", "scenes/lambert_plane.glb", "--size", "16x16"];
    args.extend(["--set", "shadow_size=64"]);
    args.extend(more);
    run(&args, true)
}

#[test]
fn render_names_what_it_does_not_find() {
    let scratch = Scratch::new("unknown-names");
    let out = scratch.path().join("a.exr");
    let out = out.to_str().unwrap();
    for (more, expected, word) in [
        (vec!["--out", out, "--camera", "Camrea"], 1, "Cam"),
        (vec!["--out", out, "--set", "bais=1"], 2, "did you mean `bias`?"),
        (vec!["--out", out, "--set", "bias=1e9"], 2, "above the maximum"),
        (vec!["--output", &format!("colr={out}")], 1, "did you mean `color`?"),
    ] {
        let (code, text) = render(&more);
        assert_eq!(code, expected, "{more:?}\n{text}");
        assert!(text.contains(word), "{more:?} doesn't say `{word}`:\n{text}");
    }
    assert_eq!(names(scratch.path()), Vec::<String>::new());
}

#[test]
fn an_unwritable_path_is_a_fault_and_leaves_nothing() {
    let scratch = Scratch::new("unwritable");
    let at = |name: &str| scratch.path().join(name).to_str().unwrap().to_string();
    std::fs::write(at("file"), "kept").unwrap();
    std::fs::create_dir(at("folder.exr")).unwrap();
    for path in [at("file/a.exr"), at("folder.exr")] {
        let (code, text) = render(&["--out", &path]);
        assert_eq!(code, 1, "{path}\n{text}");
        assert!(text.contains(&path), "{text}");
    }
    assert_eq!(names(scratch.path()), ["file", "folder.exr"]);
    assert_eq!(names(Path::new(&at("folder.exr"))), Vec::<String>::new());
    assert_eq!(std::fs::read_to_string(at("file")).unwrap(), "kept");
}

#[test]
fn render_writes_images_and_statistics() {
    let scratch = Scratch::new("written");
    let at = |name: &str| scratch.path().join(name).to_str().unwrap().to_string();
    let direct = format!("direct={}", at("new/direct.exr"));
    let stats = at("stats.json");
    let (code, text) = render(&["--frames", "2", "--out", &at("a.png"), "--output", &direct, "--stats", &stats]);
    assert_eq!(code, 0, "{text}");
    assert_eq!(names(scratch.path()), ["a.png", "new", "stats.json"]);
    let image = lightgraph::internals::image::exr::read_exr(Path::new(&at("new/direct.exr"))).unwrap();
    assert_eq!((image.width, image.height), (16, 16));

    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&stats).unwrap()).unwrap();
    assert_eq!(json["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(json["size"], serde_json::json!([16, 16]));
    assert_eq!(json["parameters"]["shadow_size"], "64");
    for key in ["name", "driver", "driver_info", "backend"] {
        assert!(json["adapter"][key].is_string(), "{key} in {}", json["adapter"]);
    }
    assert!(json["adapter"]["software"].is_boolean());
    let bytes = |key: &str| json["bytes"][key].as_u64().unwrap();
    assert!(bytes("allocated") > 0 && bytes("allocated") <= bytes("without_sharing"));
    let frames = json["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 2);
    for frame in frames {
        assert!(frame["wall_ms"].as_f64().unwrap() > 0.0);
        assert!(frame["loops"].is_array());
        for step in frame["steps"].as_array().unwrap() {
            assert!(step["name"].is_string() && step["pass"].is_string(), "{step}");
            assert!(step["runs"].is_u64() && step["cpu_ms"].is_number(), "{step}");
            match step["state"].as_str() {
                Some("ran") => assert!(step["gpu_ms"].is_number() || step["gpu_ms"].is_null()),
                Some("skipped") => assert!(step["why"].as_str().is_some_and(|w| !w.is_empty()), "{step}"),
                other => panic!("state {other:?}"),
            }
        }
    }
}

#[test]
fn tune_writes_the_variant_that_serves_and_says_what_it_measured() {
    let scratch = Scratch::new("tuned");
    let (out, unserved) = (scratch.path().join("tuned.ron"), scratch.path().join("none.ron"));
    let graphs = "lightgraph:graphs/gi/direct.ron,lightgraph:graphs/gi/first_bounce.ron";
    let tune = |wish: [&str; 2], out: &Path| {
        let out = out.display().to_string();
        let scene = ["tune", "--scene", "scenes/cornell_point", "--size", "16x16", "--reference-seconds", "1"];
        run(&[&scene[..], &wish, &["--graphs", graphs, "--sweep", "directions=2", "--out", &out]].concat(), true)
    };
    let (code, text) = tune(["--budget", "100000"], &out);
    assert_eq!(code, 0, "{text}");
    for word in [
        "reference: ",
        "standard error",
        "graphs/gi/direct.ron",
        "directions=2",
        "wrote lightgraph:graphs/gi/first_bounce.ron",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    // The variant is a graph as any other.
    let (code, text) = run(&["check", "--strict", &out.display().to_string()], false);
    assert_eq!(code, 0, "{text}");

    let (code, text) = tune(["--error", "0.0001"], &unserved);
    assert_eq!(code, 1, "{text}");
    assert!(!unserved.exists(), "{text}");
}

#[test]
fn files_are_laid_out_in_one_way() {
    let folder = Scratch::new("fmt");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("a.ron", "Graph(about:\"x\", // said\npasses:[],\n)");
    write("broken.ron", "Graph(about: \"x\"");
    write("notes.txt", "( a )");
    let path = folder.path().display().to_string();
    let one = folder.path().join("a.ron").display().to_string();
    expect(&["fmt", "--check", &one], 1, &["a.ron is laid out otherwise"]);
    expect(&["fmt", &path], 1, &["a.ron", "broken.ron:1:15"]);
    assert_eq!(std::fs::read_to_string(&one).unwrap(), "Graph(\n    about: \"x\", // said\n    passes: [],\n)\n");
    assert_eq!(std::fs::read_to_string(folder.path().join("broken.ron")).unwrap(), "Graph(about: \"x\"");
    assert_eq!(std::fs::read_to_string(folder.path().join("notes.txt")).unwrap(), "( a )");
    expect(&["fmt", "--check", &one], 0, &[]);
    expect(&["fmt", "no_such.ron"], 1, &["can't read no_such.ron"]);
    assert_eq!(names(folder.path()), ["a.ron", "broken.ron", "notes.txt"]);
}
