//! Alternatives in turn on the device, until enough is known of how long each takes. Nothing is waited for.

use crate::diag::{Checked, Diagnostic, Faults};
use crate::gpu::{Frame, FrameReport, Gpu};
use crate::plan::fastest::{Alternatives, Choice, Way};
use crate::plan::{Action, Plan};
use crate::project::Project;
use crate::scene::Scene;
use crate::session::{Session, Settings, plan_for};
use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};
use std::time::Duration;
use web_time::Instant;

/// Timed runs of each alternative, after one that is not, at least and at most.
const RUNS: [u32; 2] = [1, 7];

/// No more runs begin after this time.
const ENOUGH: Duration = Duration::from_millis(300);

/// Own steps that take fewer milliseconds run several times alone: what else the machine does would show in one run.
const SHORT: f64 = 50.0;

/// Runs of such steps after one frame that leads to them.
const REPEATS: u32 = 4;

/// A side that takes so many times as long as another is not looked at more closely.
const HOPELESS: f64 = 8.0;

/// One alternative: what to render with it, and the plan.
pub(super) struct Side {
    settings: Settings,
    pub plan: Plan,
    /// The steps that some other alternative does without.
    pub own: BTreeSet<usize>,
    /// From its first run on.
    session: Option<Session>,
    /// The least of its runs, in milliseconds.
    time: f64,
}

/// By way of a group what runs.
///
/// # Errors
/// Faults of any plan: whoever edits an alternative learns of them.
pub(super) fn sides(
    gpu: &Gpu,
    project: &Project,
    scene: &Arc<Scene>,
    settings: &Settings,
    group: &Alternatives,
) -> Checked<Vec<Side>> {
    let side = |way: &Way| {
        let mut choices = settings.choices.clone();
        choices.insert(group.name.clone(), Choice { index: way.index, why: "measured now".into() });
        let plain = Settings { choices, skip: false, verify: false, watch: false, inspect: false, ..settings.clone() };
        let plan = plan_for(project, scene, &plain, gpu)?.plan;
        Ok(Side { settings: plain, plan, own: BTreeSet::new(), session: None, time: f64::INFINITY })
    };
    let mut sides = group.ways.iter().map(side).collect::<Checked<Vec<Side>>>()?;
    let passes: Vec<BTreeSet<String>> =
        sides.iter().map(|s| s.plan.steps.iter().map(|step| step.pass.clone()).collect()).collect();
    for side in &mut sides {
        let everywhere = |pass: &String| passes.iter().all(|p| p.contains(pass));
        let steps = side.plan.steps.iter().enumerate();
        side.own = steps.filter(|(_, step)| !everywhere(&step.pass)).map(|(i, _)| i).collect();
    }
    Ok(sides)
}

/// Milliseconds of the own steps of each side, the least of several runs in turn, so that what else the machine does
/// falls on all. By the device's clock; where it can't time one of them, or is a software driver's that tells the time
/// of one step with the next, by the host's, of a frame of those steps alone.
pub(super) struct Race {
    project: Project,
    scene: Arc<Scene>,
    /// Or why the device refuses it.
    sides: Vec<Checked<Side>>,
    by_device: bool,
    /// The shortest time of a frame that leads to the own steps.
    shortest: f64,
    /// Of the timed runs.
    start: Instant,
    /// In the first one, 0, a driver may still compile: it is not timed.
    run: u32,
    side: usize,
    /// Milliseconds of the frame that led to the own steps, which are to run alone now.
    led: Option<f64>,
    /// Runs of the own steps alone since then.
    alone: u32,
    flight: Option<Flight>,
}

/// Steps that the device is at.
struct Flight {
    /// `None` where they could not begin.
    frame: Option<Frame>,
    report: Option<FrameReport>,
    /// Milliseconds until they were done.
    took: Arc<OnceLock<f64>>,
    faults: Vec<Diagnostic>,
}

impl Race {
    pub fn new(gpu: &Gpu, project: &Project, scene: &Arc<Scene>, sides: Vec<Side>) -> Race {
        let by_device = !gpu.is_software()
            && gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY)
            && (gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS) || sides.iter().all(in_passes));
        Race {
            project: project.clone(),
            scene: scene.clone(),
            sides: sides.into_iter().map(Ok).collect(),
            by_device,
            shortest: f64::INFINITY,
            start: Instant::now(),
            run: 0,
            side: 0,
            led: None,
            alone: 0,
            flight: None,
        }
    }

    /// Whether the device is at a run, or has not told of all that it finds wrong with it.
    pub fn is_under_way(&self) -> bool {
        self.flight.is_some()
    }

    /// Begins a run or ends one, without waiting. By side its time or why the device refuses it, once all is known.
    ///
    /// # Errors
    /// The device is lost.
    pub fn advance(&mut self, gpu: &Gpu) -> Checked<Option<Vec<Checked<f64>>>> {
        if let Some(flight) = &mut self.flight {
            let Some(landed) = flight.landed(gpu) else { return Ok(None) };
            self.flight = None;
            match landed {
                Ok((report, took)) => self.note(&report, took),
                Err(faults) => self.refuse(gpu, faults)?,
            }
        } else if self.turn() {
            self.begin(gpu);
        } else {
            let sides = std::mem::take(&mut self.sides);
            return Ok(Some(sides.into_iter().map(|side| side.map(|s| s.time)).collect()));
        }
        Ok(None)
    }

    /// Finds the side whose turn it is; false where enough is known.
    fn turn(&mut self) -> bool {
        let [least, most] = RUNS;
        loop {
            let enough = self.side == 0 && self.led.is_none() && self.run > least && self.start.elapsed() > ENOUGH;
            if self.run > most || enough {
                return false;
            }
            let hopeless = |side: &Side| side.time.is_finite() && side.time > HOPELESS * self.shortest;
            match self.sides.get(self.side) {
                Some(Ok(side)) if self.led.is_some() || !hopeless(side) => return true,
                _ => self.pass(),
            }
        }
    }

    fn begin(&mut self, gpu: &Gpu) {
        let Some(Ok(side)) = self.sides.get_mut(self.side) else { return };
        let wanted = if self.led.is_some() { alone(&side.plan, &side.own) } else { upto(&side.plan, &side.own) };
        let session = match side.session.take() {
            Some(session) => Ok(session),
            None => Session::new(gpu, &self.project, self.scene.clone(), side.settings.clone()),
        };
        let start = Instant::now();
        let frame = session.and_then(|session| side.session.insert(session).repeat(gpu, &wanted));
        let took = Arc::new(OnceLock::new());
        let done = took.clone();
        gpu.queue.on_submitted_work_done(move || {
            // It is set once.
            let _ = done.set(start.elapsed().as_secs_f64() * 1e3);
        });
        let (frame, faults) = match frame {
            Ok(frame) => (Some(frame), vec![]),
            Err(faults) => (None, faults.0),
        };
        self.flight = Some(Flight { frame, report: None, took, faults });
    }

    fn note(&mut self, report: &FrameReport, took: f64) {
        let led = self.led.take();
        if let (Some(Ok(side)), true) = (self.sides.get_mut(self.side), self.run > 0) {
            let time = match led {
                Some(_) => took,
                None if self.by_device => taken(report, &side.own).unwrap_or(took),
                None if took > HOPELESS * self.shortest => took,
                None => {
                    self.led = Some(took);
                    return;
                }
            };
            side.time = side.time.min(time);
            self.shortest = self.shortest.min(led.unwrap_or(took));
            self.alone += 1;
            if led.is_some() && took < SHORT && self.alone < REPEATS {
                self.led = led;
                return;
            }
        }
        self.pass();
    }

    /// Leaves out the side whose turn it is.
    fn refuse(&mut self, gpu: &Gpu, faults: Faults) -> Checked<()> {
        gpu.check()?;
        self.led = None;
        if let Some(side) = self.sides.get_mut(self.side) {
            *side = Err(faults);
        }
        self.pass();
        Ok(())
    }

    /// Hands the turn on.
    fn pass(&mut self) {
        self.alone = 0;
        self.side += 1;
        if self.side >= self.sides.len() {
            if self.run == 0 {
                self.start = Instant::now();
            }
            (self.side, self.run) = (0, self.run + 1);
        }
    }
}

impl Flight {
    /// What the run took, once it is done and the device has told of all that it finds wrong with it.
    fn landed(&mut self, gpu: &Gpu) -> Option<Checked<(FrameReport, f64)>> {
        match gpu.answered() {
            Ok(true) => {}
            Ok(false) => return None,
            Err(faults) => {
                // More may come.
                self.faults.extend(faults.0);
                return None;
            }
        }
        if !self.faults.is_empty() {
            return Some(Err(Faults(std::mem::take(&mut self.faults))));
        }
        if let (Some(frame), None) = (&mut self.frame, &self.report) {
            match frame.arrived(gpu) {
                Ok(report) => self.report = report,
                Err(faults) => return Some(Err(faults)),
            }
        }
        let took = *self.took.get()?;
        self.report.take().map(|report| Ok((report, took)))
    }
}

/// Whether a device can time its own steps that has stamps in passes alone.
fn in_passes(side: &Side) -> bool {
    let mut steps = side.own.iter().filter_map(|i| side.plan.steps.get(*i));
    steps.all(|step| matches!(step.action, Action::Compute { .. } | Action::Draw(_)))
}

/// By step: whether it is one of these.
fn alone(plan: &Plan, wanted: &BTreeSet<usize>) -> Vec<bool> {
    (0..plan.steps.len()).map(|i| wanted.contains(&i)).collect()
}

/// By step: whether it is one of these or leads to one.
fn upto(plan: &Plan, wanted: &BTreeSet<usize>) -> Vec<bool> {
    let mut run = vec![false; plan.steps.len()];
    let mut open: Vec<usize> = wanted.iter().copied().collect();
    while let Some(i) = open.pop() {
        if let Some(known) = run.get_mut(i).filter(|known| !**known) {
            *known = true;
            open.extend(plan.steps[i].after.iter().map(|s| s.0));
        }
    }
    run
}

/// Milliseconds on the device of some steps; `None` where it doesn't say.
fn taken(report: &FrameReport, steps: &BTreeSet<usize>) -> Option<f64> {
    let own = report.steps.iter().filter(|t| steps.contains(&t.step));
    own.map(|t| t.gpu_ms).sum()
}
