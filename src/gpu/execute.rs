//! Executes a frame: uploads its inputs, then walks the plan's order step by step.

use super::frame::{Frame, FrameReport, LoopReport, StepTime};
use super::numerics::Watch;
use super::{
    device::Gpu,
    device_loop::{DeviceLoop, DeviceLoops, State, on_device},
    encode::{EncodeContext, Run},
    pending::PendingBytes,
    prepare::Prepared,
    readback::map,
    recorder::Recorder,
    reports::Reports,
    scope::ErrorScope,
    timing::{Timer, Timing},
};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::plan::change::Selection;
use crate::plan::{Action, Ending, Loop, OrderNode, Plan, StepId, Until, steps_of};
use crate::scene::Table;
use crate::value::Values;
use web_time::Instant;

/// Runs of steps that go to the device in one piece: enough to hide the cost of handing over, few enough that the
/// device starts early and no watchdog wakes.
const RUNS_A_SUBMISSION: usize = 256;

/// Iterations of a device-ended loop that are submitted before the host reads the state of the last so many: the device
/// is never idle, and few iterations are submitted in vain.
const ITERATIONS_A_LOOK: u32 = 8;

/// What a frame adds to what was prepared.
#[derive(Debug, Clone, Default)]
pub struct FrameInputs<'a> {
    /// The camera, the clock and the like, by name.
    pub values: Values,
    /// Tables that changed since the last frame (or since [`super::prepare`]).
    pub tables: Option<&'a [Table]>,
    /// The steps that run; `None`: all, in full. A loop runs when any step of its body does.
    pub chosen: Option<&'a Selection>,
    pub timing: Timing,
    /// Each step is waited for by itself, so that one that never ends is known by its name.
    pub careful: bool,
}

/// Runs one frame and waits for it.
///
/// # Errors
/// Values that shaders ask for and nothing gives; what the device finds wrong, with the step's name; a lost device.
pub fn execute(gpu: &Gpu, plan: &Plan, prepared: &mut Prepared, frame: &FrameInputs<'_>) -> Checked<FrameReport> {
    let mut recorded = begin(gpu, plan, prepared, frame)?;
    let bytes = recorded.pending_bytes.wait(gpu).map_err(|faults| among(plan, &recorded, faults))?;
    Ok(recorded.report(&bytes))
}

/// Submits one frame, and waits for loops that the host must end and for nothing else.
///
/// # Errors
/// As [`execute`], of what is known by then.
pub fn begin(gpu: &Gpu, plan: &Plan, prepared: &mut Prepared, frame: &FrameInputs<'_>) -> Checked<Frame> {
    walk(gpu, plan, prepared, frame, Recorder::new(gpu))
}

/// Records one frame into an encoder, which the caller submits before the next frame is recorded. Waits for nothing.
///
/// # Errors
/// Values that shaders ask for and nothing gives; a loop that the host must end, or checks of numbers, which wait.
pub fn record(
    gpu: &Gpu,
    plan: &Plan,
    prepared: &mut Prepared,
    frame: &FrameInputs<'_>,
    encoder: &mut wgpu::CommandEncoder,
) -> Checked<Frame> {
    if prepared.watch.is_some() {
        let d = Diagnostic::error("a frame whose numbers are checked waits for them, and can't be recorded");
        return Err(d.help("run it with `Session::frame`").into());
    }
    walk(gpu, plan, prepared, frame, Recorder::into(gpu, encoder))
}

/// Adds the steps that ran to the fault of a device that does not answer.
fn among(plan: &Plan, recorded: &Frame, mut faults: Faults) -> Faults {
    let names: Vec<&str> = recorded.first_runs.iter().map(|id| plan.steps[id.0].name.as_str()).collect();
    if let Some(first) = faults.0.first_mut() {
        first.help.push(format!("what ran: {}", names.join(", ")));
    }
    faults
}

fn walk(
    gpu: &Gpu,
    plan: &Plan,
    prepared: &mut Prepared,
    frame: &FrameInputs<'_>,
    record: Recorder<'_>,
) -> Checked<Frame> {
    let start = Instant::now();
    let scope = ErrorScope::begin(gpu);
    let uploaded = match frame.tables {
        Some(tables) => prepared.update_tables(gpu, plan, tables),
        None => Ok(()),
    };
    let uploaded = uploaded.and_then(|()| prepared.uniforms.upload(gpu, plan, &frame.values));
    scope.end("upload the values of the frame")?;
    uploaded?;

    let Prepared { pool, scene, uniforms, reports, instances, steps, timer, probe, device_loops, spare, watch } =
        prepared;
    timer.start();
    let mut walk = Walk {
        context: EncodeContext { gpu, plan, pool, scene, uniforms, steps, instances },
        timer,
        reports,
        probe: probe.as_ref(),
        device_loops,
        timing: frame.timing,
        chosen: frame.chosen,
        careful: frame.careful,
        device_loop: None,
        device_loop_runs: vec![],
        watch: watch.as_mut(),
        record,
        pending: vec![],
        pending_iterations: vec![],
        offsets: vec![],
        iterations: vec![],
        times: vec![None; plan.steps.len()],
        first_runs: Vec::with_capacity(plan.steps.len()),
        loops: vec![],
        warnings: vec![],
        start,
        submit_ms: 0.0,
        wait_ms: 0.0,
    };
    if frame.timing == Timing::Frame {
        walk.timer.mark(gpu, &mut walk.record);
    }
    walk.context.scene.encode(gpu, plan, &mut walk.record);
    if let Some(chosen) = frame.chosen {
        instances.begin(plan, pool, &mut walk.record, chosen)?;
    }
    walk.top(&plan.order)?;
    if frame.timing == Timing::Frame {
        walk.timer.mark(gpu, &mut walk.record);
    }
    let (taken, stamps) = walk.timer.resolve(gpu, &mut walk.record)?;
    // What the host reads of a frame comes with its last submission.
    let counted = frame.chosen.and_then(|chosen| instances.counted(chosen));
    let of = [
        stamps.iter().map(|(buffer, bytes)| (buffer, *bytes)).collect(),
        if walk.record.is_used() { reports.all().collect() } else { vec![] },
        device_loops.reported(walk.device_loop_runs.len()).into_iter().collect(),
        counted.into_iter().collect(),
    ];
    let pending_bytes = PendingBytes::copy(gpu, &mut walk.record, spare, &of)?;
    walk.submit()?;
    let Walk { times, first_runs, loops, warnings, device_loop_runs, watch, submit_ms, wait_ms, .. } = walk;
    let record_ms = (ms_since(start) - submit_ms - wait_ms).max(0.0);
    let numerics = match watch {
        Some(watch) => {
            watch.collect(gpu, plan)?;
            Some(watch.take())
        }
        None => None,
    };
    scene.encoded();
    let (reports, period) = (reports.of_frame(), gpu.timestamp_period);
    let places = frame.chosen.map_or(vec![], |chosen| instances.places(chosen));
    Ok(Frame {
        times,
        first_runs,
        loops,
        warnings,
        device_loop_runs,
        numerics,
        taken,
        period,
        reports,
        places,
        pending_bytes,
        start,
        record_ms,
        submit_ms,
    })
}

/// The state of a walk along the order.
struct Walk<'a> {
    context: EncodeContext<'a>,
    timer: &'a mut Timer,
    reports: &'a Reports,
    probe: Option<&'a wgpu::Buffer>,
    device_loops: &'a DeviceLoops,
    timing: Timing,
    chosen: Option<&'a Selection>,
    careful: bool,
    /// Of the loop around, after its first iteration, when it ends on the device.
    device_loop: Option<&'a DeviceLoop>,
    device_loop_runs: Vec<DeviceLoopRun>,
    watch: Option<&'a mut Watch>,
    /// What is encoded and not yet submitted.
    record: Recorder<'a>,
    /// The runs in `record`, each with where its iterations begin in `pending_iterations`.
    pending: Vec<(StepId, usize)>,
    pending_iterations: Vec<u32>,
    /// Offsets of the uniforms of one run.
    offsets: Vec<u32>,
    /// Of the loops around, outermost first.
    iterations: Vec<u32>,
    times: Vec<Option<StepTime>>,
    first_runs: Vec<StepId>,
    loops: Vec<LoopReport>,
    warnings: Vec<Diagnostic>,
    /// When the frame began, and how long it has handed over and waited since.
    start: Instant,
    submit_ms: f64,
    wait_ms: f64,
}

/// A run of a loop that the device ended; its report is corrected when the frame is done.
#[derive(Debug)]
pub(super) struct DeviceLoopRun {
    /// Its place among the reports.
    report: usize,
    /// Iterations submitted.
    submitted: u32,
    steps: Vec<StepId>,
}

impl DeviceLoopRun {
    /// Replaces the iterations submitted by those that ran.
    pub(super) fn correct(
        &self,
        state: &State,
        times: &mut [Option<StepTime>],
        loops: &mut [LoopReport],
        warnings: &mut Vec<Diagnostic>,
    ) {
        for id in &self.steps {
            if let Some(Some(time)) = times.get_mut(id.0) {
                time.runs -= self.submitted - state.iterations.min(self.submitted);
            }
        }
        if let Some(report) = loops.get_mut(self.report) {
            report.iterations = state.iterations;
            report.last = Some(state.last);
            warnings.extend(no_number(report));
        }
    }
}

/// The warning of a loop that met no number.
fn no_number(report: &LoopReport) -> Option<Diagnostic> {
    let LoopReport { name, iterations, last } = report;
    last.filter(|n| n.is_nan())?;
    let text = format!("the loop `{name}` stopped after {iterations} iterations: its number is not a number");
    Some(Diagnostic::warning(text).help("look for a division by zero in its passes"))
}

impl Walk<'_> {
    fn nodes(&mut self, nodes: &[OrderNode]) -> Checked<()> {
        for node in nodes {
            match node {
                OrderNode::Step(id) => self.step(*id)?,
                OrderNode::Loop(l) => self.repeat(l)?,
            }
        }
        Ok(())
    }

    /// The nodes that are to run.
    fn top(&mut self, nodes: &[OrderNode]) -> Checked<()> {
        let Some(chosen) = self.chosen else { return self.nodes(nodes) };
        let runs = |id: &StepId| chosen.run.get(id.0).copied().unwrap_or(true);
        for node in nodes.iter().filter(|n| steps_of(std::slice::from_ref(n)).iter().any(runs)) {
            self.nodes(std::slice::from_ref(node))?;
        }
        Ok(())
    }

    fn step(&mut self, id: StepId) -> Checked<()> {
        let gpu = self.context.gpu;
        if self.pending.len() >= RUNS_A_SUBMISSION && !self.record.is_lent() {
            self.submit()?;
        }
        let writes = self.context.plan.steps.get(id.0).map_or(0, |s| s.writes.len());
        if self.watch.as_ref().is_some_and(|w| w.is_full(writes)) {
            self.submit()?;
            if let Some(watch) = &mut self.watch {
                watch.collect(gpu, self.context.plan)?;
            }
        }
        // Handing over is no encoding: a software driver works meanwhile.
        let start = Instant::now();
        let (in_pass, dispatches) = match self.context.plan.steps.get(id.0).map(|s| &s.action) {
            Some(Action::Compute { .. }) => (true, true),
            Some(Action::Draw(_)) => (true, false),
            Some(Action::Copy { .. } | Action::Clear { .. }) | None => (false, false),
        };
        if self.times.get(id.0).is_some_and(Option::is_none) {
            self.reports.clear(&mut self.record, id);
        }
        let follows = dispatches && self.record.stamped();
        let pair = match self.timing {
            Timing::Waited if !self.record.is_lent() => None,
            Timing::Steps | Timing::Waited => self.timer.pair(gpu, id, in_pass, follows),
            Timing::Frame => None,
        };
        let waited = self.timing == Timing::Waited && !self.record.is_lent();
        if waited {
            self.submit()?;
            self.wait()?;
        }
        let partial = self.chosen.is_some_and(|chosen| chosen.partial.contains(&id));
        let run = Run { iterations: &self.iterations, pair: pair.as_ref(), device_loop: self.device_loop, partial };
        self.context.encode(&mut self.record, id, &run, &mut self.offsets)?;
        if let Some(watch) = &mut self.watch {
            watch.encode(gpu, self.context.plan, self.context.pool, self.record.encoder(), id, &self.iterations)?;
        }
        self.pending.push((id, self.pending_iterations.len()));
        self.pending_iterations.extend(&self.iterations);
        if let Some(time) = self.times.get_mut(id.0) {
            if time.is_none() {
                self.first_runs.push(id);
            }
            let time = time.get_or_insert(StepTime {
                step: id.0,
                runs: 0,
                instances: None,
                gpu_ms: None,
                began_ms: None,
                cpu_ms: 0.0,
            });
            time.runs += 1;
            time.cpu_ms += ms_since(start);
        }
        if (self.careful || waited) && !self.record.is_lent() {
            let (start, began) = (Instant::now(), ms_since(self.start));
            self.submit()?;
            self.wait().map_err(|faults| self.named(id, faults))?;
            if waited && let Some(Some(time)) = self.times.get_mut(id.0) {
                *time.gpu_ms.get_or_insert(0.0) += ms_since(start);
                time.began_ms.get_or_insert(began);
            }
        }
        Ok(())
    }

    /// Names the step that a device runs which does not answer.
    fn named(&self, id: StepId, mut faults: Faults) -> Faults {
        let name = self.context.plan.steps.get(id.0).map_or("?", |s| &s.name);
        if let Some(first) = faults.0.first_mut() {
            first.message = format!("`{name}`: {}", first.message);
        }
        faults
    }

    fn repeat(&mut self, l: &Loop) -> Checked<()> {
        if on_device(l) {
            return self.hand_over(l);
        }
        if let (Some(Until { ending: Ending::Host { why }, .. }), true) = (&l.until, self.record.is_lent()) {
            let what = format!("the host must end the loop `{}`, and a recorded frame never waits", l.name);
            let d = Diagnostic::error(what).help(format!("why the host: {why}"));
            return Err(d.help("run it with `Session::frame`").into());
        }
        let mut report = LoopReport { name: l.name.clone(), iterations: 0, last: None };
        for i in 0..l.count {
            self.iterations.push(i);
            let done = self.nodes(&l.body);
            self.iterations.pop();
            done?;
            report.iterations += 1;
            if let Some(until) = &l.until {
                let tested = self.tested(until)?;
                report.last = Some(tested);
                self.warnings.extend(no_number(&report));
                if tested.is_nan() || until.comparison.holds(tested, until.value) {
                    break;
                }
            }
        }
        self.loops.push(report);
        Ok(())
    }

    /// Hands over the iterations of a loop that ends on the device.
    fn hand_over(&mut self, l: &Loop) -> Checked<()> {
        let gpu = self.context.gpu;
        let device_loop = self.device_loops.get(&l.name)?;
        device_loop.begin(self.record.encoder());
        let mut submitted = 0;
        let mut question = None;
        for i in 0..l.count {
            self.iterations.push(i);
            // The first is never left out.
            self.device_loop = (i > 0).then_some(device_loop);
            let done = self.nodes(&l.body);
            self.device_loop = None;
            self.iterations.pop();
            done?;
            device_loop.test(self.record.compute());
            submitted += 1;
            if submitted % ITERATIONS_A_LOOK == 0 && submitted < l.count && !self.record.is_lent() {
                let turn = (submitted / ITERATIONS_A_LOOK) as usize;
                device_loop.copy_state(self.record.encoder(), turn);
                let asked = self.submit()?;
                // The answer to the question before: the device works on while the host waits for it.
                if let Some(submission) = std::mem::replace(&mut question, asked)
                    && device_loop.read_state(gpu, turn - 1, submission)?.ended
                {
                    break;
                }
            }
        }
        self.device_loops.report(self.record.encoder(), device_loop, self.device_loop_runs.len());
        self.device_loop_runs.push(DeviceLoopRun { report: self.loops.len(), submitted, steps: steps_of(&l.body) });
        self.loops.push(LoopReport { name: l.name.clone(), iterations: 0, last: None });
        Ok(())
    }

    /// Waits for what was encoded, and reads the number that a loop tests.
    fn tested(&mut self, until: &Until) -> Checked<f32> {
        let gpu = self.context.gpu;
        self.submit()?;
        let buffer = self.context.pool.buffer(self.context.plan, until.buffer)?;
        let probe = self.probe.ok_or_else(|| Diagnostic::error("a loop tests a number, and none was prepared"))?;
        let scope = ErrorScope::begin(gpu);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, probe, 0, 4);
        gpu.queue.submit([encoder.finish()]);
        scope.end("read the number that a loop tests")?;
        let bytes = map(gpu, probe, 4)?;
        let mut raw = [0; 4];
        for (to, from) in raw.iter_mut().zip(bytes) {
            *to = from;
        }
        Ok(f32::from_le_bytes(raw))
    }

    /// Hands what is encoded to the device; `None` when that is nothing.
    fn submit(&mut self) -> Checked<Option<wgpu::SubmissionIndex>> {
        let start = Instant::now();
        let Some((commands, scope)) = self.record.finish() else { return Ok(None) };
        let submission = self.context.gpu.queue.submit([commands]);
        let ended = scope.end("run the frame");
        ended.map_err(|faults| self.blame().unwrap_or(faults))?;
        self.pending.clear();
        self.pending_iterations.clear();
        self.submit_ms += ms_since(start);
        Ok(Some(submission))
    }

    fn wait(&mut self) -> Checked<()> {
        let start = Instant::now();
        let waited = self.context.gpu.wait();
        self.wait_ms += ms_since(start);
        waited
    }

    /// The faults of the first run that fails when each is encoded by itself. wgpu finds faults when an encoder is
    /// finished, and its text need not name the step.
    fn blame(&self) -> Option<crate::diag::Faults> {
        let gpu = self.context.gpu;
        let ends = self.pending.iter().skip(1).map(|p| p.1).chain([self.pending_iterations.len()]);
        self.pending.iter().zip(ends).find_map(|((id, begin), end)| {
            let name = self.context.plan.steps.get(id.0).map_or("?", |s| &s.name);
            let scope = ErrorScope::begin(gpu);
            let mut record = Recorder::new(gpu);
            let iterations = self.pending_iterations.get(*begin..end).unwrap_or_default();
            let run = Run { iterations, pair: None, device_loop: None, partial: false };
            let encoded = self.context.encode(&mut record, *id, &run, &mut vec![]);
            if let Some((_, inner)) = record.finish()
                && let Err(faults) = inner.end(&format!("run `{name}`"))
            {
                return Some(faults);
            }
            scope.end(&format!("run `{name}`")).and(encoded).err()
        })
    }
}

pub(super) fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
