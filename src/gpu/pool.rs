//! Allocates the memory of a plan: one texture or buffer per slot, and the views of it.

use super::{device::Gpu, encode::clear_texture, scope::scoped, upload::write_levels};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::image::texture::Texture;
use crate::plan::{Desc, Plan, ResourceId, TextureDesc, TextureKind};
use crate::shader::TextureDim;
use crate::value::Type;
use std::ops::Range;

/// What a plan may allocate overall, in bytes. Beyond it a size in the graph is far more likely a slip than a wish.
pub const MOST_BYTES: u64 = 8 << 30;

/// A texture or buffer in which resources of a plan live: the plan's own, or lent to it by a program.
///
/// ```no_run
/// use lightgraph::{Checked, Gpu, Memory, Session};
///
/// /// Lends a texture to the graph's input `hdr`, and returns the texture of the output `color`.
/// fn share(gpu: &Gpu, session: &mut Session, hdr: wgpu::Texture) -> Checked<Option<wgpu::Texture>> {
///     session.import(gpu, "hdr", hdr, 0)?;
///     Ok(match session.memory(session.output("color")?)? {
///         Memory::Texture(texture) => Some(texture.clone()),
///         Memory::Buffer(_) => None,
///     })
/// }
/// ```
#[derive(Debug, Clone)]
pub enum Memory {
    Texture(wgpu::Texture),
    Buffer(wgpu::Buffer),
}

impl From<wgpu::Texture> for Memory {
    fn from(texture: wgpu::Texture) -> Memory {
        Memory::Texture(texture)
    }
}

impl From<wgpu::Buffer> for Memory {
    fn from(buffer: wgpu::Buffer) -> Memory {
        Memory::Buffer(buffer)
    }
}

/// All slots of a plan, by their index.
#[derive(Debug, Clone)]
pub struct Pool {
    slots: Vec<Memory>,
}

impl Pool {
    /// Allocates the plan's slots. Slots of resources with an initial content are cleared to it; all others are zero.
    /// What `kept` has for a slot serves as it is, content included.
    ///
    /// # Errors
    /// Sizes beyond the device's limits or [`MOST_BYTES`], formats or usages that the device lacks, no memory left;
    /// each names the resources that live there.
    pub fn allocate(gpu: &Gpu, plan: &Plan, kept: &[Option<Memory>]) -> Checked<Pool> {
        check_limits(plan, &gpu.limits)?;
        let mut slots = vec![];
        let mut fresh = vec![];
        let mut faults = vec![];
        gpu.caches.images.lock().next_plan();
        for (index, slot) in plan.slots.iter().enumerate() {
            if let Some(Some(kept)) = kept.get(index) {
                slots.push(kept.clone());
                fresh.push(false);
                continue;
            }
            let label = tenants(plan, index);
            let image = plan.resources.iter().find(|r| r.slot == index).and_then(|r| r.image.as_ref());
            let made = scoped(gpu, &format!("allocate `{label}`"), || match (image, &slot.desc) {
                (Some(image), Desc::Texture(t)) => Memory::Texture(uploaded(gpu, image, t, &label)),
                _ => blank(gpu, &slot.desc, &label),
            });
            match made {
                Ok(memory) => {
                    slots.push(memory);
                    fresh.push(true);
                }
                Err(f) => faults.extend(f.0),
            }
        }
        let pool = Faults::check(faults, Pool { slots })?;
        pool.clear_initial(gpu, plan, &fresh)?;
        Ok(pool)
    }

    /// The memory of some slots, for another plan to take over.
    pub fn taken(&self, slots: &[Option<usize>]) -> Vec<Option<Memory>> {
        slots.iter().map(|slot| self.slots.get((*slot)?).cloned()).collect()
    }

    /// The memory of a resource.
    ///
    /// # Errors
    /// The plan that `id` comes from is not the one that this pool was made for.
    pub fn memory(&self, plan: &Plan, id: ResourceId) -> Checked<&Memory> {
        let slot = plan.resources.get(id.0).and_then(|r| self.slots.get(r.slot));
        slot.ok_or_else(|| Diagnostic::error(format!("resource {} has no memory in this plan", id.0)).into())
    }

    /// As [`Pool::memory`], for a resource that must be a texture.
    ///
    /// # Errors
    /// As [`Pool::memory`], or it is a buffer.
    pub fn texture(&self, plan: &Plan, id: ResourceId) -> Checked<&wgpu::Texture> {
        match self.memory(plan, id)? {
            Memory::Texture(t) => Ok(t),
            Memory::Buffer(_) => {
                Err(Diagnostic::error(format!("`{}` is a buffer, where a texture is needed", name(plan, id))).into())
            }
        }
    }

    /// As [`Pool::memory`], for a resource that must be a buffer.
    ///
    /// # Errors
    /// As [`Pool::memory`], or it is a texture.
    pub fn buffer(&self, plan: &Plan, id: ResourceId) -> Checked<&wgpu::Buffer> {
        match self.memory(plan, id)? {
            Memory::Buffer(b) => Ok(b),
            Memory::Texture(_) => {
                Err(Diagnostic::error(format!("`{}` is a texture, where a buffer is needed", name(plan, id))).into())
            }
        }
    }

    /// Puts memory from outside in place of a resource's own. Whether it is other memory than before.
    ///
    /// # Errors
    /// It is of another kind, size or format, or may not be used as the plan uses it; the pool stays as it is then.
    pub(super) fn lend(&mut self, plan: &Plan, id: ResourceId, memory: Memory) -> Checked<bool> {
        let before = self.memory(plan, id)?;
        let other = match (before, &memory) {
            (Memory::Texture(a), Memory::Texture(b)) => a != b,
            (Memory::Buffer(a), Memory::Buffer(b)) => a != b,
            _ => true,
        };
        let resource = &plan.resources[id.0];
        let unfit = unfit(&resource.desc, &memory);
        let faults = unfit.into_iter().map(|(ours, theirs)| {
            let d = Diagnostic::error(format!("what is lent as `{}` is {theirs}", resource.name));
            d.help(format!("the graph takes {ours}"))
        });
        Faults::check(faults.collect(), ())?;
        self.slots[resource.slot] = memory;
        Ok(other)
    }

    fn clear_initial(&self, gpu: &Gpu, plan: &Plan, fresh: &[bool]) -> Checked<()> {
        let mut faults = vec![];
        for (index, resource) in plan.resources.iter().enumerate() {
            // Without history a frame begins with a step that gives the initial content, where it is read.
            let Some(value) = resource.initial.filter(|_| resource.history) else { continue };
            // New memory is zero already.
            if value == [0.0; 4] || fresh.get(resource.slot) != Some(&true) {
                continue;
            }
            let cleared = self.memory(plan, ResourceId(index)).and_then(|memory| {
                scoped(gpu, &format!("clear `{}`", resource.name), || match memory {
                    Memory::Texture(texture) => {
                        let mut encoder = gpu.device.create_command_encoder(&Default::default());
                        clear_texture(gpu, &mut encoder, (&resource.name, texture), value)?;
                        gpu.queue.submit([encoder.finish()]);
                        Ok(())
                    }
                    Memory::Buffer(buffer) => {
                        gpu.queue.write_buffer(buffer, 0, &numbers(resource.number, value[0], buffer.size()));
                        Ok(())
                    }
                })?
            });
            faults.extend(cleared.err().into_iter().flat_map(|f| f.0));
        }
        Faults::check(faults, ())
    }
}

/// `bytes` filled with one number of a type; `bytes` is a multiple of 4.
pub(super) fn numbers(number: Type, value: f64, bytes: u64) -> Vec<u8> {
    let word = match number {
        Type::Uint => (value as u32).to_le_bytes(),
        Type::Int => (value as i32).to_le_bytes(),
        _ => (value as f32).to_le_bytes(),
    };
    word.repeat(usize::try_from(bytes / 4).unwrap_or(0))
}

/// A view of all of a texture in the dimension that a shader asks for, or of one mip level.
pub(super) fn view(texture: &wgpu::Texture, dim: TextureDim, level: Option<u32>) -> wgpu::TextureView {
    let layers = match dim {
        TextureDim::D1 | TextureDim::D2 | TextureDim::D3 => Some(1),
        TextureDim::Cube => Some(6),
        TextureDim::D2Array | TextureDim::CubeArray => None,
    };
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(view_dimension(dim)),
        aspect: depth_aspect(texture.format()),
        base_mip_level: level.unwrap_or(0),
        mip_level_count: level.map(|_| 1),
        array_layer_count: layers,
        ..Default::default()
    })
}

/// A view of layers at a mip level, as a render target. Of a 3D texture it is the whole: there a slice
/// is chosen by the attachment.
pub(super) fn target_view(texture: &wgpu::Texture, layers: Range<u32>, mip: u32) -> wgpu::TextureView {
    let solid = texture.dimension() == wgpu::TextureDimension::D3;
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(match layers.len() {
            _ if solid => wgpu::TextureViewDimension::D3,
            0 | 1 => wgpu::TextureViewDimension::D2,
            _ => wgpu::TextureViewDimension::D2Array,
        }),
        base_mip_level: mip,
        mip_level_count: Some(1),
        base_array_layer: if solid { 0 } else { layers.start },
        array_layer_count: Some(if solid { 1 } else { layers.len() as u32 }),
        ..Default::default()
    })
}

pub(super) fn view_dimension(dim: TextureDim) -> wgpu::TextureViewDimension {
    match dim {
        TextureDim::D1 => wgpu::TextureViewDimension::D1,
        TextureDim::D2 => wgpu::TextureViewDimension::D2,
        TextureDim::D2Array => wgpu::TextureViewDimension::D2Array,
        TextureDim::Cube => wgpu::TextureViewDimension::Cube,
        TextureDim::CubeArray => wgpu::TextureViewDimension::CubeArray,
        TextureDim::D3 => wgpu::TextureViewDimension::D3,
    }
}

fn depth_aspect(format: wgpu::TextureFormat) -> wgpu::TextureAspect {
    if format.is_combined_depth_stencil_format() { wgpu::TextureAspect::DepthOnly } else { wgpu::TextureAspect::All }
}

/// New memory, all zero.
pub(super) fn blank(gpu: &Gpu, desc: &Desc, label: &str) -> Memory {
    match desc {
        Desc::Buffer { size, usage } => Memory::Buffer(gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: *size,
            usage: *usage,
            mapped_at_creation: false,
        })),
        Desc::Texture(t) => Memory::Texture(gpu.device.create_texture(&texture(t, label))),
    }
}

/// An image of files on the device.
#[derive(Debug)]
pub(super) struct Uploaded {
    hash: u128,
    desc: TextureDesc,
    texture: wgpu::Texture,
}

/// The texture of an image: a cached one, or a new one.
fn uploaded(gpu: &Gpu, image: &Texture, t: &TextureDesc, label: &str) -> wgpu::Texture {
    let mut cache = gpu.caches.images.lock();
    if let Some(there) = cache.find(|k| k.hash == image.hash && k.desc == *t) {
        return there.texture.clone();
    }
    let mut wanted = texture(t, label);
    wanted.usage |= wgpu::TextureUsages::COPY_DST;
    let made = gpu.device.create_texture(&wanted);
    write_levels(gpu, &made, &image.levels);
    cache.insert(Uploaded { hash: image.hash, desc: t.clone(), texture: made.clone() });
    made
}

fn texture<'a>(t: &TextureDesc, label: &'a str) -> wgpu::TextureDescriptor<'a> {
    wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: t.width, height: t.height, depth_or_array_layers: t.layers },
        mip_level_count: t.mips,
        sample_count: t.samples,
        dimension: match t.kind {
            TextureKind::D2 { .. } | TextureKind::Cube { .. } => wgpu::TextureDimension::D2,
            TextureKind::D3 => wgpu::TextureDimension::D3,
        },
        format: t.format,
        usage: t.usage,
        view_formats: &[],
    }
}

/// What is wrong with memory from outside: what is wanted, and what is there.
fn unfit(wanted: &Desc, memory: &Memory) -> Vec<(String, String)> {
    let mut unfit = vec![];
    let mut expect = |same: bool, ours: String, theirs: String| {
        if !same {
            unfit.push((ours, theirs));
        }
    };
    match (wanted, memory) {
        (Desc::Texture(t), Memory::Texture(there)) => {
            let (ours, theirs) = (texture(t, ""), there);
            let shape = (there.dimension(), there.size(), there.mip_level_count());
            let text = |(dimension, size, mips): (wgpu::TextureDimension, wgpu::Extent3d, u32)| {
                let wgpu::Extent3d { width, height, depth_or_array_layers: layers } = size;
                format!("a {dimension:?} texture of {width} × {height} × {layers} with {mips} mip levels")
            };
            let same = (ours.dimension, ours.size, ours.mip_level_count);
            expect(same == shape, text(same), text(shape));
            let format = |f: wgpu::TextureFormat| format!("of the format {f:?}");
            expect(t.format == theirs.format(), format(t.format), format(theirs.format()));
            let samples = theirs.sample_count();
            expect(
                samples == t.samples,
                format!("{} samples a texel", t.samples),
                format!("a texture of {samples} samples"),
            );
            // Nothing is written there.
            let needed = t.usage - wgpu::TextureUsages::COPY_DST - wgpu::TextureUsages::RENDER_ATTACHMENT;
            let usage = theirs.usage();
            expect(usage.contains(needed), format!("one for {needed:?}"), format!("a texture for {usage:?}"));
        }
        (Desc::Buffer { size, usage }, Memory::Buffer(there)) => {
            let bytes = there.size();
            expect(*size == bytes, format!("{size}"), format!("a buffer of {bytes} bytes"));
            let needed = *usage - wgpu::BufferUsages::COPY_DST;
            let usage = there.usage();
            expect(usage.contains(needed), format!("one for {needed:?}"), format!("a buffer for {usage:?}"));
        }
        (Desc::Texture(_), Memory::Buffer(_)) => expect(false, "a texture".into(), "a buffer".into()),
        (Desc::Buffer { .. }, Memory::Texture(_)) => expect(false, "a buffer".into(), "a texture".into()),
    }
    unfit
}

/// The names of the resources that live in a slot.
fn tenants(plan: &Plan, slot: usize) -> String {
    let names: Vec<&str> = plan.resources.iter().filter(|r| r.slot == slot).map(|r| r.name.as_str()).collect();
    names.join(", ")
}

fn name(plan: &Plan, id: ResourceId) -> &str {
    plan.resources.get(id.0).map_or("?", |r| &r.name)
}

fn check_limits(plan: &Plan, limits: &wgpu::Limits) -> Checked<()> {
    let mut faults = vec![];
    for (index, slot) in plan.slots.iter().enumerate() {
        for (what, ours, most) in sizes(&slot.desc, limits) {
            let label = tenants(plan, index);
            if ours == 0 {
                faults.push(
                    Diagnostic::error(format!("`{label}` has a {what} of 0")).help("give it a size of at least 1"),
                );
            } else if ours > most {
                let d = Diagnostic::error(format!("`{label}` has a {what} of {ours}, and this device allows {most}"));
                faults.push(d.help(format!(
                    "lower the parameters that its size comes from, so that its {what} is at most {most}"
                )));
            }
        }
    }
    let bytes: u64 = plan.slots.iter().fold(0, |sum, s| sum.saturating_add(s.bytes));
    if bytes > MOST_BYTES {
        let gib = |b: u64| b as f64 / (1u64 << 30) as f64;
        let mut largest: Vec<(u64, usize)> = plan.slots.iter().enumerate().map(|(i, s)| (s.bytes, i)).collect();
        largest.sort_by_key(|l| std::cmp::Reverse(l.0));
        let largest: Vec<String> =
            largest.iter().take(3).map(|(b, i)| format!("`{}` {:.2} GiB", tenants(plan, *i), gib(*b))).collect();
        faults.push(
            Diagnostic::error(format!(
                "the graph asks for {:.2} GiB; at most {:.0} GiB are allowed",
                gib(bytes),
                gib(MOST_BYTES)
            ))
            .help(format!("the largest are {}", largest.join(", "))),
        );
    }
    Faults::check(faults, ())
}

/// What is limited: its name, ours, the device's.
fn sizes(desc: &Desc, limits: &wgpu::Limits) -> Vec<(&'static str, u64, u64)> {
    match desc {
        Desc::Buffer { size, usage } => {
            let mut sizes = vec![("size in bytes", *size, limits.max_buffer_size)];
            if usage.contains(wgpu::BufferUsages::STORAGE) {
                sizes.push(("size in bytes for a storage binding", *size, limits.max_storage_buffer_binding_size));
            }
            sizes
        }
        Desc::Texture(t) => {
            let (across, deep) = match t.kind {
                TextureKind::D3 => (limits.max_texture_dimension_3d, limits.max_texture_dimension_3d),
                TextureKind::D2 { .. } | TextureKind::Cube { .. } => {
                    (limits.max_texture_dimension_2d, limits.max_texture_array_layers)
                }
            };
            let depth = if t.kind == TextureKind::D3 { "depth" } else { "number of layers" };
            vec![
                ("width", t.width.into(), across.into()),
                ("height", t.height.into(), across.into()),
                (depth, t.layers.into(), deep.into()),
            ]
        }
    }
}
