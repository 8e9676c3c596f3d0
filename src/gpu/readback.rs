//! Copies results of the device back to the host.

use super::{
    device::Gpu,
    pending::{PendingBytes, Spare},
    pool::Memory,
    prepare::Prepared,
    scope::scoped,
};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::image::{Image, texel};
use crate::plan::{Plan, ResourceId};
use std::ops::Range;

/// Of a texture, to be copied in one go.
const MOST_BYTES_AT_ONCE: u64 = 64 << 20;

/// How long to wait for word of work that is done. Far longer than it takes, so that only a broken driver runs out of
/// it.
pub(super) const ANSWER: std::time::Duration = std::time::Duration::from_secs(10);

/// All layers (slices of a 3D texture) of a resource at its first mip level, as 32-bit floats in linear light.
/// Integers become the nearest `f32`.
///
/// # Errors
/// It is a buffer, its format has no numbers to read, its memory can't be copied from, or the device fails.
pub fn read_image(gpu: &Gpu, prepared: &Prepared, plan: &Plan, id: ResourceId) -> Checked<Image> {
    let name = plan.resources.get(id.0).map_or("?", |r| &r.name);
    let texture = prepared.pool.texture(plan, id)?;
    decoded(gpu, texture, name, 0, 0..texture.depth_or_array_layers())
}

/// One layer (a face of a cube, a slice of a 3D texture) of one mip level, as [`read_image`] gives all layers.
/// `name` is the texture's in faults.
///
/// # Errors
/// As [`read_image`], or the texture has no such level or layer.
pub fn read_plane(gpu: &Gpu, texture: &wgpu::Texture, name: &str, mip: u32, layer: u32) -> Checked<Image> {
    decoded(gpu, texture, name, mip, layer..layer.saturating_add(1))
}

/// An image of some layers.
fn decoded(gpu: &Gpu, texture: &wgpu::Texture, name: &str, mip: u32, layers: Range<u32>) -> Checked<Image> {
    let format = texture.format();
    let (channels, texel) = readable(texture, name)?;
    let size = texture.size().mip_level_size(mip, texture.dimension());
    let count = layers.len() as u32;
    let mut data = Vec::with_capacity(size.width as usize * size.height as usize * layers.len() * channels as usize);
    let decode = |texels: &[u8]| texel::decode_row(format, texel as usize, texels, &mut data);
    copied(gpu, texture, (name, texel), mip, layers, decode)?;
    Ok(Image { width: size.width, height: size.height, layers: count, channels, data })
}

/// An image on its way from the device.
#[derive(Debug)]
pub struct PendingImage {
    pending: PendingBytes,
    size: wgpu::Extent3d,
    format: wgpu::TextureFormat,
    channels: u32,
    /// Bytes of a texel, of a row, and from row to row.
    texel: u32,
    row: u64,
    padded: u64,
}

impl PendingImage {
    /// The image, once the device has done the commands that copied it; never waits. They must have been submitted.
    ///
    /// # Errors
    /// The device fails.
    pub fn arrived(&mut self, gpu: &Gpu) -> Checked<Option<Image>> {
        Ok(self.pending.arrived(gpu)?.map(|parts| {
            let mut data = vec![];
            for line in parts.iter().flat_map(|bytes| bytes.chunks_exact(self.padded as usize)) {
                texel::decode_row(self.format, self.texel as usize, &line[..self.row as usize], &mut data);
            }
            let (width, height, layers) = (self.size.width, self.size.height, self.size.depth_or_array_layers);
            Image { width, height, layers, channels: self.channels, data }
        }))
    }
}

/// As [`read_image`], of what the commands before in an encoder leave; nothing is waited for.
///
/// # Errors
/// As [`read_image`].
pub fn read_image_later(
    gpu: &Gpu,
    prepared: &Prepared,
    plan: &Plan,
    id: ResourceId,
    encoder: &mut wgpu::CommandEncoder,
) -> Checked<PendingImage> {
    let name = plan.resources.get(id.0).map_or("?", |r| &r.name);
    let texture = prepared.pool.texture(plan, id)?;
    decoded_later(gpu, (texture, name), 0, 0..texture.depth_or_array_layers(), &prepared.spare, encoder)
}

/// As [`read_plane`], of what the commands before in an encoder leave; nothing is waited for.
///
/// # Errors
/// As [`read_plane`].
pub fn read_plane_later(
    gpu: &Gpu,
    (texture, name): (&wgpu::Texture, &str),
    mip: u32,
    layer: u32,
    encoder: &mut wgpu::CommandEncoder,
) -> Checked<PendingImage> {
    if mip >= texture.mip_level_count()
        || layer >= texture.size().mip_level_size(mip, texture.dimension()).depth_or_array_layers
    {
        return Err(Diagnostic::error(format!("`{name}` has no mip level {mip} with a layer {layer}")).into());
    }
    decoded_later(gpu, (texture, name), mip, layer..layer + 1, &Spare::default(), encoder)
}

fn decoded_later(
    gpu: &Gpu,
    (texture, name): (&wgpu::Texture, &str),
    mip_level: u32,
    layers: Range<u32>,
    spare: &Spare,
    encoder: &mut wgpu::CommandEncoder,
) -> Checked<PendingImage> {
    let (channels, texel) = readable(texture, name)?;
    let level = texture.size().mip_level_size(mip_level, texture.dimension());
    let size = wgpu::Extent3d { depth_or_array_layers: layers.len() as u32, ..level };
    let row = u64::from(size.width) * u64::from(texel);
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT.into());
    let too_large = || Diagnostic::error(format!("a row of `{name}` is too long to be read back"));
    let bytes_per_row = u32::try_from(padded).map_err(|_| too_large())?;
    let bytes = padded * u64::from(size.height) * u64::from(size.depth_or_array_layers);
    let (pending, buffer) = PendingBytes::allocate(gpu, spare, bytes)?;
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(bytes_per_row),
        rows_per_image: Some(size.height),
    };
    let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    let origin = wgpu::Origin3d { z: layers.start, ..wgpu::Origin3d::ZERO };
    let from = wgpu::TexelCopyTextureInfo { mip_level, origin, ..texture.as_image_copy() };
    encoder.copy_texture_to_buffer(from, to, size);
    Ok(PendingImage { pending, size, format: texture.format(), channels, texel, row, padded })
}

/// Words of a buffer on their way from the device.
#[derive(Debug)]
pub struct PendingWords(PendingBytes);

impl PendingWords {
    /// The words, once the device has done the commands that copied them; never waits. They must have been submitted.
    ///
    /// # Errors
    /// The device fails.
    pub fn arrived(&mut self, gpu: &Gpu) -> Checked<Option<Vec<u32>>> {
        Ok(self.0.arrived(gpu)?.map(|parts| bytemuck::pod_collect_to_vec(parts.concat().as_slice())))
    }
}

/// The first words of a buffer, `most` of them at most, as the commands before in an encoder leave them; nothing is
/// waited for. `name` is the buffer's in faults.
///
/// # Errors
/// Its memory can't be copied from.
pub fn read_words_later(
    gpu: &Gpu,
    (buffer, name): (&wgpu::Buffer, &str),
    most: u64,
    encoder: &mut wgpu::CommandEncoder,
) -> Checked<PendingWords> {
    if !buffer.usage().contains(wgpu::BufferUsages::COPY_SRC) {
        return Err(no_output(name));
    }
    let bytes = buffer.size().min(most * 4) / 4 * 4;
    let (pending, to) = PendingBytes::allocate(gpu, &Spare::default(), bytes)?;
    encoder.copy_buffer_to_buffer(buffer, 0, &to, 0, bytes);
    Ok(PendingWords(pending))
}

/// Channels and bytes of a texture's texels, where the host can read them.
fn readable(texture: &wgpu::Texture, name: &str) -> Checked<(u32, u32)> {
    let format = texture.format();
    if texture.sample_count() > 1 {
        let d = Diagnostic::error(format!("`{name}` has several samples a texel, and can't be read back"));
        return Err(d.help("look at what it resolves to").into());
    }
    let (Some(channels), Some(texel)) = (texel::channels(format), texel_bytes(format)) else {
        return Err(Diagnostic::error(format!("`{name}` has the format {format:?}, which can't be read back"))
            .help("copy it to a texture of a plain format in a pass")
            .into());
    };
    if !texture.usage().contains(wgpu::TextureUsages::COPY_SRC) {
        return Err(no_output(name));
    }
    Ok((channels, texel))
}

fn no_output(name: &str) -> Faults {
    let d = Diagnostic::error(format!("`{name}` can't be read back: it is no output of the graph"));
    d.help(format!("add `\"{name}\": \"{name}\"` to the outputs")).into()
}

fn texel_bytes(format: wgpu::TextureFormat) -> Option<u32> {
    format.block_copy_size(Some(wgpu::TextureAspect::All))
}

/// Hands over the texels of some layers in their order, as the device has them: whole rows, one or many at a time.
fn copied(
    gpu: &Gpu,
    texture: &wgpu::Texture,
    (name, texel): (&str, u32),
    mip: u32,
    layers: Range<u32>,
    mut take: impl FnMut(&[u8]),
) -> Checked<()> {
    if !texture.usage().contains(wgpu::TextureUsages::COPY_SRC) {
        return Err(no_output(name));
    }
    if mip >= texture.mip_level_count() {
        let levels = texture.mip_level_count();
        return Err(Diagnostic::error(format!("`{name}` has {levels} mip level(s), and none of index {mip}")).into());
    }
    let size = texture.size().mip_level_size(mip, texture.dimension());
    if layers.end > size.depth_or_array_layers {
        let all = size.depth_or_array_layers;
        let last = layers.end.saturating_sub(1);
        return Err(Diagnostic::error(format!("`{name}` has {all} layer(s), and none of index {last}")).into());
    }
    let row = u64::from(size.width) * u64::from(texel);
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT.into());
    let layer = padded * u64::from(size.height);
    let too_large = || Diagnostic::error(format!("a row of `{name}` is too long to be read back"));
    let bytes_per_row = u32::try_from(padded).map_err(|_| too_large())?;

    let at_once = (MOST_BYTES_AT_ONCE / layer.max(1)).clamp(1, layers.len().max(1) as u64) as u32;
    let staging = staging(gpu, name, layer * u64::from(at_once))?;
    for first in layers.clone().step_by(at_once as usize) {
        let count = at_once.min(layers.end - first);
        scoped(gpu, &format!("read back `{name}`"), || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let from = wgpu::TexelCopyTextureInfo {
                mip_level: mip,
                origin: wgpu::Origin3d { x: 0, y: 0, z: first },
                ..texture.as_image_copy()
            };
            let to = wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(bytes_per_row),
                    rows_per_image: Some(size.height),
                },
            };
            encoder.copy_texture_to_buffer(from, to, wgpu::Extent3d { depth_or_array_layers: count, ..size });
            gpu.queue.submit([encoder.finish()]);
        })?;
        map_after(gpu, &staging, layer * u64::from(count), None, |bytes| match padded == row {
            true => take(bytes),
            false => bytes.chunks_exact(padded as usize).for_each(|line| take(&line[..row as usize])),
        })?;
    }
    Ok(())
}

/// What a resource holds, as the device has it: of a texture the texels of its first mip level, row by row.
///
/// # Errors
/// Its memory can't be copied from, or the device fails.
pub fn read_content(gpu: &Gpu, prepared: &Prepared, plan: &Plan, id: ResourceId) -> Checked<Vec<u8>> {
    let name = plan.resources.get(id.0).map_or("?", |r| &r.name);
    match prepared.pool.memory(plan, id)? {
        Memory::Buffer(buffer) => read_bytes(gpu, buffer, name),
        Memory::Texture(texture) => {
            let unreadable = || Diagnostic::error(format!("`{name}` has texels of several parts"));
            let texel = texel_bytes(texture.format()).ok_or_else(unreadable)?;
            let mut all = vec![];
            let layers = 0..texture.depth_or_array_layers();
            copied(gpu, texture, (name, texel), 0, layers, |texels| all.extend_from_slice(texels))?;
            Ok(all)
        }
    }
}

/// All bytes of a buffer.
///
/// # Errors
/// It is a texture, its memory can't be copied from, or the device fails.
pub fn read_buffer(gpu: &Gpu, prepared: &Prepared, plan: &Plan, id: ResourceId) -> Checked<Vec<u8>> {
    let name = plan.resources.get(id.0).map_or("?", |r| &r.name);
    read_bytes(gpu, prepared.pool.buffer(plan, id)?, name)
}

/// As [`read_buffer`], of a buffer by itself; `name` is its name in faults.
///
/// # Errors
/// Its memory can't be copied from, or the device fails.
pub fn read_bytes(gpu: &Gpu, buffer: &wgpu::Buffer, name: &str) -> Checked<Vec<u8>> {
    if !buffer.usage().contains(wgpu::BufferUsages::COPY_SRC) {
        return Err(no_output(name));
    }
    let staging = staging(gpu, name, buffer.size())?;
    scoped(gpu, &format!("read back `{name}`"), || {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        gpu.queue.submit([encoder.finish()]);
    })?;
    map(gpu, &staging, buffer.size())
}

/// A buffer to copy to and map.
///
/// # Errors
/// No memory is left.
pub(super) fn staging(gpu: &Gpu, name: &str, size: u64) -> Checked<wgpu::Buffer> {
    scoped(gpu, &format!("allocate room to read back `{name}`"), || {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    })
}

/// Waits for the device, then gives the first `size` bytes of a mappable buffer.
///
/// # Errors
/// The device fails.
pub(super) fn map(gpu: &Gpu, buffer: &wgpu::Buffer, size: u64) -> Checked<Vec<u8>> {
    map_after(gpu, buffer, size, None, <[u8]>::to_vec)
}

/// As [`map`], waiting for one submission only, where one is given, and handing the bytes to `read`.
///
/// # Errors
/// The device fails.
pub(super) fn map_after<T>(
    gpu: &Gpu,
    buffer: &wgpu::Buffer,
    size: u64,
    submission: Option<wgpu::SubmissionIndex>,
    read: impl FnOnce(&[u8]) -> T,
) -> Checked<T> {
    let slice = buffer.slice(..size);
    let (send, receive) = std::sync::mpsc::channel();
    scoped(gpu, "map a buffer", || {
        slice.map_async(wgpu::MapMode::Read, move |mapped| {
            // The receiver lives until this function returns; without one, nobody waits for the answer.
            let _ = send.send(mapped);
        });
    })?;
    gpu.wait_for(submission)?;
    let failed = |e: &dyn std::fmt::Display| Diagnostic::error(format!("can't read from the device: {e}"));
    // The work is done; the answer may still be on its way, when another thread polls the same device.
    match receive.recv_timeout(ANSWER) {
        Ok(Ok(())) => {}
        Ok(Err(e)) => return Err(failed(&e).into()),
        Err(e) => return Err(failed(&e).into()),
    }
    let found = read(&slice.get_mapped_range().map_err(|e| failed(&e))?);
    buffer.unmap();
    Ok(found)
}
