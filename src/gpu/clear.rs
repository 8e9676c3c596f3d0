//! Clears by drawing, for render passes that must keep the texels around the cleared ones, and for clears that the
//! device may skip.

use super::{device::Gpu, pipelines::by_location, scope::scoped};
use crate::diag::Checked;
use crate::plan::{ColorTarget, Draw};

/// All that tells one pipeline that clears from another.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fill {
    text: String,
    targets: Vec<Option<wgpu::ColorTargetState>>,
    depth: Option<wgpu::DepthStencilState>,
    samples: u32,
}

/// A pipeline without bindings that gives each target of a draw its clear value, by one triangle of three vertices.
/// Targets that the draw keeps stay as they are. Cached pipelines are used again.
///
/// # Errors
/// What the device finds wrong.
pub(super) fn pipeline(gpu: &Gpu, name: &str, draw: &Draw) -> Checked<wgpu::RenderPipeline> {
    let target = |t: &ColorTarget| wgpu::ColorTargetState {
        format: t.format,
        blend: None,
        write_mask: if t.clear.is_some() { wgpu::ColorWrites::ALL } else { wgpu::ColorWrites::empty() },
    };
    let fill = Fill {
        text: source(draw),
        targets: by_location(&draw.color).into_iter().map(|t| t.map(target)).collect(),
        depth: draw.depth.as_ref().map(|d| wgpu::DepthStencilState {
            format: d.format,
            depth_write_enabled: Some(d.clear.is_some()),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        samples: draw.samples,
    };
    gpu.caches.fills.get(&fill, || fill.build(gpu, name))
}

impl Fill {
    fn build(&self, gpu: &Gpu, name: &str) -> Checked<wgpu::RenderPipeline> {
        scoped(gpu, &format!("build the pipeline that clears for `{name}`"), || {
            let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("clear"),
                source: wgpu::ShaderSource::Wgsl(self.text.as_str().into()),
            });
            let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("clear"),
                bind_group_layouts: &[],
                immediate_size: 0,
            });
            gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("clear"),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("cover"),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: self.depth.clone(),
                multisample: wgpu::MultisampleState { count: self.samples, ..Default::default() },
                fragment: (!self.targets.is_empty()).then_some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("fill"),
                    compilation_options: Default::default(),
                    targets: &self.targets,
                }),
                multiview_mask: None,
                cache: None,
            })
        })
    }
}

/// A triangle over all of the target at the depth to clear to, in the colours to clear to.
fn source(draw: &Draw) -> String {
    let depth = draw.depth.as_ref().and_then(|d| d.clear).unwrap_or(0.0);
    let mut text = format!(
        "@vertex fn cover(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {{
            return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, {depth:?}, 1.0);
        }}\n"
    );
    let outputs: Vec<(u32, &str, String)> = draw
        .color
        .iter()
        .map(|t| {
            let value = t.clear.unwrap_or([0.0; 4]);
            let (ty, parts) = match t.format.sample_type(None, None) {
                Some(wgpu::TextureSampleType::Uint) => ("vec4u", value.map(|v| format!("{}u", v as u32))),
                Some(wgpu::TextureSampleType::Sint) => ("vec4i", value.map(|v| format!("{}i", v as i32))),
                _ => ("vec4f", value.map(|v| format!("{:?}f", v as f32))),
            };
            (t.location, ty, format!("{ty}({})", parts.join(", ")))
        })
        .collect();
    if !outputs.is_empty() {
        let members: Vec<String> = outputs.iter().map(|(l, ty, _)| format!("@location({l}) c{l}: {ty}")).collect();
        let values: Vec<&str> = outputs.iter().map(|(.., value)| value.as_str()).collect();
        text.push_str(&format!(
            "struct Fill {{ {} }}\n@fragment fn fill() -> Fill {{ return Fill({}); }}\n",
            members.join(", "),
            values.join(", ")
        ));
    }
    text
}
