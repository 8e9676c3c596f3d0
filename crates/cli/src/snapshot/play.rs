//! Plays a test's script: on a device to images and counts, without one to the plan in the end.

use super::file::{Edit, ScriptStep, Setup, replace};
use lightgraph::internals::diag::{Source, Span, strict};
use lightgraph::internals::gpu::LoopReport;
use lightgraph::internals::graph::ast::Name;
use lightgraph::internals::graph::read::Reader;
use lightgraph::internals::plan::build::plan;
use lightgraph::internals::plan::fastest::FIRST;
use lightgraph::internals::plan::request::{Request, sample_device};
use lightgraph::internals::plan::tables;
use lightgraph::internals::scene::Shift;
use lightgraph::internals::shader::Library;
use lightgraph::internals::unused;
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, Faults, FrameReport, Gpu, Image, Plan, Project, Scene, Session, Settings};
use std::collections::{BTreeMap, BTreeSet};

/// What is known after the last frame of a script.
#[derive(Debug, Clone)]
pub struct Played {
    /// By output.
    pub images: BTreeMap<String, Image>,
    /// Passes of which at least one step ran in the last frame.
    pub ran: BTreeSet<String>,
    /// Passes of which none did, those that the plan leaves out among them.
    pub left_out: BTreeSet<String>,
    /// Loops of the last frame in which they ran, by name.
    pub loops: BTreeMap<String, LoopReport>,
}

/// Plays a script from a setup and reads the outputs after its last frame. With `verify`, every frame is compared bit
/// for bit with one that runs every step.
///
/// # Errors
/// Faults of the files, with their places; those of the device; with `verify` also contents that differ.
pub fn play(gpu: &Gpu, setup: &Setup, steps: &[ScriptStep], outputs: &[Name], verify: bool) -> Checked<Played> {
    let mut now = setup.clone();
    let scene = scene_of(setup)?;
    let mut session: Option<Session> = None;
    let mut stale = true;
    let (mut shift, mut frame, mut time) = (Shift::default(), 0, 0.0);
    let mut played =
        Played { images: BTreeMap::new(), ran: BTreeSet::new(), left_out: BTreeSet::new(), loops: BTreeMap::new() };
    for step in steps {
        match step {
            ScriptStep::Frames { count, step } => {
                let mut running = match session.take() {
                    Some(running) if !stale => running,
                    previous => open(gpu, &now, scene.clone(), outputs, verify, previous.as_ref())?,
                };
                stale = false;
                running.shift = shift.clone();
                for _ in 0..*count {
                    let report = running.frame(gpu, frame, time)?;
                    Faults::check(running.failed_checks(&report), ())?;
                    note(&mut played, &running, &report);
                    frame += 1;
                    time += step;
                }
                session = Some(running);
            }
            ScriptStep::MoveCamera(by) => shift.cameras += *by,
            ScriptStep::MoveLights(by) => shift.lights += *by,
            ScriptStep::MoveNode(name, by) => {
                shift.nodes.push((node(&scene, name)?, *by));
            }
            ScriptStep::Set(_)
            | ScriptStep::Swap(_)
            | ScriptStep::Resize(_)
            | ScriptStep::Edit(_)
            | ScriptStep::Restore(_) => {
                // Another plan, as after a reload.
                stale = true;
                now.change(step);
            }
        }
    }
    if let Some(session) = &session {
        for output in outputs {
            played.images.insert(output.value.clone(), session.image(gpu, &output.value)?);
        }
    }
    Ok(played)
}

/// The plan that holds when the script has ended, for all outputs and the least that every adapter allows.
///
/// # Errors
/// Faults of the files, with their places.
pub fn plan_in_the_end(setup: &Setup, steps: &[ScriptStep]) -> Checked<Plan> {
    let mut now = setup.clone();
    steps.iter().for_each(|s| now.change(s));
    let project = project_of(&now)?;
    let params = params_of(&now, &project)?;
    let (limits, features) = sample_device();
    let mut planned = plan(&Request {
        graph: &project.graph,
        texts: &project.texts,
        params: &params,
        facts: &scene_of(&now)?.facts(),
        screen: now.size,
        outputs: None,
        choices: &FIRST,
        levels: &[],
        limits: &limits,
        features,
    })?;
    without_scene(&now, &project, &planned.plan)?;
    // The text must not depend on where the test was started.
    planned.plan.graph = now.graph.path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
    Ok(planned.plan)
}

impl Setup {
    /// What a step changes of it; frames and moves change nothing.
    fn change(&mut self, step: &ScriptStep) {
        match step {
            ScriptStep::Set(params) => replace(&mut self.params, params),
            ScriptStep::Swap(graph) => self.graph = graph.clone(),
            ScriptStep::Resize(size) => self.size = *size,
            ScriptStep::Edit(edit) => self.edits.push(edit.clone()),
            ScriptStep::Restore(shader) => self.edits.retain(|e| e.shader.value != shader.value),
            ScriptStep::Frames { .. }
            | ScriptStep::MoveCamera(_)
            | ScriptStep::MoveLights(_)
            | ScriptStep::MoveNode(..) => {}
        }
    }
}

fn open(
    gpu: &Gpu,
    setup: &Setup,
    scene: Scene,
    outputs: &[Name],
    verify: bool,
    previous: Option<&Session>,
) -> Checked<Session> {
    let project = project_of(setup)?;
    let known: Vec<&str> = project.graph.outputs.iter().map(|o| o.0.value.as_str()).collect();
    let unknown = outputs.iter().filter(|o| !known.contains(&o.value.as_str())).map(|o| {
        let d = Diagnostic::error(format!("the graph has no output `{}`", o.value)).at(&o.span, "");
        d.nearest(&o.value, known.iter().copied()).help(format!("outputs: {}", known.join(", ")))
    });
    Faults::check(unknown.collect(), ())?;
    let settings = Settings {
        params: params_of(setup, &project)?,
        size: setup.size,
        camera: setup.camera.as_ref().map(|c| c.value.clone()),
        outputs: (!outputs.is_empty()).then(|| outputs.iter().map(|o| o.value.clone()).collect()),
        skip: true,
        verify,
        watch: setup.watch,
        ..Settings::default()
    };
    let place = setup.camera.as_ref().map_or(&setup.graph.span, |c| &c.span);
    let session = Session::after(gpu, &project, scene, settings, previous).map_err(|f| placed(f, place))?;
    without_scene(setup, &project, &session.plan)?;
    Ok(session)
}

/// A test without a scene is of a graph that uses none.
fn without_scene(setup: &Setup, project: &Project, plan: &Plan) -> Checked<()> {
    match tables::scene_use(&project.graph, plan).filter(|_| setup.scene.is_none()) {
        Some(how) => {
            let d = Diagnostic::error(format!("the test needs a scene: {how}")).at(&setup.graph.span, "");
            Err(d.help("give it one: `scene: \"…\"`").into())
        }
        None => Ok(()),
    }
}

fn note(played: &mut Played, session: &Session, report: &FrameReport) {
    let plan = &session.plan;
    let why = || session.why().iter().zip(&plan.steps);
    played.ran = why().filter(|(w, _)| w.runs()).map(|(_, s)| s.pass.clone()).collect();
    let planned_out = plan.skipped.iter().map(|s| s.0.clone());
    played.left_out =
        why().map(|(_, s)| s.pass.clone()).filter(|p| !played.ran.contains(p)).chain(planned_out).collect();
    for l in &report.loops {
        played.loops.insert(l.name.clone(), l.clone());
    }
}

/// The graph, in which nothing may be unused, and the shaders as they are edited.
fn project_of(setup: &Setup) -> Checked<Project> {
    let mut project = Project::open(&setup.graph.path, &[]).map_err(|f| placed(f, &setup.graph.span))?;
    let mut idle = unused::find(&project.graph, &project.texts);
    strict(&mut idle);
    Faults::check(idle, ())?;
    setup.edits.iter().try_for_each(|e| edited(&mut project.texts, e))?;
    Ok(project)
}

fn edited(texts: &mut Library, edit: &Edit) -> Checked<()> {
    let (name, from) = (&edit.shader.value, &edit.from.value);
    let Some(source) = texts.files.get(name) else {
        let d = Diagnostic::error(format!("there is no shader `{name}` to edit")).at(&edit.shader.span, "");
        return Err(d.nearest(name, texts.files.keys().map(String::as_str)).into());
    };
    match source.text.matches(from.as_str()).count() {
        1 => {
            let text = source.text.replacen(from.as_str(), &edit.to, 1);
            let source = Source::new(source.path.clone(), text);
            texts.files.insert(name.clone(), source);
            Ok(())
        }
        n => {
            let d = Diagnostic::error(format!("`{name}` holds this text {n} times, not once")).at(&edit.from.span, "");
            Err(d.help("give more of the line, as it stands there now").into())
        }
    }
}

/// The scene, its light multiplied.
fn scene_of(setup: &Setup) -> Checked<Scene> {
    let Some(file) = &setup.scene else { return Ok(Scene::stand_in()?.scene) };
    let mut scene = Scene::load(&file.path).map_err(|f| placed(f, &file.span))?.scene;
    scene.lights.iter_mut().for_each(|l| l.intensity *= setup.light);
    scene.materials.iter_mut().for_each(|m| m.emission *= setup.light);
    Ok(scene)
}

/// The parameters in the types that the graph gives them.
fn params_of(setup: &Setup, project: &Project) -> Checked<Values> {
    let mut reader = Reader::default();
    let mut values = Values::new();
    for (name, node) in &setup.params {
        let Some((_, param)) = project.graph.params.iter().find(|(n, _)| n.value == name.value) else {
            let d = Diagnostic::error(format!("the graph has no parameter `{}`", name.value)).at(&name.span, "");
            let known = project.graph.params.iter().map(|(n, _)| n.value.as_str());
            reader.fault(d.nearest(&name.value, known));
            continue;
        };
        let Some(value) = reader.value(node, param.ty) else { continue };
        if let Err(why) = param.accepts(&value) {
            let d = Diagnostic::error(format!("parameter `{}` = {value} is {why}", name.value));
            reader.fault(d.at(&node.span, "").at(&param.span, "declared here"));
        }
        values.insert(name.value.clone(), value);
    }
    Faults::check(reader.faults, values)
}

fn node(scene: &Scene, name: &Name) -> Checked<usize> {
    scene.nodes.iter().position(|n| n.name == name.value).ok_or_else(|| {
        let d = Diagnostic::error(format!("the scene has no node `{}`", name.value)).at(&name.span, "");
        d.nearest(&name.value, scene.nodes.iter().map(|n| n.name.as_str())).into()
    })
}

/// Faults that have no place get this one.
fn placed(mut faults: Faults, span: &Span) -> Faults {
    for d in faults.0.iter_mut().filter(|d| d.labels.is_empty()) {
        d.labels.push((span.clone(), String::new()));
    }
    faults
}
