//! The file of cases: what is rendered, and what must come out.

use super::number::{CaseNames, Formula};
use super::shape::SceneShape;
use lightgraph::internals::diag::{Source, Span};
use lightgraph::{Checked, Diagnostic};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Everything that is run.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cases {
    /// Parameters that keep graphs small; each graph takes those it has.
    #[serde(default)]
    pub(super) settings: BTreeMap<String, String>,
    /// By file name without its ending: the graphs of a quick run.
    pub(super) quick: Vec<String>,
    /// Where random parameters are tried.
    pub(super) random: Random,
    /// Through which the camera flies.
    pub(super) fly: Fly,
    /// What adapters are compared on.
    pub(super) adapters: Adapters,
    /// Graphs that an adapter is known to draw wrongly.
    #[serde(default)]
    pub(super) unfit: Vec<Unfit>,
    pub(super) cases: Vec<Case>,
    /// Folders of shaders for the cases' own graphs, relative to the file.
    #[serde(default)]
    pub(super) shaders: Vec<PathBuf>,
    /// Where the file is.
    #[serde(skip)]
    pub(super) folder: PathBuf,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Unfit {
    /// By file name without its ending.
    pub graph: String,
    /// A part of the adapter's name.
    pub adapter: String,
    pub why: String,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Random {
    pub scene: SceneShape,
    /// Pixels.
    pub size: (u32, u32),
    /// How much larger than under `settings` all parameters together may be: the product of each one's growth.
    pub growth: f64,
    /// How many times the work of the plan under `settings` a plan may do.
    pub work: f64,
    /// Parameters whose price is the compiler's, which no plan knows: whole numbers that are no larger than these.
    #[serde(default)]
    pub most: BTreeMap<String, String>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Fly {
    pub scene: SceneShape,
    pub size: (u32, u32),
    pub frames: u32,
    /// Parameters in place of those of [`Cases::settings`].
    #[serde(default)]
    pub set: BTreeMap<String, String>,
    /// By file name without its ending: the graphs that fly.
    pub graphs: Vec<String>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Adapters {
    pub scene: SceneShape,
    pub size: (u32, u32),
    pub output: String,
    /// Root-mean-square difference over the root-mean-square of the image.
    pub bound: f64,
    /// The share of pixels, those that differ most, that don't count: where a pixel's centre lies on the edge of a
    /// surface or of a shadow, drivers round to one side or the other.
    pub edges: f64,
}

/// A scene, settings, and what must come out.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Case {
    pub name: String,
    /// What is known of the right answer.
    pub about: String,
    /// Rendered even where time is short: its first combination, with the graphs of a quick run.
    #[serde(default)]
    pub quick: bool,
    pub scene: SceneShape,
    /// One run for every combination.
    #[serde(default)]
    pub over: BTreeMap<String, Vec<String>>,
    /// Only these combinations, each in the order of the names of `over`; empty: all.
    #[serde(default)]
    pub only: Vec<Vec<String>>,
    /// On top of the common settings; a value that is a name of `over` stands for its value.
    #[serde(default)]
    pub set: BTreeMap<String, String>,
    #[serde(default)]
    pub graphs: Graphs,
    /// A graph of its own, relative to the file of cases, instead of those that ship.
    #[serde(default)]
    pub graph: Option<PathBuf>,
    /// What is laid over that graph: the fields of a variant without its base.
    #[serde(default)]
    pub variant: Option<String>,
    /// Parameters without which a graph is none for this case.
    #[serde(default)]
    pub needs: Vec<String>,
    /// Pixels.
    #[serde(default = "usual_size")]
    pub size: (u32, u32),
    #[serde(default)]
    pub camera: Option<String>,
    #[serde(default = "one")]
    pub frames: u32,
    pub expect: Expect,
    /// How far the answer may be off.
    #[serde(default)]
    pub bound: Formula,
    /// By graph: another expected value, bound or number of frames.
    #[serde(default)]
    pub instead: BTreeMap<String, Instead>,
    /// Words that a notice of the scene must hold.
    #[serde(default)]
    pub says: Option<String>,
    /// Why the bound is no smaller, where it is a limit that is known.
    #[serde(default)]
    pub limit: Option<String>,
}

/// Which graphs a case is for.
#[derive(Debug, Clone, Default, Deserialize)]
pub(super) enum Graphs {
    #[default]
    All,
    /// By file name without its ending.
    Only(Vec<String>),
    /// All but those, and why.
    Without(BTreeMap<String, String>),
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Instead {
    #[serde(default)]
    pub value: Option<Formula>,
    #[serde(default)]
    pub bound: Option<Formula>,
    #[serde(default)]
    pub frames: Option<u32>,
    #[serde(default)]
    pub limit: Option<String>,
}

/// What must come out. Whatever it is, no step may leave numbers that are none.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) enum Expect {
    /// Nothing more.
    Finite,
    /// Every channel of every pixel has this value, within a relative bound.
    Uniform { output: String, value: Formula },
    /// The mean of all channels of all pixels has it.
    Mean { output: String, value: Formula },
    /// The image is `gain` times that of another scene or setting: root-mean-square difference over root-mean-square.
    Like {
        output: String,
        #[serde(default)]
        scene: Option<Box<SceneShape>>,
        #[serde(default)]
        set: BTreeMap<String, String>,
        #[serde(default)]
        gain: Option<Formula>,
    },
    /// The mean over what another camera sees, over the mean of this one's, is at most the bound.
    Dark { output: String, camera: String },
    /// The sum of all values of an output.
    Total { output: String, value: Formula },
    /// One output holds the sum of another's values, channel by channel: the error over the sum of the magnitudes.
    SumOf { sum: String, terms: String },
    /// The part of an output that is below zero, over the whole, is at most the bound.
    Negative { output: String },
    /// The loader refuses the scene, in these words.
    Refused { says: String },
}

fn one() -> u32 {
    1
}

fn usual_size() -> (u32, u32) {
    (12, 8)
}

impl Cases {
    /// Reads a file of cases.
    ///
    /// # Errors
    /// A file that can't be read or is no file of cases, with the place.
    pub fn read(path: &Path) -> Checked<Cases> {
        let source = Source::read(path)?;
        let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        let mut cases: Cases = options.from_str(&source.text).map_err(|e| {
            let place = |line: usize, column: usize| {
                let start: usize = source.text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
                let rest = source.text.get(start..).unwrap_or("");
                start + rest.char_indices().nth(column.saturating_sub(1)).map_or(rest.len(), |c| c.0)
            };
            let (start, end) = (place(e.span.start.line, e.span.start.col), place(e.span.end.line, e.span.end.col));
            Diagnostic::error(format!("no file of cases: {}", e.code))
                .at(&Span::new(&source, start..end.max(start)), "")
        })?;
        cases.folder = path.parent().unwrap_or(Path::new("")).into();
        Ok(cases)
    }
}

impl Case {
    /// The names of every run, with their values.
    pub fn runs(&self) -> Vec<CaseNames> {
        if !self.only.is_empty() {
            let run = |values: &Vec<String>| self.over.keys().cloned().zip(values.iter().cloned()).collect();
            return self.only.iter().map(run).collect();
        }
        let mut runs = vec![CaseNames::new()];
        for (name, values) in &self.over {
            let with = |names: &CaseNames, value: &String| {
                let mut names = names.clone();
                names.insert(name.clone(), value.clone());
                names
            };
            runs = runs.iter().flat_map(|n| values.iter().map(move |v| with(n, v))).collect();
        }
        runs
    }

    /// Whether a graph (its file name without the ending) is one of those it is for.
    pub fn is_for(&self, graph: &str, has: impl Fn(&str) -> bool) -> bool {
        let listed = match &self.graphs {
            Graphs::All => true,
            Graphs::Only(names) => names.iter().any(|n| n == graph),
            Graphs::Without(names) => !names.contains_key(graph),
        };
        listed && self.needs.iter().all(|n| has(n))
    }

    /// Whether no graph matters: the loader alone answers.
    pub fn is_of_the_loader(&self) -> bool {
        matches!(self.expect, Expect::Refused { .. })
    }

    /// Why the bound is no smaller for a graph.
    pub fn limit_of(&self, graph: &str) -> Option<&str> {
        self.instead.get(graph).and_then(|i| i.limit.as_deref()).or(self.limit.as_deref())
    }
}

/// `NAME=VALUE` for the settings, later ones before earlier, names of `over` replaced.
pub(super) fn settings(layers: &[&BTreeMap<String, String>], names: &CaseNames) -> BTreeMap<String, String> {
    let mut all = BTreeMap::new();
    for (name, value) in layers.iter().copied().flatten() {
        all.insert(name.clone(), names.get(value).unwrap_or(value).clone());
    }
    all
}
