//! Of two alternatives the one that is faster here runs, and what was measured is remembered.

use crate::command::lightgraph_with;
use crate::device;
use crate::support::{Scratch, repository};
use glam::Vec3;
use lightgraph::internals::fastest::measured;
use lightgraph::internals::image::metrics::compare;
use lightgraph::internals::plan::fastest::{Choice, Choices};
use lightgraph::internals::scene::Shift;
use lightgraph::{Image, Project, Scene, Session, Settings};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Two ways to the same numbers, in a loop; the first takes a thousand times as many steps. `pack` is for the second
/// alone.
const GRAPH: &str = r#"Graph(
    about: "The same, slowly and quickly",
    resources: {
        "total": Buffer(stride: 4, count: 4096),
        "packed": Buffer(stride: 4, count: 4096),
        "color": Texture(format: Rgba32Float, size: (64, 64)),
    },
    passes: [
        Clear(name: "begin", target: "total"),
        Compute(name: "pack", shader: "pack.wgsl", over: (4096, 1, 1)),
        Loop(name: "turn", count: 2, passes: [
            Fastest(name: "sum", of: [
                [Compute(name: "slow", shader: "slow.wgsl", over: (4096, 1, 1))],
                [Compute(name: "quick", shader: "quick.wgsl", over: (4096, 1, 1))],
            ]),
        ]),
        Screen(name: "show", shader: "show.wgsl"),
    ],
    outputs: {"color": "color"},
)"#;

const SHADERS: [(&str, &str); 4] = [
    (
        "slow",
        "var<storage, read_write> total: array<f32>;
        @compute @workgroup_size(64) fn slow(@builtin(global_invocation_id) at: vec3u) {
            var sum = total[at.x];
            for (var i = 0u; i < 4000u; i += 1u) { sum += f32((i + at.x) % 4u == 0u) / 4.0; }
            total[at.x] = sum;
        }",
    ),
    (
        "quick",
        "var<storage, read_write> total: array<f32>;
        var<storage, read> packed: array<f32>;
        @compute @workgroup_size(64) fn quick(@builtin(global_invocation_id) at: vec3u) {
            total[at.x] += packed[at.x];
        }",
    ),
    (
        "pack",
        "var<storage, read_write> packed: array<f32>;
        @compute @workgroup_size(64) fn pack(@builtin(global_invocation_id) at: vec3u) { packed[at.x] = 250.0; }",
    ),
    (
        "show",
        "var<storage, read> total: array<f32>;
        struct Targets { @location(0) color: vec4f }
        @fragment fn show(@builtin(position) at: vec4f) -> Targets {
            return Targets(vec4f(total[u32(at.y) * 64u + u32(at.x)]));
        }",
    ),
];

/// The graph's file and its shaders', in a folder of their own.
fn files(scratch: &Scratch) -> PathBuf {
    let shaders = scratch.path().join("shaders");
    fs::create_dir_all(&shaders).unwrap();
    for (name, text) in SHADERS {
        fs::write(shaders.join(format!("{name}.wgsl")), text).unwrap();
    }
    let graph = scratch.path().join("graph.ron");
    fs::write(&graph, GRAPH).unwrap();
    graph
}

/// The name and the times of the only group in a file of what was measured.
fn remembered(file: &Path) -> (String, Vec<f64>) {
    let all: serde_json::Value = serde_json::from_slice(&fs::read(file).unwrap()).unwrap();
    let [only] = all.as_array().unwrap().as_slice() else { panic!("{all}") };
    let ms = only["ms"].as_array().unwrap().iter().map(|ms| ms.as_f64().unwrap());
    (only["group"].as_str().unwrap().to_string(), ms.collect())
}

#[test]
fn the_faster_alternative_is_found_and_remembered() {
    let gpu = &device::gpu();
    let scratch = Scratch::new("fastest");
    let project = Project::open(&files(&scratch), &[]).unwrap_or_else(|f| panic!("{f}"));
    let scene = Scene::load(&repository("scenes/lambert_plane.glb")).unwrap_or_else(|f| panic!("{f}")).scene;
    let scene = Arc::new(scene);
    let settings = Settings { size: [64, 64], skip: true, verify: true, ..Settings::default() };
    let file = scratch.path().join("cache/fastest.json");
    let choose =
        |settings: &Settings| measured(gpu, &project, &scene, settings, Some(&file)).unwrap_or_else(|f| panic!("{f}"));
    let chosen = choose(&settings);
    let Choice { index, why } = &chosen["sum"];
    assert_eq!(*index, 1, "{why}");
    assert!(why.contains(&gpu.info.name), "{why}");
    let (group, ms) = remembered(&file);
    assert_eq!(group, "sum");
    assert!(ms[0] > 2.0 * ms[1], "{ms:?}");

    // It is not measured again: what stands in the file counts, as long as it can be read.
    let text = fs::read_to_string(&file).unwrap();
    let other = text.replacen(&format!("{:?}", ms[0]), "0.0", 1);
    assert_ne!(text, other, "the slow one is said to take no time");
    fs::write(&file, other).unwrap();
    assert_eq!(choose(&settings)["sum"].index, 0);
    fs::write(&file, "broken").unwrap();
    assert_eq!(choose(&settings)["sum"].index, 1);
    let asked = Choices::from([("sum".into(), Choice { index: 0, why: "as asked for".into() })]);
    assert_eq!(choose(&Settings { choices: asked.clone(), ..settings.clone() }), asked, "what is stated stays");

    // Either way makes the same image, with skips as without.
    let mut images = vec![];
    for choices in [Choices::new(), chosen] {
        let settings = Settings { choices, ..settings.clone() };
        let mut session = Session::new(gpu, &project, scene.clone(), settings).unwrap_or_else(|f| panic!("{f}"));
        for frame in 0..2 {
            session.frame(gpu, frame, 0.0).unwrap_or_else(|f| panic!("{f}"));
        }
        images.push(session.image(gpu, "color").unwrap_or_else(|f| panic!("{f}")).data);
    }
    assert!(images[0] == images[1] && images[0].iter().all(|x| *x == 500.0), "{:?}", &images[0][..4]);
}

#[test]
fn what_is_measured_once_holds_for_all_scenes_and_sizes_of_its_order() {
    let gpu = &device::gpu();
    let scratch = Scratch::new("fastest-once");
    let graph = files(&scratch);
    let file = scratch.path().join("fastest.json");
    let count = || {
        let text = fs::read_to_string(&file).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap().as_array().unwrap().len()
    };
    let choose = |name: &str, set: &str| {
        let project = Project::open(&graph, &[]).unwrap_or_else(|f| panic!("{f}"));
        let scene = Scene::load(&repository(name)).unwrap_or_else(|f| panic!("{f}")).scene;
        let params = project.params(&[set.into()]).unwrap_or_else(|f| panic!("{f}"));
        let settings = Settings { params, size: [64, 64], ..Settings::default() };
        measured(gpu, &project, &Arc::new(scene), &settings, Some(&file)).unwrap_or_else(|f| panic!("{f}"))["sum"].index
    };
    let sized = GRAPH
        .replace(
            "    resources:",
            "    params: {\"rows\": Uint(default: 64, min: 1, max: 64, about: \"rows\")},\n    resources:",
        )
        .replace("over: (4096, 1, 1)", "over: (\"64 * rows\", 1, 1)");
    for (text, asked) in
        [(sized.clone(), [1, 2, 3]), (sized.replace("\"sum\", of", "\"sum\", once: true, of"), [1, 1, 1])]
    {
        fs::write(&graph, text).unwrap();
        fs::write(&file, "[]").unwrap();
        let cases = [
            ("scenes/lambert_plane.glb", "rows=48"),
            ("scenes/lambert_plane.glb", "rows=32"),
            ("scenes/furnace.glb", "rows=32"),
        ];
        for ((scene, set), asked) in cases.into_iter().zip(asked) {
            assert_eq!(choose(scene, set), 1, "the quick one");
            assert_eq!(count(), asked, "{scene} {set}");
        }
    }
    // Another text of a shader is another work.
    let (name, text) = SHADERS[0];
    fs::write(scratch.path().join(format!("shaders/{name}.wgsl")), format!("// slow\n{text}")).unwrap();
    assert_eq!(choose("scenes/lambert_plane.glb", "rows=48"), 1);
    assert_eq!(count(), 2);
    // So are dispatches of another order of magnitude.
    assert_eq!(choose("scenes/lambert_plane.glb", "rows=64"), 1);
    assert_eq!(count(), 3);
    // And so is what a pass defines otherwise.
    let once = sized.replace("\"sum\", of", "\"sum\", once: true, of");
    let slow = "shader: \"slow.wgsl\", ";
    fs::write(&graph, once.replace(slow, &format!("{slow}defines: {{\"WIDE\": \"rows > 36\"}}, "))).unwrap();
    fs::write(scratch.path().join(format!("shaders/{name}.wgsl")), format!("#ifdef WIDE\n#endif\n{text}")).unwrap();
    for (set, asked) in [("rows=48", 4), ("rows=40", 4), ("rows=34", 5), ("rows=32", 5)] {
        assert_eq!(choose("scenes/lambert_plane.glb", set), 1);
        assert_eq!(count(), asked, "{set}");
    }
}

#[test]
fn the_command_measures_unless_it_is_told() {
    let scratch = Scratch::new("fastest-command");
    let graph = files(&scratch).display().to_string();
    let (home, image) = (scratch.path().join("home"), scratch.path().join("out.exr").display().to_string());
    let file = home.join("lightgraph/fastest.json");
    let run = |args: &[&str], words: &[&str]| {
        let output = lightgraph_with(args, &[("XDG_CACHE_HOME", &home)]);
        let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        for word in words {
            assert!(text.contains(word), "{args:?} doesn't say `{word}`:\n{text}");
        }
        output.status.code()
    };
    let scene = ["--scene", "scenes/lambert_plane"];
    let render = [&["render", &graph], &scene[..], &["--size", "64x64", "--out", &image]].concat();
    let plan = [&["plan", &graph], &scene[..]].concat();
    let first = "`sum` takes `slow`: the first, not measured";
    assert_eq!(run(&[&render[..], &["--fastest", "first"]].concat(), &[first]), Some(0));
    assert_eq!(run(&plan, &[first]), Some(0));
    assert!(!file.exists(), "nothing is measured");
    let asked = "`sum` takes `quick`: as asked for";
    assert_eq!(run(&[&plan[..], &["--fastest", "sum=quick"]].concat(), &[asked]), Some(0));
    assert_eq!(run(&[&plan[..], &["--fastest", "measure"]].concat(), &["no device"]), Some(2));
    let unknown = ["no alternative of `sum` has a pass `quik`", "did you mean `quick`?"];
    assert_eq!(run(&[&plan[..], &["--fastest", "sum=quik"]].concat(), &unknown), Some(1));
    assert_eq!(run(&[&plan[..], &["--fastest", "sun=quick"]].concat(), &["no group of alternatives `sun`"]), Some(1));
    assert_eq!(run(&["check", &graph], &["no faults"]), Some(0));
    // On Linux this variable names the folder of caches.
    if cfg!(target_os = "linux") {
        assert_eq!(run(&render, &["`sum` takes `quick`: measured, "]), Some(0));
        assert_eq!(remembered(&file).0, "sum");
    }
}

/// An alternative that is asked for: the group, which of it, and a pass that it has.
type Asked<'a> = (&'a str, usize, &'a str);

/// The outputs of a graph after frames in which things stand elsewhere.
fn outputs_of(
    graph: &Path,
    (group, index, pass): Asked<'_>,
    scene: &Arc<Scene>,
    set: &[String],
    outputs: &[&str],
    shifts: &[Shift],
) -> Vec<Image> {
    let gpu = &device::gpu();
    let project = Project::open(graph, &[]).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings {
        params: project.params(set).unwrap_or_else(|f| panic!("{f}")),
        size: [96, 72],
        outputs: Some(outputs.iter().map(|o| o.to_string()).collect()),
        choices: Choices::from([(group.to_string(), Choice { index, why: "asked for".into() })]),
        verify: true,
        skip: true,
        ..Settings::default()
    };
    let mut s = Session::new(gpu, &project, scene.clone(), settings).unwrap_or_else(|f| panic!("{f}"));
    assert!(s.plan.steps.iter().any(|step| step.name == pass), "{}: no `{pass}`", scene.name);
    for (i, shift) in shifts.iter().enumerate() {
        s.shift = shift.clone();
        s.frame(gpu, i as u32, 0.0).unwrap_or_else(|f| panic!("{f}"));
    }
    outputs.iter().map(|o| s.image(gpu, o).unwrap_or_else(|f| panic!("{f}"))).collect()
}

fn fast_grid() -> PathBuf {
    repository("graphs/gi/fast_grid.ron")
}

fn loaded(name: &str) -> Arc<Scene> {
    Arc::new(Scene::load(&repository("scenes").join(name)).unwrap_or_else(|f| panic!("{f}")).scene)
}

/// But for texels whose centre lies on an edge.
#[test]
fn shadow_maps_are_the_same_drawn_and_computed() {
    for (name, size) in [("cornell_point.gltf", 64), ("room_spot.gltf", 256), ("hall.ron", 256)] {
        let set = ["grid=2,2,2".to_string(), "face=8".into(), format!("shadow_size={size}")];
        let outputs = ["direct", "indirect"];
        let scene = loaded(name);
        let [drawn, computed] = [("shadows", 0, "shadow.shadow_maps"), ("shadows", 1, "kernels.shadow_tiles")]
            .map(|asked| outputs_of(&fast_grid(), asked, &scene, &set, &outputs, &[Shift::default()]));
        for (output, (a, b)) in outputs.iter().zip(drawn.iter().zip(&computed)) {
            let other = |(a, b): &(&f32, &f32)| (**a - **b).abs() > 1e-3 * a.abs().max(0.01);
            let count = a.data.iter().zip(&b.data).filter(other).count();
            let most = if *output == "direct" { a.data.len() / 500 } else { 0 };
            assert!(count <= most, "{name}, {output}: {count} of {} numbers differ, at most {most} may", a.data.len());
            assert!(a.data.iter().any(|v| *v > 0.0), "{name}, {output}: nothing is lit");
        }
    }
}

/// In cornell_point.gltf edges lie on diagonals of faces, in corridor.glb at centres of texels.
#[test]
fn what_probes_see_is_the_same_drawn_and_computed() {
    for (name, set) in [
        ("cornell_point.gltf", ["grid=4,4,4", "face=16"]),
        ("corridor.glb", ["grid=4,4,4", "face=16"]),
        ("room_spot.gltf", ["grid=3,2,3", "face=16"]),
        ("two_rooms.glb", ["grid=3,2,2", "face=6"]),
    ] {
        let scene = loaded(name);
        let last = scene.geometry.vertices.last().expect("it has surfaces").node;
        let moved = Shift { nodes: vec![(last as usize, Vec3::splat(0.05))], ..Shift::default() };
        let (set, shifts) = (set.map(String::from), [Shift::default(), moved]);
        let [drawn, computed] =
            [("capture.captures", 0, "capture.capture"), ("capture.captures", 1, "capture.capture_triangles")]
                .map(|asked| outputs_of(&fast_grid(), asked, &scene, &set, &["indirect"], &shifts));
        assert!(drawn[0].data.iter().any(|v| *v > 0.0), "{name}: nothing is lit");
        let off = compare(&computed[0], &drawn[0], None).unwrap_or_else(|f| panic!("{f}")).rmse_percent;
        assert!(off <= 0.1, "{name}: {off} % of the mean");
    }
}
