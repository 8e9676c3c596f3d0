//! Makes bind group layouts and bind groups from a shader's interface. All variables are in group 0; the binding of
//! each is its index in the interface.

use super::{
    device::Gpu,
    dirty::Instances,
    pool::{Memory, Pool, view, view_dimension},
    reports::Reports,
    scene_data::SceneData,
    uniforms::Uniforms,
};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::plan::{Binding, Desc, Plan, ResourceId, SamplerDesc, Step};
use crate::shader::{BindingKind, EntryPoint, Shader, Stage, TextureDim, TextureSample};
use std::collections::HashMap;

/// Layout entries for the variables that these entry points use, by rising binding number.
///
/// # Errors
/// A variable that the step binds to nothing.
pub(super) fn layout_entries(
    gpu: &Gpu,
    plan: &Plan,
    step: &Step,
    shader: &Shader,
    entries: &[&EntryPoint],
) -> Checked<Vec<wgpu::BindGroupLayoutEntry>> {
    let mut out = vec![];
    let mut faults = vec![];
    for (index, variable) in shader.interface.variables.iter().enumerate() {
        let visibility = entries
            .iter()
            .filter(|e| e.uses.contains_key(&index))
            .fold(wgpu::ShaderStages::NONE, |seen, e| seen | stage(e.stage));
        if visibility.is_empty() {
            continue;
        }
        let Some(binding) = step.bindings.get(index) else {
            faults.push(Diagnostic::error(format!(
                "`{}` binds nothing to the variable `{}` of {}",
                step.name, variable.name, shader.path
            )));
            continue;
        };
        out.push(wgpu::BindGroupLayoutEntry {
            binding: index as u32,
            visibility,
            ty: binding_type(gpu, plan, &variable.kind, binding),
            count: None,
        });
    }
    Faults::check(faults, out)
}

/// Everything that bind groups point to.
pub(super) struct Bindable<'a> {
    pub pool: &'a Pool,
    pub scene: &'a SceneData,
    pub uniforms: &'a Uniforms,
    pub reports: &'a Reports,
    pub instances: &'a Instances,
}

/// Views and samplers that many bind groups share. Only looked up, never walked.
#[derive(Debug, Default)]
pub(super) struct Shared {
    views: HashMap<ViewKey, wgpu::TextureView>,
    samplers: HashMap<SamplerDesc, wgpu::Sampler>,
}

/// The bind group of a step; `partial`: for its dirty instances. Errors of the device are for the caller's scope to
/// catch.
///
/// # Errors
/// A variable is bound to a thing of another kind.
pub(super) fn bind_group(
    gpu: &Gpu,
    plan: &Plan,
    (index, step): (usize, &Step),
    shader: &Shader,
    layout: (&wgpu::BindGroupLayout, &[wgpu::BindGroupLayoutEntry]),
    (things, partial): (&Bindable<'_>, bool),
    shared: &mut Shared,
) -> Checked<wgpu::BindGroup> {
    let mut faults = vec![];
    for entry in layout.1 {
        let at = entry.binding as usize;
        if let (Some(variable), Some(binding)) = (shader.interface.variables.get(at), step.bindings.get(at)) {
            let made = shared.make(gpu, plan, &variable.kind, binding, things.pool);
            faults.extend(made.err().into_iter().flat_map(|f| f.0).map(|mut d| {
                d.message = format!("in `{}`, variable `{}`: {}", step.name, variable.name, d.message);
                d
            }));
        }
    }
    Faults::check(std::mem::take(&mut faults), ())?;
    let mut entries = vec![];
    for entry in layout.1 {
        let at = entry.binding as usize;
        let (Some(variable), Some(binding)) = (shader.interface.variables.get(at), step.bindings.get(at)) else {
            continue;
        };
        let resource = match binding {
            Binding::Resource(id) | Binding::Level(id, _) => match things.pool.memory(plan, *id)? {
                Memory::Buffer(buffer) => Some(extent(buffer, &variable.kind)),
                Memory::Texture(_) => view_key(&variable.kind, *id, binding)
                    .and_then(|key| shared.views.get(&key))
                    .map(wgpu::BindingResource::TextureView),
            },
            Binding::Uniform { .. } => things.uniforms.binding(index, at),
            Binding::Table(table) => things.scene.tables.get(*table).map(|memory| match &memory.texels {
                Some((_, view)) => wgpu::BindingResource::TextureView(view),
                None => extent(&memory.buffer, &variable.kind),
            }),
            Binding::SceneTextures => Some(wgpu::BindingResource::TextureView(&things.scene.textures)),
            Binding::Report => things.reports.buffer(index).map(wgpu::Buffer::as_entire_binding),
            Binding::Instances if partial => things.instances.some(index).map(wgpu::Buffer::as_entire_binding),
            Binding::Instances => things.instances.whole(index).map(wgpu::Buffer::as_entire_binding),
            Binding::Sampler(desc) => shared.samplers.get(desc).map(wgpu::BindingResource::Sampler),
        };
        match resource {
            Some(resource) => entries.push(wgpu::BindGroupEntry { binding: entry.binding, resource }),
            None => faults.push(Diagnostic::error(format!(
                "in `{}`, variable `{}` is bound to a thing of another kind",
                step.name, variable.name
            ))),
        }
    }
    Faults::check(faults, ())?;
    let desc = wgpu::BindGroupDescriptor { label: Some(&step.name), layout: layout.0, entries: &entries };
    Ok(gpu.device.create_bind_group(&desc))
}

/// All of a buffer; for an array in a uniform, whose size devices limit, as much as it asks for.
fn extent<'b>(buffer: &'b wgpu::Buffer, kind: &BindingKind) -> wgpu::BindingResource<'b> {
    let size = match kind {
        BindingKind::UniformArray { size, .. } => wgpu::BufferSize::new(u64::from(*size)),
        _ => None,
    };
    wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size })
}

impl Shared {
    /// Makes the view or sampler that a binding needs, unless it is there.
    fn make(&mut self, gpu: &Gpu, plan: &Plan, kind: &BindingKind, binding: &Binding, pool: &Pool) -> Checked<()> {
        match binding {
            Binding::Resource(id) | Binding::Level(id, _) => {
                if let Some(key) = view_key(kind, *id, binding)
                    && !self.views.contains_key(&key)
                {
                    self.views.insert(key, view(pool.texture(plan, *id)?, key.1, key.2));
                }
            }
            Binding::Sampler(desc) => {
                if !self.samplers.contains_key(desc) {
                    self.samplers.insert(*desc, gpu.caches.samplers.get(desc, || Ok(sampler(gpu, desc)))?);
                }
            }
            Binding::Uniform { .. }
            | Binding::Table(_)
            | Binding::SceneTextures
            | Binding::Report
            | Binding::Instances => {}
        }
        Ok(())
    }
}

/// Resource, dimension, and the one level that is seen, if it is not all.
type ViewKey = (ResourceId, TextureDim, Option<u32>);

/// `None` for what isn't a texture.
fn view_key(kind: &BindingKind, id: ResourceId, binding: &Binding) -> Option<ViewKey> {
    let level = match binding {
        Binding::Level(_, level) => Some(*level),
        _ => None,
    };
    match kind {
        BindingKind::Texture { dim, .. } => Some((id, *dim, level)),
        BindingKind::StorageTexture { dim, .. } => Some((id, *dim, level.or(Some(0)))),
        BindingKind::Uniform(_)
        | BindingKind::UniformArray { .. }
        | BindingKind::Storage { .. }
        | BindingKind::Sampler { .. } => None,
    }
}

fn binding_type(gpu: &Gpu, plan: &Plan, kind: &BindingKind, binding: &Binding) -> wgpu::BindingType {
    match kind {
        BindingKind::Uniform(_) => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: None,
        },
        BindingKind::UniformArray { .. } => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        BindingKind::Storage { writable, .. } => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: !writable },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        BindingKind::Texture { dim, sample, multisampled } => wgpu::BindingType::Texture {
            sample_type: match sample {
                TextureSample::Float { filtered } => {
                    wgpu::TextureSampleType::Float { filterable: *filtered && filterable(gpu, plan, binding) }
                }
                TextureSample::Depth => wgpu::TextureSampleType::Depth,
                TextureSample::Uint => wgpu::TextureSampleType::Uint,
                TextureSample::Sint => wgpu::TextureSampleType::Sint,
            },
            view_dimension: view_dimension(*dim),
            multisampled: *multisampled,
        },
        BindingKind::StorageTexture { dim, format, access } => {
            wgpu::BindingType::StorageTexture { access: *access, format: *format, view_dimension: view_dimension(*dim) }
        }
        BindingKind::Sampler { comparison } => wgpu::BindingType::Sampler(match binding {
            _ if *comparison => wgpu::SamplerBindingType::Comparison,
            // A sampler that never filters goes with every texture, those of unfilterable formats too.
            Binding::Sampler(SamplerDesc { filter: wgpu::FilterMode::Nearest, .. }) => {
                wgpu::SamplerBindingType::NonFiltering
            }
            _ => wgpu::SamplerBindingType::Filtering,
        }),
    }
}

fn filterable(gpu: &Gpu, plan: &Plan, binding: &Binding) -> bool {
    let (Binding::Resource(id) | Binding::Level(id, _)) = binding else { return true };
    match plan.resources.get(id.0).map(|r| &r.desc) {
        Some(Desc::Texture(t)) => {
            let seen = t.format.sample_type(Some(wgpu::TextureAspect::DepthOnly), Some(gpu.features));
            seen == Some(wgpu::TextureSampleType::Float { filterable: true })
        }
        Some(Desc::Buffer { .. }) | None => true,
    }
}

fn sampler(gpu: &Gpu, desc: &SamplerDesc) -> wgpu::Sampler {
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: desc.address,
        address_mode_v: desc.address,
        address_mode_w: desc.address,
        mag_filter: desc.filter,
        min_filter: desc.filter,
        mipmap_filter: match desc.filter {
            wgpu::FilterMode::Nearest => wgpu::MipmapFilterMode::Nearest,
            wgpu::FilterMode::Linear => wgpu::MipmapFilterMode::Linear,
        },
        compare: desc.compare,
        ..Default::default()
    })
}

fn stage(stage: Stage) -> wgpu::ShaderStages {
    match stage {
        Stage::Vertex => wgpu::ShaderStages::VERTEX,
        Stage::Fragment => wgpu::ShaderStages::FRAGMENT,
        Stage::Compute => wgpu::ShaderStages::COMPUTE,
    }
}
