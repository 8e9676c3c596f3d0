//! Ends loops on the device. After each iteration a kernel tests the loop's condition; once it holds, the kernel sets
//! the sizes of all indirect draws and dispatches that follow to zero. The host submits iterations without waiting for
//! the answer.

use super::{
    buffers::{bind_buffers, empty, filled, kernel},
    device::Gpu,
    dirty::workgroups,
    pool::Pool,
    scene_data::SceneData,
};
use crate::diag::{Checked, Diagnostic};
use crate::plan::{Action, Comparison, Cull, Draw, DrawGeometry, Ending, Loop, OrderNode, Plan, StepId, steps_of};
use wgpu::BufferUsages as U;

/// The words of [`State`] on the device.
const STATE_WORDS: usize = 5;
const STATE_BYTES: u64 = 4 * STATE_WORDS as u64;

const TEST: &str = "
struct LoopState {
    ended: u32,
    iterations: u32,
    /// The number tested last.
    last: u32,
    /// 0: <, 1: <=, 2: >, 3: >=.
    comparison: u32,
    value: f32,
}
@group(0) @binding(0) var<storage, read_write> state: LoopState;
@group(0) @binding(1) var<storage, read_write> sizes: array<u32>;
@group(0) @binding(2) var<storage, read> number: array<u32>;
var<workgroup> ends: bool;

fn passes(bits: u32) -> bool {
    if (bits & 0x7fffffffu) > 0x7f800000u {
        return true;
    }
    let x = bitcast<f32>(bits);
    switch state.comparison {
        case 0u: { return x < state.value; }
        case 1u: { return x <= state.value; }
        case 2u: { return x > state.value; }
        default: { return x >= state.value; }
    }
}

@compute @workgroup_size(64)
fn end_of_iteration(@builtin(local_invocation_index) lane: u32) {
    if lane == 0u {
        ends = false;
        if state.ended == 0u {
            let bits = number[0];
            ends = passes(bits);
            state.last = bits;
            state.iterations += 1u;
            state.ended = u32(ends);
        }
    }
    if workgroupUniformLoad(&ends) {
        for (var i = lane; i < arrayLength(&sizes); i += 64u) {
            sizes[i] = 0u;
        }
    }
}";

/// The state of a loop on the device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    pub ended: bool,
    pub iterations: u32,
    pub last: f32,
}

/// All loops of a plan that the device ends.
#[derive(Debug)]
pub(super) struct DeviceLoops {
    loops: Vec<DeviceLoop>,
    /// The states of all their runs in a frame.
    reports: Option<wgpu::Buffer>,
}

/// One such loop.
#[derive(Debug)]
pub(super) struct DeviceLoop {
    name: String,
    /// Sizes of the draws and dispatches of an iteration, as indirect arguments; zeroed at the end.
    pub sizes: wgpu::Buffer,
    /// By step of the plan: where its are, in bytes.
    places: Vec<u64>,
    first_sizes: wgpu::Buffer,
    state: wgpu::Buffer,
    first_state: wgpu::Buffer,
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    /// Copies of the state that the host reads while the loop runs.
    state_copies: [wgpu::Buffer; 2],
}

impl DeviceLoops {
    /// # Errors
    /// What the device finds wrong; loops too long to report on.
    pub(super) fn prepare(gpu: &Gpu, plan: &Plan, pool: &Pool, scene: &SceneData) -> Checked<DeviceLoops> {
        let mut found = vec![];
        collect(&plan.order, 1, &mut found);
        let runs = found.iter().fold(0u64, |sum, (_, runs)| sum.saturating_add(*runs));
        if runs == 0 {
            return Ok(DeviceLoops { loops: vec![], reports: None });
        }
        let size = runs.saturating_mul(STATE_BYTES);
        let usage = U::COPY_SRC | U::COPY_DST;
        let reports = empty(gpu, "room for the iterations of loops", size, usage)?;
        let loops =
            found.iter().map(|(l, _)| DeviceLoop::prepare(gpu, plan, l, pool, scene)).collect::<Checked<_>>()?;
        Ok(DeviceLoops { loops, reports: Some(reports) })
    }

    pub(super) fn get(&self, name: &str) -> Checked<&DeviceLoop> {
        let found = self.loops.iter().find(|l| l.name == name);
        found.ok_or_else(|| Diagnostic::error(format!("the loop `{name}` was not prepared")).into())
    }

    /// Copies the state of a loop to the report of a run.
    pub(super) fn report(&self, encoder: &mut wgpu::CommandEncoder, device_loop: &DeviceLoop, run: usize) {
        if let Some(reports) = &self.reports {
            encoder.copy_buffer_to_buffer(&device_loop.state, 0, reports, run as u64 * STATE_BYTES, STATE_BYTES);
        }
    }

    /// The reports of the first so many runs: where they are, and their bytes.
    pub(super) fn reported(&self, runs: usize) -> Option<(&wgpu::Buffer, u64)> {
        self.reports.as_ref().filter(|_| runs > 0).map(|reports| (reports, runs as u64 * STATE_BYTES))
    }
}

/// The states in the bytes of reports.
pub(super) fn states(bytes: &[u8]) -> Vec<State> {
    bytes.chunks_exact(STATE_BYTES as usize).map(state).collect()
}

impl DeviceLoop {
    fn prepare(gpu: &Gpu, plan: &Plan, l: &Loop, pool: &Pool, scene: &SceneData) -> Checked<DeviceLoop> {
        let Some(until) = &l.until else {
            return Err(Diagnostic::error(format!("the loop `{}` has no test", l.name)).into());
        };
        let mut words = vec![];
        let mut places = vec![0; plan.steps.len()];
        for id in steps_of(&l.body) {
            let Some(step) = plan.steps.get(id.0) else { continue };
            places[id.0] = 4 * words.len() as u64;
            match &step.action {
                Action::Compute { groups, instances, .. } => words.extend(workgroups(gpu, *groups, *instances)),
                Action::Draw(draw) => words.extend(draw_sizes(draw, scene)),
                Action::Copy { .. } | Action::Clear { .. } => {}
            }
        }
        // A buffer has a size; an empty body has none.
        words.resize(words.len().max(4), 0);
        let comparison = match until.comparison {
            Comparison::Less => 0,
            Comparison::LessEqual => 1,
            Comparison::Greater => 2,
            Comparison::GreaterEqual => 3,
        };
        let number = pool.buffer(plan, until.buffer)?;
        let what = format!("the end of the loop `{}`", l.name);
        let filled = |words: &[u32]| filled(gpu, &what, &[bytemuck::cast_slice(words)], U::COPY_SRC);
        let empty = |size: u64, usage: U| empty(gpu, &what, size, usage | U::COPY_DST);
        let sizes = empty(4 * words.len() as u64, U::STORAGE | U::INDIRECT)?;
        let state = empty(STATE_BYTES, U::STORAGE | U::COPY_SRC)?;
        let pipeline = kernel(gpu, TEST, "end_of_iteration")?;
        let group = bind_buffers(gpu, &what, &pipeline, &[&state, &sizes, number])?;
        let state_copy = || empty(STATE_BYTES, U::MAP_READ);
        Ok(DeviceLoop {
            name: l.name.clone(),
            places,
            first_sizes: filled(&words)?,
            first_state: filled(&[0, 0, 0, comparison, until.value.to_bits()])?,
            sizes,
            state,
            pipeline,
            group,
            state_copies: [state_copy()?, state_copy()?],
        })
    }

    /// Where the sizes of a step begin, in bytes.
    pub(super) fn place(&self, id: StepId) -> u64 {
        self.places.get(id.0).copied().unwrap_or(0)
    }

    /// Resets sizes and state before the first iteration.
    pub(super) fn begin(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.copy_buffer_to_buffer(&self.first_sizes, 0, &self.sizes, 0, self.sizes.size());
        encoder.copy_buffer_to_buffer(&self.first_state, 0, &self.state, 0, STATE_BYTES);
    }

    /// Tests the number after an iteration.
    pub(super) fn test(&self, pass: &mut wgpu::ComputePass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.dispatch_workgroups(1, 1, 1);
    }

    /// Copies the state, for [`DeviceLoop::read_state`] with the same turn.
    pub(super) fn copy_state(&self, encoder: &mut wgpu::CommandEncoder, turn: usize) {
        encoder.copy_buffer_to_buffer(&self.state, 0, &self.state_copies[turn % 2], 0, STATE_BYTES);
    }

    /// Reads the copied state once its submission is done; waits for no later submission.
    ///
    /// # Errors
    /// The device fails.
    pub(super) fn read_state(&self, gpu: &Gpu, turn: usize, submission: wgpu::SubmissionIndex) -> Checked<State> {
        super::readback::map_after(gpu, &self.state_copies[turn % 2], STATE_BYTES, Some(submission), state)
    }
}

fn state(bytes: &[u8]) -> State {
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(bytes);
    let word = |i: usize| words.get(i).copied().unwrap_or(0);
    State { ended: word(0) != 0, iterations: word(1), last: f32::from_bits(word(2)) }
}

/// Indirect arguments for all that a draw issues, in its order: for each pipeline and member, after one for each member
/// that clears its targets. `u32`s: four a draw without indices, five with.
fn draw_sizes(draw: &Draw, scene: &SceneData) -> Vec<u32> {
    let mut words: Vec<u32> = draw.members.iter().flat_map(|_| [3, 1, 0, 0]).collect();
    let cull = match draw.geometry {
        DrawGeometry::Scene { cull } => cull,
        DrawGeometry::Screen => {
            words.extend(draw.members.iter().flat_map(|m| [3, 1, 0, m.index]));
            return words;
        }
        DrawGeometry::Vertices { count, instances, .. } => {
            words.extend(draw.members.iter().flat_map(|_| [count, instances, 0, 0]));
            return words;
        }
    };
    let Some(mesh) = &scene.mesh else { return words };
    // First index and number of indices.
    let part = mesh.part(draw.level);
    let one_sided = if cull == Cull::Material { part.one_sided } else { 0 };
    let parts = [(part.first, one_sided), (part.first + one_sided, part.count - one_sided)];
    for (first, count) in parts.into_iter().skip(usize::from(cull != Cull::Material)) {
        words.extend(draw.members.iter().flat_map(|m| [count, 1, first, 0, m.index]));
    }
    words
}

/// Collects the loops that the device ends, with the number of runs of each in a frame.
fn collect<'a>(nodes: &'a [OrderNode], runs: u64, out: &mut Vec<(&'a Loop, u64)>) {
    for node in nodes {
        if let OrderNode::Loop(l) = node {
            if on_device(l) {
                out.push((l, runs));
            }
            collect(&l.body, runs.saturating_mul(l.count.into()), out);
        }
    }
}

/// Whether the device ends a loop.
pub(super) fn on_device(l: &Loop) -> bool {
    matches!(&l.until, Some(until) if until.ending == Ending::Device)
}
