//! Digests of the tiles of an atlas, made on the device: whether a tile came out as it was is told without reading it.

use super::device::Gpu;
use super::pool::Memory;
use super::prepare::Prepared;
use super::readback::read_bytes;
use super::scope::scoped;
use crate::diag::Checked;
use crate::plan::{Desc, Plan, ResourceId, TextureDesc, Tiles};
use wgpu::util::DeviceExt;

/// Bytes of a digest.
pub const DIGEST: usize = 16;

/// What the texels of an atlas are to a shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Texels {
    Float,
    Uint,
    Sint,
}

impl Texels {
    /// `None`: a shader can't read all of a texel's bits.
    fn of(format: wgpu::TextureFormat) -> Option<Texels> {
        match format.sample_type(None, None)? {
            wgpu::TextureSampleType::Float { .. } => Some(Texels::Float),
            wgpu::TextureSampleType::Uint => Some(Texels::Uint),
            wgpu::TextureSampleType::Sint => Some(Texels::Sint),
            wgpu::TextureSampleType::Depth => None,
        }
    }

    fn sampled(self) -> wgpu::TextureSampleType {
        match self {
            Texels::Float => wgpu::TextureSampleType::Float { filterable: false },
            Texels::Uint => wgpu::TextureSampleType::Uint,
            Texels::Sint => wgpu::TextureSampleType::Sint,
        }
    }

    /// The part of the shader that differs.
    fn text(self) -> &'static str {
        match self {
            Texels::Float => {
                "@group(0) @binding(0) var source: texture_2d<f32>;
                fn bits(at: vec2u) -> vec4u { return bitcast<vec4u>(textureLoad(source, at, 0)); }"
            }
            Texels::Uint => {
                "@group(0) @binding(0) var source: texture_2d<u32>;
                fn bits(at: vec2u) -> vec4u { return textureLoad(source, at, 0); }"
            }
            Texels::Sint => {
                "@group(0) @binding(0) var source: texture_2d<i32>;
                fn bits(at: vec2u) -> vec4u { return bitcast<vec4u>(textureLoad(source, at, 0)); }"
            }
        }
    }
}

/// The digests of some tiles of an atlas, one behind another, [`DIGEST`] bytes each.
///
/// # Errors
/// The resource is none whose texels a shader can read, or the device fails.
pub fn digests(gpu: &Gpu, prepared: &Prepared, plan: &Plan, id: ResourceId, tiles: &[u32]) -> Checked<Vec<u8>> {
    if tiles.is_empty() {
        return Ok(vec![]);
    }
    let fault = || crate::diag::Diagnostic::error("a digest is asked of what is no atlas");
    let Desc::Texture(TextureDesc { format, tiles: Some(Tiles { edge, columns, .. }), .. }) =
        &plan.resources.get(id.0).ok_or_else(fault)?.desc
    else {
        return Err(fault().into());
    };
    let texels = Texels::of(*format).ok_or_else(fault)?;
    let Memory::Texture(texture) = prepared.pool.memory(plan, id)? else { return Err(fault().into()) };
    let what = "digest tiles";
    let pipeline = gpu.kept.digests.get(&texels, || scoped(gpu, what, || pipeline(gpu, texels)))?;
    let words: Vec<u32> = [*edge, *columns].into_iter().chain(tiles.iter().copied()).collect();
    let found = scoped(gpu, what, || {
        use wgpu::BufferUsages as U;
        let asked = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(what),
            contents: bytemuck::cast_slice(&words),
            usage: U::STORAGE,
        });
        let found = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size: (tiles.len() * DIGEST) as u64,
            usage: U::STORAGE | U::COPY_SRC,
            mapped_at_creation: false,
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            mip_level_count: Some(1),
            usage: Some(wgpu::TextureUsages::TEXTURE_BINDING),
            ..Default::default()
        });
        let bound = [wgpu::BindingResource::TextureView(&view), asked.as_entire_binding(), found.as_entire_binding()];
        let entries: Vec<wgpu::BindGroupEntry<'_>> =
            (0..).zip(bound).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(what),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        let along = (tiles.len() as u32).min(MOST_ALONG);
        pass.dispatch_workgroups(along, (tiles.len() as u32).div_ceil(along), 1);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        found
    })?;
    read_bytes(gpu, &found, what)
}

/// Workgroups along an axis that every adapter has.
const MOST_ALONG: u32 = 32_768;

fn pipeline(gpu: &Gpu, texels: Texels) -> wgpu::ComputePipeline {
    let label = Some("digest");
    let text = format!("{}\n{}", texels.text(), include_str!("digest.wgsl"));
    let source = wgpu::ShaderSource::Wgsl(text.into());
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source });
    let storage = |read_only| wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: texels.sampled(),
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let visibility = wgpu::ShaderStages::COMPUTE;
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip([texture, storage(true), storage(false)])
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None })
        .collect();
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &entries });
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label,
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label,
        layout: Some(&layout),
        module: &module,
        entry_point: Some("digest"),
        compilation_options: Default::default(),
        cache: None,
    })
}
