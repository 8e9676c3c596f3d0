//! What a shader asks of the world: its variables by name, its entry points, what each entry reads and writes.

use super::layout::Layout;
use std::{collections::BTreeMap, sync::Arc};

/// The reflected surface of one composed shader.
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// Resource variables that at least one entry point uses, in the order of their names.
    /// A variable's index here is its `@binding` in `@group(0)`.
    pub variables: Vec<Variable>,
    /// Entry points in the order of the text.
    pub entries: Vec<EntryPoint>,
}

impl Interface {
    /// The entry of a stage; `None` when there is none.
    pub fn entry(&self, stage: Stage) -> Option<&EntryPoint> {
        self.entries.iter().find(|e| e.stage == stage)
    }
}

/// A module-scope variable bound from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// The name in the text, without naga_oil's decoration.
    pub name: String,
    pub kind: BindingKind,
}

/// What may be bound to a variable.
#[derive(Debug, Clone, PartialEq)]
pub enum BindingKind {
    /// `var<uniform>`: a struct of named values, or one value of the variable's own name.
    Uniform(Arc<Layout>),
    /// `var<uniform>` of an array: a buffer or table, read through the smaller but often quicker way of uniforms.
    /// `size` is that of all elements in bytes. `of` as of storage.
    UniformArray { element: Layout, stride: u32, size: u32, of: ElementType },
    /// `var<storage>`: for `array<T>` (sized or not) `element` is `T`'s layout, otherwise the whole type's.
    /// `fixed_size` is the byte size when the type is not a runtime-sized array. `of` says what an array is of,
    /// or what struct the whole is.
    Storage { element: Layout, stride: u32, fixed_size: Option<u32>, writable: bool, of: Option<ElementType> },
    /// `texture_…<f32>` and the like.
    Texture { dim: TextureDim, sample: TextureSample, multisampled: bool },
    /// `texture_storage_…`.
    StorageTexture { dim: TextureDim, format: wgpu_types::TextureFormat, access: wgpu_types::StorageTextureAccess },
    /// `sampler` or `sampler_comparison`.
    Sampler { comparison: bool },
}

impl BindingKind {
    /// The bytes from element to element of a buffer, and what these are.
    pub fn elements(&self) -> Option<(u32, &ElementType)> {
        match self {
            BindingKind::UniformArray { stride, of, .. } | BindingKind::Storage { stride, of: Some(of), .. } => {
                Some((*stride, of))
            }
            _ => None,
        }
    }
}

/// What the elements of a buffer are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ElementType {
    /// A struct, by its name in the text.
    Struct(String),
    Plain,
}

/// The dimension of a texture variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum TextureDim {
    D1,
    D2,
    D2Array,
    Cube,
    CubeArray,
    D3,
}

/// What a load from a sampled texture gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TextureSample {
    /// `filtered` is true when a sampler is used with it (`textureSample` and kin with a non-comparison sampler).
    Float {
        filtered: bool,
    },
    Depth,
    Uint,
    Sint,
}

/// A shader stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    Vertex,
    Fragment,
    Compute,
}

/// One entry point.
#[derive(Debug, Clone, PartialEq)]
pub struct EntryPoint {
    /// The name to hand to the pipeline.
    pub name: String,
    pub stage: Stage,
    /// Compute only; `[1, 1, 1]` otherwise.
    pub workgroup_size: [u32; 3],
    /// Vertex attributes, by name; vertex only.
    pub inputs: Vec<VertexInput>,
    /// Colour outputs; fragment only.
    pub outputs: Vec<Output>,
    /// The fragment stage writes `@builtin(frag_depth)`.
    pub writes_depth: bool,
    /// What this entry, callees included, does with each variable (by its index in [`Interface::variables`]).
    pub uses: BTreeMap<usize, Access>,
}

/// A vertex attribute.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VertexInput {
    pub name: String,
    pub location: u32,
    pub format: wgpu_types::VertexFormat,
}

/// A colour output of a fragment shader.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    /// The member's name; `None` for a bare `-> @location(0) vec4f`.
    pub name: Option<String>,
    pub location: u32,
    pub kind: OutputKind,
    /// 1 to 4.
    pub components: u8,
}

/// The scalar kind of a colour output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputKind {
    Float,
    Uint,
    Sint,
}

/// How a variable is used. All false: only its size is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Access {
    pub read: bool,
    pub write: bool,
}
