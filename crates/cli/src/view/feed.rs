//! What the engine told, and what the window keeps of it.

use super::stage::Ask;
use super::variants::Variant;
use crate::probe_report::ProbeReport;
use lightgraph::internals::image::metrics::Metrics;
use lightgraph::internals::plan::ResourceId;
use lightgraph::internals::plan::change::Why;
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, FrameReport, Graph, Image, Plan, Scene};
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;

/// Frames that the bars look back on.
pub const HISTORY: usize = 120;

/// All there is to show at one moment.
#[derive(Debug, Clone, Default)]
pub struct ViewState {
    /// The number of the wish that this answers.
    pub serial: u64,
    /// Nothing more will come before something else is wished for.
    pub rest: bool,
    /// What is shown; it stays when what was wished for has faults.
    pub subject: Option<Arc<Subject>>,
    /// In linear light.
    pub image: Option<wgpu::Texture>,
    /// Counts the contents of `image` and `other`.
    pub images: u64,
    /// Stops that `image` is well exposed with, where the choice leaves them open.
    pub automatic: f32,
    /// What it is held against.
    pub other: Option<wgpu::Texture>,
    /// How often each of the two was rendered since it was last changed.
    pub frames: [u32; 2],
    /// The frame that this tells of; `None` where none was rendered.
    pub frame: Option<Arc<ShownFrame>>,
    /// Everything that stands in the way of what was wished for.
    pub faults: Arc<Vec<Diagnostic>>,
    /// The checks in shaders that do not hold in what is shown.
    pub checks: Arc<Vec<Diagnostic>>,
    pub notices: Arc<Vec<Diagnostic>>,
    pub score: Option<Arc<ShownScore>>,
    pub inspected: Option<Arc<ResourceView>>,
    pub probed: Option<Arc<ProbeAnswer>>,
    pub variants: Arc<Vec<Variant>>,
    /// The last image of each graph that is ready to be switched to, and a count of its contents.
    pub ready: Vec<(PathBuf, wgpu::Texture, u64)>,
    pub remade: Option<Remade>,
    /// The device is gone; nothing more will come.
    pub lost: bool,
}

/// A graph on a scene.
#[derive(Debug, Clone)]
pub struct Subject {
    pub graph: Arc<Graph>,
    pub path: PathBuf,
    /// What the plan was made with.
    pub params: Values,
    pub plan: Plan,
    /// As [`Subject::plan`], with memory shared as a run without a window shares it.
    pub shared: Plan,
    pub scene: Arc<Scene>,
    /// Time makes a difference: to the scene, or to a shader.
    pub moves: bool,
    /// A shader reads where the pointer is.
    pub points: bool,
}

/// A frame and why its steps ran.
#[derive(Debug, Clone)]
pub struct ShownFrame {
    pub report: FrameReport,
    /// By step.
    pub why: Vec<Why>,
}

/// How far the image is from the other one.
#[derive(Debug, Clone, PartialEq)]
pub enum ShownScore {
    Metrics(Metrics),
    /// It can't be said.
    Fault(String),
}

/// A resource as it is now.
#[derive(Debug)]
pub struct ResourceView {
    pub name: String,
    pub id: ResourceId,
    pub mip: u32,
    pub layer: u32,
    pub content: ResourceContent,
}

#[derive(Debug)]
pub enum ResourceContent {
    Plane(Image),
    /// The first words of a buffer, and how many bytes it has.
    Words(Vec<u32>, u64),
    Fault(String),
}

/// What an invocation computes that was asked.
#[derive(Debug)]
pub struct ProbeAnswer {
    pub ask: Ask,
    pub answer: Checked<ProbeReport>,
    /// Milliseconds until the answer.
    pub ms: f64,
}

/// What it took to make a session anew, in milliseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Remade {
    pub graph_ms: f64,
    pub scene_ms: f64,
    pub prepare_ms: f64,
    pub frame_ms: f64,
}

impl Remade {
    pub fn total_ms(self) -> f64 {
        self.graph_ms + self.scene_ms + self.prepare_ms + self.frame_ms
    }
}

/// The last that was told, and times of the frames before.
#[derive(Debug, Default)]
pub struct Feed {
    pub told: ViewState,
    /// By pass, in the order of the plan.
    pub passes: Vec<PassTimes>,
    /// Of whole frames, newest last: milliseconds on the device (as far as known), and from call to end.
    pub frames: VecDeque<[f64; 2]>,
}

/// The times of a pass.
#[derive(Debug, Clone, PartialEq)]
pub struct PassTimes {
    pub name: String,
    pub group: Option<String>,
    /// How many of its steps ran in the last frame, and how many there are.
    pub ran: usize,
    pub steps: usize,
    /// Why its first step ran or did not; why the pass is not in the plan.
    pub why: String,
    /// Milliseconds of the last frame in which it ran; `None` where the device can't say.
    pub gpu_ms: Option<f64>,
    pub cpu_ms: f64,
    /// Milliseconds on the device, or to encode where that is not known; newest last, 0 where it did not run.
    pub history: VecDeque<f32>,
}

impl Feed {
    /// Takes in what was told.
    pub fn take(&mut self, told: ViewState) {
        let same = match (&self.told.subject, &told.subject) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() == b.is_none(),
        };
        if let (false, Some(subject)) = (same, &told.subject) {
            let kept = std::mem::take(&mut self.passes);
            let other = self.told.subject.as_ref().is_some_and(|s| s.path != subject.path);
            self.passes = passes(&subject.plan, if other { &[] } else { &kept });
            if other {
                self.frames.clear();
            }
        }
        if let (Some(frame), Some(subject)) = (&told.frame, &told.subject) {
            self.add(frame, &subject.plan);
        }
        self.told = told;
    }

    fn add(&mut self, frame: &ShownFrame, plan: &Plan) {
        struct ErrorSum {
            ran: usize,
            gpu: Option<f64>,
            cpu: f64,
        }
        let mut sums: BTreeMap<&str, ErrorSum> = BTreeMap::new();
        for time in &frame.report.steps {
            let Some(step) = plan.steps.get(time.step) else { continue };
            let sum = sums.entry(&step.pass).or_insert(ErrorSum { ran: 0, gpu: Some(0.0), cpu: 0.0 });
            sum.ran += 1;
            sum.gpu = sum.gpu.zip(time.gpu_ms).map(|(a, b)| a + b);
            sum.cpu += time.cpu_ms;
        }
        for pass in &mut self.passes {
            let first = plan.steps.iter().position(|s| s.pass == pass.name);
            if let Some(why) = first.and_then(|i| frame.why.get(i)) {
                pass.why = why.to_string();
            }
            let sum = sums.get(pass.name.as_str());
            pass.ran = sum.map_or(0, |s| s.ran);
            if let Some(sum) = sum {
                (pass.gpu_ms, pass.cpu_ms) = (sum.gpu, sum.cpu);
            }
            // A frame in which nothing ran tells why, and is no part of the history.
            if !frame.report.steps.is_empty() {
                push(&mut pass.history, sum.map_or(0.0, |s| s.gpu.unwrap_or(s.cpu) as f32));
            }
        }
        if !frame.report.steps.is_empty() {
            let gpu = frame.report.steps.iter().filter_map(|t| t.gpu_ms).fold(0.0, |a, b| a + b);
            push(&mut self.frames, [gpu, frame.report.wall_ms]);
        }
    }
}

fn push<T>(history: &mut VecDeque<T>, value: T) {
    history.push_back(value);
    if history.len() > HISTORY {
        history.pop_front();
    }
}

/// The passes of a plan in its order, then those that do not run; with the times known from before.
fn passes(plan: &Plan, before: &[PassTimes]) -> Vec<PassTimes> {
    let mut all: Vec<PassTimes> = vec![];
    let blank = |name: &str, group: Option<String>, steps: usize, why: &str| PassTimes {
        name: name.into(),
        group,
        ran: 0,
        steps,
        why: why.into(),
        gpu_ms: None,
        cpu_ms: 0.0,
        history: VecDeque::new(),
    };
    let mut places: BTreeMap<&str, usize> = BTreeMap::new();
    for step in &plan.steps {
        match places.get(step.pass.as_str()) {
            Some(i) => all[*i].steps += 1,
            None => {
                places.insert(&step.pass, all.len());
                all.push(blank(&step.pass, step.group.clone(), 1, ""));
            }
        }
    }
    all.extend(plan.skipped.iter().map(|(name, why)| blank(name, None, 0, why)));
    for pass in &mut all {
        if let Some(old) = before.iter().find(|p| p.name == pass.name) {
            pass.history = old.history.clone();
            (pass.gpu_ms, pass.cpu_ms) = (old.gpu_ms, old.cpu_ms);
        }
    }
    all
}
