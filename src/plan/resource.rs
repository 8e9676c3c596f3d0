//! What a plan's memory holds: textures and buffers by what they are, and the slots that they share.

use crate::graph::ast;
use crate::image::texture::Texture;
use std::sync::Arc;

/// A texture or buffer of the plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Resource {
    /// The graph's name; `name[i]` for a member of a set, `pass.i` for a reduction's intermediate.
    pub name: String,
    pub desc: Desc,
    /// Where it lives. Valid for every resource.
    pub slot: usize,
    /// First and last place in the order (whole loops count as one range) at which it holds something needed.
    pub alive: (usize, usize),
    /// Keeps its content from frame to frame.
    pub history: bool,
    /// Content before anything is written; `Some` also clears it on allocation.
    pub initial: Option<[f64; 4]>,
    /// What files hold; no step writes it.
    pub image: Option<Arc<Texture>>,
    /// Holds dirty bits: what they say is for one frame.
    pub bits: bool,
    /// What the graph says that its numbers lie between.
    pub min: Option<f64>,
    pub max: Option<f64>,
}

impl Resource {
    /// One that the plan makes up.
    pub fn new(name: String, desc: Desc) -> Resource {
        Resource {
            name,
            desc,
            slot: 0,
            alive: (0, 0),
            history: false,
            initial: None,
            image: None,
            bits: false,
            min: None,
            max: None,
        }
    }

    /// One of the graph.
    pub(super) fn declared(name: String, desc: Desc, by: &ast::Resource) -> Resource {
        let image = match &by.kind {
            ast::ResourceKind::Image(image) => Some(image.clone()),
            _ => None,
        };
        // History begins with zeros where nothing is said.
        let initial = if by.history { Some(by.initial.unwrap_or([0.0; 4])) } else { by.initial };
        Resource { history: by.history, initial, image, min: by.min, max: by.max, ..Resource::new(name, desc) }
    }
}

/// Memory for one or more resources of the same [`Desc`] (usages united).
#[derive(Debug, Clone, PartialEq)]
pub struct Slot {
    pub desc: Desc,
    pub bytes: u64,
}

/// What to allocate.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Desc {
    Texture(TextureDesc),
    /// Size in bytes, a multiple of 4.
    Buffer {
        size: u64,
        usage: wgpu_types::BufferUsages,
    },
}

/// A texture to allocate.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct TextureDesc {
    pub kind: TextureKind,
    pub format: wgpu_types::TextureFormat,
    pub width: u32,
    pub height: u32,
    /// Depth of a 3D texture, layers of any other (a cube has 6 for each).
    pub layers: u32,
    pub mips: u32,
    /// Of each texel. More than one: a target of passes that draw, and nothing else.
    pub samples: u32,
    pub usage: wgpu_types::TextureUsages,
    /// An atlas: square tiles in rows, each the view of one member.
    pub tiles: Option<Tiles>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TextureKind {
    /// 2D; an array when the graph gave it layers.
    D2 {
        array: bool,
    },
    /// A cube, or an array of cubes.
    Cube {
        array: bool,
    },
    D3,
}

/// The tiling of an atlas. Tile `i` has its corner at `(i % columns, i / columns) · edge`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Tiles {
    pub edge: u32,
    pub columns: u32,
    pub count: u32,
}

impl Desc {
    /// Bytes of memory, without the driver's padding.
    pub fn bytes(&self) -> u64 {
        match self {
            Desc::Buffer { size, .. } => *size,
            Desc::Texture(t) => {
                let texel = u64::from(t.format.block_copy_size(None).unwrap_or(4)).saturating_mul(t.samples.into());
                let level = |m: u32| {
                    let side = |n: u32| u64::from((n >> m).max(1));
                    let layers = if t.kind == TextureKind::D3 { side(t.layers) } else { u64::from(t.layers) };
                    side(t.width).saturating_mul(side(t.height)).saturating_mul(layers).saturating_mul(texel)
                };
                (0..t.mips.min(32)).map(level).fold(0, u64::saturating_add)
            }
        }
    }

    /// Whether its numbers can be looked at: samples are seen by what they resolve to.
    pub fn is_readable(&self) -> bool {
        !matches!(self, Desc::Texture(t) if t.samples > 1)
    }

    /// The same without usages: what must agree for memory to be shared.
    pub fn shape(&self) -> Desc {
        match self {
            Desc::Buffer { size, .. } => Desc::Buffer { size: *size, usage: wgpu_types::BufferUsages::empty() },
            Desc::Texture(t) => {
                Desc::Texture(TextureDesc { usage: wgpu_types::TextureUsages::empty(), tiles: None, ..t.clone() })
            }
        }
    }
}

impl TextureDesc {
    /// Its extent at a level; layers are halved of 3D textures only.
    pub fn level(&self, mip: u32) -> [u32; 3] {
        let side = |n: u32| (n >> mip.min(31)).max(1);
        let layers = if self.kind == TextureKind::D3 { side(self.layers) } else { self.layers };
        [side(self.width), side(self.height), layers]
    }
}

/// The usage by which a texture is cleared: as a target where its format can be one, else by a copy.
pub fn clear_usage(t: &TextureDesc) -> wgpu_types::TextureUsages {
    let able = t.format.guaranteed_format_features(wgpu_types::Features::empty()).allowed_usages;
    if t.kind != TextureKind::D3 && able.contains(wgpu_types::TextureUsages::RENDER_ATTACHMENT) {
        wgpu_types::TextureUsages::RENDER_ATTACHMENT
    } else {
        wgpu_types::TextureUsages::COPY_DST
    }
}
