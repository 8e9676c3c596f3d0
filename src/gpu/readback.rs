//! Copies results of the device back to the host.

use super::{
    buffers::empty,
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
    let (channels, texels) = (channels(texture, name)?, Texels::of(texture, name, mip, layers)?);
    let (width, height, layers) = (texels.size.width, texels.size.height, texels.size.depth_or_array_layers);
    let mut data = Vec::with_capacity(width as usize * height as usize * layers as usize * channels as usize);
    texels.read(gpu, name, |row| texels.decode(row, &mut data))?;
    Ok(Image { width, height, layers, channels, data })
}

/// An image on its way from the device.
#[derive(Debug)]
pub struct PendingImage {
    pending: PendingBytes,
    channels: u32,
    texels: Texels,
}

impl PendingImage {
    /// The image, once the device has done the commands that copied it; never waits. They must have been submitted.
    ///
    /// # Errors
    /// The device fails.
    pub fn arrived(&mut self, gpu: &Gpu) -> Checked<Option<Image>> {
        let PendingImage { pending, channels, texels } = self;
        Ok(pending.arrived(gpu)?.map(|parts| {
            let mut data = vec![];
            parts.iter().for_each(|bytes| texels.rows(bytes, |row| texels.decode(row, &mut data)));
            let (width, height, layers) = (texels.size.width, texels.size.height, texels.size.depth_or_array_layers);
            Image { width, height, layers, channels: *channels, data }
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
    decoded_later(gpu, (texture, name), mip, layer..layer.saturating_add(1), &Spare::default(), encoder)
}

fn decoded_later(
    gpu: &Gpu,
    (texture, name): (&wgpu::Texture, &str),
    mip_level: u32,
    layers: Range<u32>,
    spare: &Spare,
    encoder: &mut wgpu::CommandEncoder,
) -> Checked<PendingImage> {
    let (channels, texels) = (channels(texture, name)?, Texels::of(texture, name, mip_level, layers)?);
    let layers = texels.size.depth_or_array_layers;
    let (pending, buffer) = PendingBytes::allocate(gpu, spare, texels.layer_bytes() * u64::from(layers))?;
    texels.copy(encoder, 0..layers, &buffer);
    Ok(PendingImage { pending, channels, texels })
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

/// Channels of a texture whose texels are numbers.
fn channels(texture: &wgpu::Texture, name: &str) -> Checked<u32> {
    let format = texture.format();
    let unreadable = || Diagnostic::error(format!("`{name}` has the format {format:?}, which can't be read back"));
    let known = texel::channels(format).filter(|_| texel_bytes(format).is_some());
    Ok(known.ok_or_else(|| unreadable().help("copy it to a texture of a plain format in a pass"))?)
}

fn no_output(name: &str) -> Faults {
    let d = Diagnostic::error(format!("`{name}` can't be read back: it is no output of the graph"));
    d.help(format!("add `\"{name}\": \"{name}\"` to the outputs")).into()
}

fn texel_bytes(format: wgpu::TextureFormat) -> Option<u32> {
    format.block_copy_size(Some(wgpu::TextureAspect::All))
}

/// Some layers of a texture's level, as a copy to a buffer lays them out.
#[derive(Debug)]
struct Texels {
    texture: wgpu::Texture,
    mip_level: u32,
    first: u32,
    size: wgpu::Extent3d,
    /// Bytes of a texel, of a row, and from row to row.
    texel: u32,
    row: u64,
    padded: u32,
}

impl Texels {
    fn of(texture: &wgpu::Texture, name: &str, mip_level: u32, layers: Range<u32>) -> Checked<Texels> {
        if texture.sample_count() > 1 {
            let d = Diagnostic::error(format!("`{name}` has several samples a texel, and can't be read back"));
            return Err(d.help("look at what it resolves to").into());
        }
        if !texture.usage().contains(wgpu::TextureUsages::COPY_SRC) {
            return Err(no_output(name));
        }
        let several = || Diagnostic::error(format!("`{name}` has texels of several parts"));
        let texel = texel_bytes(texture.format()).ok_or_else(several)?;
        let levels = texture.mip_level_count();
        if mip_level >= levels {
            let text = format!("`{name}` has {levels} mip level(s), and none of index {mip_level}");
            return Err(Diagnostic::error(text).into());
        }
        let level = texture.size().mip_level_size(mip_level, texture.dimension());
        let all = level.depth_or_array_layers;
        if layers.end > all {
            let last = layers.end.saturating_sub(1);
            return Err(Diagnostic::error(format!("`{name}` has {all} layer(s), and none of index {last}")).into());
        }
        let size = wgpu::Extent3d { depth_or_array_layers: layers.len() as u32, ..level };
        let row = u64::from(size.width) * u64::from(texel);
        let too_large = |_| Diagnostic::error(format!("a row of `{name}` is too long to be read back"));
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT.into()).try_into().map_err(too_large)?;
        Ok(Texels { texture: texture.clone(), mip_level, first: layers.start, size, texel, row, padded })
    }

    fn layer_bytes(&self) -> u64 {
        u64::from(self.padded) * u64::from(self.size.height)
    }

    /// Copies some of the layers to the start of a buffer.
    fn copy(&self, encoder: &mut wgpu::CommandEncoder, some: Range<u32>, buffer: &wgpu::Buffer) {
        let origin = wgpu::Origin3d { z: self.first + some.start, ..wgpu::Origin3d::ZERO };
        let from = wgpu::TexelCopyTextureInfo { mip_level: self.mip_level, origin, ..self.texture.as_image_copy() };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(self.padded),
            rows_per_image: Some(self.size.height),
        };
        let size = wgpu::Extent3d { depth_or_array_layers: some.len() as u32, ..self.size };
        encoder.copy_texture_to_buffer(from, wgpu::TexelCopyBufferInfo { buffer, layout }, size);
    }

    /// Hands over the rows of such a copy: one or many at a time.
    fn rows(&self, bytes: &[u8], mut take: impl FnMut(&[u8])) {
        match u64::from(self.padded) == self.row {
            true => take(bytes),
            false => bytes.chunks_exact(self.padded as usize).for_each(|line| take(&line[..self.row as usize])),
        }
    }

    fn decode(&self, row: &[u8], to: &mut Vec<f32>) {
        texel::decode_row(self.texture.format(), self.texel as usize, row, to);
    }

    /// Hands over all rows, as the device has them now.
    fn read(&self, gpu: &Gpu, name: &str, mut take: impl FnMut(&[u8])) -> Checked<()> {
        let (layer, layers) = (self.layer_bytes(), self.size.depth_or_array_layers);
        let at_once = (MOST_BYTES_AT_ONCE / layer.max(1)).clamp(1, layers.max(1).into()) as u32;
        let staging = staging(gpu, name, layer * u64::from(at_once))?;
        for first in (0..layers).step_by(at_once as usize) {
            let some = first..layers.min(first + at_once);
            let bytes = layer * some.len() as u64;
            scoped(gpu, &format!("read back `{name}`"), || {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                self.copy(&mut encoder, some, &staging);
                gpu.queue.submit([encoder.finish()]);
            })?;
            map_after(gpu, &staging, bytes, None, |bytes| self.rows(bytes, &mut take))?;
        }
        Ok(())
    }
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
            let mut all = vec![];
            let texels = Texels::of(texture, name, 0, 0..texture.depth_or_array_layers())?;
            texels.read(gpu, name, |row| all.extend_from_slice(row))?;
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
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    empty(gpu, &format!("room to read back `{name}`"), size, usage)
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
