//! Images of linear light as textures that the panels can show.

use super::choice::{Choice, Layout};
use super::feed::Told;
use lightgraph::Gpu;
use lightgraph::internals::image::png::ToneMap;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What panels show have this format: bytes in sRGB, as egui wants them.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// The longer side of a preview, in pixels.
const PREVIEW: u32 = 160;

/// As the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
struct Look {
    exposure: f32,
    tone_map: u32,
    arrangement: u32,
    at: f32,
}

/// A texture that panels can show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    pub id: egui::TextureId,
    /// In pixels.
    pub size: [u32; 2],
}

/// Turns linear images into what panels show.
pub struct Canvas {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    main: Option<Painted>,
    previews: BTreeMap<PathBuf, Painted>,
    /// What is recorded and not yet handed over.
    recorded: Vec<wgpu::CommandBuffer>,
}

struct Painted {
    texture: wgpu::Texture,
    shown: Shown,
    /// What it was painted from.
    source: (wgpu::Texture, Option<wgpu::Texture>, u64, Look),
}

impl Canvas {
    pub fn new(gpu: &Gpu) -> Canvas {
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
                targets: &[Some(FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Canvas { pipeline, layout, main: None, previews: BTreeMap::new(), recorded: vec![] }
    }

    /// What is to be submitted before the panels are drawn. Each submission waits for the frame that the engine waits
    /// for, so the window makes one only.
    pub fn recorded(&mut self) -> Vec<wgpu::CommandBuffer> {
        std::mem::take(&mut self.recorded)
    }

    /// The image as chosen; `None` before there is one.
    pub fn main(
        &mut self,
        gpu: &Gpu,
        renderer: &mut egui_wgpu::Renderer,
        told: &Told,
        choice: &Choice,
    ) -> Option<Shown> {
        let first = told.image.as_ref()?;
        let (arrangement, at) = match (choice.compare.layout, &told.other) {
            (_, None) => (0, 0.0),
            (Layout::Split(at), _) => (1, at),
            (Layout::Difference(full), _) => (2, full.max(1e-6)),
            (Layout::Other, _) => (3, 0.0),
        };
        let look = Look { arrangement, at, ..plain(choice, told) };
        let size = [first.width(), first.height()];
        let source = (first.clone(), told.other.clone(), told.images, look);
        let old = self.main.take();
        let painted = self.painted(gpu, renderer, old.as_ref(), size, source);
        let shown = painted.shown;
        self.main = Some(painted);
        Some(shown)
    }

    /// Small images of the graphs that are ready.
    pub fn previews(
        &mut self,
        gpu: &Gpu,
        renderer: &mut egui_wgpu::Renderer,
        told: &Told,
        choice: &Choice,
    ) -> BTreeMap<PathBuf, Shown> {
        let look = plain(choice, told);
        let old = std::mem::take(&mut self.previews);
        let mut shown = BTreeMap::new();
        for (path, image, images) in &told.ready {
            let longest = image.width().max(image.height()).max(1);
            let size = [image.width(), image.height()].map(|n| (n * PREVIEW / longest).max(1));
            let source = (image.clone(), None, *images, look);
            let painted = self.painted(gpu, renderer, old.get(path), size, source);
            shown.insert(path.clone(), painted.shown);
            self.previews.insert(path.clone(), painted);
        }
        for (path, painted) in old {
            if !self.previews.contains_key(&path) {
                renderer.free_texture(&painted.shown.id);
            }
        }
        shown
    }

    fn painted(
        &mut self,
        gpu: &Gpu,
        renderer: &mut egui_wgpu::Renderer,
        old: Option<&Painted>,
        size: [u32; 2],
        source: (wgpu::Texture, Option<wgpu::Texture>, u64, Look),
    ) -> Painted {
        if let Some(old) = old
            && old.source == source
            && old.shown.size == size
        {
            return Painted { texture: old.texture.clone(), shown: old.shown, source };
        }
        let (texture, shown) = match old {
            Some(old) if old.shown.size == size => (old.texture.clone(), old.shown),
            _ => {
                let texture = target(gpu, size);
                let view = texture.create_view(&Default::default());
                let id = match old {
                    Some(old) => {
                        let id = old.shown.id;
                        renderer.update_egui_texture_from_wgpu_texture(
                            &gpu.device,
                            &view,
                            wgpu::FilterMode::Nearest,
                            id,
                        );
                        id
                    }
                    None => renderer.register_native_texture(&gpu.device, &view, wgpu::FilterMode::Nearest),
                };
                (texture, Shown { id, size })
            }
        };
        self.draw(gpu, &source.0, source.1.as_ref().unwrap_or(&source.0), source.3, &texture);
        Painted { texture, shown, source }
    }

    fn draw(&mut self, gpu: &Gpu, first: &wgpu::Texture, second: &wgpu::Texture, look: Look, to: &wgpu::Texture) {
        let uniform = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("display"),
            size: size_of::<Look>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&look));
        let views = [first, second].map(|t| t.create_view(&Default::default()));
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("display"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&views[0]) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&views[1]) },
            ],
        });
        let view = to.create_view(&Default::default());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("display"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.recorded.push(encoder.finish());
    }
}

fn plain(choice: &Choice, told: &Told) -> Look {
    let tone_map = match choice.tone_map {
        ToneMap::None => 0,
        ToneMap::Neutral => 1,
    };
    Look { exposure: choice.stops(told.automatic).exp2(), tone_map, arrangement: 0, at: 0.0 }
}

fn target(gpu: &Gpu, [width, height]: [u32; 2]) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("display"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
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
        assert_eq!(*span as usize, size_of::<Look>());
        assert_eq!(offsets, [("exposure", 0), ("tone_map", 4), ("arrangement", 8), ("at", 12)]);
    }
}
