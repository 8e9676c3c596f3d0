//! What the members of dispatches are told: which of them run, and where things have moved. For each step whose shader asks.

use super::{device::Gpu, scope::scoped};
use crate::diag::Checked;
use crate::plan::{Action, Binding, Plan};
use crate::scene::Bounds;
use glam::Vec3;
use std::collections::BTreeMap;

/// By index of the step.
#[derive(Debug, Default)]
pub(super) struct Members {
    lists: BTreeMap<usize, List>,
    boxes: BTreeMap<usize, Boxes>,
}

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

#[derive(Debug)]
struct Boxes {
    buffer: wgpu::Buffer,
    count: usize,
    /// What the buffer begins with; nothing before the first frame.
    holds: Vec<Bounds>,
}

/// Round everything.
const ANYWHERE: Bounds = Bounds { min: Vec3::splat(-1e30), max: Vec3::splat(1e30) };

/// Beyond everything.
const NOWHERE: Bounds = Bounds { min: Vec3::splat(1e30), max: Vec3::splat(1e30) };

impl Members {
    /// Lists of all members, and boxes that nothing is said of.
    ///
    /// # Errors
    /// No memory is left.
    pub(super) fn allocate(gpu: &Gpu, plan: &Plan) -> Checked<Members> {
        scoped(gpu, "allocate what the members of dispatches are told", || {
            let buffer = |label, size: u64, usage| {
                let usage = usage | wgpu::BufferUsages::COPY_DST;
                gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(label),
                    size,
                    usage,
                    mapped_at_creation: false,
                })
            };
            let mut all = Members::default();
            for (index, step) in plan.steps.iter().enumerate() {
                let Action::Compute { groups: [.., members], .. } = step.action else { continue };
                for binding in &step.bindings {
                    if let Binding::Members = binding {
                        let size = 4 * u64::from(members.max(1));
                        let buffer = buffer("members", size, wgpu::BufferUsages::STORAGE);
                        all.lists.insert(index, List { buffer, members, holds: vec![], whole: false });
                    }
                    if let Binding::Moved(count) = *binding {
                        let buffer = buffer("moved", 32 * u64::from(count), wgpu::BufferUsages::UNIFORM);
                        all.boxes.insert(index, Boxes { buffer, count: count as usize, holds: vec![] });
                    }
                }
            }
            all
        })
    }

    pub(super) fn buffer(&self, step: usize) -> Option<&wgpu::Buffer> {
        self.lists.get(&step).map(|list| &list.buffer)
    }

    pub(super) fn boxes(&self, step: usize) -> Option<&wgpu::Buffer> {
        self.boxes.get(&step).map(|boxes| &boxes.buffer)
    }

    /// Before a frame: the members that steps do, by index of the step, and where what they show has moved; those that aren't named do
    /// all, and everything of them.
    pub(super) fn choose(
        &mut self,
        gpu: &Gpu,
        some: &BTreeMap<usize, Vec<bool>>,
        moved: &BTreeMap<usize, Vec<Bounds>>,
    ) {
        for (index, list) in &mut self.lists {
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
        for (index, boxes) in &mut self.boxes {
            let wanted = moved.get(index).map_or(&[ANYWHERE][..], Vec::as_slice);
            if wanted == boxes.holds {
                continue;
            }
            boxes.holds = wanted.to_vec();
            let few = Bounds::gathered(wanted, boxes.count);
            // One twice says nothing new. Where nothing moved that has a place, nothing need be looked at.
            let last = few.last().copied().unwrap_or(NOWHERE);
            let all = few.into_iter().chain(std::iter::repeat(last)).take(boxes.count);
            let rows: Vec<[[f32; 4]; 2]> =
                all.map(|b| [b.min, b.max].map(|corner| corner.extend(0.0).into())).collect();
            gpu.queue.write_buffer(&boxes.buffer, 0, bytemuck::cast_slice(&rows));
        }
    }
}
