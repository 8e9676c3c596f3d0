//! Chooses a graph and its setting for one scene: the Pareto front of what was measured, the best of it under a budget
//! of time or error, and the variant that sets it.

use super::front::front;
use lightgraph::internals::value::Value;
use serde_json::json;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// A graph at a setting, measured on a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// As a variant names its base.
    pub graph: String,
    /// Parameters that differ from their defaults.
    pub setting: Vec<(String, Value)>,
    /// Milliseconds of a frame in which everything is new.
    pub ms: f64,
    /// Root mean square error over the pixels, in percent of the mean.
    pub rmse: f64,
    /// The same of means over 8 × 8 pixels.
    pub block: f64,
    /// Of the mean, in percent.
    pub bias: f64,
}

/// What a user asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TuneGoal {
    /// The least error within so many milliseconds.
    Budget(f64),
    /// The least time with no more error, in percent.
    Error(f64),
    /// The least product of both.
    Balance,
}

impl Candidate {
    /// `rays=4 tile=2`, or what stands for a graph's own defaults.
    pub fn setting_text(&self) -> String {
        let words: Vec<String> = self.setting.iter().map(|(n, v)| format!("{n}={v}")).collect();
        if words.is_empty() { "its defaults".into() } else { words.join(" ") }
    }

    /// For programs. `unbeaten`: no other is both faster and closer.
    pub fn json(&self, unbeaten: bool) -> serde_json::Value {
        let setting: BTreeMap<&str, String> = self.setting.iter().map(|(n, v)| (n.as_str(), v.to_string())).collect();
        json!({
            "graph": self.graph, "setting": setting, "ms": self.ms, "rmse_percent": self.rmse,
            "block_rmse_percent": self.block, "bias_percent": self.bias, "unbeaten": unbeaten,
        })
    }
}

/// Indices of those that no other beats in both time and error, the fastest first.
pub fn unbeaten(all: &[Candidate]) -> Vec<usize> {
    front(&all.iter().map(|c| (c.ms, c.rmse)).collect::<Vec<_>>())
}

/// The one that serves a wish best. `None`: none does.
pub fn choose(all: &[Candidate], wish: TuneGoal) -> Option<usize> {
    let curve = unbeaten(all).into_iter();
    match wish {
        // Along the curve time rises and error falls.
        TuneGoal::Budget(ms) => curve.rev().find(|i| all[*i].ms <= ms),
        TuneGoal::Error(percent) => {
            let mut curve = curve;
            curve.find(|i| all[*i].rmse <= percent)
        }
        TuneGoal::Balance => {
            let product = |i: &usize| all[*i].ms * all[*i].rmse;
            curve.min_by(|a, b| product(a).total_cmp(&product(b)))
        }
    }
}

/// The text of a variant that is the candidate.
pub fn variant(candidate: &Candidate, about: &str) -> String {
    let mut text = format!("Variant(\n    base: {:?},\n    about: {about:?},\n", candidate.graph);
    if !candidate.setting.is_empty() {
        text += "    params: {\n";
        for (name, value) in &candidate.setting {
            // A string takes any text.
            let _ = writeln!(text, "        {name:?}: (default: {value}),");
        }
        text += "    },\n";
    }
    text + ")\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<Candidate> {
        let one = |graph: &str, ms, rmse| Candidate {
            graph: graph.into(),
            setting: vec![],
            ms,
            rmse,
            block: rmse / 4.0,
            bias: 0.0,
        };
        vec![one("slow", 80.0, 2.0), one("quick", 10.0, 20.0), one("beaten", 40.0, 30.0), one("middle", 30.0, 5.0)]
    }

    #[test]
    fn a_wish_is_served_by_what_nothing_beats() {
        let all = all();
        let named = |wish| choose(&all, wish).map(|i| all[i].graph.as_str());
        assert_eq!(unbeaten(&all), [1, 3, 0]);
        assert_eq!(named(TuneGoal::Budget(50.0)), Some("middle"));
        assert_eq!(named(TuneGoal::Budget(5.0)), None);
        assert_eq!(named(TuneGoal::Error(6.0)), Some("middle"));
        assert_eq!(named(TuneGoal::Error(2.0)), Some("slow"));
        assert_eq!(named(TuneGoal::Error(1.0)), None);
        assert_eq!(named(TuneGoal::Balance), Some("middle"));
        assert_eq!(choose(&[], TuneGoal::Balance), None);
    }

    #[test]
    fn the_variant_says_what_differs() {
        let setting = vec![("rays".to_string(), Value::Uint(8)), ("cell".to_string(), Value::Float(0.5))];
        let candidate = Candidate { graph: "a.ron".into(), setting, ..all().remove(0) };
        let expected = "Variant(
    base: \"a.ron\",
    about: \"fast\",
    params: {
        \"rays\": (default: 8),
        \"cell\": (default: 0.5),
    },
)
";
        assert_eq!(variant(&candidate, "fast"), expected);
        assert_eq!(candidate.setting_text(), "rays=8 cell=0.5");
    }
}
