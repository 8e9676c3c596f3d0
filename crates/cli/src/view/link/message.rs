//! The wire: frames of a header (JSON) and a body (bytes), each answered by one with a header alone.
//!
//! ```text
//! u32 bytes of the header, u32 bytes of the body (both little-endian), header, body
//!
//! {"hello": {"version": 1, "token": "…", "program": "Blender 5.0.1"}}
//! {"scene": {"name": "Blender", "radiance": [0.1, 0.1, 0.1]}}     the bytes of a GLB
//! {"scene": {"name": "Blender", "panorama": [1024, 512]}}         these, then three f32 a pixel
//! {"place": {"nodes": ["Cube", "Lamp"]}}                          16 f32 a node, column by column
//! {"camera": {"eye": [0, 1, 4], "target": [0, 1, 0], "fov": 50}}
//! ```
//!
//! The answer is `{"fault": null}`, or why nothing was changed, with its place.

use lightgraph::Diagnostic;
use lightgraph::internals::{diag::render, files};
use serde::Deserialize;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// Bytes of a header at most: as of other texts.
pub const HEADER: u64 = files::TEXT;

/// Bytes of a body at most.
pub const BODY: u64 = 1 << 30;

/// Bytes of the first header at most: anybody may send one.
pub const HELLO: u64 = 4096;

/// What both sides speak.
const VERSION: u32 = 1;

/// How long the first message may take.
const GREETING: Duration = Duration::from_secs(5);

/// How long a message may take from its first byte to its last, and its answer.
const MESSAGE: Duration = Duration::from_secs(60);

/// How long the other side may go on after the last answer.
const GOODBYE: Duration = Duration::from_secs(1);

/// Read at once: memory follows what has come, not what was announced.
const CHUNK: usize = 1 << 20;

/// What a program says.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum LinkMessage {
    Hello(Hello),
    /// Another scene in place of the one before.
    Scene(SceneHead),
    /// Nodes of the scene are elsewhere.
    Place {
        nodes: Vec<String>,
    },
    Camera(LinkCamera),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hello {
    version: u32,
    token: String,
    program: String,
}

/// What stands before the bytes of a scene.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneHead {
    pub name: String,
    /// From all around, where there is no panorama.
    #[serde(default)]
    pub radiance: Option<[f32; 3]>,
    /// Width and height: three f32 a pixel, row 0 above, its middle towards −Z.
    #[serde(default)]
    pub panorama: Option<[u32; 2]>,
}

/// As Python's `lightgraph.Camera`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkCamera {
    pub eye: [f32; 3],
    pub target: [f32; 3],
    #[serde(default = "upwards")]
    pub up: [f32; 3],
    #[serde(default = "usual_angle")]
    pub fov: f32,
    #[serde(default)]
    pub height: Option<f32>,
    #[serde(default)]
    pub near: Option<f32>,
    #[serde(default)]
    pub far: Option<f32>,
    #[serde(default)]
    pub shift: [f32; 2],
}

fn upwards() -> [f32; 3] {
    [0.0, 1.0, 0.0]
}

fn usual_angle() -> f32 {
    50.0
}

/// Bytes in both directions, within a time.
pub trait Transport: Read + Write {
    /// What is read and written from now on is over by then; without a limit it is waited for.
    fn limit(&mut self, time: Option<Duration>);
}

/// A connection whose reads and writes end in time.
pub struct TimedStream {
    stream: TcpStream,
    until: Option<Instant>,
}

impl TimedStream {
    pub fn new(stream: TcpStream) -> io::Result<TimedStream> {
        // Answers are small, and waited for.
        stream.set_nodelay(true)?;
        Ok(TimedStream { stream, until: None })
    }

    /// Ends the connection. What the other side still sends is thrown away for a moment, so that it can read the last
    /// answer.
    pub fn end(mut self) {
        // It may be gone already.
        let _ = self.stream.shutdown(Shutdown::Write);
        self.limit(Some(GOODBYE));
        while self.read(&mut [0; 4096]).is_ok_and(|n| n > 0) {}
        let _ = self.stream.shutdown(Shutdown::Both);
    }

    fn left(&self) -> io::Result<Option<Duration>> {
        let left = self.until.map(|until| until.saturating_duration_since(Instant::now()));
        if left == Some(Duration::ZERO) { Err(ErrorKind::TimedOut.into()) } else { Ok(left) }
    }
}

impl Transport for TimedStream {
    fn limit(&mut self, time: Option<Duration>) {
        self.until = time.map(|time| Instant::now() + time);
    }
}

impl Read for TimedStream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(self.left()?)?;
        self.stream.read(buffer)
    }
}

impl Write for TimedStream {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.stream.set_write_timeout(self.left()?)?;
        self.stream.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// A header and a body.
pub type LinkFrame = (Vec<u8>, Vec<u8>);

/// Waits for a frame; `None` where the other side has ended in good order.
///
/// # Errors
/// What is no frame within these bounds, cut off or too slow: nothing after it can be read.
pub fn frame(wire: &mut impl Transport) -> Result<Option<LinkFrame>, Diagnostic> {
    wire.limit(None);
    let mut lengths = [0_u8; 8];
    // Between messages there is no limit: nothing may be changed for hours.
    let first = loop {
        match wire.read(&mut lengths) {
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            // A program that ends without a good-bye.
            Err(_) => return Ok(None),
            Ok(n) => break n,
        }
    };
    if first == 0 {
        return Ok(None);
    }
    wire.limit(Some(MESSAGE));
    bounded(wire, lengths, first, HEADER, BODY).map(Some)
}

/// The rest of a frame of whose lengths so many bytes are there.
fn bounded(
    wire: &mut impl Transport,
    mut lengths: [u8; 8],
    there: usize,
    header: u64,
    body: u64,
) -> Result<LinkFrame, Diagnostic> {
    wire.read_exact(&mut lengths[there..]).map_err(|e| broken("its lengths", &e))?;
    let [a, b, c, d, e, f, g, h] = lengths;
    let given = [u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])].map(u64::from);
    for (part, given, most) in [("header", given[0], header), ("body", given[1], body)] {
        if given > most {
            let d = Diagnostic::error(format!("link: the {part} of a message has {given} bytes"));
            return Err(d.help(format!("it may have {most}")));
        }
    }
    Ok((taken(wire, given[0], "its header")?, taken(wire, given[1], "its body")?))
}

fn taken(wire: &mut impl Transport, count: u64, part: &str) -> Result<Vec<u8>, Diagnostic> {
    let mut bytes = vec![];
    let mut left = usize::try_from(count).unwrap_or(usize::MAX);
    while left > 0 {
        let next = left.min(CHUNK);
        let there = bytes.len();
        let full = |e| Diagnostic::error(format!("link: there is no memory for a message of {count} bytes: {e}"));
        bytes.try_reserve(next).map_err(full)?;
        bytes.resize(there + next, 0);
        wire.read_exact(&mut bytes[there..]).map_err(|e| broken(part, &e))?;
        left -= next;
    }
    Ok(bytes)
}

fn broken(part: &str, e: &io::Error) -> Diagnostic {
    let why = match e.kind() {
        ErrorKind::UnexpectedEof => "it was cut off".into(),
        ErrorKind::TimedOut | ErrorKind::WouldBlock => "it took too long".into(),
        _ => e.to_string(),
    };
    Diagnostic::error(format!("link: a message can't be read beyond {part}: {why}"))
}

/// What a header says.
///
/// # Errors
/// It is no message, with the place in the header.
pub fn parsed(header: &[u8]) -> Result<LinkMessage, Diagnostic> {
    serde_json::from_slice(header).map_err(|e| {
        let d = Diagnostic::error(format!("link: the header of a message: {e}"));
        d.help("`hello`, `scene`, `place` and `camera` are messages")
    })
}

/// Answers a message.
pub fn answer(wire: &mut impl Transport, fault: Option<&str>) -> io::Result<()> {
    let header = serde_json::json!({ "fault": fault }).to_string();
    let length = u32::try_from(header.len()).map_err(io::Error::other)?;
    let mut all = Vec::with_capacity(header.len() + 8);
    all.extend(length.to_le_bytes());
    all.extend(0_u32.to_le_bytes());
    all.extend(header.as_bytes());
    wire.limit(Some(MESSAGE));
    wire.write_all(&all)
}

/// Takes the first message and answers it. The program's name, if it has shown the token.
pub fn welcome(wire: &mut impl Transport, token: &str) -> Option<String> {
    wire.limit(Some(GREETING));
    let first = bounded(wire, [0; 8], 0, HELLO, 0);
    let said = first.and_then(|(header, _)| match parsed(&header)? {
        LinkMessage::Hello(hello) => greeted(hello, token),
        _ => Err(Diagnostic::error("link: the first message is no `hello`")),
    });
    let fault = said.as_ref().err().map(|d| render(std::slice::from_ref(d)));
    answer(wire, fault.as_deref().map(str::trim_end)).ok().and(said.ok())
}

fn greeted(hello: Hello, token: &str) -> Result<String, Diagnostic> {
    if !equal(hello.token.as_bytes(), token.as_bytes()) {
        let d = Diagnostic::error("link: the token is not this window's");
        return Err(d.help("copy the whole link that `lightgraph view --link` has printed"));
    }
    if hello.version != VERSION {
        let d = Diagnostic::error(format!("link: version {} is spoken; this is {VERSION}", hello.version));
        return Err(d.help("use the add-on that comes with this lightgraph"));
    }
    Ok(hello.program)
}

/// Whether two texts are the same, in a time that tells nothing of where they differ.
fn equal(a: &[u8], b: &[u8]) -> bool {
    let differ = a.iter().zip(b).fold(0, |differ, (a, b)| std::hint::black_box(differ | (a ^ b)));
    a.len() == b.len() && differ == 0
}
