//! The passes of chain.ron as somebody would write them against wgpu, with the same shaders: a buffer is cleared, each
//! pass turns it, one pixel shows it. No graph, no plan, no timing, no error scopes.

use lightgraph::internals::plan::Action;
use lightgraph::internals::shader::Shader;
use lightgraph::{Checked, Gpu, Plan};
use std::sync::Arc;
use wgpu::util::DeviceExt;

pub struct Handwritten {
    passes: u32,
    values: wgpu::Buffer,
    turn: wgpu::ComputePipeline,
    turn_group: wgpu::BindGroup,
    stride: u32,
    show: wgpu::RenderPipeline,
    show_group: wgpu::BindGroup,
    target: wgpu::TextureView,
}

const VALUES: u64 = 16384;

impl Handwritten {
    /// `None` when the plan is not that of chain.ron. The plan gives the shaders, the number of passes and the work.
    pub fn new(gpu: &Gpu, plan: &Plan) -> Option<Handwritten> {
        let device = &gpu.device;
        let shader = |path: &str| plan.shaders.iter().find(|s| s.path.ends_with(path)).cloned();
        let module = |shader: &Arc<Shader>| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: None,
                source: wgpu::ShaderSource::Naga(std::borrow::Cow::Owned(shader.module.clone())),
            })
        };
        let (turn, show) = (shader("turn.wgsl")?, shader("show.wgsl")?);
        let passes = plan.steps.iter().filter(|s| matches!(s.action, Action::Compute { .. })).count() as u32;
        let work = match plan.value("work")? {
            lightgraph::internals::value::Value::Uint(work) => work,
            _ => return None,
        };

        let values = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 4 * VALUES,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let stride = gpu.limits.min_uniform_buffer_offset_alignment.max(16);
        let mut bytes = vec![0; (stride * passes) as usize];
        for (i, slot) in (0..passes).zip(bytes.chunks_exact_mut(stride as usize)) {
            slot[..4].copy_from_slice(&i.to_le_bytes());
            slot[4..8].copy_from_slice(&work.to_le_bytes());
        }
        let params = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: &bytes,
            usage: wgpu::BufferUsages::UNIFORM,
        });

        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: None,
        };
        let storage = |read_only| wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
        let layout = |entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries })
        };
        let compute = wgpu::ShaderStages::COMPUTE;
        let turn_layout = layout(&[entry(0, compute, uniform), entry(1, compute, storage(false))]);
        let show_layout = layout(&[entry(0, wgpu::ShaderStages::FRAGMENT, storage(true))]);
        let pipeline_layout = |layout: &wgpu::BindGroupLayout| {
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: &[Some(layout)],
                immediate_size: 0,
            })
        };
        let group = |layout, entries: &[wgpu::BindGroupEntry<'_>]| {
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries })
        };
        let one = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &params,
            offset: 0,
            size: wgpu::BufferSize::new(16),
        });
        let turn_group = group(
            &turn_layout,
            &[
                wgpu::BindGroupEntry { binding: 0, resource: one },
                wgpu::BindGroupEntry { binding: 1, resource: values.as_entire_binding() },
            ],
        );
        let show_group =
            group(&show_layout, &[wgpu::BindGroupEntry { binding: 0, resource: values.as_entire_binding() }]);
        let turn_pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&pipeline_layout(&turn_layout)),
            module: &module(&turn),
            entry_point: Some("turn"),
            compilation_options: Default::default(),
            cache: None,
        });
        let screen = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(
                "@vertex fn screen(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
                    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
                }"
                .into(),
            ),
        });
        let format = wgpu::TextureFormat::Rgba32Float;
        let show_pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&pipeline_layout(&show_layout)),
            vertex: wgpu::VertexState {
                module: &screen,
                entry_point: Some("screen"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module(&show),
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let target = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        Some(Handwritten {
            passes,
            values,
            turn: turn_pipeline,
            turn_group,
            stride,
            show: show_pipeline,
            show_group,
            target: target.create_view(&Default::default()),
        })
    }

    /// One frame, to the end of the device's work.
    ///
    /// # Errors
    /// The device is lost.
    pub fn frame(&self, gpu: &Gpu) -> Checked<()> {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.values, 0, None);
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.turn);
        for i in 0..self.passes {
            pass.set_bind_group(0, &self.turn_group, &[i * self.stride]);
            pass.dispatch_workgroups((VALUES / 64) as u32, 1, 1);
        }
        drop(pass);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.target,
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.show);
        pass.set_bind_group(0, &self.show_group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        gpu.wait()
    }
}
