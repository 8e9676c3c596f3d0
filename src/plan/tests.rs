//! Small graphs to plans: what runs, in which order, in which memory.
//!
//! `machine` runs a plan with words for texels: a step makes a word of the words it reads. Plans of one graph must make
//! the same words, however they are ordered and whatever memory they share.

mod fastest;
mod keys;
mod machine;
mod memory;
mod order;
mod partial;
mod parts;
mod passes;
mod warnings;
mod wiring;
mod work;

use super::build::{Options, plan_with};
use super::fastest::{Choices, FIRST};
use super::request::{Request, sample_facts};
use super::{Desc, Plan, Resource, Step, TextureDesc, steps_of};
use crate::diag::{Checked, Source};
use crate::graph::{Graph, load};
use crate::project::Project;
use crate::shader::Library;
use crate::value::{Value, Values};
use std::path::Path;

/// Writes `there`.
const MAKE: &str = "
var there: texture_storage_2d<r32float, write>;
@compute @workgroup_size(8, 8)
fn make(@builtin(global_invocation_id) id: vec3u) { textureStore(there, id.xy, vec4f(1.0)); }
";

/// Reads `here`, writes `there`.
const TURN: &str = "
var here: texture_2d<f32>;
var there: texture_storage_2d<r32float, write>;
@compute @workgroup_size(8, 8)
fn turn(@builtin(global_invocation_id) id: vec3u) { textureStore(there, id.xy, textureLoad(here, id.xy, 0)); }
";

/// Sums a block of `source` to a texel of `result`.
const SUM: &str = "
var source: texture_2d<f32>;
var result: texture_storage_2d<r32float, write>;
@compute @workgroup_size(8, 8)
fn sum(@builtin(global_invocation_id) id: vec3u) { textureStore(result, id.xy, textureLoad(source, id.xy * 4, 0)); }
";

/// Writes a row of `there` for each iteration of the loop `n`.
const ROWS: &str = "
var<uniform> n: u32;
var there: texture_storage_2d<r32float, write>;
@compute @workgroup_size(8)
fn rows(@builtin(global_invocation_id) id: vec3u) { textureStore(there, vec2u(id.x, n), vec4f(1.0)); }
";

/// Turns with the clock.
const WHEN: &str = "
var<uniform> time: f32;
var here: texture_2d<f32>;
var there: texture_storage_2d<r32float, write>;
@compute @workgroup_size(8, 8)
fn turn(@builtin(global_invocation_id) id: vec3u) {
    textureStore(there, id.xy, time * textureLoad(here, id.xy, 0));
}
";

/// Holds what is there against what was.
const MEASURE: &str = "
var here: texture_2d<f32>;
var before: texture_2d<f32>;
var<storage, read_write> change: array<f32>;
@compute @workgroup_size(1)
fn measure() { change[0] = abs(textureLoad(here, vec2u(0), 0).r - textureLoad(before, vec2u(0), 0).r); }
";

/// A graph and shaders in memory.
pub(super) struct Sample {
    graph: Graph,
    texts: Library,
}

/// Resources, passes and outputs of a graph.
pub(super) fn sample(resources: &str, passes: &str, outputs: &str) -> Sample {
    sample_of(format!("Graph(resources: {{{resources}}}, passes: [{passes}], outputs: {{{outputs}}})"))
}

/// A whole graph.
pub(super) fn sample_of(text: String) -> Sample {
    let source = Source::new("test.ron", text);
    let graph = load(Path::new("test.ron"), &|_| Ok(source.clone())).unwrap_or_else(|f| panic!("{f}"));
    let shaders = [("make", MAKE), ("turn", TURN), ("sum", SUM), ("rows", ROWS), ("when", WHEN), ("measure", MEASURE)];
    let file = |(name, text): (&str, &str)| {
        let path = format!("{name}.wgsl");
        (path.clone(), Source::new(path, text))
    };
    Sample { graph, texts: Library { files: shaders.into_iter().map(file).collect(), ..Library::default() } }
}

impl Sample {
    fn try_plan(&self, options: Options, outputs: Option<&[String]>) -> Checked<Plan> {
        let (params, facts) = (Values::new(), sample_facts(true));
        try_plan(&self.graph, &self.texts, &params, &facts, options, outputs)
    }

    pub(super) fn plan(&self) -> Plan {
        self.with(Options::default())
    }

    /// The plan with these alternatives.
    fn choose(&self, choices: &Choices) -> Checked<Plan> {
        let request = Request {
            graph: &self.graph,
            texts: &self.texts,
            params: &Values::new(),
            facts: &sample_facts(true),
            screen: [64, 48],
            outputs: None,
            choices,
            levels: &[],
            limits: &wgpu_types::Limits::default(),
            features: wgpu_types::Features::FLOAT32_FILTERABLE,
        };
        plan_with(&request, Options::default()).map(|p| p.plan)
    }

    fn with(&self, options: Options) -> Plan {
        self.try_plan(options, None).unwrap_or_else(|f| panic!("{f}"))
    }
}

fn try_plan(
    graph: &Graph,
    library: &Library,
    params: &Values,
    facts: &Values,
    options: Options,
    outputs: Option<&[String]>,
) -> Checked<Plan> {
    let limits = &wgpu_types::Limits { max_multiview_view_count: 6, ..wgpu_types::Limits::default() };
    let features = wgpu_types::Features::FLOAT32_FILTERABLE | wgpu_types::Features::MULTIVIEW;
    let request = Request {
        graph,
        texts: library,
        params,
        facts,
        screen: [64, 48],
        outputs,
        choices: &FIRST,
        levels: &[],
        limits,
        features,
    };
    plan_with(&request, options).map(|p| p.plan)
}

/// The names of the graphs of the repository.
pub(super) fn all_shipped() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs/gi");
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.retain(|n| n.ends_with(".ron"));
    names.sort();
    assert!(!names.is_empty(), "{} has no graphs", folder.display());
    names
}

/// The plan of a graph of the repository, with every kind of light and material or with none.
pub(super) fn shipped(graph: &str, params: &[(&str, Value)], full: bool, options: Options) -> Plan {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs/gi").join(graph);
    let project = Project::open(&path, &[]).unwrap_or_else(|f| panic!("{f}"));
    let params: Values = params.iter().map(|(n, v)| ((*n).to_string(), *v)).collect();
    let facts = sample_facts(full);
    let mut plan =
        try_plan(&project.graph, &project.texts, &params, &facts, options, None).unwrap_or_else(|f| panic!("{f}"));
    // Not the path of this machine.
    plan.graph = format!("graphs/gi/{graph}");
    plan
}

impl Plan {
    fn resource(&self, name: &str) -> &Resource {
        self.resources.iter().find(|r| r.name == name).unwrap_or_else(|| panic!("no resource {name} in\n{self}"))
    }

    fn step(&self, name: &str) -> &Step {
        self.steps.iter().find(|s| s.name == name).unwrap_or_else(|| panic!("no step {name} in\n{self}"))
    }

    fn texture(&self, name: &str) -> &TextureDesc {
        match &self.resource(name).desc {
            Desc::Texture(t) => t,
            Desc::Buffer { .. } => panic!("{name} is a buffer"),
        }
    }

    /// Names of the steps in their order, loops opened.
    fn names(&self) -> Vec<&str> {
        steps_of(&self.order).into_iter().map(|s| self.steps[s.0].name.as_str()).collect()
    }
}

const IMAGE: &str = "Texture(format: R32Float, size: 8)";

/// A compute pass that writes one resource.
pub(super) fn make(name: &str, to: &str) -> String {
    format!("Compute(name: \"{name}\", shader: \"make.wgsl\", over: \"{to}\", bind: {{\"there\": \"{to}\"}}),")
}

/// A compute pass that reads one resource and writes another.
pub(super) fn turn(name: &str, from: &str, to: &str) -> String {
    let bind = format!("{{\"here\": \"{from}\", \"there\": \"{to}\"}}");
    format!("Compute(name: \"{name}\", shader: \"turn.wgsl\", over: \"{to}\", bind: {bind}),")
}

/// Equal images.
pub(super) fn images(names: &[&str]) -> String {
    names.iter().map(|n| format!("\"{n}\": {IMAGE},")).collect()
}
