//! Textures on show: copies of what graphs make, and files to hold them against.

use lightgraph::internals::gpu::upload_shown;
use lightgraph::internals::image::exr::read_exr;
use lightgraph::{Checked, Gpu, Image};
use std::path::Path;

/// An image from a file, and its texture.
pub(super) struct ReferenceImage {
    pub image: Image,
    pub texture: wgpu::Texture,
}

/// A copy of the first layer of a texture of colours, in `old` where it fits.
pub(super) fn copy(gpu: &Gpu, from: &wgpu::Texture, old: Option<wgpu::Texture>) -> Option<wgpu::Texture> {
    let sampled = from.format().sample_type(None, Some(gpu.features));
    if !matches!(sampled, Some(wgpu::TextureSampleType::Float { .. })) || from.dimension() != wgpu::TextureDimension::D2
    {
        return None;
    }
    let size = wgpu::Extent3d { depth_or_array_layers: 1, ..from.size() };
    let fits = old.filter(|t| t.size() == size && t.format() == from.format());
    let to = fits.unwrap_or_else(|| texture(gpu, size, from.format()));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), size);
    gpu.queue.submit([encoder.finish()]);
    Some(to)
}

fn texture(gpu: &Gpu, size: wgpu::Extent3d, format: wgpu::TextureFormat) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("seen"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// An EXR file, and its texture.
pub(super) fn reference(gpu: &Gpu, path: &Path) -> Checked<ReferenceImage> {
    let image = read_exr(path)?;
    let texture = upload_shown(gpu, &image, &path.display().to_string())?;
    Ok(ReferenceImage { image, texture })
}
