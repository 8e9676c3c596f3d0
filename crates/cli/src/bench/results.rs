//! What a bench keeps: plain data, as JSON and as a flat table.

use super::host::{Host, Machine};
use super::jobs::Part;
use super::references::PublishedTime;
use super::score::Score;
use flate2::read::MultiGzDecoder;
use lightgraph::internals::files;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Checked, Diagnostic};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The first bytes of a gzip file (RFC 1952).
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// A whole bench.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Results {
    pub version: String,
    /// Of the working tree, as `git describe --always --dirty` names it; `None` outside of one.
    pub commit: Option<String>,
    /// That of most entries.
    pub machine: Machine,
    /// Timed frames in each phase at most.
    pub repeat: u32,
    /// Pixels.
    pub size: [u32; 2],
    /// The output whose errors a report shows first.
    pub main_output: Option<String>,
    /// Times of others to set ours beside.
    pub published: Vec<PublishedTime>,
    pub entries: Vec<Entry>,
    /// Other renderers that were asked for and gave nothing.
    pub absent: Vec<Absent>,
    /// Which jobs of the whole it holds; `None`: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<Part>,
}

/// A renderer that was asked for and is not there.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Absent {
    pub name: String,
    pub why: String,
}

/// One graph (or other renderer) on one scene at one setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The graph file without its ending, or the other renderer's name.
    pub graph: String,
    /// `Some(version)` for another renderer.
    pub peer: Option<String>,
    pub scene: String,
    /// `None`: the scene's own.
    pub camera: Option<String>,
    /// Pixels.
    pub size: [u32; 2],
    /// All parameters.
    pub params: BTreeMap<String, String>,
    /// Those that the sweep set, as `grid=4 face=8`; empty: the graph's own.
    pub setting: String,
    /// A hash of everything that was read: graph, shaders, scene, program version.
    pub inputs: String,
    /// Of textures and buffers, as allocated; 0 where unknown.
    pub bytes: u64,
    /// The same if nothing shared memory.
    pub bytes_without_sharing: u64,
    /// Milliseconds of each stage before the first frame.
    pub start_up_ms: BTreeMap<String, f64>,
    /// How often all of it was measured; the phases hold the frames of each time.
    #[serde(default = "once")]
    pub rounds: u32,
    pub phases: Vec<PhaseTimes>,
    /// Of the first frame.
    pub scores: Vec<Score>,
    /// Light that gets where none should, relative to where it should be; `None` for scenes that don't ask.
    pub leak: Option<f64>,
    /// A picture of `color`, relative to the results' folder.
    pub picture: Option<String>,
    /// Why there is nothing else.
    pub fault: Option<String>,
    /// Where it was measured; `None`: on the machine of the results.
    #[serde(default)]
    pub host: Option<Host>,
}

/// What changes from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// The first frame after preparation.
    First,
    /// Nothing moves.
    Still,
    Camera,
    Lights,
    Object,
    Everything,
    /// A renderer that knows no frames: all its work.
    Whole,
}

impl Phase {
    pub const ALL: [Phase; 7] =
        [Phase::First, Phase::Still, Phase::Camera, Phase::Lights, Phase::Object, Phase::Everything, Phase::Whole];

    /// Those in which something moves.
    pub const MOVING: [Phase; 4] = [Phase::Camera, Phase::Lights, Phase::Object, Phase::Everything];

    /// As files name it.
    pub fn word(self) -> &'static str {
        match self {
            Phase::First => "first",
            Phase::Still => "still",
            Phase::Camera => "camera",
            Phase::Lights => "lights",
            Phase::Object => "object",
            Phase::Everything => "everything",
            Phase::Whole => "whole",
        }
    }
}

/// The frames of a phase.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhaseTimes {
    pub phase: Phase,
    /// Timed frames.
    pub repeats: u32,
    /// From the call to the end of the device's work, in milliseconds.
    pub wall_ms: Spread,
    /// The same of each frame, in the order they were taken.
    #[serde(default)]
    pub frames_ms: Vec<f64>,
    /// Sum over the steps, in the round with the quickest frame; `None` where the adapter has no timestamps.
    pub gpu_ms: Option<Spread>,
    /// Steps that ran in the last frame, and those of the plan that did not.
    pub steps_run: u32,
    pub steps_skipped: u32,
    /// What set them off: all that differs from the frame before, besides results of other steps.
    #[serde(default)]
    pub causes: Vec<String>,
    /// Iterations of each loop in the last frame.
    pub iterations: BTreeMap<String, u32>,
    /// Pass by pass, in the order of their first run, in the round with the quickest frame.
    pub passes: Vec<PassTime>,
    /// Root mean square change of `color` from the frame at rest to the first that moved, in percent of the mean.
    pub change_percent: Option<f64>,
    /// For graphs that keep something from frame to frame: of the last still frame, or of a frame at rest right after
    /// one that moved. Empty: those of the first frame, since every frame begins anew.
    #[serde(default)]
    pub scores: Vec<Score>,
}

impl PhaseTimes {
    /// Milliseconds that a quarter of the frames keep below. What else the machine does adds to a time, and now and
    /// then a device finds a higher clock: neither the mean frame nor the quickest says best how quick they are.
    pub fn quick_ms(&self) -> f64 {
        let mut sorted = self.frames_ms.clone();
        sorted.sort_by(f64::total_cmp);
        let place = sorted.len().saturating_sub(1) as f64 / 4.0;
        let at = |i: f64| sorted.get(i as usize).copied().unwrap_or(self.wall_ms.min);
        let (low, high) = (at(place.floor()), at(place.ceil()));
        low + (high - low) * place.fract()
    }

    fn more(&mut self, other: PhaseTimes) {
        let quicker = other.wall_ms.min < self.wall_ms.min;
        self.repeats += other.repeats;
        self.frames_ms.extend(other.frames_ms);
        self.wall_ms = Spread::of(&self.frames_ms).unwrap_or(self.wall_ms);
        if quicker {
            (self.gpu_ms, self.passes) = (other.gpu_ms, other.passes);
        }
    }
}

/// Median, least and greatest of some repeats.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

impl Spread {
    /// Of some values; `None` of none. The median of an even number is the mean of the two in the middle.
    pub fn of(values: &[f64]) -> Option<Spread> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        let median = (sorted.get(n.checked_sub(1)? / 2)? + sorted.get(n / 2)?) / 2.0;
        Some(Spread { median, min: *sorted.first()?, max: *sorted.last()? })
    }
}

/// The steps of one pass, summed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PassTime {
    pub name: String,
    /// The graph's heading for it.
    pub group: Option<String>,
    pub runs: u32,
    /// Median over the repeats; `None` where the adapter can't say.
    pub gpu_ms: Option<f64>,
}

/// Of results that don't say: one round.
fn once() -> u32 {
    1
}

impl Entry {
    /// What makes it the same entry in another bench.
    pub fn key(&self) -> (&str, &str, Option<&str>, [u32; 2], &BTreeMap<String, String>) {
        (&self.graph, &self.scene, self.camera.as_deref(), self.size, &self.params)
    }

    /// Seconds that a frame of each phase in which something moves takes, together.
    pub fn round_seconds(&self) -> f64 {
        let moving = self.phases.iter().filter(|t| Phase::MOVING.contains(&t.phase));
        moving.map(|t| t.wall_ms.min / 1e3).sum()
    }

    /// Seconds of a frame of the slowest phase, by its quickest. First frames, in which drivers compile, count where
    /// there are no others.
    pub fn slowest_seconds(&self) -> f64 {
        let moving = |t: &&PhaseTimes| Phase::MOVING.contains(&t.phase);
        let any = self.phases.iter().any(|t| moving(&t));
        self.phases.iter().filter(|t| !any || moving(t)).map(|t| t.wall_ms.min / 1e3).fold(0.0, f64::max)
    }

    /// Adds frames of another round to those of a phase. What is no time stays as it was.
    pub fn more(&mut self, more: PhaseTimes) {
        if let Some(t) = self.phases.iter_mut().find(|t| t.phase == more.phase) {
            t.more(more);
        }
    }

    /// The times of a phase. A renderer that knows no frames does all its work in each.
    pub fn times(&self, phase: Phase) -> Option<&PhaseTimes> {
        let find = |p| self.phases.iter().find(|t| t.phase == p);
        find(phase).or_else(|| find(Phase::Whole))
    }

    /// The comparison of an output in a phase with the reference that always applies.
    pub fn score(&self, output: &str, phase: Phase) -> Option<&Score> {
        let own = self.phases.iter().find(|t| t.phase == phase).map_or(&[][..], |t| &t.scores);
        let scores = if own.is_empty() { &self.scores } else { own };
        scores.iter().find(|s| s.output == output && s.only_when.is_empty())
    }
}

impl Results {
    /// What an entry's times were taken on.
    pub fn machine_of<'a>(&'a self, entry: &'a Entry) -> &'a Machine {
        entry.host.as_ref().map_or(&self.machine, |h| &h.machine)
    }

    /// Reads a results file, as it was written or compressed with gzip.
    ///
    /// # Errors
    /// A file that can't be read or is no results file.
    pub fn read(path: &Path) -> Checked<Results> {
        let shown = path.display().to_string();
        let bytes = files::read(path, files::TABLE);
        Results::from_bytes(bytes.map_err(|e| Diagnostic::error(format!("can't read {shown}: {e}")))?, &shown)
    }

    /// As [`Results::read`], of the bytes of a file, which faults call `shown`.
    ///
    /// # Errors
    /// Bytes that are no results file.
    pub fn from_bytes(mut bytes: Vec<u8>, shown: &str) -> Checked<Results> {
        let fault = |e: std::io::Error| Diagnostic::error(format!("can't read {shown}: {e}"));
        if bytes.starts_with(&GZIP) {
            let mut plain = vec![];
            files::limited(MultiGzDecoder::new(bytes.as_slice()), files::TABLE, &mut plain).map_err(fault)?;
            bytes = plain;
        }
        let parsed = serde_json::from_slice(&bytes).map_err(|e| {
            let d = Diagnostic::error(format!("{shown} holds no results: {e}"));
            d.help("give the `results.json` that `lightgraph bench` of this version wrote, or its `.gz`")
        })?;
        Ok(parsed)
    }

    /// Writes `results.json` and `results.csv` into a folder, each whole or not at all.
    ///
    /// # Errors
    /// Files that can't be written.
    pub fn write(&self, folder: &Path) -> Checked<()> {
        let json =
            serde_json::to_string(self).map_err(|e| Diagnostic::error(format!("can't write the results: {e}")))?;
        write_atomically(&folder.join("results.json"), json.as_bytes())?;
        write_atomically(&folder.join("results.csv"), self.csv().as_bytes())
    }

    /// A table with a row for each entry and phase.
    pub fn csv(&self) -> String {
        let mut outputs: Vec<&str> = self.entries.iter().flat_map(|e| &e.scores).map(|s| s.output.as_str()).collect();
        outputs.sort_unstable();
        outputs.dedup();
        let fixed = [
            "graph",
            "peer",
            "scene",
            "camera",
            "width",
            "height",
            "setting",
            "params",
            "phase",
            "repeats",
            "wall_ms_median",
            "wall_ms_min",
            "wall_ms_max",
            "gpu_ms_median",
            "gpu_ms_min",
            "gpu_ms_max",
            "steps_run",
            "steps_skipped",
            "bytes",
            "change_percent",
            "leak",
            "adapter",
            "driver",
            "host",
            "load",
            "commit",
            "fault",
        ];
        let of_output = ["rmse_percent", "block_rmse_percent", "bias_percent", "relmse", "p95", "max", "flip"];
        let mut head: Vec<String> = fixed.map(String::from).to_vec();
        head.extend(outputs.iter().flat_map(|o| of_output.map(|m| format!("{o}_{m}"))));
        let mut out = line(&head);
        for e in &self.entries {
            for phase in e.phases.iter().map(Some).chain(e.phases.is_empty().then_some(None)) {
                out += &line(&self.cells(e, phase, &outputs));
            }
        }
        out
    }

    fn cells(&self, e: &Entry, t: Option<&PhaseTimes>, outputs: &[&str]) -> Vec<String> {
        fn shown<T: ToString>(value: Option<T>) -> String {
            value.map_or(String::new(), |v| v.to_string())
        }
        let machine = self.machine_of(e);
        let spread = |s: Option<Spread>| [s.map(|s| s.median), s.map(|s| s.min), s.map(|s| s.max)].map(shown);
        let params: Vec<String> = e.params.iter().map(|(k, v)| format!("{k}={v}")).collect();
        let mut cells = vec![
            e.graph.clone(),
            shown(e.peer.clone()),
            e.scene.clone(),
            shown(e.camera.clone()),
            e.size[0].to_string(),
            e.size[1].to_string(),
            e.setting.clone(),
            params.join("; "),
            shown(t.map(|t| t.phase.word())),
            shown(t.map(|t| t.repeats)),
        ];
        cells.extend(spread(t.map(|t| t.wall_ms)));
        cells.extend(spread(t.and_then(|t| t.gpu_ms)));
        cells.extend([
            shown(t.map(|t| t.steps_run)),
            shown(t.map(|t| t.steps_skipped)),
            e.bytes.to_string(),
            shown(t.and_then(|t| t.change_percent)),
            shown(e.leak),
            machine.adapter.clone(),
            machine.driver.clone(),
            shown(e.host.as_ref().map(|h| &h.name)),
            shown(e.host.as_ref().and_then(|h| h.load)),
            shown(self.commit.clone()),
            shown(e.fault.clone()),
        ]);
        for output in outputs {
            let s = e.score(output, t.map_or(Phase::First, |t| t.phase));
            let m = s.map(|s| s.metrics);
            cells.extend([
                shown(m.map(|m| m.rmse_percent)),
                shown(m.map(|m| m.block_rmse_percent)),
                shown(m.map(|m| m.bias_percent)),
                shown(m.map(|m| m.relmse)),
                shown(m.map(|m| m.p95_error)),
                shown(m.map(|m| m.max_error)),
                shown(s.and_then(|s| s.flip)),
            ]);
        }
        cells
    }
}

/// A line of CSV (RFC 4180): cells that hold a comma, a quote or a line break stand in quotes.
fn line(cells: &[String]) -> String {
    let quoted = cells.iter().map(|c| match c.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", c.replace('"', "\"\"")),
        false => c.clone(),
    });
    quoted.collect::<Vec<_>>().join(",") + "\n"
}

/// FNV-1a, 64 bits: tells inputs apart, the same on every machine.
pub fn hash<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> String {
    let mut h = 0xcbf2_9ce4_8422_2325_u64;
    for part in parts {
        // The length keeps "ab", "c" apart from "a", "bc".
        for b in part.iter().copied().chain((part.len() as u64).to_le_bytes()) {
            h = (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    format!("{h:016x}")
}
