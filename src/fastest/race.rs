//! Alternatives in turn on the device, until enough is known of how long each takes. Nothing is waited for.

use crate::diag::Checked;
use crate::gpu::{Frame, FrameReport, Gpu};
use crate::plan::Plan;
use crate::plan::fastest::{Alternatives, Choice};
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

/// A side that takes so many times as long as another is not looked at more closely.
const HOPELESS: f64 = 8.0;

/// One alternative: what to render with it, and the plan.
pub(super) struct Side {
    settings: Settings,
    pub plan: Plan,
    /// The steps that some other alternative does without.
    pub own: BTreeSet<usize>,
}

/// # Errors
/// As of a plan.
pub(super) fn sides(
    gpu: &Gpu,
    project: &Project,
    scene: &Arc<Scene>,
    settings: &Settings,
    group: &Alternatives,
) -> Checked<Vec<Side>> {
    let mut sides = vec![];
    for way in &group.ways {
        let mut choices = settings.choices.clone();
        choices.insert(group.name.clone(), Choice { index: way.index, why: "measured now".into() });
        let plain = Settings { choices, skip: false, verify: false, watch: false, inspect: false, ..settings.clone() };
        let plan = plan_for(project, scene, &plain, gpu)?.plan;
        sides.push(Side { settings: plain, plan, own: BTreeSet::new() });
    }
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
/// falls on all. By the device's clock; where it has none, or is a software driver's that tells the time of one step
/// with the next, by the host's, of a frame of those steps alone.
pub(super) struct Race {
    sides: Vec<Side>,
    sessions: Vec<Session>,
    by_device: bool,
    times: Vec<f64>,
    /// The shortest time of a frame that leads to the own steps.
    shortest: f64,
    /// Of the timed runs.
    start: Instant,
    /// In the first one, 0, a driver may still compile: it is not timed.
    run: u32,
    side: usize,
    /// Milliseconds of the frame that led to the own steps, which are to run alone now.
    led: Option<f64>,
    flying: Option<Flying>,
}

/// Steps that the device is at.
struct Flying {
    frame: Frame,
    report: Option<FrameReport>,
    /// Milliseconds until it was done.
    took: Arc<OnceLock<f64>>,
}

impl Race {
    /// # Errors
    /// As of a session.
    pub fn new(gpu: &Gpu, project: &Project, scene: &Arc<Scene>, sides: Vec<Side>) -> Checked<Race> {
        let session = |side: &Side| Session::new(gpu, project, scene.clone(), side.settings.clone());
        Ok(Race {
            sessions: sides.iter().map(session).collect::<Checked<_>>()?,
            by_device: !gpu.is_software() && gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY),
            times: vec![f64::INFINITY; sides.len()],
            shortest: f64::INFINITY,
            start: Instant::now(),
            run: 0,
            side: 0,
            led: None,
            flying: None,
            sides,
        })
    }

    /// By side its time, once all is known.
    ///
    /// # Errors
    /// The device fails.
    pub fn advance(&mut self, gpu: &Gpu) -> Checked<Option<Vec<f64>>> {
        loop {
            if let Some(Flying { frame, report, took }) = &mut self.flying {
                if report.is_none() {
                    *report = frame.arrived(gpu)?;
                }
                let (Some(report), Some(took)) = (report.take_if(|_| took.get().is_some()), took.get().copied()) else {
                    return Ok(None);
                };
                self.flying = None;
                self.note(&report, took);
            }
            if !self.turn() {
                return Ok(Some(std::mem::take(&mut self.times)));
            }
            let (side, session) = (&self.sides[self.side], &mut self.sessions[self.side]);
            let wanted = if self.led.is_some() { alone(&side.plan, &side.own) } else { upto(&side.plan, &side.own) };
            let start = Instant::now();
            let frame = session.repeat(gpu, &wanted)?;
            let took = Arc::new(OnceLock::new());
            let done = took.clone();
            gpu.queue.on_submitted_work_done(move || {
                // It is set once.
                let _ = done.set(start.elapsed().as_secs_f64() * 1e3);
            });
            self.flying = Some(Flying { frame, report: None, took });
        }
    }

    /// Finds the side whose turn it is; false where enough is known.
    fn turn(&mut self) -> bool {
        let [least, most] = RUNS;
        loop {
            let enough = self.side == 0 && self.led.is_none() && self.run > least && self.start.elapsed() > ENOUGH;
            if self.run > most || enough {
                return false;
            }
            let time = self.times[self.side];
            let hopeless = time.is_finite() && time > HOPELESS * self.shortest;
            if self.run == 0 || self.led.is_some() || !hopeless {
                return true;
            }
            self.pass();
        }
    }

    fn note(&mut self, report: &FrameReport, took: f64) {
        let led = self.led.take();
        if self.run > 0 {
            let time = match led {
                Some(_) => took,
                None if self.by_device => taken(report, &self.sides[self.side].own).unwrap_or(took),
                None if took > HOPELESS * self.shortest => took,
                None => {
                    self.led = Some(took);
                    return;
                }
            };
            self.times[self.side] = self.times[self.side].min(time);
            self.shortest = self.shortest.min(led.unwrap_or(took));
        }
        self.pass();
    }

    /// Hands the turn on.
    fn pass(&mut self) {
        self.side += 1;
        if self.side == self.sides.len() {
            if self.run == 0 {
                self.start = Instant::now();
            }
            (self.side, self.run) = (0, self.run + 1);
        }
    }
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
