//! Conversations on a tape, then over sockets. Every one ends, whatever is said.

use super::follow::Follower;
use super::message::{BODY, HEADER, HELLO, Transport, frame, welcome};
use super::{Link, Linked, STRANGERS};
use glam::Vec3;
use lightgraph::internals::diag::render;
use serde_json::{Value, json};
use std::io::{self, Cursor, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::mpsc::channel;
use std::time::Duration;

const TOKEN: &str = "0123456789abcdef0123456789abcdef";

/// A triangle with a node of a name, one metre wide.
const TRIANGLE: &str = r#"{
"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
"nodes": [{"name": "Triangle", "mesh": 0}],
"materials": [{"emissiveFactor": [1, 1, 1]}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
    "min": [-0.5, -0.5, 0], "max": [0.5, 0.5, 0]}],
"bufferViews": [{"buffer": 0, "byteLength": 36}],
"buffers": [{"byteLength": 36,
    "uri": "data:application/octet-stream;base64,AAAAvwAAAL8AAAAAAAAAPwAAAL8AAAAAAAAAAAAAAD8AAAAA"}]
}"#;

/// What one side says, and what it is answered.
struct Tape {
    said: Cursor<Vec<u8>>,
    answers: Vec<u8>,
}

impl Tape {
    fn new(said: Vec<u8>) -> Tape {
        Tape { said: Cursor::new(said), answers: vec![] }
    }

    fn faults(self) -> Vec<Option<String>> {
        let mut answers = Tape::new(self.answers);
        let mut faults = vec![];
        while let Ok(Some((header, _))) = frame(&mut answers) {
            let answer: Value = serde_json::from_slice(&header).unwrap();
            faults.push(answer["fault"].as_str().map(String::from));
        }
        faults
    }
}

impl Read for Tape {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.said.read(buffer)
    }
}

impl Write for Tape {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.answers.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Transport for Tape {
    fn limit(&mut self, _: Option<Duration>) {}
}

/// The bytes of a message.
fn message(header: &Value, body: &[u8]) -> Vec<u8> {
    raw(header.to_string().as_bytes(), body)
}

fn raw(header: &[u8], body: &[u8]) -> Vec<u8> {
    let lengths = [header.len(), body.len()].map(|n| u32::try_from(n).unwrap().to_le_bytes());
    [&lengths[0][..], &lengths[1], header, body].concat()
}

fn hello(token: &str) -> Vec<u8> {
    message(&json!({"hello": {"version": 1, "token": token, "program": "a test"}}), b"")
}

fn scene() -> Vec<u8> {
    message(&json!({"scene": {"name": "sent", "radiance": [0.1, 0.2, 0.3]}}), TRIANGLE.as_bytes())
}

fn place(name: &str, diagonal: [f32; 3], at: [f32; 3]) -> Vec<u8> {
    let ([a, b, c], [x, y, z]) = (diagonal, at);
    let matrix = [a, 0.0, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, 0.0, c, 0.0, x, y, z, 1.0];
    let body: Vec<u8> = matrix.iter().flat_map(|x: &f32| x.to_le_bytes()).collect();
    message(&json!({"place": {"nodes": [name]}}), &body)
}

fn camera(eye: [f32; 3]) -> Vec<u8> {
    message(&json!({"camera": {"eye": eye, "target": [0, 0, 0], "fov": 40}}), b"")
}

/// What there is to show in the end, and the answers; the first message is not among what is said.
fn followed(said: &[Vec<u8>]) -> (Linked, Vec<Option<String>>) {
    let mut last = Linked::default();
    let mut tape = Tape::new(said.concat());
    let start = Linked { connection: 1, program: Some("a test".into()), ..Linked::default() };
    Follower::new(start).follow(&mut tape, |linked| {
        last = linked.clone();
        true
    });
    (last, tape.faults())
}

#[test]
fn a_scene_its_places_and_its_view_are_followed() {
    let said =
        [camera([0.0, 0.0, 3.0]), scene(), place("Triangle", [1.0; 3], [0.0, 2.0, 0.0]), camera([0.0, 0.0, 5.0])];
    let (before, _) = followed(&said[..2]);
    assert_eq!(before.view.unwrap().place.position, Vec3::new(0.0, 0.0, 3.0), "a camera may come before its scene");
    let (last, answers) = followed(&said);
    assert_eq!(answers, vec![None; 4]);
    assert_eq!(last.places[&0].w_axis.truncate(), Vec3::new(0.0, 2.0, 0.0));
    assert_eq!(last.view.unwrap().place.position, Vec3::new(0.0, 0.0, 5.0));
    let shown = last.scene.unwrap();
    assert_eq!((shown.name.as_str(), shown.nodes[0].name.as_str()), ("sent", "Triangle"));
    assert!(shown.environment.is_some() && last.program.is_none());
    // Another scene is where it says.
    let (last, _) = followed(&[scene(), place("Triangle", [1.0; 3], [0.0, 2.0, 0.0]), scene()]);
    assert!(last.places.is_empty());
}

#[test]
fn a_panorama_comes_behind_the_scene() {
    let header = json!({"scene": {"name": "sent", "panorama": [2, 1]}});
    let pixels: Vec<u8> = [1.0_f32; 6].iter().flat_map(|x| x.to_le_bytes()).collect();
    let body = [TRIANGLE.as_bytes(), &pixels].concat();
    let (last, answers) = followed(&[message(&header, &body)]);
    assert_eq!(answers, [None]);
    assert!(last.scene.unwrap().environment.is_some());
    for (size, pixels, words) in [
        ([2, 2], 4, "twice as wide"),
        ([2, 1], 4, "not valid glTF JSON"),
        ([u32::MAX, u32::MAX], 4, "is more than the"),
        ([0, 0], 0, "0 × 0 pixels"),
    ] {
        let header = json!({"scene": {"name": "sent", "panorama": size}});
        let body = [TRIANGLE.as_bytes(), &vec![0; 12 * pixels]].concat();
        let text = followed(&[message(&header, &body)]).1[0].clone().unwrap();
        assert!(text.contains(words), "{size:?}: {text}");
    }
}

#[test]
fn what_can_t_be_followed_changes_nothing_and_says_why() {
    let good = [scene(), place("Triangle", [1.0; 3], [0.0, 2.0, 0.0]), camera([0.0, 0.0, 3.0])];
    let (expected, _) = followed(&good);
    let cases = [
        (place("Triangel", [1.0; 3], [0.0; 3]), vec!["no node \"Triangel\"", "did you mean `Triangle`?"]),
        (place("Triangle", [-1.0, 1.0, 1.0], [0.0; 3]), vec!["mirrors it"]),
        (place("Triangle", [f32::NAN; 3], [0.0; 3]), vec!["can't be placed", "finite"]),
        (
            message(&json!({"place": {"nodes": ["Triangle"]}}), &[0; 60]),
            vec!["1 nodes are placed by 60 bytes", "16 f32"],
        ),
        (camera([0.0; 3]), vec!["can't look at"]),
        (message(&json!({"camera": {"eye": [0, 0, 1], "target": [0, 0, 0], "fov": 400}}), b""), vec!["extent of 400"]),
        (message(&json!({"camera": {"eye": [0, 0, 1], "target": [0, 0, 0], "far": 1e300}}), b""), vec!["camera"]),
        (message(&json!({"camera": {"eye": [0, 0, 1]}}), b""), vec!["missing field `target`", "column"]),
        (message(&json!({"camera": {"eye": [0, 0, 1], "target": [0, 0, 0]}}), b"x"), vec!["1 bytes behind it"]),
        (message(&json!({"scene": {"name": "sent"}}), b"glTF"), vec!["sent: "]),
        (message(&json!({"scene": {"name": "sent", "radiance": [-1, 0, 0]}}), TRIANGLE.as_bytes()), vec!["negative"]),
        (
            message(&json!({"scene": {"name": "sent"}}), TRIANGLE.replace("\"count\": 3", "\"count\": 9").as_bytes()),
            vec!["sent: meshes[0]", "accessor 0 of 9 elements"],
        ),
        (message(&json!({"sceene": {}}), b""), vec!["`sceene`", "line 1 column", "`place`"]),
        (raw(b"{", b""), vec!["EOF", "line 1 column 1"]),
        (hello(TOKEN), vec!["said once"]),
    ];
    for (bad, words) in cases {
        let (last, answers) = followed(&[good.concat(), bad.clone(), camera([0.0, 0.0, 3.0])]);
        let [None, None, None, Some(text), None] = &answers[..] else { panic!("{words:?}: {answers:?}") };
        for word in words {
            assert!(text.contains(word), "no {word:?} in {text}");
        }
        assert_eq!((&last.places, last.view), (&expected.places, expected.view), "{text}");
        // It stands in the window until something follows.
        let mut shown = vec![];
        let mut tape = Tape::new([good.concat(), bad].concat());
        Follower::new(Linked::default()).follow(&mut tape, |linked| {
            shown.push(render(&linked.faults).trim_end().to_string());
            true
        });
        assert_eq!(&shown[3], text);
    }
    let (_, answers) = followed(&[place("Triangle", [1.0; 3], [0.0; 3])]);
    assert!(answers[0].as_ref().unwrap().contains("before a `scene`"));
}

#[test]
fn lengths_are_bounded_before_anything_is_read() {
    let lengths = |header: u64, body: u64| {
        let both = [header, body].map(|n| u32::try_from(n).unwrap().to_le_bytes());
        both.concat()
    };
    for (said, words) in [
        (lengths(HEADER + 1, 0), "the header of a message has 4194305 bytes"),
        (lengths(2, BODY + 1), "the body of a message has 1073741825 bytes"),
        (lengths(2, BODY), "beyond its header: it was cut off"),
        ([lengths(2, BODY), b"{}".to_vec()].concat(), "beyond its body: it was cut off"),
        (b"GET ".to_vec(), "beyond its lengths: it was cut off"),
    ] {
        let (last, answers) = followed(&[scene(), said]);
        assert_eq!(answers.len(), 2, "the connection ends");
        assert!(answers[1].as_ref().unwrap().contains(words), "{words}: {answers:?}");
        assert!(render(&last.faults).contains(words) && last.scene.is_some(), "the window says so, too");
    }
}

#[test]
fn only_the_token_opens() {
    let told = |said: Vec<u8>| {
        let mut tape = Tape::new(said);
        let program = welcome(&mut tape, TOKEN);
        (program, tape.faults().pop().flatten().unwrap_or_default())
    };
    assert_eq!(told(hello(TOKEN)), (Some("a test".into()), String::new()));
    let (last, longer) = (format!("{}e", &TOKEN[..31]), format!("{TOKEN}0"));
    for token in ["", "0", &TOKEN[..31], &last, &longer, &TOKEN.to_uppercase()] {
        let (program, fault) = told(hello(token));
        assert!(program.is_none() && fault.contains("the token is not this window's"), "{token}: {fault}");
    }
    let other = message(&json!({"hello": {"version": 2, "token": TOKEN, "program": "a test"}}), b"");
    let long = message(&json!({"hello": {"version": 1, "token": TOKEN, "program": "a".repeat(5000)}}), b"");
    for (said, words) in [
        (other, "version 2 is spoken"),
        (long, "it may have 4096"),
        (scene(), "the body of a message has"),
        (camera([0.0, 0.0, 1.0]), "is no `hello`"),
        (b"GET / HTTP/1.1\r\n\r\n".to_vec(), "bytes"),
        (vec![], "cut off"),
    ] {
        let (program, fault) = told(said);
        assert!(program.is_none() && fault.contains(words), "{words}: {fault}");
    }
    const { assert!(HELLO < HEADER) };
}

/// A linear congruential generator (Knuth's MMIX constants): the same choices on every machine.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n.max(1)
    }

    /// Changes, removes, adds or repeats some bytes.
    fn spoil(&mut self, bytes: &mut Vec<u8>) {
        for _ in 0..=self.below(4) {
            let (at, length) = (self.below(bytes.len()), self.below(9));
            let end = (at + length).min(bytes.len());
            match self.below(5) {
                0 if at < bytes.len() => bytes[at] ^= 1 << self.below(8),
                1 => drop(bytes.drain(at..end)),
                2 => bytes.insert(at, self.below(256) as u8),
                3 => {
                    let again = bytes[at..end].to_vec();
                    bytes.splice(at..at, again);
                }
                _ => bytes.truncate(end),
            }
        }
    }
}

#[test]
fn a_hundred_thousand_spoilt_messages_end_without_a_panic() {
    let mut random = Random(35);
    let headers = [
        json!({"scene": {"name": "sent", "radiance": [0.1, 0.2, 0.3]}}),
        json!({"scene": {"name": "sent", "panorama": [2, 1]}}),
        json!({"place": {"nodes": ["Triangle"]}}),
        json!({"camera": {"eye": [0, 1, 4], "target": [0, 1, 0], "up": [0, 1, 0], "fov": 50, "near": 0.1, "far": 9}}),
    ];
    let (mut followed_on, mut refused) = (0, 0);
    for round in 0..100_000 {
        let mut said = scene();
        let header = &headers[random.below(headers.len())];
        let mut body = if header.get("scene").is_some() { TRIANGLE.as_bytes().to_vec() } else { vec![0; 64] };
        let mut text = header.to_string().into_bytes();
        match round % 3 {
            // What is spoilt is within the frame, or is the frame.
            0 => random.spoil(&mut text),
            1 => random.spoil(&mut body),
            _ => {}
        }
        let mut bad = raw(&text, &body);
        if round % 3 == 2 {
            random.spoil(&mut bad);
        }
        said.extend(bad);
        said.extend(camera([0.0, 0.0, 3.0]));
        // The scene is the same each time: it is read once in eight rounds.
        let said = if round % 8 == 0 { said } else { said.split_off(scene().len()) };
        let (_, answers) = followed(&[said]);
        refused += usize::from(answers.iter().any(Option::is_some));
        followed_on += usize::from(answers.last().is_some_and(Option::is_none));
        let mut tape = Tape::new({
            let mut first = hello(TOKEN);
            random.spoil(&mut first);
            first
        });
        welcome(&mut tape, TOKEN);
    }
    assert!(refused > 50_000 && followed_on > 50_000, "{refused} were refused, {followed_on} went on");
}

/// A client of a real link.
struct Client(TcpStream);

impl Client {
    fn new(at: SocketAddr, said: &[u8]) -> Client {
        let stream = TcpStream::connect(at).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let mut client = Client(stream);
        client.0.write_all(said).unwrap();
        client
    }

    fn answer(&mut self) -> io::Result<Option<String>> {
        let mut lengths = [0; 8];
        self.0.read_exact(&mut lengths)?;
        let mut header = vec![0; u32::from_le_bytes(lengths[..4].try_into().unwrap()) as usize];
        self.0.read_exact(&mut header)?;
        let answer: Value = serde_json::from_slice(&header).unwrap();
        Ok(answer["fault"].as_str().map(String::from))
    }
}

#[test]
fn one_program_at_a_time_is_followed_and_no_stranger_keeps_it_out() {
    let link = Link::bind("127.0.0.1:0".parse().unwrap()).unwrap_or_else(|f| panic!("{f}"));
    let (_, rest) = link.text().split_once("lightgraph://").unwrap();
    let (at, token) = rest.split_once('/').unwrap();
    let at: SocketAddr = at.parse().unwrap();
    assert!(at.ip().is_loopback() && token.len() == 32, "{}", link.text());
    let other = Link::bind("127.0.0.1:0".parse().unwrap()).unwrap_or_else(|f| panic!("{f}"));
    assert!(!other.text().ends_with(token), "each window has a token of its own");
    let taken = Link::bind(at).unwrap_err().to_string();
    assert!(taken.contains("can't listen at") && taken.contains("help: "), "{taken}");

    let (tell, hear) = channel();
    let wake = move || {
        // Nobody listens when the test has ended.
        let _ = tell.send(());
    };
    link.start(wake).unwrap_or_else(|f| panic!("{f}"));
    // Some say nothing, and one says half: the oldest gives way to who comes.
    let mut half = Client::new(at, &hello(token)[..20]);
    let _silent: Vec<TcpStream> = (1..STRANGERS).map(|_| TcpStream::connect(at).unwrap()).collect();
    let mut first = Client::new(at, &hello(token));
    assert_eq!(first.answer().unwrap(), None);
    half.0.set_read_timeout(Some(Duration::from_secs(2))).unwrap();
    let ended = half.answer().unwrap_err().kind();
    assert!(!matches!(ended, io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut), "it is let go at once");
    assert!(Client::new(at, &hello("wrong")).answer().unwrap().unwrap().contains("token"));
    first.0.write_all(&scene()).unwrap();
    assert_eq!(first.answer().unwrap(), None);
    hear.recv_timeout(Duration::from_secs(20)).unwrap();
    assert!(link.now().scene.is_some());
    assert_eq!(link.now().program.as_deref(), Some("a test"));
    // A half message of one that is followed changes nothing.
    first.0.write_all(&scene()[..100]).unwrap();

    let mut second = Client::new(at, &hello(token));
    assert_eq!(second.answer().unwrap(), None);
    assert!(first.answer().is_err(), "the one before is let go");
    assert_eq!((link.now().connection, link.now().scene.is_some()), (2, false));
    second.0.write_all(&[scene(), vec![0xff; 64]].concat()).unwrap();
    assert_eq!(second.answer().unwrap(), None);
    assert!(second.answer().unwrap().unwrap().contains("has 4294967295 bytes"));
    assert!(second.answer().is_err());
    let now = link.now();
    assert!(now.scene.is_some() && now.program.is_none(), "what was shown stays");
}
