//! `lightgraph view --link`: a real window, and a program that shows its scene in it.

use super::{Display, finish};
use crate::device;
use crate::support::{Scratch, repository};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Longer than it takes on a busy machine with a software driver.
const PATIENCE: Duration = Duration::from_secs(300);

/// A triangle that shines, a metre wide and high round the origin.
const TRIANGLE: &str = r#"{
"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
"nodes": [{"name": "Triangle", "mesh": 0}],
"materials": [{"emissiveFactor": [1, 1, 1], "doubleSided": true}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
    "min": [-0.5, -0.5, 0], "max": [0.5, 0.5, 0]}],
"bufferViews": [{"buffer": 0, "byteLength": 36}],
"buffers": [{"byteLength": 36,
    "uri": "data:application/octet-stream;base64,AAAAvwAAAL8AAAAAAAAAPwAAAL8AAAAAAAAAAAAAAD8AAAAA"}]
}"#;

/// Each file says that a message was answered.
const SCRIPT: &str = r#"[
    Faults("no scene has come over the live link"), Shot("waiting.png"),
    File("sent"), Rest, Shot("sent.png"),
    File("placed"), Rest, Shot("placed.png"),
    File("looked"), Rest, Shot("looked.png"),
    Faults("there is no node \"Nobody\""), Wait(3), Shot("wrong.png"),
    File("mended"), Mended, Shot("mended.png"),
    File("broken"), Faults("the header of a message has 4294967295 bytes"), Wait(3), Shot("broken.png"),
    File("again"), Rest, Wait(3), Shot("again.png"),
    Close,
]"#;

/// A connection to a window.
struct Program(TcpStream);

impl Program {
    /// Connects, and says who it is; the answer.
    fn connect(at: &str, token: &str) -> (Program, Option<String>) {
        let stream = TcpStream::connect(at).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut program = Program(stream);
        let answer = program.say(&json!({"hello": {"version": 1, "token": token, "program": "a test"}}), b"");
        (program, answer)
    }

    fn say(&mut self, header: &Value, body: &[u8]) -> Option<String> {
        self.0.write_all(&message(header, body)).unwrap();
        self.answer()
    }

    fn answer(&mut self) -> Option<String> {
        let mut lengths = [0; 8];
        self.0.read_exact(&mut lengths).unwrap();
        let mut header = vec![0; u32::from_le_bytes(lengths[..4].try_into().unwrap()) as usize];
        self.0.read_exact(&mut header).unwrap();
        let answer: Value = serde_json::from_slice(&header).unwrap();
        answer["fault"].as_str().map(String::from)
    }

    fn scene(&mut self) -> Option<String> {
        self.say(&json!({"scene": {"name": "sent"}}), TRIANGLE.as_bytes())
    }

    fn place(&mut self, name: &str, x: f32) -> Option<String> {
        let matrix = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, 0.0, 0.0, 1.0_f32];
        let body: Vec<u8> = matrix.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.say(&json!({"place": {"nodes": [name]}}), &body)
    }

    fn look(&mut self, x: f32) -> Option<String> {
        let camera = json!({"eye": [x, 0, 1.5], "target": [x, 0, 0], "fov": 40, "near": 0.01, "far": 100});
        self.say(&json!({"camera": camera}), b"")
    }
}

fn message(header: &Value, body: &[u8]) -> Vec<u8> {
    let header = header.to_string().into_bytes();
    let lengths = [header.len(), body.len()].map(|n| u32::try_from(n).unwrap().to_le_bytes());
    [lengths.concat(), header, body.to_vec()].concat()
}

/// Waits until the window has written a file.
fn wait(path: &Path) {
    let start = Instant::now();
    while !path.exists() {
        assert!(start.elapsed() < PATIENCE, "{} does not come", path.display());
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_window_follows_a_program_and_outlives_what_it_says_wrong() {
    let _alone = device::gpu();
    let display = Display::start();
    let scratch = Scratch::new("link");
    let path = |name: &str| scratch.path().join(name);
    std::fs::write(path("script"), SCRIPT).unwrap();
    let mut command = crate::support::command();
    command.current_dir(scratch.path()).arg("view").arg(repository("graphs/gi/direct.ron"));
    command.args(["--link", "--size", "900x600", "--pixels", "0.25", "--script", "script"]);
    command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").env("DISPLAY", &display.name);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut said = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    said.read_line(&mut line).unwrap();
    child.stdout = Some(said.into_inner());
    let link = line.trim().strip_prefix("lightgraph://127.0.0.1:").unwrap_or_else(|| panic!("no link: {line}"));
    let (port, token) = link.split_once('/').unwrap();
    let at = format!("127.0.0.1:{port}");

    wait(&path("waiting.png"));
    let (_, refused) = Program::connect(&at, "wrong");
    assert!(refused.unwrap().contains("the token is not this window's"));
    let mut half = TcpStream::connect(&at).unwrap();
    half.write_all(&message(&json!({"hello": {}}), b"")[..9]).unwrap();

    let (mut program, answer) = Program::connect(&at, token);
    assert_eq!(answer, None);
    let done = |name: &str| std::fs::write(path(name), "").unwrap();
    assert_eq!(program.look(0.0), None);
    assert_eq!(program.scene(), None);
    done("sent");
    wait(&path("sent.png"));
    assert_eq!(program.place("Triangle", 20.0), None);
    done("placed");
    wait(&path("placed.png"));
    assert_eq!(program.look(20.0), None);
    done("looked");
    wait(&path("looked.png"));
    let fault = program.place("Nobody", 0.0).unwrap();
    assert!(fault.contains("there is no node \"Nobody\""), "{fault}");
    wait(&path("wrong.png"));
    assert_eq!(program.place("Triangle", 20.0), None);
    done("mended");
    wait(&path("mended.png"));
    program.0.write_all(&[0xff; 8]).unwrap();
    done("broken");
    assert!(program.answer().unwrap().contains("has 4294967295 bytes"));
    wait(&path("broken.png"));

    let (mut next, answer) = Program::connect(&at, token);
    assert_eq!(answer, None);
    assert_eq!([next.scene(), next.look(0.0)], [None, None]);
    done("again");
    let (code, text) = finish(child);
    assert_eq!(code, 0, "{text}");
    // The window is gone, and says so.
    assert!(next.0.read(&mut [0; 1]).is_ok_and(|n| n == 0));

    let middle = |shot: &str| {
        let image = image::open(path(shot)).unwrap_or_else(|e| panic!("{shot}: {e}")).to_rgb8();
        image.get_pixel(image.width() / 2, image.height() / 3).0[0]
    };
    assert!(middle("sent.png") > 100, "the triangle shines: {}", middle("sent.png"));
    assert!(middle("placed.png") < 30, "it is elsewhere: {}", middle("placed.png"));
    assert!(middle("looked.png") > 100, "and there it is seen: {}", middle("looked.png"));
    assert_eq!(middle("wrong.png"), middle("looked.png"), "a fault leaves what is shown");
    assert_eq!(middle("broken.png"), middle("looked.png"));
    assert!(middle("again.png") > 100, "another program begins anew: {}", middle("again.png"));
}

#[test]
fn a_port_that_is_taken_is_a_fault_with_a_remedy() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("--link={}", taken.local_addr().unwrap());
    let mut command = crate::support::command();
    let output = command.arg("view").arg("graphs/gi/direct.ron").arg(link).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("can't listen at 127.0.0.1:") && text.contains("help: "), "{text}");
}
