//! Reports a frame: times, loops and findings. They arrive once the device is done.

use super::execute::{DeviceLoopRun, ms_since};
use super::{
    device::Gpu, device_loop::states, numerics::Numerics, pending::PendingBytes, reports::FrameReports, timing::Stamps,
};
use crate::diag::{Checked, Diagnostic};
use crate::plan::StepId;
use crate::shader::report::Failed;
use web_time::Instant;

/// What a frame took.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrameReport {
    /// The steps that ran, in the order of their first run.
    pub steps: Vec<StepTime>,
    /// Every run of every loop, in the order of their ends; an inner loop has one entry for each iteration of the
    /// outer.
    pub loops: Vec<LoopReport>,
    /// What went on, but probably not as meant.
    pub warnings: Vec<Diagnostic>,
    /// What the checks of numbers found; `None` without [`super::Prepared::watch`].
    pub numerics: Option<Numerics>,
    /// Checks in shaders that do not hold, by step: as of its last run.
    pub failed: Vec<(StepId, Failed)>,
    /// From the begin of the first timed step to the end of the last one, by the device's clock; `None` where it has
    /// none.
    pub device_ms: Option<f64>,
    /// From the call to the end of the device's work, in milliseconds.
    pub wall_ms: f64,
    /// Of them: to upload and encode, and to hand over to the driver.
    pub record_ms: f64,
    pub submit_ms: f64,
}

/// The time of one step, summed over the iterations of the loops around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepTime {
    /// Index into [`crate::Plan::steps`].
    pub step: usize,
    pub runs: u32,
    /// Of a step that ran in part: for how many instances.
    pub instances: Option<u32>,
    /// On the device; `None` where it can't say.
    pub gpu_ms: Option<f64>,
    /// When its first run began, in milliseconds: with [`super::Timing::Waited`] since the call, else since the first
    /// timed step.
    pub began_ms: Option<f64>,
    /// To encode.
    pub cpu_ms: f64,
}

/// How a loop went.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopReport {
    pub name: String,
    /// How many it took.
    pub iterations: u32,
    /// The number tested last; `None` without a test or an iteration.
    pub last: Option<f32>,
}

/// A recorded frame, whose report arrives once the device is done. The caller submits the encoder that holds its
/// commands.
///
/// ```no_run
/// use lightgraph::{Checked, Frame, Gpu, Session};
///
/// fn draw(gpu: &Gpu, session: &mut Session, index: u32) -> Checked<Frame> {
///     let mut encoder = gpu.device.create_command_encoder(&Default::default());
///     let frame = session.record(gpu, &mut encoder, index, index as f32 / 60.0)?;
///     gpu.queue.submit([encoder.finish()]);
///     Ok(frame)
/// }
///
/// fn collect(gpu: &Gpu, frame: &mut Frame) -> Checked<()> {
///     if let Some(report) = frame.arrived(gpu)? {
///         println!("{:?} ms on the device", report.device_ms);
///     }
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct Frame {
    pub(super) times: Vec<Option<StepTime>>,
    pub(super) first_runs: Vec<StepId>,
    pub(super) loops: Vec<LoopReport>,
    pub(super) warnings: Vec<Diagnostic>,
    pub(super) device_loop_runs: Vec<DeviceLoopRun>,
    pub(super) numerics: Option<Numerics>,
    pub(super) taken: Stamps,
    /// Nanoseconds of a tick.
    pub(super) period: f32,
    pub(super) reports: FrameReports,
    /// Of steps that ran in part: where their counts are.
    pub(super) places: Vec<(StepId, usize)>,
    pub(super) pending_bytes: PendingBytes,
    pub(super) start: Instant,
    pub(super) record_ms: f64,
    pub(super) submit_ms: f64,
}

impl Frame {
    /// What the frame took, once the device has done it; never waits. The frame must have been submitted.
    ///
    /// # Errors
    /// The device fails.
    pub fn arrived(&mut self, gpu: &Gpu) -> Checked<Option<FrameReport>> {
        Ok(self.pending_bytes.arrived(gpu)?.map(|bytes| self.report(&bytes)))
    }

    pub(super) fn report(&mut self, bytes: &[Vec<u8>]) -> FrameReport {
        let part = |i: usize| bytes.get(i).map_or(&[][..], Vec::as_slice);
        let taken = self.taken.read(part(0), self.period, self.times.len());
        for (timed, time) in taken.steps.into_iter().zip(&mut self.times) {
            if let Some(time) = time {
                time.gpu_ms = time.gpu_ms.or((timed.runs == time.runs).then_some(timed.ms));
                time.began_ms = time.began_ms.or(timed.began_ms);
            }
        }
        for (run, state) in self.device_loop_runs.iter().zip(states(part(2))) {
            run.correct(&state, &mut self.times, &mut self.loops, &mut self.warnings);
        }
        let counts: Vec<u32> = bytemuck::pod_collect_to_vec(part(3));
        for (id, place) in &self.places {
            if let Some(Some(time)) = self.times.get_mut(id.0) {
                time.instances = counts.get(*place).copied();
            }
        }
        let times = &self.times;
        FrameReport {
            steps: self.first_runs.iter().filter_map(|s| times.get(s.0).copied().flatten()).collect(),
            loops: std::mem::take(&mut self.loops),
            warnings: std::mem::take(&mut self.warnings),
            numerics: self.numerics.take(),
            failed: self.reports.failed(part(1)),
            device_ms: taken.whole,
            wall_ms: ms_since(self.start),
            record_ms: self.record_ms,
            submit_ms: self.submit_ms,
        }
    }
}
