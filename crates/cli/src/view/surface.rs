//! The window's surface: what panels painted, on the screen.

use lightgraph::internals::gpu;
use lightgraph::internals::image::png::{ToneMap, write_png};
use lightgraph::internals::image::srgb;
use lightgraph::{Checked, Diagnostic, Faults, Gpu, Image};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use winit::window::Window;

/// A window's surface on a device, and the painter of its panels.
pub struct Screen {
    gpu: Arc<Gpu>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    /// The surface must be set up before the next image.
    stale: bool,
    pub renderer: egui_wgpu::Renderer,
}

/// What is to be painted.
pub struct Paint<'a> {
    pub context: &'a egui::Context,
    pub output: egui::FullOutput,
    /// What comes before the panels.
    pub before: Vec<wgpu::CommandBuffer>,
    /// Where to write what the window shows.
    pub shot: Option<&'a Path>,
}

/// The size of a window that its display shows all of, with room for a title and a bar.
pub fn fitting(wanted: [u32; 2], display: Option<[u32; 2]>) -> [u32; 2] {
    match display {
        Some([width, height]) if width > 0 && height > 0 => {
            [wanted[0].min(width), wanted[1].min((height - height / 10).max(1))]
        }
        _ => wanted,
    }
}

impl Screen {
    /// # Errors
    /// The device can't draw to the window.
    pub fn new(gpu: Arc<Gpu>, surface: wgpu::Surface<'static>, window: &Window) -> Checked<Screen> {
        let capabilities = surface.get_capabilities(&gpu.adapter);
        // Panels blend in sRGB: the surface must take bytes as they are.
        let plain =
            |f: &&wgpu::TextureFormat| matches!(f, wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Rgba8Unorm);
        let format = capabilities.formats.iter().find(plain).or(capabilities.formats.first());
        let format =
            *format.ok_or_else(|| Diagnostic::error(format!("`{}` can't draw to the window", gpu.info.name)))?;
        let size = window.inner_size();
        let config = surface.get_default_config(&gpu.adapter, size.width.max(1), size.height.max(1));
        let config =
            config.ok_or_else(|| Diagnostic::error(format!("`{}` can't draw to the window", gpu.info.name)))?;
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | (capabilities.usages & wgpu::TextureUsages::COPY_SRC);
        // One image waits at most: what is seen is what was done last.
        let config = wgpu::SurfaceConfiguration { format, usage, desired_maximum_frame_latency: 1, ..config };
        let renderer = egui_wgpu::Renderer::new(&gpu.device, format, egui_wgpu::RendererOptions::default());
        Ok(Screen { gpu, surface, config, stale: true, renderer })
    }

    pub fn resize(&mut self, width: u32, height: u32) {
        let most = self.gpu.limits.max_texture_dimension_2d;
        let (width, height) = (width.clamp(1, most), height.clamp(1, most));
        if (self.config.width, self.config.height) != (width, height) {
            (self.config.width, self.config.height) = (width, height);
            self.stale = true;
        }
    }

    pub fn size(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// Paints what the panels made. False when the surface gave no image this time; then paint again.
    ///
    /// # Errors
    /// The picture of the window can't be written.
    pub fn paint(&mut self, paint: Paint) -> Checked<bool> {
        let Paint { context, mut output, mut before, shot } = paint;
        let gpu = self.gpu.clone();
        let (device, queue) = (&gpu.device, &gpu.queue);
        for (id, deltas) in output.textures_delta.set.drain() {
            for delta in deltas {
                self.renderer.update_texture(device, queue, id, &delta);
            }
        }
        let shown = self.present(context, output.shapes, output.pixels_per_point, &mut before, shot);
        if !before.is_empty() {
            queue.submit(before);
        }
        for id in output.textures_delta.free.drain() {
            self.renderer.free_texture(&id);
        }
        shown
    }

    fn present(
        &mut self,
        context: &egui::Context,
        shapes: Vec<egui::epaint::ClippedShape>,
        pixels_per_point: f32,
        before: &mut Vec<wgpu::CommandBuffer>,
        shot: Option<&Path>,
    ) -> Checked<bool> {
        if self.stale && !self.configure() {
            return Ok(false);
        }
        let gpu = self.gpu.clone();
        let image = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(image) => image,
            wgpu::CurrentSurfaceTexture::Suboptimal(image) => {
                self.stale = true;
                image
            }
            wgpu::CurrentSurfaceTexture::Outdated
            | wgpu::CurrentSurfaceTexture::Lost
            | wgpu::CurrentSurfaceTexture::Validation => {
                self.stale = true;
                return Ok(false);
            }
            wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Occluded => return Ok(false),
        };
        let view = image.texture.create_view(&Default::default());
        let jobs = context.tessellate(shapes, pixels_per_point);
        let descriptor = egui_wgpu::ScreenDescriptor { size_in_pixels: self.size(), pixels_per_point };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut buffers = std::mem::take(before);
        buffers.extend(self.renderer.update_buffers(&gpu.device, &gpu.queue, &mut encoder, &jobs, &descriptor));
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        self.renderer.render(&mut pass.forget_lifetime(), &jobs, &descriptor);
        buffers.push(encoder.finish());
        gpu.queue.submit(buffers);
        let written = shot.map_or(Ok(()), |path| self.write(&image.texture, path));
        gpu.queue.present(image);
        written.map(|()| true)
    }

    /// Sets the surface up for its size. The engine may be submitting at the same moment, which some drivers refuse:
    /// then the next image tries again.
    fn configure(&mut self) -> bool {
        let scope = self.gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        self.surface.configure(&self.gpu.device, &self.config);
        self.stale = pollster::block_on(scope.pop()).is_some();
        !self.stale
    }

    fn write(&self, texture: &wgpu::Texture, path: &Path) -> Checked<()> {
        let mut image = gpu::read_plane(&self.gpu, texture, "window", 0, 0).map_err(|f| {
            let mut faults = vec![Diagnostic::error("this surface does not give its picture back")];
            faults.extend(f.0);
            Faults(faults)
        })?;
        // The surface holds sRGB already, and the file wants light.
        image.data.iter_mut().for_each(|v| *v = srgb::decode(*v));
        let image = Image::new(image.width, image.height, image.channels, image.data)?;
        write_png(path, &image, ToneMap::None, 0.0, &BTreeMap::new())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_no_larger_than_its_display() {
        assert_eq!(fitting([1600, 900], Some([1280, 800])), [1280, 720]);
        assert_eq!(fitting([640, 480], Some([1280, 800])), [640, 480]);
        assert_eq!(fitting([640, 480], None), [640, 480]);
    }
}
