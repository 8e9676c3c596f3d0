//! All scenes in one plot: geometric means, so that every scene weighs the same however bright or large it is.

use super::front::front;
use super::report::{METRICS, SceneView, number, of, views};
use super::results::{Entry, Phase, Results};
use serde_json::{Map, Value, json};

/// Errors below this count as it, so that a scene that some graphs solve exactly does not outweigh all others: a
/// hundredth of the mean, for errors in percent of it, or of FLIP's range.
fn least(metric: &str) -> f64 {
    if metric == "flip" { 0.01 } else { 1.0 }
}

/// The results of all scenes as those of one more: each graph at each setting that every scene with a reference for
/// `output` has. Scenes with less than half the entries of another, of which only a few things were asked, don't count.
/// `None` for fewer than two scenes.
pub fn overview(results: &Results, output: &str) -> Option<Value> {
    let scored = |v: &SceneView| of(results, v).iter().any(|e| e.score(output, Phase::First).is_some());
    // Means over times of two machines would be of neither.
    let counts = |v: &&SceneView| v.machine == results.machine && scored(v);
    let mut scenes: Vec<Vec<&Entry>> = views(results).iter().filter(counts).map(|v| of(results, v)).collect();
    let most = scenes.iter().map(Vec::len).max().unwrap_or(0);
    scenes.retain(|entries| 2 * entries.len() >= most);
    let first = scenes.first().filter(|_| scenes.len() > 1)?;
    let everywhere = |e: &&Entry| -> Option<Vec<&Entry>> {
        let same = |o: &&Entry| o.graph == e.graph && o.setting == e.setting && o.score(output, Phase::First).is_some();
        scenes.iter().map(|s| s.iter().copied().find(|o| same(o))).collect()
    };
    let sets: Vec<Vec<&Entry>> = first.iter().filter_map(everywhere).collect();
    let mut fronts = Map::new();
    for phase in Phase::ALL {
        for (name, metric) in METRICS {
            let error = |set: &[&Entry]| mean_of(set, |e| metric(e.score(output, phase)?).map(|v| v.max(least(name))));
            let point = |set: &Vec<&Entry>| {
                let own = set.iter().all(|e| e.peer.is_none());
                time(set, phase).filter(|_| own).zip(error(set)).unwrap_or((f64::NAN, f64::NAN))
            };
            let points: Vec<(f64, f64)> = sets.iter().map(point).collect();
            fronts.insert(format!("{output}|{name}|{}", phase.word()), json!(front(&points)));
        }
    }
    let entries: Vec<Value> = sets.iter().filter_map(|set| entry(set, output)).collect();
    let count = scenes.len();
    Some(json!({
        "name": "", "label": format!("{count} scenes"), "noise": {}, "entries": entries, "fronts": fronts, "pictures": [],
        "origin": "Geometric means of times and errors over all scenes and cameras with one, errors below 1 % as 1 %; bias is an arithmetic mean",
    }))
}

fn entry(set: &[&Entry], output: &str) -> Option<Value> {
    let e = set.first()?;
    let (mut times, mut own) = (Map::new(), Map::new());
    for phase in Phase::ALL {
        if let Some(ms) = time(set, phase) {
            times.insert(phase.word().into(), json!({"ms": number(ms), "min": number(ms), "max": number(ms), "device": Value::Null, "repeats": set.len()}));
        }
        let mut numbers = Map::new();
        for (name, metric) in METRICS {
            let error = mean_of(set, |e| metric(e.score(output, phase)?).map(|v| v.max(least(name))));
            numbers.insert(name.into(), json!(error.map(number)));
        }
        let bias: f64 = set.iter().filter_map(|e| Some(e.score(output, phase)?.metrics.bias_percent)).sum();
        numbers.insert("bias".into(), number(bias / set.len() as f64));
        own.insert(phase.word().into(), json!({ output: numbers }));
    }
    Some(json!({
        "graph": e.graph, "peer": e.peer, "setting": e.setting, "rest": [], "mib": Value::Null, "times": times, "change": {},
        "passes": {}, "steps": {}, "errors": {}, "own": own, "bounded": [], "leak": Value::Null, "fault": Value::Null,
    }))
}

/// Over the scenes in which anything moves in this way.
fn time(set: &[&Entry], phase: Phase) -> Option<f64> {
    let ms: Vec<f64> = set.iter().filter_map(|e| Some(e.times(phase)?.wall_ms.median)).collect();
    geometric(&ms)
}

/// `None` when one has none.
fn mean_of(set: &[&Entry], value: impl Fn(&Entry) -> Option<f64>) -> Option<f64> {
    geometric(&set.iter().map(|e| value(e)).collect::<Option<Vec<f64>>>()?)
}

/// `None` of nothing and of what has no logarithm.
fn geometric(values: &[f64]) -> Option<f64> {
    let sum: f64 = values.iter().map(|v| v.ln()).sum();
    Some((sum / values.len() as f64).exp()).filter(|m| m.is_finite() && !values.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geometric_means() {
        assert!((geometric(&[1.0, 4.0]).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(geometric(&[]), None);
        assert_eq!(geometric(&[-1.0, 2.0]), None);
    }
}
