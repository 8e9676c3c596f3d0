//! `lightgraph watch`: a broken shader leaves the last good image, a mended one makes a new one.

use crate::device;
use crate::support::{Scratch, repository};
use std::fs;
use std::io::{BufRead, BufReader};
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
    let mut child = Command::new(env!("CARGO_BIN_EXE_lightgraph"))
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
        let image = lightgraph::image::exr::read_exr(&file("out.exr")).unwrap_or_else(|f| panic!("{f}"));
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
