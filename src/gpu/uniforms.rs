//! Allocates the uniforms of a whole frame in one buffer: a slot for each binding, and for each iteration of the loops
//! around it if it reads their indices.

use super::{device::Gpu, scope::scoped};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::plan::{Binding, OrderNode, Plan, StepId};
use crate::shader::{Layout, Member};
use crate::value::{Value, Values};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Where every uniform of a plan lies.
#[derive(Debug)]
pub(super) struct Uniforms {
    buffer: wgpu::Buffer,
    uses: Vec<UniformUse>,
    /// The content; values that no frame changes are written once.
    bytes: Vec<u8>,
    asked: Vec<AskedValue>,
    /// The buffer holds `bytes`.
    uploaded: bool,
}

/// A uniform variable of one step.
#[derive(Debug)]
struct UniformUse {
    step: usize,
    variable: usize,
    layout: Arc<Layout>,
    /// The loops whose indices tell its slots apart, outermost first: name and count. Empty when it reads none.
    loops: Vec<(String, u32)>,
    /// First slot, in bytes.
    first: u64,
    /// From slot to slot, in bytes.
    stride: u64,
}

/// A value that each frame may give; the plan's is the default.
#[derive(Debug)]
struct AskedValue {
    name: String,
    /// The frame's value that is in `bytes`.
    value: Option<Value>,
    /// Members of this name: the index of the use, and of the member in its layout.
    places: Vec<(usize, usize)>,
}

impl Uniforms {
    /// Lays out the slots and allocates the buffer.
    ///
    /// # Errors
    /// Fails where loops make the buffer larger than the device allows, or where a value doesn't fit its member.
    pub(super) fn allocate(gpu: &Gpu, plan: &Plan) -> Checked<Uniforms> {
        let align = u64::from(gpu.limits.min_uniform_buffer_offset_alignment.max(16));
        let mut uses = vec![];
        let mut total: u64 = 0;
        for (step, loops) in enclosing_loops(plan) {
            let Some(found) = plan.steps.get(step.0) else { continue };
            for (variable, binding) in found.bindings.iter().enumerate() {
                let Binding::Uniform { layout, .. } = binding else { continue };
                let turns = layout.members.iter().any(|m| loops.iter().any(|(name, _)| *name == m.name));
                let loops = if turns { loops.clone() } else { vec![] };
                let stride = u64::from(layout.size.max(16)).next_multiple_of(align);
                let slots = loops.iter().fold(1u64, |n, (_, count)| n.saturating_mul((*count).max(1).into()));
                uses.push(UniformUse { step: step.0, variable, layout: layout.clone(), loops, first: total, stride });
                total = total.saturating_add(stride.saturating_mul(slots));
            }
        }
        // Offsets into the buffer are 32 bits wide.
        let most = gpu.limits.max_buffer_size.min(u32::MAX.into());
        if total > most {
            return Err(Diagnostic::error(format!(
                "the uniforms of all iterations take {total} bytes, and this device allows {most}"
            ))
            .help("lower the counts of the loops")
            .into());
        }
        let size = total.max(align);
        let buffer = scoped(gpu, "allocate the uniforms", || {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("uniforms"),
                size,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        })?;
        let bytes = vec![0; usize::try_from(size).unwrap_or(0)];
        let mut all = Uniforms { buffer, uses, bytes, asked: vec![], uploaded: false };
        all.begin(plan)?;
        Ok(all)
    }

    /// Writes the values that are the same in all frames and lists the others. Of equal names an `extra` of the binding
    /// wins over a loop's index, a loop's index over the frame's value, and the frame's over the plan's.
    fn begin(&mut self, plan: &Plan) -> Checked<()> {
        let mut asked: BTreeMap<&str, Vec<(usize, usize)>> = BTreeMap::new();
        let mut faults = vec![];
        for (index, found) in self.uses.iter().enumerate() {
            let binding = plan.steps.get(found.step).and_then(|s| s.bindings.get(found.variable));
            let Some(Binding::Uniform { extra, .. }) = binding else { continue };
            for (place, member) in found.layout.members.iter().enumerate() {
                // The innermost of equal names counts.
                let around = found.loops.iter().rposition(|(name, _)| *name == member.name);
                let value = |slot| match (extra.get(&member.name), around) {
                    (Some(value), _) => Some(*value),
                    (None, Some(around)) => Some(Value::Uint(found.iteration(slot, around))),
                    (None, None) => None,
                };
                if value(0).is_none() {
                    asked.entry(&member.name).or_default().push((index, place));
                } else if !found.write(&mut self.bytes, member, value) {
                    faults.push(found.missing(plan, member, value(0), &[]));
                }
            }
        }
        let asked = asked.into_iter().map(|(name, places)| AskedValue { name: name.into(), value: None, places });
        self.asked = asked.collect();
        Faults::check(faults, ())
    }

    /// What to bind for a variable of a step: its first slot; the others are reached by dynamic offsets.
    pub(super) fn binding(&self, step: usize, variable: usize) -> Option<wgpu::BindingResource<'_>> {
        let found = self.uses.iter().find(|u| u.step == step && u.variable == variable)?;
        Some(wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.buffer,
            offset: 0,
            size: wgpu::BufferSize::new(u64::from(found.layout.size.max(16)).next_multiple_of(16)),
        }))
    }

    /// The uses that a bind group with these variables needs offsets for, in their order.
    pub(super) fn of_step(&self, step: usize, variables: impl Fn(usize) -> bool) -> Vec<usize> {
        let mut found: Vec<usize> =
            (0..self.uses.len()).filter(|i| self.uses[*i].step == step && variables(self.uses[*i].variable)).collect();
        found.sort_by_key(|i| self.uses[*i].variable);
        found
    }

    /// The offset of a use at these iterations of the loops around its step, outermost first.
    pub(super) fn offset(&self, index: usize, iterations: &[u32]) -> u32 {
        let found = &self.uses[index];
        let slot =
            found.loops.iter().zip(iterations).fold(0u64, |n, ((_, count), i)| n * u64::from(*count) + u64::from(*i));
        (found.first + slot * found.stride) as u32
    }

    /// Writes the values that differ from the frame before, and uploads all if there are any.
    ///
    /// # Errors
    /// Members that nothing gives a value, each with its shader.
    pub(super) fn upload(&mut self, gpu: &Gpu, plan: &Plan, frame: &Values) -> Checked<()> {
        let mut faults: Vec<Diagnostic> = vec![];
        let mut other = !self.uploaded;
        for asked in &mut self.asked {
            let now = frame.get(&asked.name);
            // By their bits: a zero may have a sign.
            let same = match (now, &asked.value) {
                (Some(now), Some(before)) => now.ty() == before.ty() && now.bytes() == before.bytes(),
                (now, before) => now.is_none() && before.is_none(),
            };
            if self.uploaded && same {
                continue;
            }
            other = true;
            asked.value = now.copied();
            let value = now.or_else(|| plan.values.get(&asked.name)).copied();
            for (index, place) in &asked.places {
                let (found, member) = (&self.uses[*index], &self.uses[*index].layout.members[*place]);
                if !found.write(&mut self.bytes, member, |_| value) {
                    let fault = found.missing(plan, member, value, &[frame]);
                    if !faults.contains(&fault) {
                        faults.push(fault);
                    }
                }
            }
        }
        self.uploaded = false;
        Faults::check(faults, ())?;
        if other {
            gpu.queue.write_buffer(&self.buffer, 0, &self.bytes);
        }
        self.uploaded = true;
        Ok(())
    }
}

impl UniformUse {
    /// The number of slots: one an iteration of all loops.
    fn slots(&self) -> usize {
        self.loops.iter().map(|(_, count)| (*count).max(1) as usize).product()
    }

    /// The iteration of a loop that a slot is for.
    fn iteration(&self, slot: usize, around: usize) -> u32 {
        let within: usize = self.loops[around + 1..].iter().map(|(_, count)| (*count).max(1) as usize).product();
        (slot / within % self.loops[around].1.max(1) as usize) as u32
    }

    /// Writes a member in all slots. Returns false where the value is missing or of another type.
    fn write(&self, bytes: &mut [u8], member: &Member, value: impl Fn(usize) -> Option<Value>) -> bool {
        let first = self.first as usize + member.offset as usize;
        (0..self.slots()).all(|slot| {
            let Some(value) = value(slot).and_then(|v| v.cast(member.ty)) else { return false };
            let (value, at) = (value.bytes(), first + slot * self.stride as usize);
            bytes[at..at + value.len()].copy_from_slice(value);
            true
        })
    }

    /// The fault of a member without a value of its type: `value` is the one of that name, `frame` offers names.
    fn missing(&self, plan: &Plan, member: &Member, value: Option<Value>, frame: &[&Values]) -> Diagnostic {
        let (Member { name, ty, .. }, (shader, variable)) = (member, shown(plan, self.step, self.variable));
        match value {
            Some(v) => Diagnostic::error(format!(
                "{shader}: `{variable}.{name}` is {}, and the value of that name, {v}, is {}",
                ty.wgsl(),
                v.ty().wgsl()
            ))
            .help("declare the member with the value's type"),
            None => Diagnostic::error(format!("{shader}: nothing gives `{variable}.{name}` a value"))
                .nearest(name, plan.values.keys().chain(frame.iter().flat_map(|f| f.keys())).map(String::as_str))
                .help("name a parameter, a derived value, a fact of the scene or a value of the frame"),
        }
    }
}

/// The steps in their order, each with the loops around it: name and count, outermost first.
pub(super) fn enclosing_loops(plan: &Plan) -> Vec<(StepId, Vec<(String, u32)>)> {
    fn walk(nodes: &[OrderNode], around: &mut Vec<(String, u32)>, out: &mut Vec<(StepId, Vec<(String, u32)>)>) {
        for node in nodes {
            match node {
                OrderNode::Step(id) => out.push((*id, around.clone())),
                OrderNode::Loop(l) => {
                    around.push((l.name.clone(), l.count));
                    walk(&l.body, around, out);
                    around.pop();
                }
            }
        }
    }
    let mut out = vec![];
    walk(&plan.order, &mut vec![], &mut out);
    out
}

/// A variable of a step as the user knows it: the shader's path and its name.
fn shown(plan: &Plan, step: usize, variable: usize) -> (String, String) {
    let shader = plan.steps.get(step).and_then(|s| s.action.shader());
    match shader.and_then(|shader| plan.shaders.get(shader)) {
        Some(s) => (s.path.clone(), s.interface.variables.get(variable).map_or_else(String::new, |v| v.name.clone())),
        None => (String::new(), String::new()),
    }
}
