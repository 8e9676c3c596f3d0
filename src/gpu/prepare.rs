//! Prepares everything that a steady frame needs, once: memory, pipelines, bind groups, views of targets.

use super::{
    bindings::{Bindable, Shared, bind_group},
    clear,
    device::Gpu,
    device_loop::{DeviceLoops, on_device},
    dirty::{Instances, able},
    numerics::Watch,
    pending::Spare,
    pipelines::{self, StepPipelines, by_location},
    pool::{Memory, Pool, target_view},
    readback::staging,
    reports::Reports,
    scene_data::SceneData,
    scope::ErrorScope,
    timing::Timer,
    uniforms::{Uniforms, enclosing_loops},
};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::plan::{Action, ColorTarget, Desc, Draw, DrawMember, OrderNode, Place, Plan, ResourceId, Step, StepId};
use crate::scene::{Assets, Table};

/// A plan made ready for one device and one scene. Frames run on it through [`super::execute`].
#[derive(Debug)]
pub struct Prepared {
    /// The textures and buffers of the plan.
    pub pool: Pool,
    pub(super) scene: SceneData,
    pub(super) uniforms: Uniforms,
    pub(super) reports: Reports,
    pub(super) instances: Instances,
    pub(super) steps: Vec<Ready>,
    pub(super) timer: Timer,
    /// Where loops that the host ends read their number; `None` without such loops.
    pub(super) probe: Option<wgpu::Buffer>,
    pub(super) device_loops: DeviceLoops,
    /// Where frames leave what the host reads of them.
    pub(super) spare: Spare,
    /// Checks the numbers that every step leaves; `None`: nobody asked.
    pub(super) watch: Option<Watch>,
}

/// A step made ready.
#[derive(Debug)]
pub(super) enum Ready {
    /// Copies, clears and what is not in the order need nothing.
    Plain,
    Shaded(Box<Shaded>),
}

#[derive(Debug)]
pub(super) struct Shaded {
    pub pipelines: StepPipelines,
    pub group: wgpu::BindGroup,
    /// The same for the dirty instances of a dispatch.
    pub partial: Option<wgpu::BindGroup>,
    /// Indices of the uniform uses that want an offset, in the order of their bindings.
    pub uniforms: Vec<usize>,
    /// The render passes of a draw; none for a compute step.
    pub passes: Vec<PreparedPass>,
    /// Clears the targets of a draw by drawing, where it may have to keep what is around or not happen at all.
    pub clear: Option<wgpu::RenderPipeline>,
}

/// One render pass of a draw: the members that go to the same layer.
#[derive(Debug)]
pub(super) struct PreparedPass {
    pub members: Vec<DrawMember>,
    /// False when an earlier pass of the same step has drawn to this layer.
    pub clears: bool,
    /// One; or, for a layer chosen by a loop's index, one for each iteration.
    pub targets: Vec<Targets>,
}

/// The attachments of a render pass.
#[derive(Debug)]
pub(super) struct Targets {
    /// By location.
    pub color: Vec<Option<PreparedTarget>>,
    pub depth: Option<wgpu::TextureView>,
}

/// A colour target of a render pass.
#[derive(Debug)]
pub(super) struct PreparedTarget {
    pub view: wgpu::TextureView,
    /// Of a 3D texture.
    pub slice: Option<u32>,
    /// What takes the mean of its samples.
    pub resolve: Option<wgpu::TextureView>,
}

/// Makes a plan ready.
///
/// # Errors
/// Whatever the device lacks or finds wrong, all at once for each stage: memory, scene, pipelines, bindings.
pub fn prepare(gpu: &Gpu, plan: &Plan, assets: &Assets<'_>, tables: &[Table]) -> Checked<Prepared> {
    prepare_after(gpu, plan, assets, tables, &[])
}

/// As [`prepare`], for a plan that takes over memory of an earlier one on the same device, by slot. A piece of memory
/// that two plans share holds what either wrote last.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_after(
    gpu: &Gpu,
    plan: &Plan,
    assets: &Assets<'_>,
    tables: &[Table],
    kept: &[Option<Memory>],
) -> Checked<Prepared> {
    let probe = probe(gpu, plan)?;
    let pool = Pool::allocate(gpu, plan, kept)?;
    let scene = SceneData::upload(gpu, plan, assets, tables)?;
    let uniforms = Uniforms::allocate(gpu, plan)?;
    let reports = Reports::allocate(gpu, plan)?;
    let instances = Instances::prepare(gpu, plan, &pool)?;
    let loops = enclosing_loops(plan);
    let pipelines = pipelines::build(gpu, plan, |step| loops.iter().any(|(id, _)| id.0 == step))?;
    let device_loops = DeviceLoops::prepare(gpu, plan, &pool, &scene)?;
    let mut shared = Shared::default();
    let things = Bindable { pool: &pool, scene: &scene, uniforms: &uniforms, reports: &reports, instances: &instances };
    let mut steps = vec![];
    let mut faults = vec![];
    for (index, built) in pipelines.into_iter().enumerate() {
        let Some(built) = built else {
            steps.push(Ready::Plain);
            continue;
        };
        let around = loops.iter().find(|(id, _)| id.0 == index).and_then(|(_, l)| l.last());
        let device_ended = around.is_some_and(|(name, _)| device_loops.get(name).is_ok());
        match shaded(gpu, plan, index, built, (around.map(|(_, count)| *count), device_ended), &things, &mut shared) {
            Ok(ready) => steps.push(Ready::Shaded(Box::new(ready))),
            Err(f) => faults.extend(f.0),
        }
    }
    Faults::check(faults, ())?;
    gpu.check()?;
    let timer = Timer::new(gpu);
    Ok(Prepared {
        pool,
        scene,
        uniforms,
        reports,
        instances,
        steps,
        timer,
        probe,
        device_loops,
        spare: Spare::default(),
        watch: None,
    })
}

impl Prepared {
    /// From now on every frame checks what its steps leave, for a plan whose resources can all be read: its report has
    /// [`super::Numerics`].
    ///
    /// # Errors
    /// No memory is left.
    pub fn watch(&mut self, gpu: &Gpu) -> Checked<()> {
        self.watch = Some(Watch::new(gpu)?);
        Ok(())
    }

    /// Uploads changed tables, and binds anew what had to move.
    ///
    /// # Errors
    /// A table without a column that a shader asks for, or beyond the device's limits.
    pub(super) fn update_tables(&mut self, gpu: &Gpu, plan: &Plan, changed: &[Table]) -> Checked<()> {
        if self.scene.update(gpu, plan, changed)? {
            self.bind(gpu, plan, |_| true)?;
        }
        Ok(())
    }

    /// Puts memory from outside in place of what the plan has for an input. Whether it is other memory than before.
    ///
    /// # Errors
    /// The memory is of another kind, size or format, or lacks a usage; or the device fails.
    pub fn lend(&mut self, gpu: &Gpu, plan: &Plan, id: ResourceId, memory: Memory) -> Checked<bool> {
        let other = self.pool.lend(plan, id, memory)?;
        if other {
            self.bind(gpu, plan, |step| step.reads.contains(&id))?;
        }
        Ok(other)
    }

    /// Makes the bind groups of some steps anew.
    fn bind(&mut self, gpu: &Gpu, plan: &Plan, some: impl Fn(&Step) -> bool) -> Checked<()> {
        let Prepared { pool, scene, uniforms, reports, instances, steps, .. } = self;
        let things = Bindable { pool, scene, uniforms, reports, instances };
        let mut shared = Shared::default();
        for (index, ready) in steps.iter_mut().enumerate() {
            if let Ready::Shaded(shaded) = ready
                && some(&plan.steps[index])
            {
                shaded.group = bound(gpu, plan, index, &shaded.pipelines, (&things, false), &mut shared)?;
                if shaded.partial.is_some() {
                    shaded.partial = Some(bound(gpu, plan, index, &shaded.pipelines, (&things, true), &mut shared)?);
                }
            }
        }
        Ok(())
    }
}

fn shaded(
    gpu: &Gpu,
    plan: &Plan,
    index: usize,
    pipelines: StepPipelines,
    (innermost, device_ended): (Option<u32>, bool),
    things: &Bindable<'_>,
    shared: &mut Shared,
) -> Checked<Shaded> {
    let group = bound(gpu, plan, index, &pipelines, (things, false), shared)?;
    let partial = match things.instances.some(index) {
        Some(_) => Some(bound(gpu, plan, index, &pipelines, (things, true), shared)?),
        None => None,
    };
    let uniforms = things.uniforms.of_step(index, |v| pipelines.entries.iter().any(|e| e.binding as usize == v));
    let (passes, clear) = match plan.steps.get(index).map(|s| (&s.action, s)) {
        Some((Action::Draw(draw), step)) => {
            let scope = ErrorScope::begin(gpu);
            let passes = passes(plan, &step.name, draw, innermost, things.pool);
            scope.end(&format!("make the targets of `{}`", step.name))?;
            let some = step.only.is_some() && able(step);
            let clear = if device_ended || some { Some(clear::pipeline(gpu, &step.name, draw)?) } else { None };
            (passes?, clear)
        }
        _ => (vec![], None),
    };
    Ok(Shaded { pipelines, group, partial, uniforms, passes, clear })
}

fn bound(
    gpu: &Gpu,
    plan: &Plan,
    index: usize,
    pipelines: &StepPipelines,
    things: (&Bindable<'_>, bool),
    shared: &mut Shared,
) -> Checked<wgpu::BindGroup> {
    let step = plan.steps.get(index);
    let shader = step.and_then(|s| plan.shaders.get(s.action.shader()?));
    let (Some(step), Some(shader)) = (step, shader) else {
        return Err(Diagnostic::error(format!("step {index} has no shader")).into());
    };
    let scope = ErrorScope::begin(gpu);
    let layout = (&pipelines.layout, pipelines.entries.as_slice());
    let group = bind_group(gpu, plan, (index, step), shader, layout, things, shared);
    scope.end(&format!("bind the resources of `{}`", step.name))?;
    group
}

/// Splits the members of a draw into passes. A draw without members has one that only clears.
fn passes(plan: &Plan, name: &str, draw: &Draw, innermost: Option<u32>, pool: &Pool) -> Checked<Vec<PreparedPass>> {
    let mut groups: Vec<(Place, Vec<DrawMember>)> = vec![];
    for member in &draw.members {
        // What matters here is the layer; rectangles share the pass over the whole.
        let key = match member.place {
            Place::Rect(_) | Place::Whole => Place::Whole,
            layer => layer,
        };
        match groups.last_mut() {
            Some((last, members)) if *last == key => members.push(*member),
            _ => groups.push((key, vec![*member])),
        }
    }
    if groups.is_empty() {
        groups.push((Place::Whole, vec![]));
    }
    let mut out: Vec<PreparedPass> = vec![];
    for (i, (place, members)) in groups.iter().enumerate() {
        let layers = match place {
            Place::Whole | Place::Rect(_) => 0..1,
            Place::Layer(layer) => *layer..layer.saturating_add(1),
            Place::LoopLayer(offset) => match innermost {
                Some(count) => *offset..offset.saturating_add(count),
                None => {
                    return Err(Diagnostic::error(format!("`{name}` draws to a loop's layer outside of a loop")).into());
                }
            },
        };
        let targets = layers.map(|layer| targets(plan, name, draw, layer, pool)).collect::<Checked<Vec<_>>>()?;
        let clears = !groups[..i].iter().any(|(before, _)| before == place);
        out.push(PreparedPass { members: members.clone(), clears, targets });
    }
    Ok(out)
}

fn targets(plan: &Plan, name: &str, draw: &Draw, layer: u32, pool: &Pool) -> Checked<Targets> {
    let attach = |id: ResourceId, layer: u32, mip: u32| -> Checked<(wgpu::TextureView, Option<u32>)> {
        let texture = pool.texture(plan, id)?;
        let layers = texture.size().mip_level_size(mip, texture.dimension()).depth_or_array_layers;
        if layer.saturating_add(draw.views) > layers {
            let target = plan.resources.get(id.0).map_or("?", |r| &r.name);
            return Err(Diagnostic::error(format!(
                "`{name}` draws to layer {layer} of `{target}`, which has {layers}"
            ))
            .help(format!("give `{target}` more layers, or draw to one below {layers}"))
            .into());
        }
        let slice = (texture.dimension() == wgpu::TextureDimension::D3).then_some(layer);
        Ok((target_view(texture, layer..layer.saturating_add(draw.views), mip), slice))
    };
    let target = |t: &ColorTarget| -> Checked<PreparedTarget> {
        let (view, slice) = attach(t.resource, layer, t.mip)?;
        let resolve = t.resolve.map(|id| attach(id, 0, 0)).transpose()?.map(|(view, _)| view);
        Ok(PreparedTarget { view, slice, resolve })
    };
    let color = by_location(&draw.color).into_iter().map(|t| t.map(target).transpose());
    let depth = draw.depth.as_ref().map(|d| {
        // A depth buffer with the layers of one member serves all in turn.
        let single = pool.texture(plan, d.resource)?.depth_or_array_layers() == draw.views;
        attach(d.resource, if single { 0 } else { layer }, 0).map(|(view, _)| view)
    });
    Ok(Targets { color: color.collect::<Checked<_>>()?, depth: depth.transpose()? })
}

/// The buffer to read loops' numbers from, after a check that they can be read.
fn probe(gpu: &Gpu, plan: &Plan) -> Checked<Option<wgpu::Buffer>> {
    fn tested<'a>(nodes: &'a [OrderNode], out: &mut Vec<(bool, &'a str, ResourceId)>) {
        for node in nodes {
            match node {
                OrderNode::Step(StepId(_)) => {}
                OrderNode::Loop(l) => {
                    out.extend(l.until.iter().map(|u| (!on_device(l), l.name.as_str(), u.buffer)));
                    tested(&l.body, out);
                }
            }
        }
    }
    let mut found = vec![];
    tested(&plan.order, &mut found);
    let mut faults = vec![];
    for (_, name, id) in &found {
        let resource = plan.resources.get(id.0);
        let slot = resource.and_then(|r| plan.slots.get(r.slot));
        let shown = resource.map_or("?", |r| &r.name);
        match slot.map(|s| &s.desc) {
            Some(Desc::Buffer { size, usage }) if *size >= 4 && usage.contains(wgpu::BufferUsages::COPY_SRC) => {}
            _ => faults.push(
                Diagnostic::error(format!(
                    "the loop `{name}` tests `{shown}`, which is no readable buffer of an `f32`"
                ))
                .help(format!("declare `{shown}` as `Buffer(stride: 4, count: 1)`")),
            ),
        }
    }
    Faults::check(faults, ())?;
    if !found.iter().any(|(host, ..)| *host) { Ok(None) } else { staging(gpu, "the number of a loop", 4).map(Some) }
}
