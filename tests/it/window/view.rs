//! `lightgraph view`: a real window on a virtual display, played by a script. It takes longer than other tests: a
//! minute on two busy cores, for every step waits until the window shows what came of it.

use super::{Display, finish};
use crate::device;
use crate::support::{Scratch, repository};
use std::path::PathBuf;
use std::process::{Command, Stdio};

const GRAPH: &str = r#"Graph(
    about: "One colour",
    params: {"red": Float(default: 0.0, min: 0.0, max: 1.0, about: "how red")},
    resources: {
        "color": Texture(format: Rgba32Float, size: "screen"),
        "ramp": Texture(format: R32Float, size: (4, 4), layers: 2, mips: 1),
    },
    passes: [
        Compute(name: "fill", shader: "fill.wgsl", over: "ramp"),
        Screen(name: "paint", shader: "paint.wgsl", color: "color"),
    ],
    outputs: {"color": "color"},
)"#;

const FILL: &str = "
var ramp: texture_storage_2d_array<r32float, write>;
@compute @workgroup_size(4, 4, 1) fn fill(@builtin(global_invocation_id) at: vec3u) {
    textureStore(ramp, at.xy, at.z, vec4f(f32(at.x) / 3.0));
}";

const PAINT: &str = "
var<uniform> red: f32;
var ramp: texture_2d_array<f32>;
@fragment fn paint() -> @location(0) vec4f {
    return vec4f(red, 0.25 + 0.0 * textureLoad(ramp, vec2u(0, 0), 0, 0).r, 0.0, 1.0);
}";

const VARIANT: &str = r#"Variant(base: "graph.ron", about: "redder", params: {"red": (default: 1.0)})"#;

const SCRIPT: &str = r#"[
    Rest, Shot("start.png"),
    Drag(on: "param red", from: (0.02, 0.5), to: (0.98, 0.5)), Rest, Shot("dragged.png"), Save("dragged.ron"),
    Click("undo"), Rest, Shot("undone.png"),
    Replace(file: "shaders/paint.wgsl", text: "0.25 +", by: "0.25 + green +"),
    Faults("paint.wgsl:5:"), Wait(3), Shot("broken.png"),
    Replace(file: "shaders/paint.wgsl", text: "0.25 + green +", by: "0.5 +"), Mended, Rest, Shot("mended.png"),
    Click("variant other"), Rest, Shot("variant.png"), Click("variant graph"), Rest,
    Click("tab Graph"), Wait(3), Shot("network.png"), Click("pass paint"), Wait(3),
    Click("declared"), Wait(3), Shot("declared.png"), Click("declared paint"), Wait(3), Click("compiled"), Wait(3),
    Click("tab Memory"), Wait(3), Shot("memory.png"), Click("lifetime ramp"), Rest, Wait(3), Shot("lifetime.png"),
    Click("tab Graph"), Wait(3), Click("port ramp"), Rest, Wait(3), Shot("resource.png"),
    ClickAt(on: "plane", at: (0.1, 0.1), ctrl: true), Answer("`fill`, fill.wgsl, at 0,0,0"), Rest,
    ClickAt(on: "image", at: (0.25, 0.25), ctrl: true), Answer("(0, 0.5, 0, 1)"), Rest, Wait(3), Shot("probed.png"),
    Replace(file: "shaders/paint.wgsl", text: "0.5 +", by: "0.75 +"), Answer("(0, 0.75, 0, 1)"),
    Replace(file: "shaders/paint.wgsl", text: "0.75 +", by: "0.5 +"), Answer("(0, 0.5, 0, 1)"), Rest,
    Drag(on: "image", from: (0.5, 0.5), to: (0.6, 0.45)), Rest, Save("orbited.ron"),
    Size(1, 1), Rest, Shot("tiny.png"), Size(900, 600), Rest, Shot("back.png"),
    LoseDevice, Rest, Wait(3), Shot("reopened.png"),
    Close,
]"#;

/// What is moved, compared, saved, and what shaders say of themselves.
const MOVES: &str = r##"[
    Rest, Size(1200, 900), Rest,
    Drag(on: "light 0", from: (0.5, 0.5), to: (3.5, 0.5)), Rest, Save("light.ron"),
    ClickAt(on: "image", at: (0.3, 0.7)), Wait(3),
    Drag(on: "image", from: (0.3, 0.7), to: (0.4, 0.7)), Rest, Save("object.ron"), Shot("moved.png"),
    Click("against"), Wait(3), Click("against other"), Rest, Wait(3), Shot("split.png"),
    Drag(on: "split line", from: (0.5, 0.5), to: (-60.0, 0.5)), Rest, Save("split.ron"),
    Click("layout difference"), Rest, Shot("difference.png"),
    Drag(on: "param red", from: (0.02, 0.5), to: (0.98, 0.5)), Rest,
    Click("save picture"), Wait(3), Click("save EXR"), Wait(3), Click("save all"), Wait(3),
    Click("save parameters"), Rest, Wait(3), Shot("saved.png"),
    Replace(file: "shaders/paint.wgsl", text: "var<uniform> red: f32;", by: "#import lightgraph::report::{check}\nvar<uniform> red: f32;"),
    Replace(file: "shaders/paint.wgsl", text: "return vec4f(red", by: "check(red < 0.5, vec3u(7u, 0u, 0u), #{HERE}); return vec4f(red"),
    Faults("a check in the shader of `paint` does not hold"), Wait(3), Shot("check.png"),
    Replace(file: "shaders/paint.wgsl", text: "red < 0.5", by: "red < 5.0"), Mended,
    Close,
]"##;

struct Project(Scratch);

impl Project {
    fn new(name: &str, script: &str) -> Project {
        let project = Project(Scratch::new(&format!("view-{name}")));
        std::fs::create_dir_all(project.path("shaders")).unwrap();
        let files = [
            ("graph.ron", GRAPH),
            ("other.ron", VARIANT),
            ("shaders/fill.wgsl", FILL),
            ("shaders/paint.wgsl", PAINT),
            ("script", script),
        ];
        for (name, text) in files {
            std::fs::write(project.path(name), text).unwrap();
        }
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self) -> Command {
        let mut command = crate::support::command();
        command.current_dir(self.0.path()).args(["view", "graph.ron", "--size", "900x600", "--pixels", "0.25"]);
        command.arg("--scene").arg(repository("scenes/lambert_plane")).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").env_remove("DISPLAY");
        command
    }

    /// The colour of a pixel, at shares of the width and height.
    fn pixel(&self, shot: &str, x: f32, y: f32) -> [u8; 3] {
        let image = image::open(self.path(shot)).unwrap_or_else(|e| panic!("{shot}: {e}")).to_rgb8();
        let at = |share: f32, n: u32| (share * n as f32) as u32;
        image.get_pixel(at(x, image.width()), at(y, image.height())).0
    }
}

#[test]
fn a_window_is_dragged_broken_mended_switched_shrunk_and_closed() {
    let _alone = device::gpu();
    let display = Display::start();
    let project = Project::new("played", SCRIPT);
    // An editor that notes what it is asked to open.
    std::fs::write(project.path("editor.sh"), "echo \"$@\" > opened").unwrap();
    let mut command = project.command();
    command.env("DISPLAY", &display.name).env_remove("VISUAL").env("EDITOR", "sh editor.sh");
    let (code, text) = finish(command.args(["--script", "script"]).spawn().unwrap());
    assert_eq!(code, 0, "{text}");
    assert_eq!(std::fs::read_to_string(project.path("opened")).unwrap().trim(), "+10 graph.ron");
    let shot = |name: &str| std::fs::read(project.path(name)).unwrap();
    assert_ne!(shot("declared.png"), shot("network.png"), "passes in the order of the text");
    assert_ne!(shot("memory.png"), shot("network.png"), "lifetimes in place of the graph");
    assert_ne!(shot("lifetime.png"), shot("memory.png"), "a click shows the resource");
    assert_ne!(shot("probed.png"), shot("resource.png"), "what a pixel's shader computes");

    // The middle of the image; green is 0.25 of the light, tone mapped.
    let middle = |shot: &str| project.pixel(shot, 0.5, 0.3);
    let [red, green, _] = middle("start.png");
    assert!(red < 30 && green > 100, "{red} {green}");
    let dragged = middle("dragged.png");
    assert!(dragged[0] > 200, "the slider makes it red: {dragged:?}");
    assert_eq!(middle("undone.png"), middle("start.png"));
    assert_eq!(middle("broken.png"), middle("start.png"), "the last good frame goes on");
    assert_ne!(std::fs::read(project.path("broken.png")).unwrap(), std::fs::read(project.path("undone.png")).unwrap());
    let mended = middle("mended.png");
    assert!(mended[1] > green + 30, "the mended shader is in use: {mended:?}");
    assert!(middle("variant.png")[0] > 200, "the variant is red: {:?}", middle("variant.png"));
    assert_eq!(middle("network.png"), mended);
    assert_eq!(middle("back.png"), mended);
    assert_eq!(middle("reopened.png"), mended, "another device shows the same");
    let tiny = image::open(project.path("tiny.png")).unwrap();
    assert_eq!((tiny.width(), tiny.height()), (1, 1));

    let saved = std::fs::read_to_string(project.path("dragged.ron")).unwrap();
    assert!(saved.contains("\"red\": Float("), "{saved}");
    let orbited = std::fs::read_to_string(project.path("orbited.ron")).unwrap();
    assert!(orbited.contains("view: Some("), "{orbited}");
}

#[test]
fn what_is_dragged_compared_saved_and_checked_is_seen() {
    let _alone = device::gpu();
    let display = Display::start();
    let project = Project::new("moves", MOVES);
    let mut command = project.command();
    let (code, text) = finish(command.args(["--script", "script"]).env("DISPLAY", &display.name).spawn().unwrap());
    let set = std::fs::read_to_string(project.path("graph_set.ron")).unwrap_or_default();
    assert_eq!(code, 0, "{text}\nthe parameters that were saved:\n{set}");

    let read = |name: &str| std::fs::read_to_string(project.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let (light, object) = (read("light.ron"), read("object.ron"));
    assert!(light.contains("lights: {\n") && light.contains("nodes: {},"), "{light}");
    assert!(object.contains("lights: {\n") && object.contains("nodes: {\n"), "{object}");
    // To the left of the line what is chosen, green; to the right the other, red as well.
    let (left, right) = (project.pixel("split.png", 0.35, 0.2), project.pixel("split.png", 0.7, 0.2));
    assert!(left[0] < 30 && left[1] > 100 && right[0] > 200, "{left:?} {right:?}");
    let split = read("split.ron");
    let at = split.split("Split(").nth(1).and_then(|s| s.split(')').next()).and_then(|s| s.parse::<f32>().ok());
    assert!(at.is_some_and(|at| at < 0.4), "the line was dragged to the left: {split}");
    let [red, _, blue] = project.pixel("difference.png", 0.5, 0.2);
    assert!(blue > red, "darker than the other is blue: {red} {blue}");
    for name in ["graph.png", "graph.exr", "graph.view.ron"] {
        assert!(project.path(name).is_file(), "{name} was saved");
    }
    assert!(read("graph_set.ron").contains("\"red\": (default: "), "{}", read("graph_set.ron"));
    let shot = |name: &str| std::fs::read(project.path(name)).unwrap();
    assert_ne!(shot("check.png"), shot("saved.png"), "the check is shown");
}

#[test]
fn without_a_display_the_remedy_is_named() {
    let project = Project::new("unset", "[]");
    let (code, text) = finish(project.command().spawn().unwrap());
    assert_eq!(code, 3, "{text}");
    for word in ["neither DISPLAY nor WAYLAND_DISPLAY is set", "help: ", "lightgraph watch"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    assert!(!text.contains("panicked"), "{text}");
}

#[test]
fn a_display_that_is_not_there_is_a_fault_and_no_panic() {
    let project = Project::new("absent", "[]");
    let (code, text) = finish(project.command().env("DISPLAY", ":9999").spawn().unwrap());
    assert_eq!(code, 3, "{text}");
    assert!(text.contains("no window can be opened") && !text.contains("panicked"), "{text}");
}

/// Scripts are no words for users, so only their own test reads them: a wrong one is told with its place.
#[test]
fn a_script_that_is_none_is_refused() {
    let project = Project::new("dance", "[Dance]");
    let (code, text) = finish(project.command().args(["--script", "script"]).spawn().unwrap());
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("script:1:"), "{text}");
}
