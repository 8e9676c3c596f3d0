//! From an output in linear light to the canvas, by the shader that the window uses too.

use lightgraph::{Checked, Diagnostic, Gpu};

/// As the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
struct Look {
    exposure: f32,
    tone_map: u32,
    arrangement: u32,
    at: f32,
}

/// Number of the tone map in the shader: Khronos PBR Neutral.
const NEUTRAL: u32 = 1;

/// Draws an output to the canvas.
pub struct Display {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    look: wgpu::Buffer,
}

impl Display {
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Display {
        let device = &gpu.device;
        let source = wgpu::ShaderSource::Wgsl(include_str!("../../cli/src/view/display.wgsl").into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("display"), source });
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let image = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("display"),
            entries: &[entry(0, uniform), entry(1, image), entry(2, image)],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("display"),
            bind_group_layouts: &[Some(&layout)],
            ..Default::default()
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("display"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("cover"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("display"),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let look = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("display"),
            size: size_of::<Look>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Display { pipeline, layout, look }
    }

    /// Draws the first layer of `image`, `exposure` stops brighter.
    pub fn draw(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        image: &wgpu::Texture,
        exposure: f32,
        target: &wgpu::TextureView,
    ) {
        let look = Look { exposure: exposure.exp2(), tone_map: NEUTRAL, arrangement: 0, at: 1.0 };
        gpu.queue.write_buffer(&self.look, 0, bytemuck::bytes_of(&look));
        let view = image.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            mip_level_count: Some(1),
            array_layer_count: Some(1),
            ..Default::default()
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("display"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: self.look.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&view) },
            ],
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("display"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// # Errors
/// The texture holds no colours.
pub fn showable(gpu: &Gpu, texture: &wgpu::Texture, name: &str) -> Checked<()> {
    let sampled = texture.format().sample_type(None, Some(gpu.features));
    let color = matches!(sampled, Some(wgpu::TextureSampleType::Float { .. }));
    if color && texture.dimension() == wgpu::TextureDimension::D2 {
        return Ok(());
    }
    let d = Diagnostic::error(format!("`{name}` holds no image of colours, and can't be shown"));
    Err(d.help("choose another output").into())
}
