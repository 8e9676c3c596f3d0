//! `lightgraph watch`: a broken shader leaves the last good image, a mended one makes a new one.

use crate::device;
use crate::support::{Scratch, repository};
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};

const GRAPH: &str = r#"Graph(
    about: "One colour",
    resources: {"color": Texture(format: Rgba32Float, size: "screen")},
    passes: [Screen(name: "paint", shader: "paint.wgsl", color: "color")],
    outputs: {"color": "color"},
)"#;

fn paint(red: &str) -> String {
    format!("@fragment fn paint() -> @location(0) vec4f {{ return vec4f({red}, 0.0, 0.0, 1.0); }}")
}

#[test]
fn a_broken_shader_keeps_the_last_image_and_a_mended_one_replaces_it() {
    let _alone = device::gpu();
    let scratch = Scratch::new("watch");
    let file = |name: &str| scratch.path().join(name);
    fs::create_dir_all(file("shaders")).unwrap();
    fs::write(file("graph.ron"), GRAPH).unwrap();
    fs::write(file("shaders/paint.wgsl"), paint("0.25")).unwrap();
    let mut child = crate::support::command()
        .arg("watch")
        .arg(file("graph.ron"))
        .arg("--scene")
        .arg(repository("scenes/lambert_plane"))
        .args(["--size", "8x8", "--reloads", "2", "--out"])
        .arg(file("out.exr"))
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut line = || lines.next().expect("the command goes on").unwrap();
    let red = || {
        let image = lightgraph::internals::image::exr::read_exr(&file("out.exr")).unwrap_or_else(|f| panic!("{f}"));
        image.pixel(0, 3, 3).unwrap()[0]
    };
    assert!(line().contains("out.exr: graph"));
    assert_eq!(red(), 0.25);
    fs::write(file("shaders/paint.wgsl"), "@fragment fn paint() -> oops").unwrap();
    assert!(line().contains("the last good image stays"));
    assert_eq!(red(), 0.25);
    // As editors save: another file takes the name.
    fs::write(file("shaders/paint.new"), paint("0.75")).unwrap();
    fs::rename(file("shaders/paint.new"), file("shaders/paint.wgsl")).unwrap();
    assert!(line().contains("out.exr: graph"));
    assert_eq!(red(), 0.75);
    assert!(child.wait().unwrap().success());
}

#[cfg(unix)]
#[test]
fn a_pipe_that_comes_and_goes_is_not_waited_for() {
    let _alone = device::gpu();
    let scratch = Scratch::new("watch-pipe");
    let file = |name: &str| scratch.path().join(name);
    fs::create_dir_all(file("shaders")).unwrap();
    fs::write(file("graph.ron"), GRAPH).unwrap();
    fs::write(file("shaders/paint.wgsl"), paint("0.25")).unwrap();
    let mut child = crate::support::command()
        .arg("watch")
        .arg(file("graph.ron"))
        .arg("--scene")
        .arg(repository("scenes/lambert_plane"))
        .args(["--size", "8x8", "--reloads", "2", "--out"])
        .arg(file("out.exr"))
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut line = || lines.next().expect("the command goes on").unwrap();
    assert!(line().contains("out.exr: graph"));
    assert!(Command::new("mkfifo").arg(file("shaders/unused.wgsl")).status().unwrap().success());
    assert!(line().contains("the last good image stays"));
    fs::remove_file(file("shaders/unused.wgsl")).unwrap();
    assert!(line().contains("out.exr: graph"));
    assert!(child.wait().unwrap().success());
}

#[test]
fn a_folder_that_is_deleted_and_made_anew_is_seen() {
    let _alone = device::gpu();
    let scratch = Scratch::new("watch-folder");
    let file = |name: &str| scratch.path().join("project").join(name);
    let make = |red: &str| {
        fs::create_dir_all(file("shaders")).unwrap();
        fs::write(file("shaders/paint.wgsl"), paint(red)).unwrap();
    };
    make("0.25");
    fs::write(file("graph.ron"), GRAPH).unwrap();
    let mut child = crate::support::command()
        .arg("watch")
        .arg(file("graph.ron"))
        .arg("--scene")
        .arg(repository("scenes/lambert_plane"))
        .args(["--size", "8x8", "--out"])
        .arg(scratch.path().join("out.exr"))
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    // Each state is told at least once; loads in the middle of a change may come before.
    let mut until = |part: &str| while !lines.next().expect("the command goes on").unwrap().contains(part) {};
    let red = || {
        let image = lightgraph::internals::image::exr::read_exr(&scratch.path().join("out.exr"))
            .unwrap_or_else(|f| panic!("{f}"));
        image.pixel(0, 3, 3).unwrap()[0]
    };
    until("out.exr: graph");
    fs::remove_dir_all(file("shaders")).unwrap();
    until("the last good image stays");
    assert_eq!(red(), 0.25);
    make("0.5");
    until("out.exr: graph");
    // The folder that is new is watched, all of it.
    fs::remove_dir_all(scratch.path().join("project")).unwrap();
    until("the last good image stays");
    make("0.75");
    fs::write(file("graph.ron"), GRAPH).unwrap();
    while red() != 0.75 {
        until("out.exr: graph");
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Red is a number of the graph times one of the shader times one of the scene's buffer.
const PRODUCT: &str = "struct Triangle { a: vec3f }
var<storage, read> triangles: array<Triangle>;
var<uniform> amount: f32;
@fragment fn paint() -> @location(0) vec4f { return vec4f(1.0 * amount * triangles[0].a.x, 0.0, 0.0, 1.0); }
";

const BASE: &str = r#"Graph(
    about: "One colour",
    params: {"amount": Float(default: 2.0, about: "of red")},
    resources: {"color": Texture(format: Rgba32Float, size: "screen")},
    passes: [Screen(name: "paint", shader: "paint.wgsl", color: "color")],
    outputs: {"color": "color"},
)"#;

const TRIANGLE: &str = r#"{
"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
"bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": "parts/triangle.bin"}]
}"#;

#[test]
fn every_way_of_saving_ends_in_the_final_state() {
    let _alone = device::gpu();
    let scratch = Scratch::new("watch-saves");
    let file = |name: &str| scratch.path().join(name);
    let corners = |x: f32| -> Vec<u8> {
        [x, 0.0, 0.0, x, 1.0, 0.0, x, 0.0, 1.0].iter().flat_map(|v: &f32| v.to_le_bytes()).collect()
    };
    for folder in ["graphs/bases", "shaders", "scene/parts"] {
        fs::create_dir_all(file(folder)).unwrap();
    }
    let variant = "Variant(base: \"bases/base.ron\", about: \"One colour\")";
    fs::write(file("graphs/bases/base.ron"), BASE).unwrap();
    fs::write(file("graphs/graph.ron"), variant).unwrap();
    fs::write(file("shaders/paint.wgsl"), PRODUCT).unwrap();
    fs::write(file("scene/scene.gltf"), TRIANGLE).unwrap();
    fs::write(file("scene/parts/triangle.bin"), corners(0.5)).unwrap();
    // Its own image lies among the watched files.
    let out = format!("color={}", file("graphs/out.exr").display());
    let mut child = crate::support::command()
        .arg("watch")
        .arg(file("graphs/graph.ron"))
        .arg("--scene")
        .arg(file("scene/scene.gltf"))
        .args(["--size", "8x8", "--out"])
        .arg(file("graphs/out.png"))
        .args(["--output", &out])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let red = || {
        let image =
            lightgraph::internals::image::exr::read_exr(&file("graphs/out.exr")).unwrap_or_else(|f| panic!("{f}"));
        image.pixel(0, 3, 3).unwrap()[0]
    };
    // A machine under load may see a save in two steps as two; the end is the same.
    let mut until = |what: &str, good: bool, value: f32| {
        for _ in 0..4 {
            let line = lines.next().expect("the command goes on").unwrap();
            let is_good = !line.contains("the last good image stays");
            if is_good == good && red() == value {
                return;
            }
        }
        panic!("{what}: red is {}, not {value}", red());
    };
    until("start", true, 1.0);
    let shader = PRODUCT.replace("1.0 * amount", "2.0 * amount");
    let (head, tail) = shader.split_at(shader.len() / 2);
    let mut written = fs::File::create(file("shaders/paint.wgsl")).unwrap();
    written.write_all(head.as_bytes()).unwrap();
    written.sync_all().unwrap();
    written.write_all(tail.as_bytes()).unwrap();
    drop(written);
    until("truncated and written in two pieces", true, 2.0);
    fs::write(file("graphs/bases/base.ron"), BASE.replace("2.0", "4.0")).unwrap();
    until("the base of the variant", true, 4.0);
    fs::write(file("graphs/bases/base.ron"), BASE.replace("2.0", "8.0")).unwrap();
    fs::write(file("shaders/paint.wgsl"), PRODUCT).unwrap();
    fs::write(file("scene/parts/triangle.bin"), corners(0.25)).unwrap();
    until("three files at once", true, 2.0);
    fs::write(file("scene/parts/new"), corners(2.0)).unwrap();
    fs::rename(file("scene/parts/new"), file("scene/parts/triangle.bin")).unwrap();
    until("a buffer renamed into place", true, 16.0);
    fs::remove_file(file("shaders/paint.wgsl")).unwrap();
    until("a shader removed", false, 16.0);
    fs::write(file("scene/parts/triangle.bin"), &corners(1.0)[..7]).unwrap();
    until("half a buffer", false, 16.0);
    fs::write(file("shaders/paint.wgsl"), PRODUCT).unwrap();
    until("a shader restored, the buffer still half", false, 16.0);
    fs::write(file("scene/parts/triangle.bin"), corners(1.0)).unwrap();
    until("all mended", true, 8.0);
    child.kill().unwrap();
    child.wait().unwrap();
}
