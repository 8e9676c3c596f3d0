//! A page of results: one file that needs no network, and a summary for the terminal.

use super::front::front;
use super::measure::SEEN;
use super::overview::overview;
use super::references::References;
use super::results::{Entry, Phase, Results};
use super::score::{Score, mean};
use crate::diag::{Checked, Diagnostic};
use crate::image::Image;
use crate::image::difference::difference;
use crate::image::png::{ToneMap, write_png};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Mean light that pictures are exposed to show.
const MIDDLE: f64 = 0.25;

/// Phases whose passes the page draws.
const WITH_PASSES: [Phase; 3] = [Phase::Everything, Phase::Lights, Phase::Camera];

pub(super) type Metric = (&'static str, fn(&Score) -> Option<f64>);

/// What the page can plot, by the names of its script.
pub(super) const METRICS: [Metric; 5] = [
    ("rmse", |s| Some(s.metrics.rmse_percent)),
    ("block", |s| Some(s.metrics.block_rmse_percent)),
    ("fine", |s| Some(s.fine_percent)),
    ("hit", |s| s.hit.map(|h| h.rmse_percent)),
    ("flip", |s| s.flip),
];

/// The page. `folder` is where the results' pictures are; `most` how many graphs have theirs shown on each scene.
///
/// # Errors
/// Results that make no JSON, a fault of this program.
pub fn html(results: &Results, folder: &Path, most: usize) -> Checked<String> {
    let all = overview(results, results.main_output.as_deref().unwrap_or(SEEN));
    let scenes = views(results);
    let scenes = all.into_iter().chain(scenes.iter().map(|view| scene(results, view, folder, most)));
    let scenes: Vec<Value> = scenes.collect();
    let page = json!({
        "version": results.version, "commit": results.commit, "machine": results.machine, "repeat": results.repeat,
        "size": results.size, "main": results.main_output, "published": results.published, "absent": results.absent,
        "scenes": scenes,
    });
    let text = serde_json::to_string(&page).map_err(|e| Diagnostic::error(format!("can't write the report: {e}")))?;
    // In a script element only `</` and `<!--` end or change the text.
    let text = text.replace("</", "<\\/").replace("<!--", "<\\u0021--");
    let page = include_str!("report/page.html").replace("@STYLE@", include_str!("report/page.css"));
    Ok(page.replace("@SCRIPT@", include_str!("report/page.js")).replace("@DATA@", &text))
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
        let _ = writeln!(out, "{}: rmse of `{output}` against a frame's time ({})", label(&view), phase.word());
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

/// Writes a picture of an entry and, where there is a reference, one of the difference. Its path relative to the folder.
///
/// # Errors
/// Files that can't be written.
pub fn pictures(
    folder: &Path,
    entry: &Entry,
    images: &BTreeMap<String, Image>,
    references: &References,
) -> Checked<Option<String>> {
    let Some(seen) = images.get(SEEN).or_else(|| images.values().next()) else { return Ok(None) };
    let stem = file_name(&[&view_name(&entry.scene, entry.camera.as_deref()), &entry.graph, &entry.setting]);
    let path = format!("images/{stem}.png");
    write_png(&folder.join(&path), seen, ToneMap::Neutral, exposure(seen, references), &BTreeMap::new())?;
    let compared = references.all.iter().find(|r| r.output == SEEN && r.only_when.is_empty() && mean(&r.image) > 0.0);
    if let (Some(reference), Some(image)) = (compared, images.get(SEEN)) {
        let shown = difference(image, &reference.image)?.image;
        let to = folder.join(difference_path(&path));
        write_png(&to, &shown, ToneMap::None, 0.0, &BTreeMap::new())?;
    }
    Ok(Some(path))
}

/// Writes the picture of a scene's reference.
///
/// # Errors
/// A file that can't be written.
pub fn reference_pictures(folder: &Path, scene: &str, camera: Option<&str>, references: &References) -> Checked<()> {
    match references.all.iter().find(|r| r.output == SEEN && r.only_when.is_empty()) {
        Some(r) => {
            let path = folder.join(reference_path(scene, camera));
            write_png(&path, &r.image, ToneMap::Neutral, exposure(&r.image, references), &BTreeMap::new())
        }
        None => Ok(()),
    }
}

pub(super) type View = (String, Option<String>);

/// Scenes and cameras in the order of the entries.
pub(super) fn views(results: &Results) -> Vec<View> {
    let mut views: Vec<View> = vec![];
    for e in &results.entries {
        let view = (e.scene.clone(), e.camera.clone());
        if !views.contains(&view) {
            views.push(view);
        }
    }
    views
}

pub(super) fn of<'a>(results: &'a Results, view: &View) -> Vec<&'a Entry> {
    results.entries.iter().filter(|e| e.scene == view.0 && e.camera == view.1).collect()
}

fn label(view: &View) -> String {
    view.1.as_ref().map_or(view.0.clone(), |camera| format!("{}, camera {camera}", view.0))
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

fn scene(results: &Results, view: &View, folder: &Path, most: usize) -> Value {
    let entries = of(results, view);
    let mut outputs: Vec<&Score> = vec![];
    for s in entries.iter().flat_map(|e| &e.scores).filter(|s| s.only_when.is_empty()) {
        if outputs.iter().all(|o| o.output != s.output) {
            outputs.push(s);
        }
    }
    let mut fronts = Map::new();
    for s in &outputs {
        for (name, metric) in METRICS {
            for phase in Phase::ALL {
                let found = entry_front(&entries, phase, &|e| metric(e.score(&s.output, phase)?));
                fronts.insert(format!("{}|{name}|{}", s.output, phase.word()), json!(found));
            }
        }
    }
    for phase in Phase::ALL {
        fronts.insert(format!("leak|{}", phase.word()), json!(entry_front(&entries, phase, &|e| e.leak)));
    }
    let noise: Map<String, Value> =
        outputs.iter().filter_map(|s| Some((s.output.clone(), json!(s.stderr_percent?)))).collect();
    json!({
        "name": view.0, "label": label(view), "origin": outputs.first().map(|s| s.origin.clone()), "noise": noise,
        "entries": entries.iter().map(|e| entry(e)).collect::<Vec<_>>(), "fronts": fronts,
        "pictures": shown(results, view, &entries, folder, most),
    })
}

fn entry(e: &Entry) -> Value {
    let by_phase = |f: &dyn Fn(&super::results::PhaseTimes) -> Option<Value>| -> Map<String, Value> {
        e.phases.iter().filter_map(|t| Some((t.phase.word().to_string(), f(t)?))).collect()
    };
    let times = by_phase(&|t| {
        let w = t.wall_ms;
        Some(json!([round(w.median), round(w.min), round(w.max), t.gpu_ms.map(|g| round(g.median)), t.repeats]))
    });
    let passes = by_phase(&|t| {
        let passes = t.passes.iter().map(|p| json!([p.name, p.group, p.gpu_ms.map(round), p.runs]));
        WITH_PASSES.contains(&t.phase).then(|| passes.collect())
    });
    let numbers = |s: &Score| {
        let m = s.metrics;
        json!({
            "rmse": round(m.rmse_percent), "block": round(m.block_rmse_percent), "fine": round(s.fine_percent),
            "bias": round(m.bias_percent), "relmse": round(m.relmse), "p95": round(m.p95_error), "max": round(m.max_error),
            "hit": s.hit.map(|h| round(h.rmse_percent)), "flip": s.flip.map(round),
        })
    };
    let by_output = |scores: &[Score]| -> Map<String, Value> {
        scores.iter().filter(|s| s.only_when.is_empty()).map(|s| (s.output.clone(), numbers(s))).collect()
    };
    let own = by_phase(&|t| (!t.scores.is_empty()).then(|| by_output(&t.scores).into()));
    let bounded = e.scores.iter().filter(|s| !s.only_when.is_empty()).map(|s| {
        let mut value = numbers(s);
        let when: Vec<String> = s.only_when.iter().map(|(n, v)| format!("{n}={v}")).collect();
        value["output"] = json!(s.output);
        value["when"] = json!(when.join(", "));
        value
    });
    json!({
        "steps": by_phase(&|t| Some(json!([t.steps_run, t.steps_skipped, t.causes]))),
        "graph": e.graph, "peer": e.peer, "setting": e.setting, "params": e.params, "bytes": e.bytes, "times": times,
        "change": by_phase(&|t| t.change_percent.map(|c| json!(round(c)))), "passes": passes, "errors": by_output(&e.scores), "own": own,
        "bounded": bounded.collect::<Vec<_>>(), "leak": e.leak, "fault": e.fault,
    })
}

/// Five digits: what a page shows.
pub(super) fn round(x: f64) -> f64 {
    format!("{x:.4e}").parse().unwrap_or(x)
}

/// The reference, and each graph at its most accurate setting, as data URIs.
fn shown(results: &Results, view: &View, entries: &[&Entry], folder: &Path, most: usize) -> Vec<Value> {
    let mut pictures = vec![];
    if most == 0 {
        return pictures;
    }
    if let Some(color) = data_uri(&folder.join(reference_path(&view.0, view.1.as_deref()))) {
        pictures.push(json!({"label": "reference", "color": color}));
    }
    let output = results.main_output.as_deref().unwrap_or(SEEN);
    let still = Phase::Still;
    let error = |e: &Entry| {
        let score = e.score(output, still).or(e.score(SEEN, still));
        score.map(|s| s.metrics.rmse_percent).or(e.leak).unwrap_or(f64::INFINITY)
    };
    let mut best: Vec<&Entry> = vec![];
    for e in entries.iter().filter(|e| e.picture.is_some()) {
        match best.iter_mut().find(|b| b.graph == e.graph) {
            Some(b) if error(e) < error(b) => *b = e,
            Some(_) => {}
            None => best.push(e),
        }
    }
    best.sort_by(|a, b| error(a).total_cmp(&error(b)));
    for e in best.into_iter().take(most) {
        let Some(path) = &e.picture else { continue };
        if let Some(color) = data_uri(&folder.join(path)) {
            let difference = data_uri(&folder.join(difference_path(path)));
            let text = format!("{} {}", e.graph, e.setting);
            pictures.push(json!({"label": text.trim(), "color": color, "difference": difference}));
        }
    }
    pictures
}

fn exposure(image: &Image, references: &References) -> f32 {
    let reference = references.all.iter().find(|r| r.output == SEEN && r.only_when.is_empty());
    let level = mean(reference.map_or(image, |r| &r.image));
    if level > 0.0 { (MIDDLE / level).log2() as f32 } else { 0.0 }
}

fn view_name(scene: &str, camera: Option<&str>) -> String {
    camera.map_or(scene.to_string(), |c| format!("{scene}_{c}"))
}

fn reference_path(scene: &str, camera: Option<&str>) -> String {
    format!("images/{}.png", file_name(&[&view_name(scene, camera), "reference"]))
}

fn difference_path(picture: &str) -> String {
    picture.replace(".png", "_difference.png")
}

/// A name of letters, digits, `-` and `_` only.
fn file_name(parts: &[&str]) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    parts.iter().filter(|p| !p.is_empty()).map(|p| p.chars().map(plain).collect()).collect::<Vec<String>>().join("_")
}

fn data_uri(path: &Path) -> Option<String> {
    Some(format!("data:image/png;base64,{}", base64(&std::fs::read(path).ok()?)))
}

/// RFC 4648, with padding.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i)) as usize & 63];
            out.push(if i <= chunk.len() { letter as char } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_as_the_standard_says() {
        for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg==")] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn names_hold_nothing_that_a_file_system_minds() {
        assert_eq!(file_name(&["a/b", "", "grid=(4, 2)"]), "a_b_grid__4__2_");
    }
}
