//! What passes took last and why they ran, from a window or a `watch` that shows a graph: a file in the user's cache,
//! which editors show beside the passes.

use lightgraph::internals::caches;
use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, SystemTime};

/// How often a run is looked for that has left one.
const EACH: Duration = Duration::from_secs(1);
/// A status of more bytes is none.
const MOST_BYTES: u64 = 1 << 20;
/// What was noted longer ago is of no run that goes on.
const OLDEST: Duration = Duration::from_secs(24 * 3600);

/// The last frame of a graph.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// The graph's whole path.
    pub graph: PathBuf,
    pub passes: Vec<PassStatus>,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PassStatus {
    /// As the plan calls it.
    pub name: String,
    /// On the device, in the last frame in which it ran.
    pub ms: Option<f64>,
    /// It ran in the last frame.
    pub ran: bool,
    /// Why it ran, or did not.
    pub why: String,
}

impl Status {
    pub fn new(graph: &Path, passes: impl IntoIterator<Item = PassStatus>) -> Status {
        Status { graph: whole(graph), passes: passes.into_iter().collect() }
    }

    /// Leaves the status for editors.
    ///
    /// # Errors
    /// The system names no cache, or the file can't be written.
    pub fn write(&self) -> io::Result<()> {
        let folder = folder().ok_or(io::ErrorKind::NotFound)?;
        caches::write(&folder.join(name(&self.graph)), &serde_json::to_vec(self)?)
    }

    /// The status of a graph; `None` where nothing has shown it of late.
    pub fn read(graph: &Path) -> Option<Status> {
        let graph = whole(graph);
        let file = folder()?.join(name(&graph));
        let noted = std::fs::metadata(&file).and_then(|m| m.modified()).ok()?;
        if SystemTime::now().duration_since(noted).is_ok_and(|age| age > OLDEST) {
            return None;
        }
        let status: Status = serde_json::from_slice(&caches::read(&file, MOST_BYTES)?).ok()?;
        // Two paths may have one hash.
        (status.graph == graph).then_some(status)
    }

    /// What there is to say of a pass, or of the passes of a sub-graph that is used under this name.
    pub fn words(&self, pass: &str) -> Option<String> {
        let inside =
            |p: &&PassStatus| p.name == pass || p.name.strip_prefix(pass).is_some_and(|rest| rest.starts_with('.'));
        let found: Vec<&PassStatus> = self.passes.iter().filter(inside).collect();
        let first = found.first()?;
        let known: Vec<f64> = found.iter().filter_map(|p| p.ms).collect();
        let time = if known.is_empty() { String::new() } else { format!("{:.3} ms · ", known.iter().sum::<f64>()) };
        let cause = found.iter().find(|p| p.ran).unwrap_or(first);
        let done = if cause.ran { "ran" } else { "skipped" };
        Some(format!("{time}{done}: {}", cause.why))
    }
}

/// Calls `tell` with a number after each time that a run leaves a status, until it returns false or the other end of
/// the channel is dropped.
pub fn follow(ended: &Receiver<()>, mut tell: impl FnMut(u32) -> bool) {
    let stamp = || std::fs::metadata(folder()?).and_then(|m| m.modified()).ok();
    let (mut last, mut turn) = (stamp(), 0);
    while ended.recv_timeout(EACH) == Err(RecvTimeoutError::Timeout) {
        let now = stamp();
        if now != last {
            turn += 1;
            if !tell(turn) {
                return;
            }
        }
        last = now;
    }
}

fn folder() -> Option<PathBuf> {
    Some(caches::folder()?.join("shown"))
}

fn whole(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

fn name(graph: &Path) -> String {
    let mut hasher = DefaultHasher::new();
    graph.hash(&mut hasher);
    format!("{:016x}.json", hasher.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_and_used_graphs_have_words() {
        let pass = |name: &str, ms, ran, why: &str| PassStatus { name: name.into(), ms, ran, why: why.into() };
        let passes = [
            pass("surface", Some(1.25), true, "changed: camera"),
            pass("shadow.maps", Some(0.5), false, "unchanged since frame 3"),
            pass("shadow.lights", Some(0.25), true, "changed: lights"),
            pass("shadows", None, false, "left out"),
        ];
        let status = Status::new(Path::new("/no/graph.ron"), passes);
        assert_eq!(status.words("surface").unwrap(), "1.250 ms · ran: changed: camera");
        assert_eq!(status.words("shadow").unwrap(), "0.750 ms · ran: changed: lights");
        assert_eq!(status.words("shadows").unwrap(), "skipped: left out");
        assert_eq!(status.words("other"), None);
    }
}
