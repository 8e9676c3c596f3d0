//! The file that says what to measure.

use lightgraph::internals::diag::{Source, Span};
use lightgraph::{Checked, Diagnostic};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Everything to measure. Paths are relative to the folder that the command runs in.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SpeedList {
    pub chains: Vec<Chain>,
    pub pairs: Vec<GraphPair>,
    pub published: Vec<OtherTime>,
    pub renderers: Vec<OtherRenderer>,
    pub scaling: Vec<Scaling>,
    pub loads: Vec<Load>,
    pub starts: Vec<StartUp>,
    pub times: Vec<Time>,
    pub bounds: Option<Rooflines>,
}

/// A graph on a scene.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraphRun {
    pub graph: String,
    pub scene: String,
    /// As on the command line: `NAME=VALUE`.
    #[serde(default)]
    pub set: Vec<String>,
    /// Outputs to produce; empty: all.
    #[serde(default)]
    pub outputs: Vec<String>,
    /// Pixels.
    #[serde(default = "size")]
    pub size: (u32, u32),
}

fn size() -> (u32, u32) {
    (128, 128)
}

/// What is new in each timed frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
pub enum Moves {
    /// Every step runs.
    #[default]
    All,
    /// Lights move; what doesn't depend on them is kept.
    Lights,
    /// The camera moves.
    Camera,
}

/// One graph against another that makes the same.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraphPair {
    pub name: String,
    pub fast: GraphRun,
    /// The graph to be faster than, run as `fast` is.
    pub slow: String,
    pub moves: Moves,
    /// How many times as fast it is to be.
    pub at_least: f64,
    /// An output that both make, and how far apart they may be: rmse in percent of the mean.
    #[serde(default)]
    pub equal: Option<(String, f64)>,
}

/// A time that others have measured, elsewhere.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OtherTime {
    pub name: String,
    /// Whose it is, and on what it was measured.
    pub origin: String,
    pub seconds: f64,
    /// Of the output `output` against the reference image of the scene.
    pub rmse_percent: f64,
    pub run: GraphRun,
    pub output: String,
    pub at_least: f64,
}

/// Another renderer, on the same scene and machine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OtherRenderer {
    pub name: String,
    /// The folder of the files that describe renderers, and the name in one of them.
    pub peer: (String, String),
    /// What of its settings must be so. Only those are run, and the one counts that errs least among all that err no
    /// less than our image.
    #[serde(default)]
    pub setting: BTreeMap<String, String>,
    /// Its size is that of the reference images: errors are taken there.
    pub run: GraphRun,
    /// The output whose rmse counts.
    pub output: String,
    /// Pixels of the images that are timed.
    pub image: (u32, u32),
    /// Which of our times its time is set beside.
    pub ours: Ours,
    /// How many times as fast ours is to be.
    pub at_least: f64,
    /// The same of a frame after the camera moved.
    #[serde(default)]
    pub moved_at_least: Option<f64>,
}

/// One of our times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum Ours {
    /// From reading the files to the image, with what the driver caches there.
    Files,
    /// A frame in which every step runs, with pipelines ready.
    Frame,
}

/// A graph that grows.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scaling {
    pub name: String,
    pub run: GraphRun,
    /// Settings from small to large, each on top of `run.set`.
    #[serde(default)]
    pub steps: Vec<String>,
    /// In place of settings: scenes from small to large, each in place of `run.scene`.
    #[serde(default)]
    pub scenes: Vec<String>,
    #[serde(default)]
    pub moves: Moves,
    /// An expression over parameters and derived values: what time and bytes are divided by.
    pub per: String,
    /// Resources that are not counted in the bytes.
    #[serde(default)]
    pub without: Vec<String>,
    pub most_bytes: f64,
    /// By how much the time of one may grow from the second setting to the last.
    pub most_growth: f64,
}

/// A generated scene.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Load {
    /// A ground of so many triangles, read and sorted for rays.
    Triangles {
        count: u32,
        most_ms: f64,
        /// Peak, in sizes of the file.
        most_memory: f64,
    },
    /// JPEG files, each the base color of a material, read and decoded with their mips.
    Textures {
        count: u32,
        /// Pixels along an edge.
        edge: u32,
        most_ms: f64,
    },
    /// Frames of a skinned mesh of so many vertices, each at another pose: what the host does for one.
    Poses { vertices: u32, frames: u32, graph: String, most_ms: f64 },
}

/// From reading the files to the first pixel.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartUp {
    pub name: String,
    pub run: GraphRun,
    pub most_ms: f64,
}

/// A time that holds on a GPU only.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Time {
    pub name: String,
    pub run: GraphRun,
    pub moves: Moves,
    pub most_ms: f64,
}

/// A graph of any number of passes, and a program written by hand that does the same.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chain {
    pub name: String,
    pub run: GraphRun,
    /// The parameter that says how many.
    pub count: String,
    pub few: u32,
    pub many: u32,
    /// The setting under which the passes do enough to be compared with the program written by hand.
    pub work: String,
    pub most_encode_us: f64,
    pub most_ratio: f64,
}

/// Steps against what the adapter can do.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rooflines {
    /// A graph with a step that only copies, and that step's name.
    pub copy: (GraphRun, String),
    /// A graph with a step that only multiplies and adds, that step's name, and its operations as an expression.
    pub fma: (GraphRun, String, String),
    pub runs: Vec<GraphRun>,
    /// Operations of a step by its pass, as expressions; others count by their bytes alone.
    #[serde(default)]
    pub operations: BTreeMap<String, String>,
    /// Steps this many times above their bound are named.
    pub most_ratio: f64,
}

impl Scaling {
    /// The runs from small to large, each with what it is called.
    pub fn runs(&self) -> Vec<(String, GraphRun)> {
        let set = |step: &String| {
            let set = self.run.set.iter().chain([step]).cloned().collect();
            (step.clone(), GraphRun { set, ..self.run.clone() })
        };
        let on = |scene: &String| (scene.clone(), GraphRun { scene: scene.clone(), ..self.run.clone() });
        self.steps.iter().map(set).chain(self.scenes.iter().map(on)).collect()
    }
}

impl SpeedList {
    /// Reads a list.
    ///
    /// # Errors
    /// A file that can't be read or is no list, with the place.
    pub fn read(path: &Path) -> Checked<SpeedList> {
        let source = Source::read(path)?;
        ron::Options::default()
            .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
            .from_str(&source.text)
            .map_err(|e| {
                let line: usize = e.span.start.line.saturating_sub(1);
                let start: usize = source.text.split_inclusive('\n').take(line).map(str::len).sum();
                let at = (start + e.span.start.col.saturating_sub(1)).min(source.text.len());
                let at = (0..=at).rev().find(|i| source.text.is_char_boundary(*i)).unwrap_or(0);
                Diagnostic::error(e.code.to_string()).at(&Span::new(&source, at..at), "").into()
            })
    }
}
