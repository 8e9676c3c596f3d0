//! A page of results: one file that needs no network, and a summary for the terminal.

mod data;
mod pack;
mod pictures;

pub(super) use data::page;
pub(super) use pack::number;
#[cfg(test)]
pub(super) use pack::tests::inflated;
pub use pictures::{copy, pictures, reference_pictures};

use super::front::front;
use super::host::Machine;
use super::measure::SEEN;
use super::results::{Entry, Phase, Results};
use super::score::Score;
use lightgraph::Checked;
use pack::pack;
use std::fmt::Write;
use std::path::Path;

/// What the page does, in this order: the later ones use the earlier ones.
const SCRIPT: [&str; 4] = [
    include_str!("report/unpack.js"),
    include_str!("report/plot.js"),
    include_str!("report/tables.js"),
    include_str!("report/page.js"),
];

pub(super) type Metric = (&'static str, fn(&Score) -> Option<f64>);

/// What the page can plot, by the names of its script.
pub(super) const METRICS: [Metric; 4] = [
    ("rmse", |s| Some(s.metrics.rmse_percent)),
    ("block", |s| Some(s.metrics.block_rmse_percent)),
    ("fine", |s| Some(s.fine_percent)),
    ("flip", |s| s.flip),
];

/// The page. `folder` is where the results' pictures are; `most` how many graphs have theirs shown on each scene.
///
/// # Errors
/// Results that make no JSON, a fault of this program.
pub fn html(results: &Results, folder: &Path, most: usize) -> Checked<String> {
    let data = pack(page(results, folder, most))?;
    let page = include_str!("report/page.html").replace("@STYLE@", include_str!("report/page.css"));
    Ok(page.replace("@SCRIPT@", &SCRIPT.concat()).replace("@DATA@", &data))
}

/// The front of each scene for the main output with everything moving, as text.
pub fn text(results: &Results) -> String {
    let mut out = String::new();
    let output = results.main_output.as_deref().unwrap_or(SEEN);
    for view in views(results) {
        let entries = of(results, &view);
        let phase =
            [Phase::Everything, Phase::First].into_iter().find(|p| entries.iter().any(|e| e.times(*p).is_some()));
        let phase = phase.unwrap_or(Phase::First);
        // Writing to a string can't fail.
        let _ =
            writeln!(out, "{}: rmse of `{output}` against a frame's time ({})", label(results, &view), phase.word());
        let best = entry_front(&entries, phase, &|e| METRICS[0].1(e.score(output, phase)?));
        for e in best.iter().filter_map(|i| entries.get(*i)) {
            if let (Some(t), Some(s)) = (e.times(phase), e.score(output, phase)) {
                let (ms, m) = (t.wall_ms.median, s.metrics);
                let (rmse, block, bias) = (m.rmse_percent, m.block_rmse_percent, m.bias_percent);
                let (graph, set) = (&e.graph, &e.setting);
                let _ = writeln!(
                    out,
                    "  {ms:9.2} ms  {rmse:7.2} %  structural {block:7.2} %  bias {bias:+7.2} %  {graph} {set}"
                );
            }
        }
        if best.is_empty() {
            out.push_str("  no entry has both\n");
        }
        for e in entries.iter().filter(|e| e.fault.is_some()) {
            let _ = writeln!(out, "  failed: {} {}: {}", e.graph, e.setting, e.fault.as_deref().unwrap_or(""));
        }
    }
    for a in &results.absent {
        let _ = writeln!(out, "{} is absent: {}", a.name, a.why);
    }
    out
}

/// A scene by a camera, on a machine: times of two are not held against each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SceneView {
    pub scene: String,
    pub camera: Option<String>,
    pub machine: Machine,
}

/// Scenes, cameras and machines in the order of the entries.
pub(super) fn views(results: &Results) -> Vec<SceneView> {
    let mut views: Vec<SceneView> = vec![];
    for e in &results.entries {
        let machine = results.machine_of(e).clone();
        let view = SceneView { scene: e.scene.clone(), camera: e.camera.clone(), machine };
        if !views.contains(&view) {
            views.push(view);
        }
    }
    views
}

pub(super) fn of<'a>(results: &'a Results, view: &SceneView) -> Vec<&'a Entry> {
    let here = |e: &&Entry| e.scene == view.scene && e.camera == view.camera && *results.machine_of(e) == view.machine;
    results.entries.iter().filter(here).collect()
}

/// What a view is called; with its machine, where there are others.
fn label(results: &Results, view: &SceneView) -> String {
    let camera = view.camera.as_ref().map_or(String::new(), |camera| format!(", camera {camera}"));
    let alone = results.entries.iter().all(|e| *results.machine_of(e) == results.machine);
    let machine = if alone { String::new() } else { format!(", on {}", view.machine.shown()) };
    format!("{}{camera}{machine}", view.scene)
}

/// Indices of our own entries that no other of ours beats.
fn entry_front(entries: &[&Entry], phase: Phase, error: &dyn Fn(&Entry) -> Option<f64>) -> Vec<usize> {
    let points: Vec<(f64, f64)> = entries
        .iter()
        .map(|e| {
            let x = e.times(phase).filter(|_| e.peer.is_none()).map(|t| t.wall_ms.median);
            x.zip(error(e)).unwrap_or((f64::NAN, f64::NAN))
        })
        .collect();
    front(&points)
}
