//! The window, on a virtual display.

mod link;
mod view;

use crate::support::ended;
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A display without a screen, ended with the test.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn start() -> Display {
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x1024x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut server = server.unwrap_or_else(|e| {
            panic!("can't start the virtual display Xvfb ({e}): on Debian and Ubuntu `apt install xvfb`");
        });
        let mut number = String::new();
        let out = server.stdout.take().unwrap();
        BufReader::new(out).read_line(&mut number).unwrap();
        assert!(!number.trim().is_empty(), "Xvfb names no display");
        Display { server, name: format!(":{}", number.trim()) }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Longer than a window takes on a busy machine with a software driver.
const PATIENCE: Duration = Duration::from_secs(600);

/// Waits for the command; its exit code and what it said.
fn finish(mut child: Child) -> (i32, String) {
    let status = ended(&mut child, PATIENCE);
    let mut text = String::new();
    child.stdout.take().unwrap().read_to_string(&mut text).unwrap();
    child.stderr.take().unwrap().read_to_string(&mut text).unwrap();
    (status.and_then(|s| s.code()).unwrap_or(-1), text)
}
