//! Other renderers on the same scenes: commands that a folder of JSON files describes.
//!
//! A file: `{"name": "mitsuba", "command": ["peers/run.sh", "run_mitsuba.py"], …}`. The command runs with `--scene FILE
//! --size WxH --out FOLDER`, and `--camera NAME` where one is asked for, and tries all the `"settings"` of its file in turn, or those
//! of the numbers, from 1, that `--setting N` names. It prints a JSON line a result: `{"renderer", "version",
//! "settings", "seconds", "image", …}`, where `image` is the path of a linear EXR of all light; any other field that
//! holds such a path (`"indirect": "a.exr"`) is the output of its name. Its exit code is 4 when the renderer isn't
//! installed or can't render the scene; the reason is the last line of its error stream.

use super::measure::SEEN;
use super::references::ReferenceSet;
use super::results::{Absent, Entry, Phase, PhaseTimes, Spread};
use super::score::score;
use lightgraph::internals::files;
use lightgraph::internals::image::exr::read_exr;
use lightgraph::{Checked, Diagnostic, Faults, Image};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A renderer that a file describes.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Peer {
    pub name: String,
    /// A program and its first arguments; run in the current folder.
    pub command: Vec<String>,
    /// What it tries.
    #[serde(default)]
    pub settings: Vec<BTreeMap<String, serde_json::Value>>,
}

impl Peer {
    /// The numbers, from 1, of the settings in which every one of these names has this value.
    pub fn numbers(&self, asked: &BTreeMap<String, String>) -> Vec<usize> {
        let has = |s: &BTreeMap<String, serde_json::Value>| {
            asked.iter().all(|(name, value)| s.get(name).is_some_and(|v| word(v) == *value))
        };
        self.settings.iter().zip(1..).filter(|(s, _)| has(s)).map(|(_, number)| number).collect()
    }
}

/// A line of its output.
#[derive(Debug, Clone, PartialEq, Deserialize)]
struct PeerLine {
    renderer: String,
    version: String,
    #[serde(default)]
    settings: serde_json::Value,
    seconds: f64,
    image: PathBuf,
    /// Other images among what else it says.
    #[serde(flatten)]
    rest: BTreeMap<String, serde_json::Value>,
}

/// What a peer is asked to render.
#[derive(Debug, Clone, Copy)]
pub struct PeerJob<'a> {
    pub scene_file: &'a Path,
    pub scene: &'a str,
    pub camera: Option<&'a str>,
    pub size: [u32; 2],
    pub references: &'a ReferenceSet,
    /// A folder for its images.
    pub folder: &'a Path,
    /// Numbers of its settings, from 1; none: all of them.
    pub settings: &'a [usize],
}

/// The peers of a folder, by file name; files without a `command` are others' business.
///
/// # Errors
/// A folder or file that can't be read.
pub fn find(folder: &Path) -> Checked<Vec<Peer>> {
    let fault =
        |path: &Path, e: &dyn std::fmt::Display| Diagnostic::error(format!("can't read {}: {e}", path.display()));
    let entries = std::fs::read_dir(folder).map_err(|e| fault(folder, &e))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "json"));
    paths.sort();
    let (mut peers, mut faults) = (vec![], vec![]);
    for path in paths {
        let read = files::read(&path, files::TEXT).map_err(|e| fault(&path, &e));
        let value = read.and_then(|b| serde_json::from_slice::<serde_json::Value>(&b).map_err(|e| fault(&path, &e)));
        match value {
            Ok(value) if value.get("command").is_some() => match serde_json::from_value(value) {
                Ok(peer) => peers.push(peer),
                Err(e) => faults.push(fault(&path, &e)),
            },
            Ok(_) => {}
            Err(d) => faults.push(d),
        }
    }
    Faults::check(faults, peers)
}

/// A row, and the images it came with, by quantity.
pub type PeerResult = (Entry, BTreeMap<String, Image>);

/// Runs a peer on a scene. Its entries; or that it is absent, and why.
pub fn run(peer: &Peer, job: PeerJob<'_>) -> Result<Vec<PeerResult>, Absent> {
    let absent = |why: String| Absent { name: peer.name.clone(), why };
    let Some((program, first)) = peer.command.split_first() else { return Err(absent("its command is empty".into())) };
    let mut command = Command::new(program);
    command.args(first).arg("--scene").arg(job.scene_file);
    command.arg("--size").arg(format!("{}x{}", job.size[0], job.size[1])).arg("--out").arg(job.folder);
    if let Some(camera) = job.camera {
        command.arg("--camera").arg(camera);
    }
    for setting in job.settings {
        command.arg("--setting").arg(setting.to_string());
    }
    let done = command.output().map_err(|e| absent(format!("`{program}` doesn't run: {e}")))?;
    if !done.status.success() {
        let errors = String::from_utf8_lossy(&done.stderr);
        let last = errors.lines().rfind(|l| !l.trim().is_empty()).unwrap_or("it gives no reason").to_string();
        return Err(absent(format!("{}: {last}", done.status)));
    }
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    let lines = text.lines().filter(|l| l.starts_with('{'));
    lines.map(|l| entry(l, job).map_err(|Faults(f)| absent(f.into_iter().map(|d| d.message).collect()))).collect()
}

fn entry(line: &str, job: PeerJob<'_>) -> Checked<(Entry, BTreeMap<String, Image>)> {
    let line: PeerLine = serde_json::from_str(line)
        .map_err(|e| Diagnostic::error(format!("a line of its output is no result: {e}: {line}")))?;
    let mut images = BTreeMap::from([(SEEN.to_string(), read_exr(&line.image)?)]);
    for (output, value) in &line.rest {
        if let Some(path) = value.as_str().filter(|p| p.ends_with(".exr")) {
            images.insert(output.clone(), read_exr(Path::new(path))?);
        }
    }
    let params = match &line.settings {
        serde_json::Value::Object(map) => map.iter().map(|(k, v)| (k.clone(), word(v))).collect(),
        serde_json::Value::Null => BTreeMap::new(),
        other => BTreeMap::from([("setting".to_string(), word(other))]),
    };
    let pairs =
        |map: &BTreeMap<String, String>| map.iter().map(|(k, v)| format!("{k}={v}")).collect::<Vec<_>>().join(" ");
    let setting = line.settings.as_str().map_or_else(|| pairs(&params), String::from);
    let ms = line.seconds * 1e3;
    let times = PhaseTimes {
        phase: Phase::Whole,
        repeats: 1,
        wall_ms: Spread { median: ms, min: ms, max: ms },
        frames_ms: vec![ms],
        gpu_ms: None,
        steps_run: 0,
        steps_skipped: 0,
        causes: vec![],
        iterations: BTreeMap::new(),
        passes: vec![],
        change_percent: None,
        scores: vec![],
    };
    let scores = score(&images, job.references, &params)?;
    let entry = Entry {
        graph: line.renderer,
        peer: Some(line.version),
        scene: job.scene.to_string(),
        camera: job.camera.map(String::from),
        size: job.size,
        params,
        setting,
        inputs: String::new(),
        bytes: 0,
        bytes_without_sharing: 0,
        start_up_ms: BTreeMap::new(),
        rounds: 1,
        phases: vec![times],
        scores,
        leak: None,
        picture: None,
        fault: None,
        host: None,
    };
    Ok((entry, images))
}

fn word(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::String(s) => s.clone(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightgraph::internals::image::exr::{Precision, write_exr};
    use tempfile::TempDir;

    fn peer(script: &str) -> Peer {
        let command = ["sh", "-c", script, "peer"].map(String::from).to_vec();
        Peer { name: "other".into(), command, settings: vec![] }
    }

    fn job<'a>(folder: &'a TempDir, references: &'a ReferenceSet) -> PeerJob<'a> {
        PeerJob {
            scene_file: Path::new("s.glb"),
            scene: "s",
            camera: None,
            size: [2, 2],
            references,
            folder: folder.path(),
            settings: &[],
        }
    }

    #[test]
    fn a_line_becomes_an_entry() {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("a.exr");
        write_exr(&path, &[("", &Image::filled(2, 2, &[1.0; 3]).unwrap())], Precision::Float, &BTreeMap::new())
            .unwrap();
        let line = format!(
            r#"echo noise; echo '{{"renderer": "R", "version": "1", "settings": {{"n": 4}}, "seconds": 0.5, "image": "{0}", "indirect": "{0}"}}'"#,
            path.display()
        );
        let references = ReferenceSet::default();
        let found = run(&peer(&line), job(&folder, &references)).unwrap();
        assert_eq!(found.len(), 1);
        assert_eq!(
            (found[0].0.setting.as_str(), found[0].0.times(Phase::Still).unwrap().wall_ms.median),
            ("n=4", 500.0)
        );
        assert_eq!(found[0].1.keys().collect::<Vec<_>>(), [SEEN, "indirect"]);
    }

    #[test]
    fn what_is_not_installed_is_absent_with_its_reason() {
        let folder = TempDir::new().unwrap();
        let references = ReferenceSet::default();
        let absent = run(&peer("echo not installed >&2; exit 4"), job(&folder, &references)).unwrap_err();
        assert!(absent.why.ends_with("not installed"), "{}", absent.why);
        let absent = run(&peer("echo '{\"renderer\": 1}'"), job(&folder, &references)).unwrap_err();
        assert!(absent.why.contains("no result"), "{}", absent.why);
        let none = Peer { command: vec!["no-such-program-here".into()], ..peer("") };
        assert!(run(&none, job(&folder, &references)).unwrap_err().why.contains("doesn't run"));
    }

    #[test]
    fn settings_are_found_by_what_they_say() {
        let text =
            r#"{"name": "a", "command": ["a"], "settings": [{"size": 4, "samples": 2}, {"size": 8, "samples": 2}]}"#;
        let peer: Peer = serde_json::from_str(text).unwrap();
        let asked = |name: &str, value: &str| BTreeMap::from([(name.to_string(), value.to_string())]);
        assert_eq!(peer.numbers(&asked("size", "8")), [2]);
        assert_eq!(peer.numbers(&asked("samples", "2")), [1, 2]);
        assert_eq!(peer.numbers(&asked("size", "5")), [0; 0]);
        assert_eq!(peer.numbers(&BTreeMap::new()), [1, 2]);
    }

    #[test]
    fn files_without_a_command_are_others_business() {
        let folder = TempDir::new().unwrap();
        std::fs::write(folder.path().join("a.json"), r#"{"name": "A", "command": ["a"]}"#).unwrap();
        std::fs::write(folder.path().join("b.json"), r#"{"versions": []}"#).unwrap();
        assert_eq!(find(folder.path()).unwrap().len(), 1);
        std::fs::write(folder.path().join("c.json"), "{").unwrap();
        assert!(find(folder.path()).is_err());
    }
}
