//! Images of linear light as textures that the panels can show.

use super::choice::{SplitLayout, ViewChoice};
use super::feed::ViewState;
use lightgraph::Gpu;
use lightgraph::internals::gpu::{Arrangement, Display, DisplayLook};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What panels show have this format: bytes in sRGB, as egui wants them.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// The longer side of a preview, in pixels.
const PREVIEW: u32 = 160;

/// A texture that panels can show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShownTexture {
    pub id: egui::TextureId,
    /// In pixels.
    pub size: [u32; 2],
}

/// Turns linear images into what panels show.
pub struct TexturePainter {
    display: Display,
    main: Option<PaintedTexture>,
    previews: BTreeMap<PathBuf, PaintedTexture>,
    /// What is recorded and not yet handed over.
    recorded: Vec<wgpu::CommandBuffer>,
}

struct PaintedTexture {
    texture: wgpu::Texture,
    shown: ShownTexture,
    /// What it was painted from.
    source: (wgpu::Texture, Option<wgpu::Texture>, u64, DisplayLook),
}

impl TexturePainter {
    pub fn new(gpu: &Gpu) -> TexturePainter {
        let display = Display::new(gpu, FORMAT);
        TexturePainter { display, main: None, previews: BTreeMap::new(), recorded: vec![] }
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
        told: &ViewState,
        choice: &ViewChoice,
    ) -> Option<ShownTexture> {
        let first = told.image.as_ref()?;
        let arrangement = match (choice.compare.layout, &told.other) {
            (_, None) => Arrangement::First,
            (SplitLayout::Split(at), _) => Arrangement::Split(at),
            (SplitLayout::Difference(full), _) => Arrangement::Difference(full),
            (SplitLayout::Other, _) => Arrangement::Second,
        };
        let look = DisplayLook { arrangement, ..plain(choice, told) };
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
        told: &ViewState,
        choice: &ViewChoice,
    ) -> BTreeMap<PathBuf, ShownTexture> {
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
        old: Option<&PaintedTexture>,
        size: [u32; 2],
        source: (wgpu::Texture, Option<wgpu::Texture>, u64, DisplayLook),
    ) -> PaintedTexture {
        if let Some(old) = old
            && old.source == source
            && old.shown.size == size
        {
            return PaintedTexture { texture: old.texture.clone(), shown: old.shown, source };
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
                (texture, ShownTexture { id, size })
            }
        };
        let images = [&source.0, source.1.as_ref().unwrap_or(&source.0)];
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.display.draw(gpu, &mut encoder, images, source.3, &texture.create_view(&Default::default()));
        self.recorded.push(encoder.finish());
        PaintedTexture { texture, shown, source }
    }
}

fn plain(choice: &ViewChoice, told: &ViewState) -> DisplayLook {
    DisplayLook { stops: choice.stops(told.automatic), tone_map: choice.tone_map, arrangement: Arrangement::First }
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
