//! Allocates the uniforms of a whole frame in one buffer: a slot for each binding, and for each iteration of the loops
//! around it if it reads their indices.

use super::{device::Gpu, scope::scoped};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::plan::{Binding, OrderNode, Plan, StepId};
use crate::shader::Layout;
use crate::value::{Type, Value, Values};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Where every uniform of a plan lies.
#[derive(Debug)]
pub(super) struct Uniforms {
    buffer: wgpu::Buffer,
    uses: Vec<UniformUse>,
    bytes: Vec<u8>,
    /// What is asked for besides the plan's own, by name, as it was when `bytes` were uploaded.
    asked: Vec<(String, Option<Value>)>,
    /// The buffer holds `bytes`.
    uploaded: bool,
}

/// A uniform variable of one step.
#[derive(Debug)]
struct UniformUse {
    step: usize,
    variable: usize,
    /// As the user knows it: the shader's path and the variable's name.
    shown: (String, String),
    layout: Arc<Layout>,
    extra: Values,
    /// The loops whose indices tell its slots apart, outermost first: name and count. Empty when it reads none.
    loops: Vec<(String, u32)>,
    /// First slot, in bytes.
    first: u64,
    /// From slot to slot, in bytes.
    stride: u64,
}

impl Uniforms {
    /// Lays out the slots and allocates the buffer.
    ///
    /// # Errors
    /// The loops make it larger than the device allows.
    pub(super) fn allocate(gpu: &Gpu, plan: &Plan) -> Checked<Uniforms> {
        let align = u64::from(gpu.limits.min_uniform_buffer_offset_alignment.max(16));
        let mut uses = vec![];
        let mut total: u64 = 0;
        for (step, loops) in enclosing_loops(plan) {
            let Some(found) = plan.steps.get(step.0) else { continue };
            for (variable, binding) in found.bindings.iter().enumerate() {
                let Binding::Uniform { layout, extra } = binding else { continue };
                let turns = layout.members.iter().any(|m| loops.iter().any(|(name, _)| *name == m.name));
                let loops = if turns { loops.clone() } else { vec![] };
                let stride = u64::from(layout.size.max(16)).next_multiple_of(align);
                let slots = loops.iter().fold(1u64, |n, (_, count)| n.saturating_mul((*count).max(1).into()));
                uses.push(UniformUse {
                    step: step.0,
                    variable,
                    shown: shown(plan, step, variable),
                    layout: layout.clone(),
                    extra: extra.clone(),
                    loops,
                    first: total,
                    stride,
                });
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
        let names: BTreeSet<&String> = uses.iter().flat_map(|u| &u.layout.members).map(|m| &m.name).collect();
        let asked = names.into_iter().map(|name| (name.clone(), None)).collect();
        let bytes = vec![0; usize::try_from(size).unwrap_or(0)];
        Ok(Uniforms { buffer, uses, bytes, asked, uploaded: false })
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

    /// Packs the slots whose values differ from the frame before, and uploads all if there are any. Of equal names an
    /// `extra` wins over a loop's index, that over the frame's value, that over the plan's.
    ///
    /// # Errors
    /// Members that nothing gives a value, each with its shader.
    pub(super) fn upload(&mut self, gpu: &Gpu, plan: &Plan, frame: &Values) -> Checked<()> {
        let mut changed: BTreeSet<&str> = BTreeSet::new();
        for (name, before) in &mut self.asked {
            let now = frame.get(name).copied();
            // By their bits: a zero may have a sign.
            let same = match (&now, &before) {
                (Some(now), Some(before)) => now.ty() == before.ty() && now.bytes() == before.bytes(),
                (now, before) => now.is_none() && before.is_none(),
            };
            if !same {
                *before = now;
                changed.insert(name);
            }
        }
        let all = !self.uploaded;
        if !all && changed.is_empty() {
            return Ok(());
        }
        self.uploaded = false;
        let due = |found: &&UniformUse| all || found.layout.members.iter().any(|m| changed.contains(m.name.as_str()));
        let mut faults: Vec<Diagnostic> = vec![];
        for found in self.uses.iter().filter(due) {
            let size = found.layout.size as usize;
            let mut base = vec![0; size];
            let missing = found.layout.pack(&mut base, |name| found.value(plan, frame, name));
            for member in missing {
                let fault = found.missing(&member.name, member.ty, plan, frame);
                if !faults.contains(&fault) {
                    faults.push(fault);
                }
            }
            let mut iterations = vec![0; found.loops.len()];
            let mut at = usize::try_from(found.first).unwrap_or(usize::MAX);
            loop {
                found.turn(&mut base, &iterations);
                if let Some(slot) = self.bytes.get_mut(at..at.saturating_add(size)) {
                    slot.copy_from_slice(&base);
                }
                at += found.stride as usize;
                if !advance(&mut iterations, &found.loops) {
                    break;
                }
            }
        }
        Faults::check(faults, ())?;
        gpu.queue.write_buffer(&self.buffer, 0, &self.bytes);
        self.uploaded = true;
        Ok(())
    }
}

impl UniformUse {
    fn value(&self, plan: &Plan, frame: &Values, name: &str) -> Option<Value> {
        let index = || self.loops.iter().any(|(l, _)| l == name).then_some(Value::Uint(0));
        let known = || frame.get(name).or_else(|| plan.values.get(name)).copied();
        self.extra.get(name).copied().or_else(index).or_else(known)
    }

    /// Writes the loops' indices over those of another iteration.
    fn turn(&self, slot: &mut [u8], iterations: &[u32]) {
        for member in &self.layout.members {
            if self.extra.contains_key(&member.name) {
                continue;
            }
            // The innermost of equal names counts.
            let index = self.loops.iter().zip(iterations).rev().find(|((name, _), _)| *name == member.name);
            if let Some(v) = index.and_then(|(_, i)| Value::Uint(*i).cast(member.ty)) {
                let bytes = v.bytes();
                let at = member.offset as usize;
                if let Some(to) = slot.get_mut(at..at + bytes.len()) {
                    to.copy_from_slice(bytes);
                }
            }
        }
    }

    fn missing(&self, name: &str, ty: Type, plan: &Plan, frame: &Values) -> Diagnostic {
        let (shader, variable) = &self.shown;
        match self.value(plan, frame, name) {
            Some(v) => Diagnostic::error(format!(
                "{shader}: `{variable}.{name}` is {}, and the value of that name, {v}, is {}",
                ty.wgsl(),
                v.ty().wgsl()
            ))
            .help("declare the member with the value's type"),
            None => Diagnostic::error(format!("{shader}: nothing gives `{variable}.{name}` a value"))
                .nearest(name, plan.values.keys().chain(frame.keys()).map(String::as_str))
                .help("name a parameter, a derived value, a fact of the scene or a value of the frame"),
        }
    }
}

/// The next combination of indices, the innermost fastest; false after the last.
fn advance(iterations: &mut [u32], loops: &[(String, u32)]) -> bool {
    for (i, (_, count)) in iterations.iter_mut().zip(loops).rev() {
        if *i + 1 < *count {
            *i += 1;
            return true;
        }
        *i = 0;
    }
    false
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

fn shown(plan: &Plan, step: StepId, variable: usize) -> (String, String) {
    use crate::plan::Action;
    let shader = match plan.steps.get(step.0).map(|s| &s.action) {
        Some(Action::Draw(d)) => plan.shaders.get(d.shader),
        Some(Action::Compute { shader, .. }) => plan.shaders.get(*shader),
        Some(Action::Copy { .. } | Action::Clear { .. }) | None => None,
    };
    match shader {
        Some(s) => (s.path.clone(), s.interface.variables.get(variable).map_or_else(String::new, |v| v.name.clone())),
        None => (String::new(), String::new()),
    }
}
