//! Finds invalid numbers. After every step, one reduction over each resource it wrote counts values that are NaN,
//! infinite or outside the range that the graph declares, and keeps the place of the first.

mod found;

pub use found::{Broken, Numerics, ResourceNumbers};

use super::{
    buffers::empty,
    device::Gpu,
    pool::{Memory, Pool},
    readback::{map, staging},
    scope::scoped,
};
use crate::diag::Checked;
use crate::image::texel;
use crate::plan::{Binding, Desc, Plan, Resource, ResourceId, StepId, TextureDesc, TextureKind};
use crate::shader::BindingKind;
use crate::value::Type;
use std::collections::BTreeMap;

/// Checks that wait for their rows to be read.
const SLOTS: usize = 128;
/// Workgroups of one check at most, each with a row.
const GROUPS: u32 = 32;
/// Bytes of `Row` in the shader.
const ROW: u64 = 48;
const LANES: u32 = 64;
/// Bytes of `Check` in the shader, rounded up.
const PARAMS: u64 = 48;

/// The checks of one prepared plan.
#[derive(Debug)]
pub(super) struct Watch {
    /// By resource and by what of a buffer is a number.
    ready: BTreeMap<(usize, ReadMode), (wgpu::ComputePipeline, wgpu::BindGroup)>,
    params: wgpu::Buffer,
    /// Bytes from one check's parameters to the next.
    pitch: u64,
    rows: wgpu::Buffer,
    staging: wgpu::Buffer,
    pending: Vec<NumericCheck>,
    found: Numerics,
}

#[derive(Debug)]
struct NumericCheck {
    step: StepId,
    iterations: Vec<u32>,
    resource: ResourceId,
    groups: u32,
    /// Words of a buffer's element; 0 for a texture.
    stride: u32,
}

/// How a resource is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum ReadMode {
    Layers,
    Depth,
    Volume,
    Words,
}

impl ReadMode {
    /// The part of the shader that differs.
    fn text(self) -> &'static str {
        match self {
            ReadMode::Layers => {
                "@group(0) @binding(0) var source: texture_2d_array<f32>;
                fn size() -> u32 { let s = textureDimensions(source); return s.x * s.y * textureNumLayers(source); }
                fn channels_of(i: u32) -> u32 {
                    let s = textureDimensions(source);
                    return in_tiles(vec2u(i % s.x, i / s.x % s.y));
                }
                fn load(i: u32) -> vec4f {
                    let s = textureDimensions(source);
                    return textureLoad(source, vec2u(i % s.x, i / s.x % s.y), i / (s.x * s.y), 0);
                }"
            }
            ReadMode::Depth => {
                "@group(0) @binding(0) var source: texture_depth_2d_array;
                fn size() -> u32 { let s = textureDimensions(source); return s.x * s.y * textureNumLayers(source); }
                fn channels_of(i: u32) -> u32 {
                    let s = textureDimensions(source);
                    return in_tiles(vec2u(i % s.x, i / s.x % s.y));
                }
                fn load(i: u32) -> vec4f {
                    let s = textureDimensions(source);
                    return vec4f(textureLoad(source, vec2u(i % s.x, i / s.x % s.y), i / (s.x * s.y), 0));
                }"
            }
            ReadMode::Volume => {
                "@group(0) @binding(0) var source: texture_3d<f32>;
                fn size() -> u32 { let s = textureDimensions(source); return s.x * s.y * s.z; }
                fn channels_of(i: u32) -> u32 { return check.channels; }
                fn load(i: u32) -> vec4f {
                    let s = textureDimensions(source);
                    return textureLoad(source, vec3u(i % s.x, i / s.x % s.y, i / (s.x * s.y)), 0);
                }"
            }
            ReadMode::Words => {
                "@group(0) @binding(0) var<storage, read> source: array<u32>;
                fn size() -> u32 { return arrayLength(&source); }
                fn channels_of(i: u32) -> u32 { return (check.floats >> (i % check.stride)) & 1u; }
                fn load(i: u32) -> vec4f { return vec4f(bitcast<f32>(source[i])); }"
            }
        }
    }
}

impl Watch {
    /// # Errors
    /// No memory is left.
    pub(super) fn new(gpu: &Gpu) -> Checked<Watch> {
        let pitch = PARAMS.next_multiple_of(u64::from(gpu.limits.min_uniform_buffer_offset_alignment).max(1));
        let bytes = SLOTS as u64 * u64::from(GROUPS) * ROW;
        use wgpu::BufferUsages as U;
        let params = empty(gpu, "numerical checks", SLOTS as u64 * pitch, U::UNIFORM | U::COPY_DST)?;
        let rows = empty(gpu, "rows of numerical checks", bytes, U::STORAGE | U::COPY_SRC)?;
        Ok(Watch {
            ready: BTreeMap::new(),
            params,
            pitch,
            rows,
            staging: staging(gpu, "rows of checks", bytes)?,
            pending: vec![],
            found: Numerics::default(),
        })
    }

    /// Whether the checks of a step with so many writes must wait until those before are read.
    pub(super) fn is_full(&self, writes: usize) -> bool {
        !self.pending.is_empty() && self.pending.len() + writes > SLOTS
    }

    /// Encodes the checks of what a step has just written.
    ///
    /// # Errors
    /// What the device finds wrong with the checks themselves.
    pub(super) fn encode(
        &mut self,
        gpu: &Gpu,
        plan: &Plan,
        pool: &Pool,
        encoder: &mut wgpu::CommandEncoder,
        step: StepId,
        iterations: &[u32],
    ) -> Checked<()> {
        let Some(writes) = plan.steps.get(step.0).map(|s| s.writes.as_slice()) else { return Ok(()) };
        for id in writes.iter().take(SLOTS) {
            let Some(resource) = plan.resources.get(id.0).filter(|r| r.desc.is_readable()) else { continue };
            let Some((source, texels, numbers)) = numbers(plan, step, *id, resource) else { continue };
            self.ready(gpu, pool.memory(plan, *id)?, *id, source)?;
            let Some((pipeline, group)) = self.ready.get(&(id.0, source)) else { continue };
            let slot = self.pending.len() as u32;
            let offset = u64::from(slot) * self.pitch;
            let words = [numbers.channels, numbers.stride, numbers.floats, slot * GROUPS];
            let tiling = match &resource.desc {
                Desc::Texture(TextureDesc { tiles: Some(t), .. }) => [t.edge, t.columns, t.count],
                Desc::Texture(_) | Desc::Buffer { .. } => [0; 3],
            };
            let range = [resource.min.map_or(f32::MIN, |x| x as f32), resource.max.map_or(f32::MAX, |x| x as f32)];
            let bytes = [bytemuck::bytes_of(&words), bytemuck::bytes_of(&range), bytemuck::bytes_of(&tiling)].concat();
            gpu.queue.write_buffer(&self.params, offset, &bytes);
            let groups = texels.div_ceil(u64::from(LANES) * 4).clamp(1, GROUPS.into()) as u32;
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("check of numbers"),
                timestamp_writes: None,
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[offset as u32]);
            pass.dispatch_workgroups(groups, 1, 1);
            drop(pass);
            let iterations = iterations.to_vec();
            self.pending.push(NumericCheck { step, iterations, resource: *id, groups, stride: numbers.stride });
        }
        Ok(())
    }

    /// Makes the bind group that is not there yet, and its pipeline where the device has none.
    fn ready(&mut self, gpu: &Gpu, memory: &Memory, id: ResourceId, source: ReadMode) -> Checked<()> {
        if self.ready.contains_key(&(id.0, source)) {
            return Ok(());
        }
        let what = "prepare the check of numbers";
        let pipeline = gpu.caches.checks.get(&source, || scoped(gpu, what, || pipeline(gpu, source)))?;
        let group = scoped(gpu, what, || {
            let view;
            let read = match memory {
                Memory::Buffer(b) => b.as_entire_binding(),
                Memory::Texture(t) => {
                    use wgpu::TextureViewDimension as D;
                    view = t.create_view(&wgpu::TextureViewDescriptor {
                        dimension: Some(if source == ReadMode::Volume { D::D3 } else { D::D2Array }),
                        mip_level_count: Some(1),
                        usage: Some(wgpu::TextureUsages::TEXTURE_BINDING),
                        ..Default::default()
                    });
                    wgpu::BindingResource::TextureView(&view)
                }
            };
            let part = wgpu::BufferBinding { buffer: &self.params, offset: 0, size: wgpu::BufferSize::new(PARAMS) };
            let bound = [read, wgpu::BindingResource::Buffer(part), self.rows.as_entire_binding()];
            let entries: Vec<wgpu::BindGroupEntry<'_>> =
                (0..).zip(bound).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("check of numbers"),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &entries,
            })
        })?;
        self.ready.insert((id.0, source), (pipeline, group));
        Ok(())
    }

    /// Reads the rows of all checks that were submitted.
    ///
    /// # Errors
    /// The device fails.
    pub(super) fn collect(&mut self, gpu: &Gpu, plan: &Plan) -> Checked<()> {
        let pending = std::mem::take(&mut self.pending);
        if pending.is_empty() {
            return Ok(());
        }
        let bytes = pending.len() as u64 * u64::from(GROUPS) * ROW;
        scoped(gpu, "read the checks of numbers", || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&self.rows, 0, &self.staging, 0, bytes);
            gpu.queue.submit([encoder.finish()]);
        })?;
        let data = map(gpu, &self.staging, bytes)?;
        let pitch = GROUPS as usize * ROW as usize;
        for (check, rows) in pending.into_iter().zip(data.chunks_exact(pitch)) {
            let rows = rows.chunks_exact(ROW as usize).take(check.groups as usize).map(CountRow::read);
            self.note(plan, check, rows.fold(CountRow::NOTHING, CountRow::joined));
        }
        Ok(())
    }

    fn note(&mut self, plan: &Plan, check: NumericCheck, row: CountRow) {
        let (least, largest) = (f64::from(row.least), f64::from(row.largest));
        let resource = check.resource;
        match self.found.readings.iter_mut().find(|r| r.resource == resource) {
            Some(r) => {
                r.checks += 1;
                (r.least, r.largest) = (r.least.min(least), r.largest.max(largest));
                (r.energy, r.negative) = (row.sum, row.negative);
            }
            None => {
                let (energy, negative) = (row.sum, row.negative);
                self.found.readings.push(ResourceNumbers { resource, checks: 1, least, largest, energy, negative });
            }
        }
        let wrong = row.not_numbers + row.infinite + row.below + row.above;
        if wrong == 0 || self.found.broken.iter().any(|b| b.resource == resource) {
            return;
        }
        self.found.broken.push(Broken {
            step: check.step,
            iterations: check.iterations,
            resource,
            not_numbers: row.not_numbers,
            infinite: row.infinite,
            below: row.below,
            above: row.above,
            texel: place(plan, resource, check.stride, row.broken_at.min(row.outside_at)),
        });
    }

    /// What was found since the last call.
    pub(super) fn take(&mut self) -> Numerics {
        self.pending.clear();
        std::mem::take(&mut self.found)
    }
}

/// Where texel (or word) number `i` is.
fn place(plan: &Plan, id: ResourceId, stride: u32, i: u32) -> [u32; 3] {
    match plan.resources.get(id.0).map(|r| &r.desc) {
        Some(Desc::Texture(TextureDesc { width: w, height: h, .. })) => {
            let (w, h) = ((*w).max(1), (*h).max(1));
            [i % w, i / w % h, i / w / h]
        }
        _ => [i / stride.max(1), i % stride.max(1), 0],
    }
}

/// Which of a resource's words are floats.
#[derive(Debug, Clone, Copy)]
struct NumberLayout {
    channels: u32,
    stride: u32,
    floats: u32,
}

/// How to read what a step wrote, and how many texels or words it has; `None` for integers, and for buffers that
/// nothing says to hold floats.
fn numbers(plan: &Plan, step: StepId, id: ResourceId, resource: &Resource) -> Option<(ReadMode, u64, NumberLayout)> {
    match &resource.desc {
        Desc::Texture(t) => {
            let channels = (1 << texel::channels(t.format)?) - 1;
            let source = match t.format.sample_type(Some(wgpu::TextureAspect::All), None)? {
                wgpu::TextureSampleType::Depth => ReadMode::Depth,
                wgpu::TextureSampleType::Float { .. } if t.kind == TextureKind::D3 => ReadMode::Volume,
                wgpu::TextureSampleType::Float { .. } => ReadMode::Layers,
                wgpu::TextureSampleType::Sint | wgpu::TextureSampleType::Uint => return None,
            };
            let texels = u64::from(t.width) * u64::from(t.height) * u64::from(t.layers);
            Some((source, texels, NumberLayout { channels, stride: 0, floats: 0 }))
        }
        Desc::Buffer { size, .. } => {
            let step = plan.steps.get(step.0)?;
            let shader = plan.shaders.get(step.action.shader()?)?;
            let bound = |b: &Binding| matches!(b, Binding::Resource(r) if *r == id);
            let variables = shader.interface.variables.iter().zip(&step.bindings).filter(|(_, b)| bound(b));
            let (stride, floats) = variables.filter_map(|(v, _)| floats(&v.kind)).next()?;
            Some((ReadMode::Words, size / 4, NumberLayout { channels: 1, stride, floats }))
        }
    }
}

/// The words of an element, and a bit for each that is a float; `None` without floats or beyond 32 words.
fn floats(kind: &BindingKind) -> Option<(u32, u32)> {
    let BindingKind::Storage { element, stride, .. } = kind else { return None };
    let words = stride / 4;
    let mut floats = 0u64;
    for m in &element.members {
        let count = match m.ty {
            Type::Float => 1,
            Type::Vec2 => 2,
            Type::Vec3 => 3,
            Type::Vec4 => 4,
            Type::Mat4 => 16,
            Type::Bool | Type::Uint | Type::Int | Type::UVec2 | Type::UVec3 | Type::UVec4 => 0,
        };
        floats |= ((1 << count) - 1u64) << (m.offset / 4).min(63);
    }
    let floats = u32::try_from(floats).ok()?;
    ((1..=32).contains(&words) && floats != 0).then_some((words, floats))
}

/// The sum of what workgroups found.
#[derive(Debug, Clone, Copy)]
struct CountRow {
    not_numbers: u64,
    infinite: u64,
    below: u64,
    above: u64,
    broken_at: u32,
    outside_at: u32,
    least: f32,
    largest: f32,
    sum: f64,
    negative: f64,
}

impl CountRow {
    const NOTHING: CountRow = CountRow {
        not_numbers: 0,
        infinite: 0,
        below: 0,
        above: 0,
        broken_at: u32::MAX,
        outside_at: u32::MAX,
        least: f32::MAX,
        largest: f32::MIN,
        sum: 0.0,
        negative: 0.0,
    };

    /// From the shader's `Row`.
    fn read(bytes: &[u8]) -> CountRow {
        let word = |i: usize| {
            let mut raw = [0; 4];
            raw.iter_mut().zip(bytes.iter().skip(i * 4)).for_each(|(to, from)| *to = *from);
            u32::from_le_bytes(raw)
        };
        CountRow {
            not_numbers: word(0).into(),
            infinite: word(1).into(),
            below: word(2).into(),
            above: word(3).into(),
            broken_at: word(4),
            outside_at: word(5),
            least: f32::from_bits(word(6)),
            largest: f32::from_bits(word(7)),
            sum: f32::from_bits(word(8)).into(),
            negative: f32::from_bits(word(9)).into(),
        }
    }

    fn joined(self, b: CountRow) -> CountRow {
        CountRow {
            not_numbers: self.not_numbers + b.not_numbers,
            infinite: self.infinite + b.infinite,
            below: self.below + b.below,
            above: self.above + b.above,
            broken_at: self.broken_at.min(b.broken_at),
            outside_at: self.outside_at.min(b.outside_at),
            least: self.least.min(b.least),
            largest: self.largest.max(b.largest),
            sum: self.sum + b.sum,
            negative: self.negative + b.negative,
        }
    }
}

fn pipeline(gpu: &Gpu, source: ReadMode) -> wgpu::ComputePipeline {
    let text = format!("{}\n{}", source.text(), include_str!("numerics.wgsl"));
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("check of numbers"),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let storage = |read_only| wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let texture =
        |sample_type, view_dimension| wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false };
    let float = wgpu::TextureSampleType::Float { filterable: false };
    use wgpu::TextureViewDimension as D;
    let read = match source {
        ReadMode::Layers => texture(float, D::D2Array),
        ReadMode::Volume => texture(float, D::D3),
        ReadMode::Depth => texture(wgpu::TextureSampleType::Depth, D::D2Array),
        ReadMode::Words => storage(true),
    };
    let params = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: true,
        min_binding_size: None,
    };
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip([read, params, storage(false)])
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        })
        .collect();
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("check of numbers"),
        entries: &entries,
    });
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("check of numbers"),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("check of numbers"),
        layout: Some(&layout),
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    })
}
