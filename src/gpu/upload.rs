//! Uploads host data to textures and buffers that a graph can import.

use super::pool::Memory;
use super::{device::Gpu, pool, scope::scoped};
use crate::diag::{Checked, Diagnostic};
use crate::image::{Image, texel};
use crate::plan::{Desc, TextureDesc};

/// A texture like `desc` that holds an image, for [`crate::session::Session::import`]. Values are linear light, as
/// [`super::read_image`] gives them; the layers of the image are those of the texture, the slices of a 3D texture, or
/// the faces of a cube (+X, −X, +Y, −Y, +Z, −Z). `name` is the input's in faults.
///
/// # Errors
/// The input is a buffer or has mip levels, its format can't be written, the image has another size, other layers or
/// channels, or no memory is left.
pub fn upload_image(gpu: &Gpu, desc: &Desc, name: &str, image: &Image) -> Checked<Memory> {
    image.check(&format!("what is given as `{name}`"))?;
    let t = match desc {
        Desc::Texture(t) if t.mips == 1 => t,
        Desc::Texture(t) => {
            let d = Diagnostic::error(format!("`{name}` has {} mip levels, an image has one", t.mips));
            return Err(d.help("let the graph make the others in passes of its own").into());
        }
        Desc::Buffer { size, .. } => {
            let d = Diagnostic::error(format!("`{name}` is a buffer, not an image"));
            return Err(d.help(format!("give its {size} bytes as they are")).into());
        }
    };
    fits(t, name, image)?;
    let bytes = texel::encode_rows(t.format, &image.data);
    let wanted = Desc::Texture(TextureDesc { usage: t.usage | wgpu::TextureUsages::COPY_DST, ..t.clone() });
    scoped(gpu, &format!("upload `{name}`"), || {
        let memory = pool::blank(gpu, &wanted, name);
        if let Memory::Texture(texture) = &memory {
            write_levels(gpu, texture, &[bytes]);
        }
        memory
    })
}

/// Writes levels of a texture, the largest first: layers one after another, rows from the top, without padding.
pub(super) fn write_levels(gpu: &Gpu, texture: &wgpu::Texture, levels: &[Vec<u8>]) {
    let texel = texture.format().block_copy_size(None).unwrap_or(4);
    for (mip_level, bytes) in (0..).zip(levels) {
        let size = texture.size().mip_level_size(mip_level, texture.dimension());
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(size.width * texel),
            rows_per_image: Some(size.height),
        };
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo { mip_level, ..texture.as_image_copy() },
            bytes,
            layout,
            size,
        );
    }
}

/// A texture that holds the first layer of an image in red, green and blue, for [`super::Display`]. `name` is the
/// image's in faults.
///
/// # Errors
/// The image is too large for the device, or no memory is left.
pub fn upload_shown(gpu: &Gpu, image: &Image, name: &str) -> Checked<wgpu::Texture> {
    let most = gpu.limits.max_texture_dimension_2d;
    if image.width > most || image.height > most {
        let size = format!("{} × {}", image.width, image.height);
        return Err(Diagnostic::error(format!("{name}: {size} pixels are too many for this device")).into());
    }
    let layer = image.width as usize * image.height as usize;
    let texels: Vec<[f32; 4]> = image.rgb().take(layer).map(|[r, g, b]| [r, g, b, 1.0]).collect();
    scoped(gpu, &format!("upload {name}"), || {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shown"),
            size: wgpu::Extent3d { width: image.width, height: image.height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        write_levels(gpu, &texture, &[bytemuck::cast_slice(&texels).to_vec()]);
        texture
    })
}

/// A buffer like `desc` that holds these bytes. `name` is the input's in faults.
///
/// # Errors
/// The input is a texture or has another size, or no memory is left.
pub fn upload_bytes(gpu: &Gpu, desc: &Desc, name: &str, bytes: &[u8]) -> Checked<Memory> {
    let Desc::Buffer { size, usage } = desc else {
        let d = Diagnostic::error(format!("`{name}` is a texture, not a buffer"));
        return Err(d.help("give it an image").into());
    };
    if bytes.len() as u64 != *size {
        let d = Diagnostic::error(format!("`{name}` is a buffer of {size} bytes, but {} are given", bytes.len()));
        return Err(d.help("its size is what the graph's `stride` and `count` say").into());
    }
    let wanted = Desc::Buffer { size: *size, usage: *usage | wgpu::BufferUsages::COPY_DST };
    scoped(gpu, &format!("upload `{name}`"), || {
        let memory = pool::blank(gpu, &wanted, name);
        if let Memory::Buffer(buffer) = &memory {
            gpu.queue.write_buffer(buffer, 0, bytes);
        }
        memory
    })
}

fn fits(t: &TextureDesc, name: &str, image: &Image) -> Checked<()> {
    let Some(channels) = texel::channels(t.format) else {
        let d =
            Diagnostic::error(format!("`{name}` has the format {:?}, which can't be written from outside", t.format));
        return Err(d.help("declare the input with a plain format, such as Rgba32Float").into());
    };
    let wanted = (t.width, t.height, t.layers, channels);
    let given = (image.width, image.height, image.layers, image.channels);
    if wanted == given {
        return Ok(());
    }
    let text = |(width, height, layers, channels): (u32, u32, u32, u32)| {
        let layers = if layers == 1 { String::new() } else { format!(" in {layers} layers") };
        format!("{width} × {height} pixels{layers} of {channels} channel(s)")
    };
    let d = Diagnostic::error(format!("what is given as `{name}` has {}", text(given)));
    Err(d.help(format!("the graph takes {}", text(wanted))).into())
}
