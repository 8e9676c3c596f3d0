//! Probes one invocation of a pass for the values it computes: the plan gets an instrumented copy of the shader, and a
//! buffer that the copy writes to.

use super::Session;
use crate::diag::{Checked, Diagnostic};
use crate::gpu::{self, Gpu};
use crate::plan::change::Why;
use crate::plan::{Action, Binding, Desc, Draw, Place, Plan, Resource, ResourceId, Slot, Step, StepId, steps_of};
use crate::shader::probe::{Invocation, Probe, instrument};
use crate::shader::{BindingKind, EntryPoint, Shader, Stage};
use std::sync::Arc;

/// What to ask.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Probing {
    /// The name of a pass, or of one of its steps.
    pub pass: String,
    /// Of `let`s and `var`s those of these names; empty: all.
    pub values: Vec<String>,
}

/// A pass of a plan that can be asked.
#[derive(Debug)]
pub(super) struct Probed {
    step: StepId,
    probe: Probe,
    buffer: ResourceId,
}

impl Probed {
    /// Puts the instrumented shader into the plan.
    ///
    /// # Errors
    /// No such pass, one that has no shader or is several steps, and what the device can't do.
    pub fn of(plan: &mut Plan, wanted: &Probing, gpu: &Gpu) -> Checked<Probed> {
        let index = find(plan, &wanted.pass)?;
        let step = &plan.steps[index];
        let entry = match &step.action {
            Action::Draw(draw) => draw.fragment.clone(),
            Action::Compute { entry, .. } => Some(entry.clone()),
            Action::Copy { .. } | Action::Clear { .. } => {
                let d = Diagnostic::error(format!("`{}` runs no shader", step.name));
                return Err(d.help("probe a pass of the kind Screen, Draw or Compute").into());
            }
        };
        let Some(entry) = entry else {
            let d = Diagnostic::error(format!("`{}` draws depth alone: it has no fragment stage", step.name));
            return Err(d.help("give its shader a `@fragment` entry, or probe a pass that reads what it draws").into());
        };
        let Some(shader) = step.action.shader().and_then(|i| plan.shaders.get(i)) else {
            return Err(Diagnostic::error(format!("`{}` has no shader", step.name)).into());
        };
        let described = shader.interface.entries.iter().find(|e| e.name == entry);
        described.map_or(Ok(()), |entry| able(gpu, shader, entry, &step.name))?;
        let probe = instrument(shader, &entry, &wanted.values)?;
        let known = |name: &String| probe.sites.iter().any(|s| s.name.split(['.', '[']).next() == Some(name));
        if let Some(unknown) = wanted.values.iter().find(|name| !known(name)) {
            let all = instrument(shader, &entry, &[])?;
            let names = all.sites.iter().map(|s| s.name.split(['.', '[']).next().unwrap_or_default());
            let d = Diagnostic::error(format!("`{}` computes no `{unknown}` that a probe sees", step.name));
            return Err(d.nearest(unknown, names).help("name a `let` or a `var` of its shader").into());
        }
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let desc = Desc::Buffer { size: probe.bytes(), usage };
        let slot = plan.slots.len();
        plan.slots.push(Slot { desc: desc.clone(), bytes: probe.bytes() });
        let buffer = ResourceId(plan.resources.len());
        let lifetime = (0, plan.order.len());
        plan.resources.push(Resource { slot, lifetime, ..Resource::new(format!("{} (probe)", step.name), desc) });
        let copy = plan.shaders.len();
        plan.shaders.push(Arc::new(probe.shader.clone()));
        let step = &mut plan.steps[index];
        match &mut step.action {
            Action::Draw(draw) => draw.shader = copy,
            Action::Compute { shader, .. } => *shader = copy,
            Action::Copy { .. } | Action::Clear { .. } => {}
        }
        step.bindings.push(Binding::Resource(buffer));
        Ok(Probed { step: StepId(index), probe, buffer })
    }
}

impl Session {
    /// Asks an invocation of the pass of [`super::Settings::probe`]: the pixel `x`, `y` of a draw, or a global
    /// invocation of a dispatch. The frames from now on answer; [`Session::probed`] reads.
    ///
    /// # Errors
    /// The session probes nothing, or the pass has no such invocation.
    pub fn probe(&self, gpu: &Gpu, at: [u32; 3]) -> Checked<()> {
        let probed = self.asked()?;
        let end = extent(&self.plan, probed);
        if at.iter().zip(end).any(|(at, end)| *at >= end) {
            let (step, [x, y, z]) = (&self.plan.steps[probed.step.0], at);
            let d = Diagnostic::error(format!("`{}` has no invocation at {x},{y},{z}", step.name));
            let [width, height, depth] = end;
            return Err(d.help(format!("it has {width} × {height} × {depth} of them, counted from 0")).into());
        }
        if let gpu::Memory::Buffer(buffer) = self.memory(probed.buffer)? {
            // What an earlier answer left must not pass for one to this.
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.clear_buffer(buffer, 0, None);
            gpu.queue.submit([encoder.finish()]);
            gpu.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&Probe::ask(at)));
        }
        Ok(())
    }

    /// How many invocations were at the place that is asked for since [`Session::probe`], and what the last of them
    /// did, in terms of [`Session::probe_sites`].
    ///
    /// # Errors
    /// The session probes nothing, or the device fails.
    pub fn probed(&self, gpu: &Gpu) -> Checked<(u32, Vec<Invocation>)> {
        let probed = self.asked()?;
        let bytes = gpu::read_buffer(gpu, &self.prepared, &self.plan, probed.buffer)?;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
        Ok(probed.probe.read(&words))
    }

    /// The step that is probed, and its shader's copy.
    ///
    /// # Errors
    /// The session probes nothing.
    pub fn probe_sites(&self) -> Checked<(StepId, &Probe)> {
        self.asked().map(|p| (p.step, &p.probe))
    }

    /// The step that wrote a texel of a texture last, and its invocation for the texel. Where a step copied the
    /// texture, the step that wrote the copied one.
    ///
    /// # Errors
    /// No shader of the plan writes the texture, or not by an invocation for each texel.
    pub fn writer(&self, texture: ResourceId, (mip, layer): (u32, u32), at: [u32; 2]) -> Checked<(StepId, [u32; 3])> {
        let plan = &self.plan;
        let mut steps = steps_of(&plan.order);
        // A step for other frames wrote nothing in this one.
        steps.retain(|id| self.why.get(id.0) != Some(&Why::OtherFrames));
        let name = |id: ResourceId| plan.resources.get(id.0).map_or("?", |r| r.name.as_str());
        let mut wanted = texture;
        while let Some(id) = steps.pop() {
            let step = &plan.steps[id.0];
            if !step.writes.contains(&wanted) {
                continue;
            }
            match &step.action {
                Action::Copy { from, .. } => wanted = *from,
                Action::Clear { .. } => {
                    let d = Diagnostic::error(format!("`{}` cleared `{}`: no shader did", step.name, name(wanted)));
                    return Err(d.help("ask a pass that draws or computes").into());
                }
                Action::Draw(draw) if draws(draw, wanted, (mip, layer), at) => return Ok((id, [at[0], at[1], 0])),
                Action::Draw(_) => {}
                Action::Compute { .. } if !stores(plan, step, wanted, mip) => {}
                Action::Compute { entry, groups, instances, .. } => {
                    let size = workgroup_size(step.action.shader().and_then(|i| plan.shaders.get(i)), entry);
                    let whole = match &plan.resources[wanted.0].desc {
                        Desc::Texture(t) => t.level(mip),
                        Desc::Buffer { .. } => [0; 3],
                    };
                    let over = |i: usize| groups[i] == whole[i].div_ceil(size[i].max(1));
                    let deep = groups[2].saturating_mul(size[2]) > layer;
                    if instances.is_none() && over(0) && over(1) && deep {
                        return Ok((id, [at[0], at[1], layer]));
                    }
                    let step = &step.name;
                    let d = Diagnostic::error(format!(
                        "`{step}` wrote `{}`, but not by an invocation for each texel",
                        name(wanted)
                    ));
                    return Err(d.help(format!("ask one of the invocations of `{step}` by its number")).into());
                }
            }
        }
        let d = Diagnostic::error(format!("no pass of the plan writes `{}`", name(wanted)));
        Err(d.help("it holds what a file or the program around has put there").into())
    }

    fn asked(&self) -> Checked<&Probed> {
        let none = || Diagnostic::error("this session probes no pass").help("name one in its settings").into();
        self.probe.as_ref().ok_or_else(none)
    }
}

/// The step of this name, or the only one of the pass of this name.
pub(super) fn find(plan: &Plan, name: &str) -> Checked<usize> {
    if let Some(exact) = plan.steps.iter().position(|s| s.name == name) {
        return Ok(exact);
    }
    let of_pass: Vec<usize> = (0..plan.steps.len()).filter(|i| plan.steps[*i].pass == name).collect();
    match (of_pass.as_slice(), plan.skipped.iter().find(|s| s.0 == name)) {
        ([only], _) => Ok(*only),
        ([first, ..], _) => {
            let first = &plan.steps[*first].name;
            let d = Diagnostic::error(format!("`{name}` runs as {} steps", of_pass.len()));
            Err(d.help(format!("name one of them, such as `{first}`; `lightgraph plan` lists them")).into())
        }
        ([], Some((_, why))) => {
            Err(Diagnostic::error(format!("`{name}` does not run: {why}")).help("probe a pass that runs").into())
        }
        ([], None) => {
            let d = Diagnostic::error(format!("the plan has no pass `{name}`"));
            Err(d.nearest(name, plan.steps.iter().flat_map(|s| [s.name.as_str(), &s.pass])).into())
        }
    }
}

/// # Errors
/// The device has no room for one more buffer in this stage, or none that it can write to.
fn able(gpu: &Gpu, shader: &Shader, entry: &EntryPoint, step: &str) -> Checked<()> {
    let writes =
        gpu.adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::FRAGMENT_WRITABLE_STORAGE);
    if entry.stage == Stage::Fragment && !writes {
        let d =
            Diagnostic::error(format!("`{step}` can't be probed: fragment stages of this device only read buffers"));
        return Err(d.help("probe a Compute pass, or use another adapter").into());
    }
    let buffers = entry.uses.keys().filter_map(|i| shader.interface.variables.get(*i));
    let used = buffers.filter(|v| matches!(v.kind, BindingKind::Storage { .. })).count() as u32;
    let most = gpu.limits.max_storage_buffers_per_shader_stage;
    if used >= most {
        let d = Diagnostic::error(format!(
            "`{step}` can't be probed: its shader has {used} storage buffers, all that this device gives a stage, and \
             the probe needs one"
        ));
        return Err(d.help("bind one of them as a uniform array, or use an adapter that allows more").into());
    }
    Ok(())
}

/// Whether a draw goes to a texel of a resource.
fn draws(draw: &Draw, resource: ResourceId, (mip, layer): (u32, u32), [x, y]: [u32; 2]) -> bool {
    let color = draw.color.iter().find(|t| t.resource == resource).map(|t| t.mip);
    let depth = draw.depth.iter().any(|t| t.resource == resource).then_some(0);
    if color.or(depth).is_some_and(|level| level != mip) {
        return false;
    }
    draw.members.iter().any(|member| match member.place {
        Place::Whole | Place::LoopLayer(_) => true,
        Place::Layer(first) => (first..first.saturating_add(draw.views)).contains(&layer),
        Place::Rect([left, top, width, height]) => {
            (left..left.saturating_add(width)).contains(&x) && (top..top.saturating_add(height)).contains(&y)
        }
    })
}

/// Whether the shader of a dispatch stores to a level of a resource.
fn stores(plan: &Plan, step: &Step, resource: ResourceId, mip: u32) -> bool {
    let shader = step.action.shader().and_then(|i| plan.shaders.get(i));
    let variables = shader.map_or(&[][..], |s| &s.interface.variables);
    step.bindings.iter().zip(variables).any(|(binding, variable)| {
        let level = match binding {
            Binding::Resource(id) if *id == resource => 0,
            Binding::Level(id, level) if *id == resource => *level,
            _ => return false,
        };
        matches!(variable.kind, BindingKind::StorageTexture { .. }) && level == mip
    })
}

fn workgroup_size(shader: Option<&Arc<Shader>>, entry: &str) -> [u32; 3] {
    let entries = shader.map_or(&[][..], |s| &s.interface.entries);
    entries.iter().find(|e| e.name == entry).map_or([1; 3], |e| e.workgroup_size)
}

/// How many invocations the step has along each axis; of a draw: the pixels of its targets.
fn extent(plan: &Plan, probed: &Probed) -> [u32; 3] {
    let step = &plan.steps[probed.step.0];
    match &step.action {
        Action::Compute { entry, groups, instances, .. } => {
            let size = workgroup_size(plan.shaders.get(step.action.shader().unwrap_or(0)), entry);
            let mut all = [0, 1, 2].map(|i| groups[i].saturating_mul(size[i]));
            // Instances are laid out along the axes as the device allows.
            if instances.is_some() {
                all = [u32::MAX; 3];
            }
            all
        }
        Action::Draw(draw) => {
            let color = draw.color.iter().map(|t| (t.resource, t.mip));
            let depth = draw.depth.iter().map(|d| (d.resource, 0));
            let size = |(id, mip): (ResourceId, u32)| match &plan.resources[id.0].desc {
                Desc::Texture(t) => Some(t.level(mip)),
                Desc::Buffer { .. } => None,
            };
            let [width, height, _] = color.chain(depth).find_map(size).unwrap_or([0; 3]);
            [width, height, 1]
        }
        Action::Copy { .. } | Action::Clear { .. } => [0; 3],
    }
}
