//! What a page shows, as JSON: scenes, and in each the entries, the fronts and pictures.

use super::pack::number;
use super::{METRICS, SceneView, entry_front, label, of, pictures::shown, views};
use crate::bench::measure::SEEN;
use crate::bench::overview::overview;
use crate::bench::results::{Entry, PassTime, Phase, PhaseTimes, Results};
use crate::bench::score::Score;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Phases whose passes the page draws.
const WITH_PASSES: [Phase; 3] = [Phase::Everything, Phase::Lights, Phase::Camera];

/// All of it. `folder` is where the results' pictures are; `most` how many graphs have theirs shown on each scene.
pub fn page(results: &Results, folder: &Path, most: usize) -> Value {
    let all = overview(results, results.main_output.as_deref().unwrap_or(SEEN));
    let scenes = views(results);
    let scenes = all.into_iter().chain(scenes.iter().map(|view| scene(results, view, folder, most)));
    let scenes: Vec<Value> = scenes.collect();
    json!({
        "version": results.version, "commit": results.commit, "machine": results.machine, "repeat": results.repeat,
        "size": results.size, "main": results.main_output, "published": results.published, "absent": results.absent,
        "scenes": scenes,
    })
}

fn scene(results: &Results, view: &SceneView, folder: &Path, most: usize) -> Value {
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
        outputs.iter().filter_map(|s| Some((s.output.clone(), number(s.stderr_percent?)))).collect();
    let origin = outputs.first().map(|s| format!("Reference: {}", s.origin));
    json!({
        "name": view.scene, "label": label(results, view), "origin": origin, "noise": noise,
        "entries": entries.iter().map(|e| entry(e)).collect::<Vec<_>>(), "fronts": fronts,
        "pictures": shown(results, view, &entries, folder, most),
    })
}

fn entry(e: &Entry) -> Value {
    let by_phase = |f: &dyn Fn(&PhaseTimes) -> Option<Value>| -> Map<String, Value> {
        e.phases.iter().filter_map(|t| Some((t.phase.word().to_string(), f(t)?))).collect()
    };
    let times = by_phase(&|t| {
        let w = t.wall_ms;
        let device = t.gpu_ms.map(|g| number(g.median));
        Some(json!({
            "ms": number(w.median), "min": number(w.min), "max": number(w.max), "device": device, "repeats": t.repeats,
        }))
    });
    let numbers = |s: &Score| {
        let m = s.metrics;
        json!({
            "rmse": number(m.rmse_percent), "block": number(m.block_rmse_percent), "fine": number(s.fine_percent),
            "bias": number(m.bias_percent), "relmse": number(m.relmse), "p95": number(m.p95_error),
            "max": number(m.max_error), "flip": s.flip.map(number),
        })
    };
    let by_output = |scores: &[Score]| -> Map<String, Value> {
        scores.iter().filter(|s| s.only_when.is_empty()).map(|s| (s.output.clone(), numbers(s))).collect()
    };
    let bounded: Map<String, Value> = e.scores.iter().filter(|s| !s.only_when.is_empty()).map(bounded).collect();
    json!({
        "graph": e.graph, "peer": e.peer, "setting": e.setting, "rest": rest(e), "times": times,
        "mib": (e.bytes > 0).then(|| number(e.bytes as f64 / f64::from(1 << 20))),
        "steps": by_phase(&|t| Some(json!({"run": t.steps_run, "left": t.steps_skipped, "causes": t.causes}))),
        "change": by_phase(&|t| t.change_percent.map(number)),
        "passes": by_phase(&|t| (WITH_PASSES.contains(&t.phase) && !t.passes.is_empty()).then(|| passes(&t.passes))),
        "errors": by_output(&e.scores), "own": by_phase(&|t| (!t.scores.is_empty()).then(|| by_output(&t.scores).into())),
        "bounded": bounded, "leak": e.leak.map(number), "fault": e.fault,
    })
}

/// A reference of some parameters, and the errors against it.
fn bounded(s: &Score) -> (String, Value) {
    let when: Vec<String> = s.only_when.iter().map(|(n, v)| format!("{n}={v}")).collect();
    let m = s.metrics;
    let numbers = json!({
        "rmse": number(m.rmse_percent), "block": number(m.block_rmse_percent), "bias": number(m.bias_percent),
    });
    (format!("{}, {}", s.output, when.join(", ")), numbers)
}

/// The parameters that the setting doesn't name.
fn rest(e: &Entry) -> Vec<String> {
    let set = |name: &str| e.setting.split(' ').any(|s| s.split_once('=').is_some_and(|(n, _)| n == name));
    e.params.iter().filter(|(n, _)| !set(n)).map(|(n, v)| format!("{n}={v}")).collect()
}

/// Device times summed under the graph's headings, and those of passes without one, in the order of their first run.
fn passes(all: &[PassTime]) -> Value {
    let sums = |grouped: bool| {
        let (mut names, mut sums): (Vec<&str>, Vec<f64>) = (vec![], vec![]);
        for p in all.iter().filter(|p| p.group.is_some() == grouped) {
            let (name, ms) = (p.group.as_ref().unwrap_or(&p.name), p.gpu_ms.unwrap_or(0.0));
            match names.iter().position(|n| n == name).and_then(|at| sums.get_mut(at)) {
                Some(sum) => *sum += ms,
                None => {
                    names.push(name);
                    sums.push(ms);
                }
            }
        }
        let ms: Vec<Value> = sums.into_iter().map(number).collect();
        json!({ "names": names, "ms": ms })
    };
    json!({ "groups": sums(true), "others": sums(false) })
}
