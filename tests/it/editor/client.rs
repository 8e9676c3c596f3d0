//! An editor without a screen: a real server process, spoken to over its streams.

use crate::support::command;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Longer than any answer takes on a machine that others use too.
const PATIENCE: Duration = Duration::from_secs(120);

pub struct Client {
    process: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    last: i64,
    versions: BTreeMap<PathBuf, i64>,
    /// The version that was last told of.
    told_of: BTreeMap<PathBuf, i64>,
    /// By file what the server last told of it.
    pub told: BTreeMap<PathBuf, Value>,
}

pub fn uri(path: &Path) -> String {
    format!("file://{}", path.display())
}

fn path_of(uri: &Value) -> PathBuf {
    PathBuf::from(uri.as_str().unwrap().strip_prefix("file://").unwrap())
}

impl Client {
    /// Starts a server for a folder of the editor, or for none.
    pub fn start(root: Option<&Path>, options: Value) -> Client {
        Client::of(command(), root, options)
    }

    /// As [`Client::start`], by a command that has an environment of its own.
    pub fn of(mut command: Command, root: Option<&Path>, options: Value) -> Client {
        let mut process = command
            .arg("lsp")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|e| panic!("can't start lightgraph: {e}"));
        let (to, stdout) = (process.stdin.take().unwrap(), process.stdout.take().unwrap());
        let (send, from) = channel();
        std::thread::spawn(move || {
            let mut stdout = BufReader::new(stdout);
            while let Some(message) = read(&mut stdout) {
                if send.send(message).is_err() {
                    return;
                }
            }
        });
        let mut client = Client {
            process,
            to,
            from,
            last: 0,
            versions: BTreeMap::new(),
            told_of: BTreeMap::new(),
            told: BTreeMap::new(),
        };
        let capabilities = json!({"general": {"positionEncodings": ["utf-16"]}});
        client.request(
            "initialize",
            json!({"processId": null, "rootUri": root.map(uri), "capabilities": capabilities, "initializationOptions": options}),
        );
        client.notify("initialized", json!({}));
        client
    }

    fn write(&mut self, message: &Value) {
        let text = message.to_string();
        write!(self.to, "Content-Length: {}\r\n\r\n{text}", text.len())
            .unwrap_or_else(|e| panic!("the server is gone: {e}"));
        self.to.flush().unwrap();
    }

    /// The next message, after notes are taken of diagnostics.
    fn next(&mut self) -> Value {
        let message = self.from.recv_timeout(PATIENCE).unwrap_or_else(|e| panic!("the server says nothing: {e}"));
        if message["method"] == "textDocument/publishDiagnostics" {
            let params = &message["params"];
            let path = path_of(&params["uri"]);
            self.told_of.extend(params["version"].as_i64().map(|version| (path.clone(), version)));
            self.told.insert(path, params["diagnostics"].clone());
        }
        message
    }

    pub fn notify(&mut self, method: &str, params: Value) {
        self.write(&json!({"jsonrpc": "2.0", "method": method, "params": params}));
    }

    /// The whole answer, be it a result or an error.
    pub fn ask(&mut self, method: &str, params: Value) -> Value {
        self.last += 1;
        let id = self.last;
        self.write(&json!({"jsonrpc": "2.0", "id": id, "method": method, "params": params}));
        loop {
            let message = self.next();
            if message["id"] == id && message.get("method").is_none() {
                return message;
            }
        }
    }

    pub fn request(&mut self, method: &str, params: Value) -> Value {
        let answer = self.ask(method, params);
        assert!(answer.get("error").is_none(), "{method}: {answer}");
        answer["result"].clone()
    }

    pub fn open(&mut self, path: &Path, text: &str) {
        self.versions.insert(path.into(), 1);
        self.told_of.remove(path);
        let language = path.extension().unwrap().to_string_lossy();
        let document = json!({"uri": uri(path), "languageId": language, "version": 1, "text": text});
        self.notify("textDocument/didOpen", json!({"textDocument": document}));
    }

    pub fn close(&mut self, path: &Path) {
        self.versions.remove(path);
        self.notify("textDocument/didClose", json!({"textDocument": {"uri": uri(path)}}));
    }

    /// Tells of edits: `(range or null, text)`.
    pub fn edit(&mut self, path: &Path, changes: Value) {
        let version = self.versions.get_mut(path).unwrap();
        *version += 1;
        let document = json!({"uri": uri(path), "version": *version});
        self.notify("textDocument/didChange", json!({"textDocument": document, "contentChanges": changes}));
    }

    pub fn replace(&mut self, path: &Path, text: &str) {
        self.edit(path, json!([{"text": text}]));
    }

    /// Waits until the server has told of the last version of a document; how long that took.
    pub fn checked(&mut self, path: &Path) -> Duration {
        let start = Instant::now();
        while self.told_of.get(path) != self.versions.get(path) {
            self.next();
        }
        start.elapsed()
    }

    /// Waits until what the server has told is so.
    pub fn until(&mut self, mut so: impl FnMut(&Client) -> bool) {
        while !so(self) {
            self.next();
        }
    }

    /// The parameters of requests about a place, given by the text before and behind it: `§` marks the cursor.
    pub fn at(path: &Path, text: &str, mark: &str) -> Value {
        let wanted = mark.replace('§', "");
        let found = text.find(&wanted).unwrap_or_else(|| panic!("no `{wanted}` in {}", path.display()));
        let byte = found + mark.find('§').unwrap();
        json!({"textDocument": {"uri": uri(path)}, "position": place(text, byte)})
    }

    /// Kilobytes that the server has in memory.
    pub fn memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.process.id())).ok()?;
        let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
        line.split_whitespace().next()?.parse().ok()
    }

    /// Says goodbye; the server ends without a fault.
    pub fn stop(mut self) {
        self.request("shutdown", Value::Null);
        self.notify("exit", Value::Null);
        let status = self.process.wait().unwrap();
        assert!(status.success(), "{status}");
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Line and column in units of UTF-16.
pub fn place(text: &str, byte: usize) -> Value {
    let before = &text[..byte];
    let line = before.matches('\n').count();
    let column: usize = before.rsplit('\n').next().unwrap().chars().map(char::len_utf16).sum();
    json!({"line": line, "character": column})
}

fn read(from: &mut impl BufRead) -> Option<Value> {
    let mut length = 0;
    loop {
        let mut line = String::new();
        if from.read_line(&mut line).ok()? == 0 {
            return None;
        }
        match line.trim().split_once(": ") {
            Some((name, value)) if name.eq_ignore_ascii_case("content-length") => length = value.parse().ok()?,
            Some(_) => {}
            None => break,
        }
    }
    let mut body = vec![0; length];
    from.read_exact(&mut body).ok()?;
    serde_json::from_slice(&body).ok()
}
