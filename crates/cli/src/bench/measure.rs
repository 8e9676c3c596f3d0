//! One graph on one scene at one setting: its phases timed, its images compared.
//!
//! The frames: the first; then nothing moves; then one of each kind of motion, for the change it makes and, where a
//! graph keeps something from frame to frame, the error it leaves; then more of each, as many as there is time for. How
//! many frames come before an image is compared never depends on how long they take, so that errors are the same in
//! every repeat of a bench. Further rounds, with other settings' in between, add to the times alone.

use super::references::ReferenceSet;
use super::results::{Entry, PassTime, Phase, PhaseTimes, Spread};
use super::score::{change, mean, score};
use glam::Vec3;
use lightgraph::internals::fastest::Policy;
use lightgraph::internals::gpu::Timing;
use lightgraph::internals::scene::{Bounds, Shift};
use lightgraph::{Checked, Faults, FrameReport, Gpu, Image, Plan, Project, Scene, Session, Settings};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Instant;

/// What is measured.
#[derive(Debug, Clone)]
pub struct Target<'a> {
    pub graph: &'a str,
    pub project: &'a Project,
    pub scene: &'a Arc<Scene>,
    pub camera: Option<&'a str>,
    pub size: [u32; 2],
    /// What the sweep sets, as `NAME`, `VALUE`.
    pub setting: &'a [(String, String)],
    pub references: &'a ReferenceSet,
    /// Stages of start-up that came before: milliseconds to open the device, read the graph and the scene.
    pub start_up_ms: &'a BTreeMap<String, f64>,
    /// See [`Entry::inputs`].
    pub inputs: &'a str,
    /// Which of the graph's alternatives run.
    pub fastest: Policy,
}

/// How long to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort<'a> {
    /// Timed frames a phase at most, at least 1.
    pub repeat: u32,
    /// A moving phase ends after the frame that exceeds this many seconds; the phases before have no limit.
    pub seconds: f64,
    /// What is measured besides the first frame.
    pub phases: &'a [Phase],
}

/// An entry and the pictures it was judged by.
pub struct Measured<'a> {
    pub entry: Entry,
    /// Outputs by name: the last that nothing moved in.
    pub images: BTreeMap<String, Image>,
    /// What rendered it, for more frames. `None` after a fault, and of other renderers.
    pub subject: Option<MeasuredSetting<'a>>,
}

/// The output that a viewer sees.
pub const SEEN: &str = "color";

/// A step of a motion, as a share of the diagonal of the scene's bounds.
const STEP: f32 = 0.0025;

/// Places that what moves visits in turn.
const PLACES: u32 = 61;

/// A frame of so many seconds is taken once: what a driver compiles in it adds little.
const LONG: f64 = 2.0;

/// The entry as far as it is known before anything runs.
///
/// # Errors
/// A setting that the graph refuses.
pub fn planned(target: &Target<'_>) -> Checked<Entry> {
    let texts: Vec<String> = target.setting.iter().map(|(n, v)| format!("{n}={v}")).collect();
    let set = target.project.params(&texts)?;
    let params = &target.project.graph.params;
    let params = params.iter().map(|(n, p)| (n.value.clone(), set.get(&n.value).unwrap_or(&p.default).to_string()));
    Ok(Entry {
        graph: target.graph.to_string(),
        peer: None,
        scene: target.scene.name.clone(),
        camera: target.camera.map(String::from),
        size: target.size,
        params: params.collect(),
        setting: texts.join(" "),
        inputs: target.inputs.to_string(),
        bytes: 0,
        bytes_without_sharing: 0,
        start_up_ms: target.start_up_ms.clone(),
        rounds: 1,
        phases: vec![],
        scores: vec![],
        leak: None,
        picture: None,
        fault: None,
        host: None,
    })
}

/// Runs all phases. What the device or the graph finds wrong is the entry's `fault`.
///
/// # Errors
/// A setting that the graph refuses.
pub fn measure<'a>(gpu: &'a Gpu, target: &Target<'_>, effort: Effort<'_>) -> Checked<Measured<'a>> {
    let (mut entry, mut images) = (planned(target)?, BTreeMap::new());
    let subject = match run(gpu, target, effort, &mut entry, &mut images) {
        Ok(subject) => Some(subject),
        Err(faults) => {
            entry.fault = Some(faults.one_line());
            None
        }
    };
    Ok(Measured { entry, images, subject })
}

fn run<'a>(
    gpu: &'a Gpu,
    target: &Target<'_>,
    effort: Effort<'_>,
    entry: &mut Entry,
    images: &mut BTreeMap<String, Image>,
) -> Checked<MeasuredSetting<'a>> {
    let declared = target.project.graph.outputs.iter().map(|o| o.0.value.clone());
    let wanted = |o: &String| o == SEEN || target.references.all.iter().any(|r| r.output == *o);
    let outputs: Vec<String> = declared.filter(wanted).collect();
    let texts: Vec<String> = target.setting.iter().map(|(n, v)| format!("{n}={v}")).collect();
    let mut settings = Settings {
        params: target.project.params(&texts)?,
        size: target.size,
        camera: target.camera.map(String::from),
        outputs: Some(outputs.clone()),
        skip: true,
        // A software driver's stamps tell no step's time, and waiting for each would tell on the frame's.
        timing: if gpu.is_software() { Timing::Frame } else { Timing::Steps },
        ..Settings::default()
    };
    settings.choices = target.fastest.choices(gpu, target.project, target.scene, &settings)?;
    let start = Instant::now();
    let session = Session::new(gpu, target.project, target.scene.clone(), settings)?;
    entry.start_up_ms.insert("prepare".into(), start.elapsed().as_secs_f64() * 1e3);
    (entry.bytes, entry.bytes_without_sharing) = session.plan.bytes();

    let mut runner = CountedSession {
        gpu,
        session,
        frame: 0,
        ran: BTreeSet::new(),
        motions: Motions::of(target.scene),
        places: Places::default(),
    };
    let once = PhaseFrames::of(runner.frame(Shift::default())?);
    entry.phases.extend(once.times(Phase::First, &runner.session.plan));
    *images = runner.images(&outputs)?;
    entry.scores = score(images, target.references, &entry.params)?;
    let carries = runner.session.plan.resources.iter().any(|r| r.history);
    if effort.phases.contains(&Phase::Still) {
        let mut still = PhaseFrames::default();
        for _ in 0..effort.repeat.max(1) {
            still.add(runner.frame(Shift::default())?);
        }
        let mut rest = vec![];
        if carries {
            *images = runner.images(&outputs)?;
            rest = score(images, target.references, &entry.params)?;
        }
        let times = still.times(Phase::Still, &runner.session.plan);
        entry.phases.extend(times.map(|t| PhaseTimes { scores: rest, ..t }));
    }

    let mut moving = Phase::MOVING.to_vec();
    moving.retain(|p| effort.phases.contains(p) && runner.motions.has(*p));
    let mut begun = vec![];
    for &phase in &moving {
        let before = runner.seen(images)?;
        let ran = runner.ran.len();
        let taken = PhaseFrames::of(runner.step(phase, Places::turned)?);
        let compiled = runner.ran.len() > ran;
        let change_percent = before.map(|before| change(&before, &runner.session.image(gpu, SEEN)?)).transpose()?;
        let mut scores = vec![];
        if carries {
            runner.places = Places::default();
            runner.frame(Shift::default())?;
            scores = score(&runner.images(&outputs)?, target.references, &entry.params)?;
        }
        begun.push((phase, taken, compiled, change_percent, scores));
    }
    for (phase, mut taken, compiled, change_percent, scores) in begun {
        if compiled && taken.seconds() < LONG {
            taken = PhaseFrames::of(runner.go_on(phase)?);
        }
        while taken.walls.len() < effort.repeat as usize && taken.seconds() <= effort.seconds {
            taken.add(runner.go_on(phase)?);
        }
        let times = taken.times(phase, &runner.session.plan);
        entry.phases.extend(times.map(|t| PhaseTimes { change_percent, scores, ..t }));
    }
    if let Some(leak) = &target.references.leak
        && outputs.iter().any(|o| o == SEEN)
    {
        let [dark, lit] = [&leak.dark, &leak.lit].map(|camera| {
            runner.session.settings.camera = Some(camera.clone());
            runner.frame(Shift::default())?;
            Ok::<f64, Faults>(mean(&runner.session.image(gpu, SEEN)?))
        });
        entry.leak = Some(dark? / lit?).filter(|l| l.is_finite());
        runner.session.settings.camera = target.camera.map(String::from);
    }
    Ok(MeasuredSetting { runner, moving })
}

/// A setting that was measured and can go on.
pub struct MeasuredSetting<'a> {
    runner: CountedSession<'a>,
    /// The phases in which something moves that are measured.
    moving: Vec<Phase>,
}

impl MeasuredSetting<'_> {
    /// Another round: of each phase in which something moves a frame more. In the second round a frame before them in
    /// which nothing is held, as in the first one; by then the driver has compiled everything. False: what went wrong
    /// is the entry's `fault`.
    pub fn again(&mut self, entry: &mut Entry) -> bool {
        let more = self.frames(entry.rounds == 1);
        entry.rounds += 1;
        match more {
            Ok(more) => more.into_iter().for_each(|t| entry.more(t)),
            Err(faults) => entry.fault = Some(faults.one_line()),
        }
        entry.fault.is_none()
    }

    fn frames(&mut self, first: bool) -> Checked<Vec<PhaseTimes>> {
        let mut found = vec![];
        if first {
            self.runner.session.forget();
            let once = PhaseFrames::of(self.runner.frame(Shift::default())?);
            found.extend(once.times(Phase::First, &self.runner.session.plan));
        }
        for phase in &self.moving {
            let once = PhaseFrames::of(self.runner.go_on(*phase)?);
            found.extend(once.times(*phase, &self.runner.session.plan));
        }
        Ok(found)
    }
}

/// A session that counts its frames.
struct CountedSession<'a> {
    gpu: &'a Gpu,
    session: Session,
    frame: u32,
    /// Steps that have run: drivers compile late what runs for the first time.
    ran: BTreeSet<usize>,
    motions: Motions,
    places: Places,
}

impl CountedSession<'_> {
    /// Milliseconds, the report, and what set its steps off.
    fn frame(&mut self, shift: Shift) -> Checked<(f64, FrameReport, Vec<String>)> {
        self.session.shift = shift;
        let start = Instant::now();
        let report = self.session.frame(self.gpu, self.frame, 0.0)?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        self.frame += 1;
        self.ran.extend(report.steps.iter().map(|s| s.step));
        Ok((ms, report, self.session.causes().into_iter().map(String::from).collect()))
    }

    /// A frame in which what a phase moves goes to another place. The rest stays where it is.
    fn step(&mut self, phase: Phase, to: impl Fn(f32) -> f32) -> Checked<(f64, FrameReport, Vec<String>)> {
        let all = phase == Phase::Everything;
        let Places { camera, lights, object } = &mut self.places;
        for (place, of) in [(camera, Phase::Camera), (lights, Phase::Lights), (object, Phase::Object)] {
            if all || phase == of {
                *place = to(*place);
            }
        }
        let shift = self.motions.shift(self.places);
        self.frame(shift)
    }

    /// A frame in which what a phase moves is within a step of its place, and never twice at the same in a row.
    fn go_on(&mut self, phase: Phase) -> Checked<(f64, FrameReport, Vec<String>)> {
        let share = ((self.frame % PLACES) as f32 + 0.5) / PLACES as f32;
        self.step(phase, |_| share)
    }

    fn images(&self, outputs: &[String]) -> Checked<BTreeMap<String, Image>> {
        outputs.iter().map(|o| Ok((o.clone(), self.session.image(self.gpu, o)?))).collect()
    }

    /// What a viewer sees now, where the graph has it.
    fn seen(&self, images: &BTreeMap<String, Image>) -> Checked<Option<Image>> {
        images.contains_key(SEEN).then(|| self.session.image(self.gpu, SEEN)).transpose()
    }
}

/// The frames of a phase.
#[derive(Default)]
struct PhaseFrames {
    /// Milliseconds.
    walls: Vec<f64>,
    reports: Vec<FrameReport>,
    /// Of the last one.
    causes: Vec<String>,
}

impl PhaseFrames {
    fn of((ms, report, causes): (f64, FrameReport, Vec<String>)) -> PhaseFrames {
        PhaseFrames { walls: vec![ms], reports: vec![report], causes }
    }

    fn add(&mut self, (ms, report, causes): (f64, FrameReport, Vec<String>)) {
        self.causes = causes;
        self.walls.push(ms);
        self.reports.push(report);
    }

    fn seconds(&self) -> f64 {
        self.walls.iter().sum::<f64>() / 1e3
    }

    /// The statistics; `None` of no frames.
    fn times(&self, phase: Phase, plan: &Plan) -> Option<PhaseTimes> {
        let PhaseFrames { walls, reports, causes } = self;
        let last = reports.last()?;
        let totals: Option<Vec<f64>> = reports.iter().map(|r| r.steps.iter().map(|s| s.gpu_ms).sum()).collect();
        let steps_run = last.steps.len() as u32;
        let mut iterations = BTreeMap::new();
        for l in &last.loops {
            *iterations.entry(l.name.clone()).or_insert(0) += l.iterations;
        }
        Some(PhaseTimes {
            phase,
            repeats: reports.len() as u32,
            wall_ms: Spread::of(walls)?,
            frames_ms: walls.clone(),
            gpu_ms: totals.and_then(|t| Spread::of(&t)),
            steps_run,
            steps_skipped: plan.steps.len() as u32 - steps_run.min(plan.steps.len() as u32),
            causes: causes.clone(),
            iterations,
            passes: passes(plan, reports),
            change_percent: None,
            scores: vec![],
        })
    }
}

fn passes(plan: &Plan, reports: &[FrameReport]) -> Vec<PassTime> {
    let mut found: Vec<(PassTime, Vec<Option<f64>>)> = vec![];
    for (frame, report) in reports.iter().enumerate() {
        for time in &report.steps {
            let Some(step) = plan.steps.get(time.step) else { continue };
            let at = found.iter().position(|(p, _)| p.name == step.pass).unwrap_or_else(|| {
                let pass = PassTime { name: step.pass.clone(), group: step.group.clone(), runs: 0, gpu_ms: None };
                found.push((pass, vec![Some(0.0); reports.len()]));
                found.len() - 1
            });
            let Some((pass, frames)) = found.get_mut(at) else { continue };
            if frame + 1 == reports.len() {
                pass.runs += time.runs;
            }
            if let Some(sum) = frames.get_mut(frame) {
                *sum = sum.zip(time.gpu_ms).map(|(a, b)| a + b);
            }
        }
    }
    let median =
        |frames: Vec<Option<f64>>| Spread::of(&frames.into_iter().collect::<Option<Vec<f64>>>()?).map(|s| s.median);
    found.into_iter().map(|(pass, frames)| PassTime { gpu_ms: median(frames), ..pass }).collect()
}

/// What can move in a scene, and how far in one step.
#[derive(Debug, Clone, PartialEq)]
struct Motions {
    cameras: bool,
    lights: bool,
    object: Option<usize>,
    step: f32,
}

impl Motions {
    fn of(scene: &Scene) -> Motions {
        Motions {
            cameras: !scene.cameras.is_empty(),
            lights: !scene.lights.is_empty(),
            object: object(scene),
            step: scene.bounds.diagonal() * STEP,
        }
    }

    fn has(&self, phase: Phase) -> bool {
        match phase {
            Phase::Camera => self.cameras,
            Phase::Lights => self.lights,
            Phase::Object => self.object.is_some(),
            Phase::Everything => self.cameras || self.lights || self.object.is_some(),
            Phase::First | Phase::Still | Phase::Whole => false,
        }
    }

    fn shift(&self, places: Places) -> Shift {
        let by = |share: f32| Vec3::X * self.step * share;
        Shift {
            cameras: by(places.camera),
            lights: by(places.lights),
            nodes: self.object.map(|node| (node, by(places.object))).into_iter().collect(),
            ..Shift::default()
        }
    }
}

/// Where what moves is: shares of a step from where the scene says.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Places {
    camera: f32,
    lights: f32,
    object: f32,
}

impl Places {
    /// The other end of the step.
    fn turned(share: f32) -> f32 {
        1.0 - share
    }
}

/// The node whose own geometry is smallest: a thing in the scene rather than its walls. `None` when all geometry is of
/// one node.
fn object(scene: &Scene) -> Option<usize> {
    let pose = scene.pose(0.0);
    let mut boxes = vec![Bounds::EMPTY; scene.nodes.len()];
    for vertex in &scene.geometry.vertices {
        let node = scene.geometry.owners.node(vertex.node) as usize;
        if let (Some(b), Some(m)) = (boxes.get_mut(node), pose.nodes.get(vertex.node as usize)) {
            *b = b.union(Bounds::of([m.transform_point3(Vec3::from(vertex.position))]));
        }
    }
    let with: Vec<usize> = (0..boxes.len()).filter(|i| boxes[*i].min.x <= boxes[*i].max.x).collect();
    if with.len() < 2 {
        return None;
    }
    with.into_iter().min_by(|a, b| boxes[*a].diagonal().total_cmp(&boxes[*b].diagonal()))
}
