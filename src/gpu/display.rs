//! Converts linear images to what a display shows: one image, two side by side, or their difference.

use super::device::Gpu;
use crate::image::png::ToneMap;

/// How images are shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DisplayLook {
    /// Exposure in stops.
    pub stops: f32,
    pub tone_map: ToneMap,
    pub arrangement: Arrangement,
}

/// Which of two images is seen where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Arrangement {
    First,
    Second,
    /// The second right of this share of the width.
    Split(f32),
    /// In full colour where they differ by this much.
    Difference(f32),
}

/// Draws images to targets of one format, whose values are sRGB.
#[derive(Debug)]
pub struct Display {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    last: Option<Drawn>,
}

/// What was drawn last.
#[derive(Debug)]
struct Drawn {
    images: [wgpu::Texture; 2],
    look: DisplayLook,
    group: wgpu::BindGroup,
}

/// As the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Uniform {
    exposure: f32,
    tone_map: u32,
    arrangement: u32,
    at: f32,
}

impl From<DisplayLook> for Uniform {
    fn from(look: DisplayLook) -> Uniform {
        let tone_map = match look.tone_map {
            ToneMap::None => 0,
            ToneMap::Neutral => 1,
        };
        let (arrangement, at) = match look.arrangement {
            Arrangement::First => (0, 0.0),
            Arrangement::Split(at) => (1, at),
            Arrangement::Difference(full) => (2, full.max(1e-6)),
            Arrangement::Second => (3, 0.0),
        };
        Uniform { exposure: look.stops.exp2(), tone_map, arrangement, at }
    }
}

impl Display {
    /// Errors of the device come to whoever catches them: it lacks nothing that any device has.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Display {
        let device = &gpu.device;
        let source = wgpu::ShaderSource::Wgsl(include_str!("display.wgsl").into());
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
        Display { pipeline, layout, last: None }
    }

    /// Draws the first layers of two 2D textures of colours over all of the target; one image is both.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        images: [&wgpu::Texture; 2],
        look: DisplayLook,
        target: &wgpu::TextureView,
    ) {
        let same = self.last.take_if(|last| last.images.each_ref() == images && last.look == look);
        let drawn = self.last.insert(same.unwrap_or_else(|| Drawn {
            images: images.map(Clone::clone),
            look,
            group: bind(gpu, &self.layout, images, look),
        }));
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
        pass.set_bind_group(0, &drawn.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// With a uniform of its own: several draws are recorded before the first is handed over.
fn bind(gpu: &Gpu, layout: &wgpu::BindGroupLayout, images: [&wgpu::Texture; 2], look: DisplayLook) -> wgpu::BindGroup {
    let uniform = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("display"),
        size: size_of::<Uniform>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&Uniform::from(look)));
    let views = images.map(|image| {
        image.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            mip_level_count: Some(1),
            array_layer_count: Some(1),
            ..Default::default()
        })
    });
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("display"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&views[0]) },
            wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&views[1]) },
        ],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shader_is_valid_and_takes_what_it_is_given() {
        let module = naga::front::wgsl::parse_str(include_str!("display.wgsl")).unwrap_or_else(|e| panic!("{e}"));
        let mut validator = naga::valid::Validator::new(Default::default(), Default::default());
        validator.validate(&module).unwrap_or_else(|e| panic!("{e:?}"));
        let look = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Look"));
        let Some((_, naga::Type { inner: naga::TypeInner::Struct { span, members }, .. })) = look else { panic!() };
        let offsets: Vec<(&str, u32)> = members.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset)).collect();
        assert_eq!(*span as usize, size_of::<Uniform>());
        assert_eq!(offsets, [("exposure", 0), ("tone_map", 4), ("arrangement", 8), ("at", 12)]);
    }
}
