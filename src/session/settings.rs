//! Holds the settings of a session, and plans a project for a scene with them.

use super::{Probing, Session};
use crate::diag::Checked;
use crate::gpu::{Gpu, Timing};
use crate::graph::Graph;
use crate::plan::build::{Options, Planned, plan_with};
use crate::plan::draw::{asked_parts, parts};
use crate::plan::fastest::Choices;
use crate::plan::inputs::InputKind;
use crate::plan::request::{self, Request};
use crate::project::Project;
use crate::scene::{Level, Scene};
use crate::shader::Library;
use crate::value::Values;
use std::sync::Arc;

/// What a session renders, and how.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// Parameters that differ from their defaults.
    pub params: Values,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// A camera's name; `None`: the scene's default.
    pub camera: Option<String>,
    /// Outputs to produce; `None`: all.
    pub outputs: Option<Vec<String>>,
    /// Which alternatives run, by the names of their groups; the first of those that aren't named.
    /// [`crate::internals::fastest::measured`] finds the fastest here.
    pub choices: Choices,
    /// Leave out steps whose results are still in memory.
    pub skip: bool,
    /// Whether each step is timed, or frames alone: what the former takes by itself some GPUs notice.
    pub timing: Timing,
    /// Run every step of every frame a second time, in memory of its own, and compare all contents bit for bit.
    pub verify: bool,
    /// Check the numbers that every step leaves; see [`crate::FrameReport::numerics`].
    pub watch: bool,
    /// Every resource keeps memory of its own and can be looked at after the frame.
    pub inspect: bool,
    /// A pass whose invocations can be asked what they compute; see [`super::Session::probe`].
    pub probe: Option<Probing>,
    /// For tests of the proof: a kind of ingredient that is left out of every key, so that contents become wrong.
    pub without: Option<InputKind>,
}

/// Plans a project for a scene with an adapter's limits.
///
/// # Errors
/// As [`crate::plan::build::plan`].
pub fn plan_for(project: &Project, scene: &Scene, settings: &Settings, gpu: &Gpu) -> Checked<Planned> {
    plan_of(&project.graph, &project.texts, scene, settings, gpu).map(|(planned, _)| planned)
}

/// A plan, and the levels of the scene that it draws.
pub(super) fn plan_of(
    graph: &Graph,
    texts: &Library,
    scene: &Scene,
    settings: &Settings,
    gpu: &Gpu,
) -> Checked<(Planned, Vec<Arc<Level>>)> {
    let facts = scene.facts();
    let request = request_for((graph, texts), &facts, settings, gpu);
    let levels = parts(&asked_parts(&request), scene)?;
    let readable = settings.verify || settings.inspect || settings.watch;
    let options = Options { readable, share: !settings.inspect, ..Options::default() };
    Ok((plan_with(&Request { levels: &levels, ..request }, options)?, levels))
}

/// Without the scene's levels.
fn request_for<'r>(
    (graph, texts): (&'r Graph, &'r Library),
    facts: &'r Values,
    settings: &'r Settings,
    gpu: &'r Gpu,
) -> Request<'r> {
    Request {
        graph,
        texts,
        params: &settings.params,
        facts,
        screen: settings.size,
        outputs: settings.outputs.as_deref(),
        choices: &settings.choices,
        levels: &[],
        limits: &gpu.limits,
        features: gpu.features,
    }
}

/// What the expressions of a graph are computed from.
///
/// # Errors
/// As [`request::values`].
pub(crate) fn values_for(project: &Project, scene: &Scene, settings: &Settings, gpu: &Gpu) -> Checked<Values> {
    request::values(&request_for((&project.graph, &project.texts), &scene.facts(), settings, gpu))
}

impl Session {
    /// Plans anew if keyframes of the scene file give the graph other parameters at `time` than it has, and returns
    /// whether they do. Call it before each frame of a sequence, with the session's project.
    ///
    /// # Errors
    /// As [`Session::new`]; the session stays as it is.
    pub fn retime(&mut self, gpu: &Gpu, project: &Project, time: f32) -> Checked<bool> {
        if self.scene.params.is_empty() {
            return Ok(false);
        }
        let params = project.params_at(&self.settings.params, &self.scene, time)?;
        if params == self.params {
            return Ok(false);
        }
        let (scene, settings) = (self.scene.clone(), self.settings.clone());
        let next = Session::with_params(gpu, project, scene, settings, params, Some(self))?;
        *self = Session { shift: self.shift.clone(), ..next };
        Ok(true)
    }
}
