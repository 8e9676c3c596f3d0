//! From files to frames: a graph with its shaders, a scene, a plan for both, and what the device holds for it.

use crate::diag::{Checked, Diagnostic, Faults, Source};
use crate::gpu::{self, Frame, FrameReport, Gpu, Prepared};
use crate::graph::{self, Graph};
use crate::image::Image;
use crate::plan::build::{Options, Planned, plan_with};
use crate::plan::change::{self, Held, Why};
use crate::plan::request::Request;
use crate::plan::{Plan, ResourceId};
use crate::scene::{Pose, Scene, Shift, Table};
use crate::shader::{Library, Shader};
use crate::value::{Value, Values};
use crate::verify::Scratch;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A graph and the shaders it may use.
#[derive(Debug, Clone)]
pub struct Project {
    pub graph: Graph,
    pub texts: Library,
}

impl Project {
    /// Reads a graph file and the shader folders: those given, then `shaders` beside the graph, then `../shaders`.
    ///
    /// # Errors
    /// Every fault of the graph file and its bases, and shader files that can't be read.
    pub fn open(path: &Path, shaders: &[PathBuf]) -> Checked<Project> {
        let graph = graph::load(path, &Source::read)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let usual = [folder.join("shaders"), folder.join("../shaders")];
        let mut folders: Vec<PathBuf> = shaders.to_vec();
        folders.extend(usual.into_iter().filter(|f| f.is_dir()));
        Ok(Project { graph, texts: Library::load(&folders)? })
    }

    /// Parameters from `NAME=VALUE` texts.
    ///
    /// # Errors
    /// Unknown names, values of the wrong type or out of range; all at once.
    pub fn params(&self, settings: &[String]) -> Checked<Values> {
        let mut values = Values::new();
        let mut faults = vec![];
        for text in settings {
            let Some((name, value)) = text.split_once('=') else {
                faults.push(Diagnostic::error(format!("`{text}` is not NAME=VALUE")));
                continue;
            };
            let (name, value) = (name.trim(), value.trim());
            let Some((_, param)) = self.graph.params.iter().find(|(n, _)| n.value == name) else {
                let d = Diagnostic::error(format!("the graph has no parameter `{name}`"));
                faults.push(d.nearest(name, self.graph.params.iter().map(|(n, _)| n.value.as_str())));
                continue;
            };
            match param.read(value) {
                None => {
                    let d = Diagnostic::error(format!("`{name}`: `{value}` is not a {}", param.ty.wgsl()));
                    faults.push(d.at(&param.span, "declared here"));
                }
                Some(v) => match param.accepts(&v) {
                    Ok(()) => drop(values.insert(name.to_string(), v)),
                    Err(why) => {
                        let d = Diagnostic::error(format!("parameter `{name}` = {v} is {why}"));
                        faults.push(d.at(&param.span, "declared here"));
                    }
                },
            }
        }
        Faults::check(faults, values)
    }
}

/// What a session renders.
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
    /// Leave out steps whose results are still in memory.
    pub skip: bool,
    /// Run every step of every frame a second time, in memory of its own, and compare all contents bit for bit.
    pub verify: bool,
    /// Check the numbers that every step leaves; see [`FrameReport::numerics`].
    pub watch: bool,
}

/// Plans a project for a scene with an adapter's limits.
///
/// # Errors
/// As [`crate::plan::build::plan`].
pub fn plan_for(project: &Project, scene: &Scene, settings: &Settings, gpu: &Gpu) -> Checked<Planned> {
    let request = Request {
        graph: &project.graph,
        texts: &project.texts,
        params: &settings.params,
        facts: &scene.facts(),
        screen: settings.size,
        outputs: settings.outputs.as_deref(),
        limits: &gpu.limits,
        features: gpu.features,
    };
    plan_with(&request, Options { readable: settings.verify || settings.watch, ..Options::default() })
}

/// A plan on a device, ready for frames.
pub struct Session {
    pub scene: Scene,
    pub settings: Settings,
    pub plan: Plan,
    /// What the user should know about the plan and the view.
    pub notices: Vec<Diagnostic>,
    /// How far cameras, lights and nodes of the next frames are from where the scene says.
    pub shift: Shift,
    /// The texts that the plan's shaders were made from.
    texts: Library,
    prepared: Prepared,
    pose: Pose,
    /// What memory holds; `None` runs every step of every frame.
    held: Option<Held>,
    /// By step: why it ran or did not in the last frame.
    why: Vec<Why>,
    scratch: Option<Scratch>,
}

impl Session {
    /// Plans and prepares.
    ///
    /// # Errors
    /// Faults of the graph for this scene, and what the device can't do.
    pub fn new(gpu: &Gpu, project: &Project, scene: Scene, settings: Settings) -> Checked<Session> {
        Session::after(gpu, project, scene, settings, None)
    }

    /// As [`Session::new`], in place of another session, which stays as it is when this one fails: pipelines of shaders
    /// that did not change are taken over, and resources with history keep what they hold.
    ///
    /// # Errors
    /// As [`Session::new`].
    pub fn after(
        gpu: &Gpu,
        project: &Project,
        scene: Scene,
        settings: Settings,
        previous: Option<&Session>,
    ) -> Checked<Session> {
        let Planned { mut plan, mut notices } = plan_for(project, &scene, &settings, gpu)?;
        if let Some(previous) = previous {
            for shader in &mut plan.shaders {
                let same = |old: &&Arc<Shader>| unchanged(old, shader, &previous.texts, &project.texts);
                if let Some(old) = previous.plan.shaders.iter().find(same) {
                    *shader = old.clone();
                }
            }
        }
        let pose = scene.pose(0.0);
        let [width, height] = settings.size;
        notices.extend(scene.camera_values(&pose, settings.camera.as_deref(), width, height)?.1);
        let tables = tables(&scene, &plan, &pose);
        let earlier = previous.map(|p| (&p.plan, &p.prepared));
        let mut prepared = gpu::prepare_after(gpu, &plan, &scene.geometry, scene.textures.as_ref(), &tables, earlier)?;
        if settings.watch {
            prepared.watch(gpu)?;
        }
        let held = settings.skip.then(Held::default);
        let scratch = match settings.verify {
            true => Some(Scratch::new(gpu, &plan, &scene, &tables)?),
            false => None,
        };
        let shift = Shift::default();
        let texts = project.texts.clone();
        Ok(Session { scene, settings, plan, notices, shift, texts, prepared, pose, held, why: vec![], scratch })
    }

    /// Renders frame number `index` at `time` (seconds).
    ///
    /// # Errors
    /// What the device reports, with the pass's name.
    pub fn frame(&mut self, gpu: &Gpu, index: u32, time: f32) -> Checked<FrameReport> {
        let pose = self.scene.pose_shifted(time, &self.shift);
        let [width, height] = self.settings.size;
        let camera = self.settings.camera.as_deref();
        let (mut values, _) = self.scene.camera_values(&pose, camera, width, height)?;
        values.insert("frame".into(), Value::Uint(index));
        values.insert("time".into(), Value::Float(time));
        let stale = self.why.is_empty() || !pose.same_tables(&self.pose);
        let moved = stale.then(|| tables(&self.scene, &self.plan, &pose));
        let tables = moved.as_deref();
        // After a fault nothing is known of what memory holds: the next frame begins anew.
        let held = std::mem::replace(&mut self.held, self.settings.skip.then(Held::default));
        self.why = vec![];
        let selection = match held {
            Some(held) => Some(change::select(&self.plan, &held, &values, tables)?),
            None => None,
        };
        let run = selection.as_ref().map(|s| s.run.as_slice());
        let frame = Frame { values, tables, run };
        let report = gpu::execute(gpu, &self.plan, &mut self.prepared, &frame)?;
        if let (Some(scratch), Some(selection)) = (&mut self.scratch, &selection) {
            scratch.verify(gpu, &self.plan, &self.prepared, selection, &frame)?;
        }
        self.pose = pose;
        match selection {
            Some(selection) => {
                self.why.clone_from(&selection.why);
                self.held = Some(selection.done());
            }
            None => self.why = vec![Why::First; self.plan.steps.len()],
        }
        Ok(report)
    }

    /// By step: why it ran or did not in the last frame. Empty before the first.
    pub fn why(&self) -> &[Why] {
        &self.why
    }

    /// Reads an output back.
    ///
    /// # Errors
    /// An unknown output, or one that holds no image.
    pub fn image(&self, gpu: &Gpu, output: &str) -> Checked<Image> {
        gpu::read_image(gpu, &self.prepared, &self.plan, self.output(output)?)
    }

    fn output(&self, name: &str) -> Checked<ResourceId> {
        match self.plan.outputs.iter().find(|o| o.0 == name) {
            Some((_, id)) => Ok(*id),
            None => {
                let d = Diagnostic::error(format!("the output `{name}` was not asked for"));
                Err(d.nearest(name, self.plan.outputs.iter().map(|o| o.0.as_str())).into())
            }
        }
    }
}

/// The tables that the plan's shaders read.
fn tables(scene: &Scene, plan: &Plan, pose: &Pose) -> Vec<Table> {
    scene.tables_named(pose, |name| plan.tables.iter().any(|t| t.table == name))
}

/// Whether two shaders are the same composition of the same texts.
fn unchanged(old: &Shader, new: &Shader, before: &Library, now: &Library) -> bool {
    let text = |library: &Library, path: &String| library.files.get(path).map(|s| s.text.clone());
    old.path == new.path
        && old.defs == new.defs
        && old.sources == new.sources
        && new.sources.iter().all(|path| text(before, path) == text(now, path))
}
