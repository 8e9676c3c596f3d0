//! Builds the pipelines of a plan: each distinct one once per device, all new ones in parallel.

use super::{bindings::layout_entries, device::Gpu, dirty::workgroups, scope::scoped};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::parallel;
use crate::plan::{Action, ColorTarget, Cull, DepthTarget, Draw, DrawGeometry, Plan, Step};
use crate::scene::{VERTEX_ATTRIBUTES, Vertex};
use crate::shader::{EntryPoint, Shader, Stage};
use std::num::NonZeroU32;
use std::sync::Arc;

/// The vertex stage of a pass that covers its target: one triangle, nearest in depth.
const SCREEN: &str = "@vertex fn screen(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}";

/// What a step with a shader runs with.
#[derive(Debug)]
pub(super) struct StepPipelines {
    pub entries: Vec<wgpu::BindGroupLayoutEntry>,
    pub layout: wgpu::BindGroupLayout,
    pub built: Built,
}

/// A pipeline, and all that tells it from others.
#[derive(Debug, Clone)]
pub(super) struct Pipeline {
    /// [`Shader::content`]
    content: u128,
    key: PipelineKey,
    layout: wgpu::BindGroupLayout,
    built: Built,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Built {
    Compute(wgpu::ComputePipeline),
    Render {
        /// For the single-sided triangles, or for all when [`Built::Render::rest`] is `None`.
        first: wgpu::RenderPipeline,
        /// For the double-sided ones.
        rest: Option<wgpu::RenderPipeline>,
        /// Scene geometry is fetched from the vertex buffer.
        attributes: bool,
    },
}

/// Builds the pipelines of the steps that `runs` picks, by their index; `None` for the others and for steps without a
/// shader. What the device keeps of earlier plans is used again.
///
/// # Errors
/// Entry points or attributes that do not exist, and all that the device finds wrong; each names its step.
pub(super) fn build(gpu: &Gpu, plan: &Plan, runs: impl Fn(usize) -> bool) -> Checked<Vec<Option<StepPipelines>>> {
    let mut faults = vec![];
    let mut jobs: Vec<PipelineJob<'_>> = vec![];
    let mut of_step: Vec<Option<usize>> = vec![];
    for (index, step) in plan.steps.iter().enumerate() {
        if !runs(index) {
            of_step.push(None);
            continue;
        }
        match PipelineJob::of(gpu, plan, step) {
            Ok(None) => of_step.push(None),
            Ok(Some(job)) => {
                let index = jobs.iter().position(|j| j.index == job.index && j.key == job.key).unwrap_or_else(|| {
                    jobs.push(job);
                    jobs.len() - 1
                });
                of_step.push(Some(index));
            }
            Err(f) => faults.extend(f.0),
        }
    }
    Faults::check(faults, ())?;

    let cached: Vec<Option<Pipeline>> = {
        let mut cache = gpu.caches.pipelines.lock();
        cache.next_plan();
        jobs.iter().map(|j| cache.find(|k| k.content == j.shader.content && k.key == j.key).cloned()).collect()
    };
    // Only those that a new pipeline needs: a module that nobody runs need not suit the device.
    let wanted = |i: usize| jobs.iter().zip(&cached).any(|(j, k)| j.index == i && k.is_none());
    let modules = in_parallel(0..plan.shaders.len(), |i| match plan.shaders.get(i) {
        Some(shader) if wanted(i) => module(gpu, shader).map(Some),
        _ => Ok(None),
    })?;
    let screen = if cached.iter().all(Option::is_some) { None } else { Some(screen(gpu)?) };
    // The longest first, so that no core waits for one that began last.
    let mut order: Vec<usize> = (0..jobs.len()).collect();
    order.sort_by_key(|i| std::cmp::Reverse(length(jobs[*i].shader)));
    let built = in_parallel(order, |i| match &cached[i] {
        Some(cached) => Ok(cached.clone()),
        None => jobs[i].build(gpu, modules[jobs[i].index].as_ref().zip(screen.as_ref())),
    })?;
    {
        let mut cache = gpu.caches.pipelines.lock();
        let new = built.iter().zip(&cached).filter(|(_, cached)| cached.is_none());
        new.for_each(|(new, _)| cache.insert(new.clone()));
    }
    let of_step = of_step.into_iter().map(|job| {
        job.and_then(|j| built.get(j)).map(|p| StepPipelines {
            entries: p.key.entries.clone(),
            layout: p.layout.clone(),
            built: p.built.clone(),
        })
    });
    Ok(of_step.collect())
}

/// Everything but the shader that tells one pipeline from another.
#[derive(Debug, Clone, PartialEq)]
struct PipelineKey {
    entries: Vec<wgpu::BindGroupLayoutEntry>,
    kind: PipelineKind,
}

#[derive(Debug, Clone, PartialEq)]
enum PipelineKind {
    Compute { entry: String },
    Render(Box<Render>),
}

#[derive(Debug, Clone, PartialEq)]
struct Render {
    vertex: Option<String>,
    fragment: Option<String>,
    geometry: DrawGeometry,
    attributes: Vec<wgpu::VertexAttribute>,
    targets: Vec<Option<wgpu::ColorTargetState>>,
    depth: Option<wgpu::DepthStencilState>,
    samples: u32,
    views: u32,
}

/// Every one of so many views; `None` for a pass without.
pub(super) fn view_mask(views: u32) -> Option<NonZeroU32> {
    if views > 1 { NonZeroU32::new(u32::MAX >> 32u32.saturating_sub(views)) } else { None }
}

struct PipelineJob<'a> {
    /// Of the shader in the plan.
    index: usize,
    shader: &'a Arc<Shader>,
    key: PipelineKey,
    /// The first step that wants it, for faults.
    step: &'a Step,
}

impl<'a> PipelineJob<'a> {
    fn of(gpu: &Gpu, plan: &'a Plan, step: &'a Step) -> Checked<Option<PipelineJob<'a>>> {
        let (index, kind) = match &step.action {
            Action::Copy { .. } | Action::Clear { .. } => return Ok(None),
            Action::Compute { shader, entry, groups, instances, indirect: _ } => {
                check_groups(gpu, step, workgroups(gpu, *groups, *instances))?;
                (*shader, PipelineKind::Compute { entry: entry.clone() })
            }
            Action::Draw(draw) => (draw.shader, PipelineKind::Render(Box::new(render(plan, step, draw)?))),
        };
        let shader = shader(plan, step, index)?;
        let entries = match &kind {
            PipelineKind::Compute { entry: name } => vec![entry(shader, step, name, Stage::Compute)?],
            PipelineKind::Render(r) => {
                let mut entries = vec![];
                if let Some(name) = &r.vertex {
                    entries.push(entry(shader, step, name, Stage::Vertex)?);
                }
                if let Some(name) = &r.fragment {
                    entries.push(entry(shader, step, name, Stage::Fragment)?);
                }
                entries
            }
        };
        let entries = layout_entries(gpu, plan, step, shader, &entries)?;
        Ok(Some(PipelineJob { index, shader, key: PipelineKey { entries, kind }, step }))
    }

    /// Builds from the shader's module and that of [`SCREEN`].
    fn build(&self, gpu: &Gpu, modules: Option<(&wgpu::ShaderModule, &wgpu::ShaderModule)>) -> Checked<Pipeline> {
        let name = &self.step.name;
        let (module, screen) = modules.ok_or_else(|| Diagnostic::error(format!("`{name}` has no shader module")))?;
        let what = format!("build the pipeline of `{name}` ({})", self.shader.path);
        scoped(gpu, &what, || {
            let label = Some(self.step.name.as_str());
            let layout = gpu
                .device
                .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &self.key.entries });
            let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label,
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
            let built = match &self.key.kind {
                PipelineKind::Compute { entry } => {
                    Built::Compute(gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                        label,
                        layout: Some(&pipeline_layout),
                        module,
                        entry_point: Some(entry),
                        compilation_options: Default::default(),
                        cache: None,
                    }))
                }
                PipelineKind::Render(r) => {
                    let make = |cull| r.pipeline(gpu, label, &pipeline_layout, (module, screen), cull);
                    let cull = match r.geometry {
                        DrawGeometry::Screen => Cull::None,
                        DrawGeometry::Scene { cull } | DrawGeometry::Vertices { cull, .. } => cull,
                    };
                    let (first, rest) = match cull {
                        Cull::None => (make(None), None),
                        Cull::Front => (make(Some(wgpu::Face::Front)), None),
                        Cull::Back => (make(Some(wgpu::Face::Back)), None),
                        Cull::Material => (make(Some(wgpu::Face::Back)), Some(make(None))),
                    };
                    Built::Render { first, rest, attributes: !r.attributes.is_empty() }
                }
            };
            Pipeline { content: self.shader.content, key: self.key.clone(), layout, built }
        })
    }
}

impl Render {
    fn pipeline(
        &self,
        gpu: &Gpu,
        label: Option<&str>,
        layout: &wgpu::PipelineLayout,
        (module, screen): (&wgpu::ShaderModule, &wgpu::ShaderModule),
        cull_mode: Option<wgpu::Face>,
    ) -> wgpu::RenderPipeline {
        let vertices = Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &self.attributes,
        });
        let (vertex_module, vertex_entry) = match &self.vertex {
            Some(name) => (module, name.as_str()),
            None => (screen, "screen"),
        };
        gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label,
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module: vertex_module,
                entry_point: Some(vertex_entry),
                compilation_options: Default::default(),
                buffers: if self.attributes.is_empty() { &[] } else { std::slice::from_ref(&vertices) },
            },
            primitive: wgpu::PrimitiveState {
                topology: match self.geometry {
                    DrawGeometry::Vertices { topology, .. } => topology,
                    DrawGeometry::Scene { .. } | DrawGeometry::Screen => wgpu::PrimitiveTopology::TriangleList,
                },
                front_face: wgpu::FrontFace::Ccw,
                cull_mode,
                ..Default::default()
            },
            depth_stencil: self.depth.clone(),
            multisample: wgpu::MultisampleState { count: self.samples, ..Default::default() },
            fragment: self.fragment.as_ref().map(|name| wgpu::FragmentState {
                module,
                entry_point: Some(name),
                compilation_options: Default::default(),
                targets: &self.targets,
            }),
            multiview_mask: view_mask(self.views),
            cache: None,
        })
    }
}

/// What is drawn to each location; a location that no target takes is empty.
pub(super) fn by_location(targets: &[ColorTarget]) -> Vec<Option<&ColorTarget>> {
    let count = targets.iter().map(|t| t.location as usize + 1).max().unwrap_or(0);
    (0..count).map(|l| targets.iter().find(|t| t.location as usize == l)).collect()
}

fn render(plan: &Plan, step: &Step, draw: &Draw) -> Checked<Render> {
    let attributes = match (&draw.vertex, draw.geometry) {
        (Some(name), DrawGeometry::Scene { .. }) => {
            let shader = shader(plan, step, draw.shader)?;
            attributes(shader, step, entry(shader, step, name, Stage::Vertex)?)?
        }
        (None, DrawGeometry::Scene { .. }) => {
            return Err(Diagnostic::error(format!("`{}` draws the scene without a vertex entry", step.name))
                .help("write an entry point marked `@vertex`")
                .into());
        }
        (_, DrawGeometry::Screen | DrawGeometry::Vertices { .. }) => vec![],
    };
    let targets = by_location(&draw.color).into_iter().map(|t| {
        t.map(|t| wgpu::ColorTargetState { format: t.format, blend: t.blend, write_mask: wgpu::ColorWrites::ALL })
    });
    Ok(Render {
        vertex: draw.vertex.clone(),
        fragment: draw.fragment.clone(),
        geometry: match draw.geometry {
            // How many there are is nothing to a pipeline.
            DrawGeometry::Vertices { topology, cull, .. } => {
                DrawGeometry::Vertices { count: 0, instances: 0, topology, cull, indirect: None }
            }
            geometry => geometry,
        },
        attributes,
        targets: targets.collect(),
        depth: draw.depth.as_ref().map(depth_state),
        samples: draw.samples,
        views: draw.views,
    })
}

fn depth_state(depth: &DepthTarget) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: depth.format,
        depth_write_enabled: Some(depth.write),
        depth_compare: Some(depth.compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

fn attributes(shader: &Shader, step: &Step, entry: &EntryPoint) -> Checked<Vec<wgpu::VertexAttribute>> {
    let mut faults = vec![];
    let mut out = vec![];
    for input in &entry.inputs {
        match VERTEX_ATTRIBUTES.iter().find(|(name, ..)| *name == input.name) {
            Some((_, format, offset)) => {
                out.push(wgpu::VertexAttribute { format: *format, offset: *offset, shader_location: input.location });
            }
            None => faults.push(
                Diagnostic::error(format!(
                    "`{}` ({}): vertices have no attribute `{}`",
                    step.name, shader.path, input.name
                ))
                .nearest(&input.name, VERTEX_ATTRIBUTES.iter().map(|(name, ..)| *name))
                .help("attributes are position, normal, uv, node and material"),
            ),
        }
    }
    Faults::check(faults, out)
}

fn check_groups(gpu: &Gpu, step: &Step, groups: [u32; 3]) -> Checked<()> {
    let most = gpu.limits.max_compute_workgroups_per_dimension;
    match groups.iter().max() {
        Some(largest) if *largest > most => Err(Diagnostic::error(format!(
            "`{}` starts {groups:?} workgroups, and this device allows {most} along each axis",
            step.name
        ))
        .help("use larger workgroups, or spread the work over two axes")
        .into()),
        _ => Ok(()),
    }
}

fn shader<'a>(plan: &'a Plan, step: &Step, index: usize) -> Checked<&'a Arc<Shader>> {
    let found = plan.shaders.get(index);
    found.ok_or_else(|| Diagnostic::error(format!("`{}` has no shader", step.name)).into())
}

fn entry<'a>(shader: &'a Shader, step: &Step, name: &str, stage: Stage) -> Checked<&'a EntryPoint> {
    let mut of_stage = shader.interface.entries.iter().filter(|e| e.stage == stage);
    of_stage.clone().find(|e| e.name == name).ok_or_else(|| {
        Diagnostic::error(format!("`{}`: {} has no entry point `{name}` of that stage", step.name, shader.path))
            .nearest(name, of_stage.by_ref().map(|e| e.name.as_str()))
            .into()
    })
}

fn module(gpu: &Gpu, shader: &Shader) -> Checked<wgpu::ShaderModule> {
    scoped(gpu, &format!("load the shader {}", shader.path), || {
        gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(&shader.path),
            source: wgpu::ShaderSource::Naga(std::borrow::Cow::Owned(shader.module.clone())),
        })
    })
}

fn screen(gpu: &Gpu) -> Checked<wgpu::ShaderModule> {
    scoped(gpu, "load the built-in vertex stage", || {
        gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("screen"),
            source: wgpu::ShaderSource::Wgsl(SCREEN.into()),
        })
    })
}

/// How much code a shader has: about what a driver takes its time for.
fn length(shader: &Shader) -> usize {
    let module = &shader.module;
    let functions = module.functions.iter().map(|(_, f)| f).chain(module.entry_points.iter().map(|e| &e.function));
    functions.map(|f| f.expressions.len()).sum()
}

/// `work` of each number on all cores, begun in the order given; results in the order of the numbers, or all faults in
/// it.
fn in_parallel<T: Send>(
    numbers: impl IntoIterator<Item = usize>,
    work: impl Fn(usize) -> Checked<T> + Sync,
) -> Checked<Vec<T>> {
    let mut faults = vec![];
    let mut out = vec![];
    for result in parallel::each(numbers, work) {
        match result {
            Ok(value) => out.push(value),
            Err(f) => faults.extend(f.0),
        }
    }
    Faults::check(faults, out)
}
