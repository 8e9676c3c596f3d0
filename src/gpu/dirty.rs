//! Compacts dirty bits into the list of instances that a step runs for, and the indirect arguments for it.

use super::{
    buffers::{bind_buffers, empty, filled, kernel},
    device::Gpu,
    pool::Pool,
    recorder::Recorder,
};
use crate::diag::Checked;
use crate::plan::change::{Bits, Selection};
use crate::plan::cull::DRAW_BYTES;
use crate::plan::{Action, Binding, Only, Plan, Step, StepId};
use std::collections::BTreeMap;
use wgpu::BufferUsages as U;

/// Words before the numbers of a list: workgroups of an instance along x, instances along x, whether only some run, how
/// many do.
const HEADER: usize = 4;

/// What the steps of a plan need that have instances.
#[derive(Debug)]
pub(super) struct Instances {
    /// By index of the step: the list of all instances.
    whole: BTreeMap<usize, wgpu::Buffer>,
    /// By index of the step, of steps that can run in part.
    partial: BTreeMap<usize, Partial>,
    /// How many instances ran of each step that ran in part.
    counts: Option<wgpu::Buffer>,
    /// Set bits to copy from.
    ones: Option<wgpu::Buffer>,
}

/// A step that can run in part.
#[derive(Debug)]
struct Partial {
    /// Its place among the counts.
    place: u64,
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    workgroups: u32,
    arguments: Arguments,
}

/// What the device makes for a step that runs in part.
#[derive(Debug)]
pub(super) enum Arguments {
    Dispatch { list: wgpu::Buffer, groups: wgpu::Buffer },
    Draws { draws: wgpu::Buffer, clears: wgpu::Buffer },
}

/// Workgroups of a dispatch over so many instances, `groups` each, and how many instances lie along x.
fn folded([x, y, _]: [u32; 3], instances: u32, most: u32) -> ([u32; 3], u32) {
    let fold = instances.div_ceil(most.max(1)).max(1);
    ([x * fold, y, instances.div_ceil(fold)], fold)
}

/// Workgroups of a dispatch in full.
pub(super) fn workgroups(gpu: &Gpu, groups: [u32; 3], instances: Option<u32>) -> [u32; 3] {
    let most = gpu.limits.max_compute_workgroups_per_dimension;
    instances.map_or(groups, |instances| folded(groups, instances, most).0)
}

impl Instances {
    /// # Errors
    /// No memory is left; what the device finds wrong with the kernels.
    pub(super) fn prepare(gpu: &Gpu, plan: &Plan, pool: &Pool) -> Checked<Instances> {
        let mut all = Instances { whole: BTreeMap::new(), partial: BTreeMap::new(), counts: None, ones: None };
        let most = gpu.limits.max_compute_workgroups_per_dimension;
        for (index, step) in plan.steps.iter().enumerate() {
            let Action::Compute { groups, instances: Some(instances), .. } = step.action else { continue };
            let ([.., layers], fold) = folded(groups, instances, most);
            let numbers = (0..layers * fold).map(|i| i.min(instances.saturating_sub(1)));
            let words: Vec<u32> = [groups[0], fold, 0, instances].into_iter().chain(numbers).collect();
            all.whole.insert(index, filled(gpu, "instances", &[bytemuck::cast_slice(&words)], U::STORAGE)?);
        }
        let in_part = |(i, s): (usize, &Step)| Some((i, s.only.clone().filter(|_| able(s))?));
        let steps: Vec<(usize, Only)> = plan.steps.iter().enumerate().filter_map(in_part).collect();
        if steps.is_empty() {
            return Ok(all);
        }
        let size = 4 * steps.len() as u64;
        let counts = empty(gpu, "instances that ran", size, U::STORAGE | U::COPY_SRC | U::COPY_DST)?;
        let longest = steps.iter().map(|(_, only)| plan.resources[only.bits.0].desc.bytes()).max().unwrap_or(4);
        all.ones = Some(filled(gpu, "set bits", &[&vec![u8::MAX; longest as usize]], U::COPY_SRC)?);
        for (place, (index, only)) in steps.iter().enumerate() {
            let step = &plan.steps[*index];
            let partial = Partial::prepare(gpu, plan, pool, step, only, (&counts, place as u64))?;
            all.partial.insert(*index, partial);
        }
        all.counts = Some(counts);
        Ok(all)
    }

    pub(super) fn whole(&self, step: usize) -> Option<&wgpu::Buffer> {
        self.whole.get(&step)
    }

    /// The list of instances of a step that runs in part.
    pub(super) fn some(&self, step: usize) -> Option<&wgpu::Buffer> {
        match &self.partial.get(&step)?.arguments {
            Arguments::Dispatch { list, .. } => Some(list),
            Arguments::Draws { .. } => None,
        }
    }

    pub(super) fn arguments(&self, id: StepId) -> Option<&Arguments> {
        self.partial.get(&id.0).map(|p| &p.arguments)
    }

    /// Before a frame's steps: clears the dirty bits that someone reads, or sets them where all instances run.
    ///
    /// # Errors
    /// The bits are not of the plan.
    pub(super) fn begin(&self, plan: &Plan, pool: &Pool, record: &mut Recorder<'_>, chosen: &Selection) -> Checked<()> {
        for (id, bits) in &chosen.bits {
            let buffer = pool.buffer(plan, *id)?;
            match &self.ones {
                Some(ones) if *bits == Bits::Set => {
                    record.encoder().copy_buffer_to_buffer(ones, 0, buffer, 0, buffer.size().min(ones.size()));
                }
                _ => record.encoder().clear_buffer(buffer, 0, None),
            }
        }
        if let Some(counts) = self.counts.as_ref().filter(|_| !chosen.partial.is_empty()) {
            record.encoder().clear_buffer(counts, 0, None);
        }
        Ok(())
    }

    /// Before a step that runs in part: chooses its instances.
    pub(super) fn choose(&self, record: &mut Recorder<'_>, id: StepId) {
        if let Some(partial) = self.partial.get(&id.0) {
            let pass = record.compute();
            pass.set_pipeline(&partial.pipeline);
            pass.set_bind_group(0, &partial.group, &[]);
            pass.dispatch_workgroups(partial.workgroups, 1, 1);
        }
    }

    /// How many instances ran of the steps that ran in part: where that is, and its bytes.
    pub(super) fn counted(&self, chosen: &Selection) -> Option<(&wgpu::Buffer, u64)> {
        self.counts.as_ref().filter(|_| !chosen.partial.is_empty()).map(|counts| (counts, counts.size()))
    }

    /// For each step that runs in part, its place among the counts.
    pub(super) fn places(&self, chosen: &Selection) -> Vec<(StepId, usize)> {
        let place = |id: &StepId| Some((*id, self.partial.get(&id.0)?.place as usize));
        chosen.partial.iter().filter_map(place).collect()
    }
}

/// Whether a step that may run in part can. What checks in a shader say is said of all instances together.
pub(super) fn able(step: &Step) -> bool {
    let checked = step.bindings.iter().any(|b| matches!(b, Binding::Report));
    let indirect = !matches!(&step.action, Action::Draw(draw) if draw.indirect.is_none());
    !checked && indirect
}

impl Partial {
    fn prepare(
        gpu: &Gpu,
        plan: &Plan,
        pool: &Pool,
        step: &Step,
        only: &Only,
        (counts, place): (&wgpu::Buffer, u64),
    ) -> Checked<Partial> {
        let bits = pool.buffer(plan, only.bits)?;
        let most = gpu.limits.max_compute_workgroups_per_dimension;
        let mut job = [only.instances, 1, 1, most, 0, place as u32, 0, 0];
        let (arguments, draws) = match &step.action {
            Action::Draw(draw) => {
                let indirect = draw.indirect.map(|i| (pool.buffer(plan, i.buffer), i.first + i.second));
                let (buffer, each) = indirect.map_or((Ok(bits), 0), |found| found);
                job[4] = each;
                let size = u64::from(only.instances) * u64::from(each) * DRAW_BYTES;
                let draws = empty(gpu, "draws of dirty instances", size.max(4), U::STORAGE | U::INDIRECT)?;
                let clears = 16 * u64::from(only.instances);
                let clears = empty(gpu, "clears of dirty instances", clears, U::STORAGE | U::INDIRECT)?;
                (Arguments::Draws { draws, clears }, Some(buffer?))
            }
            Action::Compute { groups: [x, y, _], .. } => {
                (job[1], job[2]) = (*x, *y);
                let ([.., layers], fold) = folded([*x, *y, 1], only.instances, most);
                let words = HEADER as u64 + u64::from(layers) * u64::from(fold) + u64::from(fold);
                let list = empty(gpu, "dirty instances", 4 * words, U::STORAGE)?;
                let groups = empty(gpu, "workgroups of dirty instances", 12, U::STORAGE | U::INDIRECT)?;
                (Arguments::Dispatch { list, groups }, None)
            }
            Action::Copy { .. } | Action::Clear { .. } => {
                return Err(crate::diag::Diagnostic::error(format!("`{}` has no instances", step.name)).into());
            }
        };
        let job = filled(gpu, "dirty instances", &[bytemuck::cast_slice(&job)], U::UNIFORM)?;
        let mut buffers = vec![&job, bits, counts];
        let (pipeline, workgroups) = match &arguments {
            Arguments::Dispatch { list, groups } => {
                buffers.extend([list, groups]);
                (kernel(gpu, include_str!("dirty.wgsl"), "compact")?, 1)
            }
            Arguments::Draws { draws: some, clears } => {
                buffers.extend(draws.into_iter().chain([some, clears]));
                (kernel(gpu, include_str!("dirty_draws.wgsl"), "choose")?, only.instances.div_ceil(64))
            }
        };
        let group = bind_buffers(gpu, &format!("the dirty instances of `{}`", step.name), &pipeline, &buffers)?;
        Ok(Partial { place, pipeline, group, workgroups, arguments })
    }
}
