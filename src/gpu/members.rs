//! The numbers of the members that a dispatch does, for each step whose shader asks for them.

use super::{device::Gpu, scope::scoped};
use crate::diag::Checked;
use crate::plan::{Action, Binding, Plan};
use std::collections::BTreeMap;

/// By index of the step.
#[derive(Debug, Default)]
pub(super) struct Members(BTreeMap<usize, List>);

#[derive(Debug)]
struct List {
    /// A `u32` for each member of the step.
    buffer: wgpu::Buffer,
    members: u32,
    /// What the buffer begins with.
    holds: Vec<u32>,
    /// That is all of them.
    whole: bool,
}

impl Members {
    /// Lists of all members.
    ///
    /// # Errors
    /// No memory is left.
    pub(super) fn allocate(gpu: &Gpu, plan: &Plan) -> Checked<Members> {
        scoped(gpu, "allocate the members of dispatches", || {
            let listed = plan.steps.iter().enumerate().filter_map(|(index, step)| match step.action {
                Action::Compute { groups: [.., members], .. }
                    if step.bindings.iter().any(|b| matches!(b, Binding::Members)) =>
                {
                    Some((index, members))
                }
                _ => None,
            });
            let list = |members: u32| List {
                buffer: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("members"),
                    size: 4 * u64::from(members.max(1)),
                    usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                }),
                members,
                holds: vec![],
                whole: false,
            };
            Members(listed.map(|(index, members)| (index, list(members))).collect())
        })
    }

    pub(super) fn buffer(&self, step: usize) -> Option<&wgpu::Buffer> {
        self.0.get(&step).map(|list| &list.buffer)
    }

    /// Before a frame: the members that steps do, by index of the step; those that aren't named do all.
    pub(super) fn choose(&mut self, gpu: &Gpu, some: &BTreeMap<usize, Vec<bool>>) {
        for (index, list) in &mut self.0 {
            let does = |member: &u32| match some.get(index) {
                Some(some) => some.get(*member as usize).copied().unwrap_or(false),
                None => true,
            };
            let whole = !some.contains_key(index);
            if whole && list.whole {
                continue;
            }
            list.whole = whole;
            // Most frames want what the last one did, and must not ask for memory.
            let wanted = (0..list.members).filter(does);
            if !wanted.clone().eq(list.holds.iter().copied()) {
                list.holds = wanted.collect();
                gpu.queue.write_buffer(&list.buffer, 0, bytemuck::cast_slice(&list.holds));
            }
        }
    }
}
