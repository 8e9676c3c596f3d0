//! What the members of steps are told: which of them run, where things have moved, and the parts of their places that draws go over.
//! For each step whose shader asks.

use super::{device::Gpu, scope::scoped};
use crate::diag::Checked;
use crate::plan::change::Partly;
use crate::plan::window::{WHOLE, Window};
use crate::plan::{Action, Binding, Plan, ResourceId};
use crate::scene::Bounds;
use glam::Vec3;
use std::collections::BTreeMap;

/// By index of the step, unless another thing is said.
#[derive(Debug, Default)]
pub(super) struct Members {
    lists: BTreeMap<usize, List>,
    boxes: BTreeMap<usize, Boxes>,
    /// By buffer of draws.
    windows: BTreeMap<ResourceId, Edges>,
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

#[derive(Debug)]
struct Edges {
    /// A `vec4f` for each member of the draw.
    buffer: wgpu::Buffer,
    members: usize,
    /// What the buffer holds; nothing before the first frame.
    holds: Vec<[f32; 4]>,
    /// That is all of each place.
    whole: bool,
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
                    if let Binding::Windows { draws, members } = *binding {
                        let size = 16 * u64::from(members.max(1));
                        let buffer = buffer("windows", size, wgpu::BufferUsages::STORAGE);
                        let members = members as usize;
                        all.windows.insert(draws, Edges { buffer, members, holds: vec![], whole: false });
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

    pub(super) fn windows(&self, draws: ResourceId) -> Option<&wgpu::Buffer> {
        self.windows.get(&draws).map(|edges| &edges.buffer)
    }

    /// Before a frame; what isn't named does all, and everything of it.
    pub(super) fn choose(&mut self, gpu: &Gpu, Partly { members: some, moved, windows }: &Partly) {
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
        for (draws, edges) in &mut self.windows {
            let some = windows.get(draws);
            if some.is_none() && edges.whole {
                continue;
            }
            edges.whole = some.is_none();
            let edge = |window: Option<&Option<Window>>| window.copied().flatten().map_or(WHOLE, |w| w.edges);
            let wanted = (0..edges.members).map(|row| edge(some.and_then(|all| all.get(row))));
            if !wanted.clone().eq(edges.holds.iter().copied()) {
                edges.holds = wanted.collect();
                gpu.queue.write_buffer(&edges.buffer, 0, bytemuck::cast_slice(&edges.holds));
            }
        }
    }
}
