//! Runs a graph on a scene, frame after frame: owns the plan and what the device holds for it.

mod capture;
mod last;
mod probe;
mod settings;

pub use last::Pointer;
pub use probe::Probing;
pub use settings::{Settings, plan_for};

use last::Last;
use settings::plan_of;
pub(crate) use settings::values_for;

use crate::diag::{Checked, Diagnostic};
use crate::gpu::{self, Frame, FrameInputs, FrameReport, Gpu, Memory, PendingImage, Prepared};
use crate::image::Image;
use crate::plan::build::Planned;
use crate::plan::change::{self, Held, Selection, Why};
use crate::plan::keys::{Keys, UNDEFINED, Version};
use crate::plan::tables::SceneInputs;
use crate::plan::{Action, Binding, Plan, Resource, ResourceId, StepId, cull};
use crate::project::Project;
use crate::scene::{Level, Pose, Scene, Shift, Table, Tables};
use crate::shader::Library;
use crate::shader::report::Failed;
use crate::value::Values;
use crate::verify::Scratch;
use std::collections::BTreeMap;
use std::sync::Arc;
use web_time::Instant;

/// A plan on a device, ready for frames.
///
/// ```no_run
/// use lightgraph::{Checked, Gpu, Project, Scene, Session, Settings};
/// use std::path::Path;
///
/// fn render(frames: u32) -> Checked<()> {
///     let gpu = Gpu::open()?;
///     let project = Project::open(Path::new("lightgraph:graphs/gi/direct.ron"), &[])?;
///     let scene = Scene::load(Path::new("scenes/cornell.glb"))?.scene;
///     let settings = Settings { size: [320, 240], skip: true, ..Settings::default() };
///     let mut session = Session::new(&gpu, &project, scene, settings)?;
///     for step in &session.plan.steps {
///         println!("{}", step.name);
///     }
///     for index in 0..frames {
///         let report = session.frame(&gpu, index, index as f32 / 60.0)?;
///         println!("{} steps ran in {:.1} ms", report.steps.len(), report.wall_ms);
///     }
///     session.image(&gpu, "color")?.save(Path::new("direct.png"))
/// }
/// ```
pub struct Session {
    pub scene: Arc<Scene>,
    pub settings: Settings,
    /// With those that the scene gives at the time.
    params: Values,
    pub plan: Plan,
    /// What the user should know about the plan and the view.
    pub notices: Vec<Diagnostic>,
    /// Milliseconds that the plan took, before anything was asked of the device.
    pub plan_ms: f64,
    /// Of them: to compose the shaders.
    pub compose_ms: f64,
    /// How far cameras, lights and nodes of the next frames are from where the scene says.
    pub shift: Shift,
    /// The texts that the plan's shaders were made from.
    texts: Library,
    prepared: Prepared,
    keys: Keys,
    held: Held,
    /// What the uploaded tables and the rest of the scene are, hashed.
    inputs: SceneInputs,
    tables: Tables,
    /// The tables are on the device.
    uploaded: bool,
    /// For graphs that read where it is.
    pub pointer: Pointer,
    last: Last,
    /// By step: why it ran or did not in the last frame.
    why: Vec<Why>,
    scratch: Option<Scratch>,
    /// The pass that is asked what it computes.
    probe: Option<probe::Probed>,
}

impl Session {
    /// Plans and prepares.
    ///
    /// # Errors
    /// Faults of the graph for this scene, and what the device can't do.
    pub fn new(gpu: &Gpu, project: &Project, scene: impl Into<Arc<Scene>>, settings: Settings) -> Checked<Session> {
        Session::after(gpu, project, scene, settings, None)
    }

    /// As [`Session::new`], in place of another session, which stays as it is when this one fails. What the two have in
    /// common is not made again: shaders of the same texts, memory that holds what this one wants, resources with
    /// history. The other session may go on: both know what is in the memory that they share.
    ///
    /// # Errors
    /// As [`Session::new`].
    pub fn after(
        gpu: &Gpu,
        project: &Project,
        scene: impl Into<Arc<Scene>>,
        settings: Settings,
        previous: Option<&Session>,
    ) -> Checked<Session> {
        let (scene, time) = (same_scene(scene.into(), previous), previous.map_or(0.0, |p| p.last.time));
        let params = project.params_at(&settings.params, &scene, time)?;
        Session::with_params(gpu, project, scene, settings, params, previous)
    }

    /// As [`Session::after`], with parameters as the scene gives them at a time.
    fn with_params(
        gpu: &Gpu,
        project: &Project,
        scene: Arc<Scene>,
        settings: Settings,
        params: Values,
        previous: Option<&Session>,
    ) -> Checked<Session> {
        let texts = match previous {
            Some(previous) => project.texts.clone().after(&previous.texts),
            None => project.texts.clone(),
        };
        let hashes = match previous.filter(|p| Arc::ptr_eq(&p.scene, &scene)) {
            Some(previous) => previous.inputs.assets,
            None => scene.assets().hashes,
        };
        let start = Instant::now();
        let planned = Settings { params, ..settings.clone() };
        let (Planned { mut plan, mut notices, warnings, compose_ms }, levels) =
            plan_of(&project.graph, &texts, &scene, &planned, gpu)?;
        notices.extend(project.params_of_others(&scene));
        let probe = settings.probe.as_ref().map(|wanted| probe::Probed::of(&mut plan, wanted, gpu)).transpose()?;
        let plan_ms = start.elapsed().as_secs_f64() * 1e3;
        // The next frame is most likely the last one again.
        let mut last = previous.map(|p| p.last.clone()).unwrap_or_default();
        let pose = scene.pose_shifted(last.time, &last.shift);
        let pointer = previous.map(|p| p.pointer).unwrap_or_default();
        let (values, more) = last.next((&scene, &settings), (&pose, pointer), last.index)?;
        notices.extend(warnings);
        notices.extend(more);
        let earlier = previous.filter(|p| Arc::ptr_eq(&p.scene, &scene)).map(|p| &p.tables);
        let tables = tables(&scene, &plan, pose, levels, earlier);
        let began = previous.map_or(0, |p| p.held.frames());
        let inputs = SceneInputs::new(&plan, hashes, began, &tables.list)?;
        let keys = Keys::of(&plan, settings.without);
        // The memory that verifies begins as the other does, or not at all.
        let earlier = previous.filter(|p| !settings.verify || p.scratch.is_some());
        let kept = match earlier {
            Some(earlier) => change::carry(&plan, &keys, &earlier.held, &inputs, &values),
            None => vec![None; plan.slots.len()],
        };
        let anew = |r: &Resource| r.history && r.image.is_none() && kept[r.slot].is_none();
        let own = |(i, r): (usize, &Resource)| anew(r) && !plan.inputs.contains(&ResourceId(i));
        last.begins |= plan.resources.iter().enumerate().any(own);
        let held = Held::new(&plan, &keys, &kept, earlier.map(|e| &e.held));
        let memory = earlier.map(|e| e.prepared.pool.taken(&kept)).unwrap_or_default();
        let assets = scene.assets_with(hashes, &tables.levels);
        let mut prepared = gpu::prepare_after(gpu, &plan, &assets, &tables.list, &memory)?;
        if settings.watch {
            prepared.watch(gpu)?;
        }
        let scratch = match settings.verify {
            true => {
                let earlier = earlier.and_then(|e| e.scratch.as_ref());
                Some(Scratch::new(gpu, &plan, &keys, &assets, &tables.list, earlier)?)
            }
            false => None,
        };
        notices.extend(
            previous.into_iter().flat_map(|p| p.held.lent()).filter(|name| !held.lent().any(|n| n == *name)).map(
                |name| {
                    let d = Diagnostic::warning(format!("what was lent as `{name}` does not serve the changed graph"));
                    d.help("it is blank until other memory is lent")
                },
            ),
        );
        let shift = Shift::default();
        Ok(Session {
            scene,
            settings,
            params: planned.params,
            plan,
            notices,
            plan_ms,
            compose_ms,
            shift,
            texts,
            prepared,
            keys,
            held,
            inputs,
            tables,
            uploaded: true,
            pointer,
            last,
            why: vec![],
            scratch,
            probe,
        })
    }

    /// Renders frame number `index` at `time` (seconds).
    ///
    /// # Errors
    /// What the device reports, with the pass's name.
    pub fn frame(&mut self, gpu: &Gpu, index: u32, time: f32) -> Checked<FrameReport> {
        let (values, tables, selection) = self.choose(index, time)?;
        let careful = selection.why.iter().any(Why::is_new);
        let (chosen, timing) = (Some(&selection), self.settings.timing);
        let frame = FrameInputs { values, tables: tables.as_deref(), chosen, timing, careful };
        self.start(&selection);
        let report = gpu::execute(gpu, &self.plan, &mut self.prepared, &frame);
        let report = self.finish(&selection, (index, time), &frame.values, report)?;
        if let Some(scratch) = &mut self.scratch {
            let (plan, keys) = (&self.plan, &self.keys);
            scratch.verify(gpu, (plan, keys), (&self.prepared, &self.held), &self.inputs, &frame)?;
        }
        Ok(report)
    }

    /// As [`Session::frame`], into an encoder that the caller submits before anything else is asked of this session.
    /// Waits for nothing: what the frame took, and images ([`Session::image_later`]), arrive later.
    ///
    /// # Errors
    /// As [`gpu::record`]; a session that verifies waits, and can't be recorded. What the device finds wrong comes when
    /// the encoder is finished.
    pub fn record(&mut self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, index: u32, time: f32) -> Checked<Frame> {
        if self.scratch.is_some() {
            let d = Diagnostic::error("a session that verifies waits for both of its frames, and can't be recorded");
            return Err(d.help("run frames with `Session::frame`, or leave out `verify`").into());
        }
        let (values, tables, selection) = self.choose(index, time)?;
        let (chosen, timing) = (Some(&selection), self.settings.timing);
        let frame = FrameInputs { values, tables: tables.as_deref(), chosen, timing, careful: false };
        self.start(&selection);
        let recorded = gpu::record(gpu, &self.plan, &mut self.prepared, &frame, encoder);
        self.finish(&selection, (index, time), &frame.values, recorded)
    }

    /// What a frame is made from, and what of it runs.
    fn choose(&mut self, index: u32, time: f32) -> Checked<(Values, Option<Vec<Table>>, Selection)> {
        let pose = self.scene.pose_shifted(time, &self.shift);
        let (mut values, _) = self.last.next((&self.scene, &self.settings), (&pose, self.pointer), index)?;
        let tables = self.pose(pose)?;
        self.inputs.frame = self.held.frames();
        values.extend([self.held.content(&self.plan, &self.keys, &self.inputs, &values)]);
        let choose = if self.settings.skip { change::select } else { change::full };
        let selection = choose(&self.plan, &self.keys, &self.held, &self.inputs, &values);
        Ok((values, tables, selection))
    }

    fn start(&mut self, selection: &Selection) {
        self.why.clear();
        self.uploaded = false;
        self.held.start(selection);
    }

    /// Takes what was selected for done. After a fault the next frame begins anew.
    fn finish<T>(
        &mut self,
        selection: &Selection,
        (index, time): (u32, f32),
        values: &Values,
        done: Checked<T>,
    ) -> Checked<T> {
        self.uploaded = done.is_ok();
        if done.is_err() {
            self.forget();
            return done;
        }
        self.held.finish(selection);
        self.last = Last { index, time, shift: self.shift.clone(), values: values.clone(), begins: false };
        self.why.clone_from(&selection.why);
        done
    }

    /// Lends memory to the graph for one of its `inputs`, in place of a blank one: from the next frame on, until other
    /// memory is lent. Steps that read it run again when `version` is another than before. The graph never writes
    /// there; what the caller writes is to be submitted before the frame that reads it.
    ///
    /// # Errors
    /// The plan reads no such input; the memory is of another kind, size or format, or lacks a usage. Nothing changes
    /// then.
    pub fn import(&mut self, gpu: &Gpu, input: &str, memory: impl Into<Memory>, version: u64) -> Checked<()> {
        let id = self.input(input)?;
        let memory = memory.into();
        let other = self.prepared.lend(gpu, &self.plan, id, memory.clone())?;
        self.held.lend(self.plan.resources[id.0].slot, version, other);
        match &mut self.scratch {
            Some(scratch) => scratch.lend(gpu, &self.plan, id, memory, version),
            None => Ok(()),
        }
    }

    /// The resource of one of the graph's `inputs`; [`gpu::upload_image`] makes memory that fits it.
    ///
    /// # Errors
    /// The plan reads no such input.
    pub fn input(&self, input: &str) -> Checked<ResourceId> {
        let name = |id: &ResourceId| self.plan.resources[id.0].name.as_str();
        self.plan.inputs.iter().copied().find(|id| name(id) == input).ok_or_else(|| {
            let d = Diagnostic::error(format!("the graph takes nothing from outside as `{input}`"));
            let known: Vec<&str> = self.plan.inputs.iter().map(name).collect();
            d.nearest(input, known.iter().copied()).help("declare it among the graph's `inputs`").into()
        })
    }

    /// Makes the next frame run every step, as the first one did.
    pub fn forget(&mut self) {
        self.held.forget();
        self.last.begins = true;
    }

    /// Submits some steps of the last frame once more, or of the first, whatever they hold: for whoever asks how long
    /// they take.
    ///
    /// # Errors
    /// As [`gpu::begin`].
    pub(crate) fn repeat(&mut self, gpu: &Gpu, run: &[bool]) -> Checked<Frame> {
        let pose = self.scene.pose_shifted(self.last.time, &self.last.shift);
        let at = self.last.index;
        let (mut values, _) = self.last.next((&self.scene, &self.settings), (&pose, self.pointer), at)?;
        values.extend([self.held.content(&self.plan, &self.keys, &self.inputs, &values)]);
        // What other steps would have left isn't there.
        self.forget();
        gpu::begin(
            gpu,
            &self.plan,
            &mut self.prepared,
            &FrameInputs { values, chosen: Some(&Selection::of(run)), ..FrameInputs::default() },
        )
    }

    /// Puts nodes and lights where a pose has them; the tables that the device does not hold as they are now.
    fn pose(&mut self, pose: Pose) -> Checked<Option<Vec<Table>>> {
        let mut changed = vec![];
        if !pose.same_tables(&self.tables.pose) || self.tables.settles() {
            let levels = self.tables.levels.clone();
            let tables = tables(&self.scene, &self.plan, pose, levels, Some(&self.tables));
            self.inputs.follow(&self.plan, &self.tables.list, &tables.list)?;
            let kept = |t: &Table| self.tables.list.iter().any(|before| before.is_clone(t));
            changed.extend(tables.list.iter().filter(|t| !kept(t)).cloned());
            self.tables = tables;
        }
        if !self.uploaded {
            changed.clone_from(&self.tables.list);
        }
        Ok(Some(changed).filter(|c| !c.is_empty()))
    }

    /// The checks in shaders that do not hold after a frame, each at its line, and the numbers that steps left and
    /// should not have.
    pub fn failed_checks(&self, report: &FrameReport) -> Vec<Diagnostic> {
        let fault = |(step, failed): &(StepId, Failed)| {
            let step = &self.plan.steps[step.0];
            let (count, [x, y, z]) = (failed.count, failed.first);
            let often = if count == 1 { String::new() } else { format!(", the first of {count} to say so") };
            let d = Diagnostic::error(format!(
                "a check in the shader of `{}` does not hold: invocation ({x}, {y}, {z}){often}",
                step.name
            ));
            let shader = step.action.shader().and_then(|i| self.plan.shaders.get(i));
            match shader.and_then(|s| failed.span(s, &self.texts)) {
                Some(span) => d.at(&span, ""),
                None => d,
            }
        };
        let numbers = report.numerics.as_ref().map_or(vec![], |n| n.faults(&self.plan));
        report.failed.iter().map(fault).chain(numbers).collect()
    }

    /// What set off the steps of the last frame, each thing once: what they read besides each other's results.
    pub fn causes(&self) -> Vec<&str> {
        let mut causes: Vec<&str> = vec![];
        for why in &self.why {
            let (Why::Changed(names) | Why::ChangedInPart(names)) = why else { continue };
            for name in names {
                let result = self.plan.resources.iter().any(|r| r.name == *name);
                if !result && !causes.contains(&name.as_str()) {
                    causes.push(name);
                }
            }
        }
        causes
    }

    /// Whether a shader of the plan reads a value of the frame, as `pointer`.
    pub fn reads(&self, value: &str) -> bool {
        let members = self.plan.steps.iter().flat_map(|s| &s.bindings).filter_map(|binding| match binding {
            Binding::Uniform { layout, .. } => Some(&layout.members),
            _ => None,
        });
        members.flatten().any(|m| m.read && m.name == value)
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

    /// The words of an output that is a buffer.
    ///
    /// # Errors
    /// An output that was not asked for or is no buffer, or the device fails.
    pub fn words(&self, gpu: &Gpu, output: &str) -> Checked<Vec<u32>> {
        let bytes = gpu::read_buffer(gpu, &self.prepared, &self.plan, self.output(output)?)?;
        Ok(bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect())
    }

    /// As [`Session::image`], of what the commands before in an encoder leave. The image arrives once they are
    /// submitted and done.
    ///
    /// # Errors
    /// As [`Session::image`].
    pub fn image_later(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, output: &str) -> Checked<PendingImage> {
        gpu::read_image_later(gpu, &self.prepared, &self.plan, self.output(output)?, encoder)
    }

    /// By step that leaves out what its members don't see: the triangles of the draws of all its members, and those if
    /// each drew the whole scene.
    ///
    /// # Errors
    /// The device fails.
    pub fn triangles(&self, gpu: &Gpu) -> Checked<BTreeMap<usize, (u64, u64)>> {
        let mut found = BTreeMap::new();
        for (index, step) in self.plan.steps.iter().enumerate() {
            let Action::Draw(draw) = &step.action else { continue };
            let Some(indirect) = draw.indirect else { continue };
            let bytes = gpu::read_buffer(gpu, &self.prepared, &self.plan, indirect.buffer)?;
            let whole = draw.members.len() as u64 * (self.scene.geometry.indices.len() / 3) as u64;
            found.insert(index, (cull::triangles(&bytes), whole));
        }
        Ok(found)
    }

    /// The texture or buffer that a resource of the plan lives in.
    ///
    /// # Errors
    /// The resource is of another plan.
    pub fn memory(&self, id: ResourceId) -> Checked<&Memory> {
        self.prepared.pool.memory(&self.plan, id)
    }

    /// What an output holds after the frames so far, as a hash of all that it was made from: while this stays the same,
    /// so does the content. `None`: nothing is known of it, as before the first frame.
    ///
    /// # Errors
    /// An unknown output.
    pub fn version(&self, output: &str) -> Checked<Option<Version>> {
        let slot = self.plan.resources[self.output(output)?.0].slot;
        Ok(Some(self.held.version(slot)).filter(|version| *version != UNDEFINED))
    }

    /// The resource of an output.
    ///
    /// # Errors
    /// An unknown output.
    pub fn output(&self, name: &str) -> Checked<ResourceId> {
        match self.plan.outputs.iter().find(|o| o.0 == name) {
            Some((_, id)) => Ok(*id),
            None => {
                let d = Diagnostic::error(format!("the output `{name}` was not asked for"));
                Err(d.nearest(name, self.plan.outputs.iter().map(|o| o.0.as_str())).into())
            }
        }
    }
}

/// The tables that the plan's shaders read; of earlier ones of the same scene what is the same.
fn tables(scene: &Scene, plan: &Plan, pose: Pose, levels: Vec<Arc<Level>>, earlier: Option<&Tables>) -> Tables {
    let wanted = |name: &str| plan.tables.iter().any(|t| t.table == name);
    scene.tables_after(pose, wanted, levels, earlier)
}

/// The scene of an earlier session, where it is the same.
fn same_scene(scene: Arc<Scene>, previous: Option<&Session>) -> Arc<Scene> {
    match previous {
        Some(previous) if !Arc::ptr_eq(&previous.scene, &scene) && previous.scene == scene => previous.scene.clone(),
        _ => scene,
    }
}
