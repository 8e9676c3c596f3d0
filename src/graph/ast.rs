//! What a graph file says, each part with its place. Names are not yet resolved; [`super::check`] does that.

use super::expr::Expr;
pub use super::raster::Cull;
pub use super::walk::{groups, inherit_groups, rescope, told_groups, walk, walk_mut};
use crate::diag::{Source, Span};
use crate::image::texture::Texture;
use crate::value::{Type, Value};
use std::{collections::BTreeMap, path::PathBuf, sync::Arc};

/// The name of a set, of a name that may be one of its members: `chain` of `chain[2]`.
pub fn set_of(name: &str) -> &str {
    name.split('[').next().unwrap_or(name)
}

/// A value and its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Spanned<T> {
    pub value: T,
    pub span: Span,
}

/// A name and its place.
pub type Name = Spanned<String>;

/// A graph file, variants applied.
#[derive(Debug, Clone, PartialEq)]
pub struct Graph {
    pub source: Arc<Source>,
    /// Files it was made from: itself first, then its bases.
    pub files: Vec<PathBuf>,
    /// Files of its images.
    pub images: Vec<PathBuf>,
    pub about: String,
    /// What the graph takes from the graph that uses it. By itself it has each as a resource or a parameter: blank,
    /// unless told otherwise.
    pub inputs: Vec<(Name, Input)>,
    pub params: Vec<(Name, Param)>,
    pub lets: Vec<(Name, Expr)>,
    pub defines: Vec<(Name, Expr)>,
    pub resources: Vec<(Name, ResourceDecl)>,
    pub passes: Vec<Pass>,
    /// Output name, resource name.
    pub outputs: Vec<(Name, Name)>,
    /// What the graph can't do, by a name for variants.
    pub warnings: Vec<(Name, Warning)>,
}

/// What a sub-graph takes: a resource, or a value.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    Resource(ResourceDecl),
    Value(Param),
}

/// `Warning(when: "metallic_materials > 0", about: "metals look matte")`: what users are told of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Warning {
    pub when: Expr,
    pub about: String,
}

/// A parameter that users set.
#[derive(Debug, Clone, PartialEq)]
pub struct Param {
    pub ty: Type,
    pub default: Value,
    pub min: Option<Value>,
    pub max: Option<Value>,
    pub about: String,
    pub span: Span,
}

/// A texture, buffer or sampler, or a set of them.
#[derive(Debug, Clone, PartialEq)]
pub struct ResourceDecl {
    pub span: Span,
    pub kind: ResourceKind,
    /// Keeps its content to the next frame.
    pub history: bool,
    /// Content before anything is written.
    pub initial: Option<[f64; 4]>,
    /// What its numbers should lie between; checks of numbers hold it to them.
    pub min: Option<f64>,
    pub max: Option<f64>,
    /// How many equal ones the set has; `None`: a single one.
    pub members: Option<Expr>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum ResourceKind {
    Texture {
        format: wgpu_types::TextureFormat,
        size: Size,
        layers: Option<Expr>,
        mips: Option<Expr>,
        /// Of each texel, for passes that draw to it.
        samples: Option<Expr>,
    },
    Texture3d {
        format: wgpu_types::TextureFormat,
        size: Size,
        mips: Option<Expr>,
    },
    Cube {
        format: wgpu_types::TextureFormat,
        size: Size,
        count: Option<Expr>,
        mips: Option<Expr>,
    },
    Atlas {
        format: wgpu_types::TextureFormat,
        tile: Expr,
        count: Expr,
    },
    Buffer {
        stride: Stride,
        count: Expr,
    },
    /// What files hold; no pass writes it.
    Image(Arc<Texture>),
    /// Columns of a table of the scene, as texels; no pass writes it.
    Table {
        of: Name,
        columns: Vec<Name>,
    },
    Sampler(SamplerDesc),
}

/// How a shader samples a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SamplerDesc {
    pub filter: wgpu_types::FilterMode,
    pub address: wgpu_types::AddressMode,
    pub compare: Option<wgpu_types::CompareFunction>,
}

/// Bytes from element to element of a buffer.
#[derive(Debug, Clone, PartialEq)]
pub enum Stride {
    Bytes(Expr),
    /// Those of a type: a plain one, or a struct of the shaders that bind the buffer.
    Of(Name),
    /// An input's, which is as the graph around has it.
    Any,
}

/// An extent: one expression (a vector, a scalar, or the name of a resource), or one for each axis.
#[derive(Debug, Clone, PartialEq)]
pub enum Size {
    One(Expr),
    Axes(Vec<Expr>, Span),
}

/// One pass of the graph.
#[derive(Debug, Clone, PartialEq)]
pub struct Pass {
    pub name: Name,
    pub span: Span,
    pub when: Option<Expr>,
    /// A heading under which reports sum passes up. After [`inherit_groups`]: also that of the pass around.
    pub group: Option<Name>,
    pub each: Option<Expr>,
    /// The instances that run again when nothing but certain inputs changed.
    pub only: Option<Dirty>,
    pub defines: Vec<(Name, Expr)>,
    /// The entry points of its shader that it runs, where the text has several of a stage.
    pub entry: Vec<Name>,
    /// Shader variable, resource.
    pub bind: Vec<(Name, Name)>,
    /// By shader variable or output: the level of the texture that is bound to it. Without one all levels are read, the
    /// first is written.
    pub mips: Vec<(Name, Expr)>,
    /// Values of its shader's uniforms by name, before all others of that name.
    pub set: Vec<(Name, Expr)>,
    /// What its shader's names mean; `None`: themselves.
    pub scope: Option<Arc<NameScope>>,
    /// The indices of the repetitions that it comes from, by their names.
    pub indices: Vec<(String, u32)>,
    pub kind: PassKind,
}

/// What the names of a sub-graph are in the graph that it is part of.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NameScope {
    /// Of names that nobody has.
    pub prefix: String,
    pub names: BTreeMap<String, String>,
    /// Names that its shaders find in the graphs around, where it has none of its own.
    pub around: BTreeMap<String, String>,
}

impl NameScope {
    /// The name in the whole graph. What scenes and frames provide has the same name everywhere.
    pub fn resolve(&self, name: &str) -> String {
        match self.names.get(name).or_else(|| self.around.get(name)) {
            Some(whole) => whole.clone(),
            None if super::check::is_provided(name) => name.to_string(),
            None => format!("{}{name}", self.prefix),
        }
    }
}

impl Pass {
    /// The names of the entry points that it asks for.
    pub fn entries(&self) -> Vec<String> {
        self.entry.iter().map(|name| name.value.clone()).collect()
    }

    /// The level of a texture that a variable or output of its shader is bound to.
    pub fn mip(&self, variable: &str) -> Option<&Expr> {
        self.mips.iter().find(|(name, _)| name.value == variable).map(|(_, level)| level)
    }

    /// What a variable of its shader is bound to, and the binding that says so.
    pub fn target(&self, variable: &str) -> (String, Option<&Name>) {
        match self.bind.iter().find(|(from, _)| from.value == variable) {
            Some((_, to)) => (to.value.clone(), Some(to)),
            None => (self.scope.as_ref().map_or_else(|| variable.to_string(), |s| s.resolve(variable)), None),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum PassKind {
    Draw(Raster),
    Screen(Raster),
    Compute {
        shader: Name,
        /// `None`: over the one thing that the shader writes.
        over: Option<Size>,
        /// A buffer of three counts of workgroups, which earlier passes write; `over` is the most.
        indirect: Option<Name>,
    },
    Reduce {
        shader: Name,
        from: Name,
        to: Name,
        factor: Vec<Expr>,
        until: Expr,
    },
    /// Sums of all elements before each, or, if inclusive, up to it.
    Scan {
        from: Name,
        to: Name,
        inclusive: bool,
    },
    Copy {
        from: Name,
        to: Name,
    },
    Clear {
        target: Name,
        value: [f64; 4],
    },
    /// Every level of a texture but the first, each from the one above: [`super::unroll`] makes the passes.
    Mips {
        of: Name,
    },
    Loop {
        count: Expr,
        until: Option<Expr>,
        passes: Vec<Pass>,
    },
    /// Passes that stand there `count` times, each time with another index.
    For {
        count: Expr,
        passes: Vec<Pass>,
    },
    /// Alternatives that leave the same results; one of them runs.
    Fastest {
        of: Vec<Vec<Pass>>,
        /// Measured once on an adapter for what its passes define, whatever the scene, and for sizes of the same order.
        once: bool,
    },
}

/// `Dirty(bits: "b", of: ["r"])`: a pass whose other inputs are unchanged runs only the instances whose bit is set.
#[derive(Debug, Clone, PartialEq)]
pub struct Dirty {
    /// A buffer of one bit an instance, which an earlier pass writes.
    pub bits: Name,
    /// Resources and scene tables whose changes the bits account for.
    pub of: Vec<Name>,
}

/// What draw and screen passes share.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    pub shader: Name,
    /// The target of a fragment that returns a bare value.
    pub color: Option<Name>,
    pub depth: Option<Name>,
    pub depth_compare: wgpu_types::CompareFunction,
    pub depth_write: bool,
    /// What is drawn instead of the scene.
    pub vertices: Option<Vertices>,
    /// What each member sees: a buffer of matrices, or a table of the scene that has them.
    pub frusta: Option<Name>,
    /// Leaves out what can hide nothing of the scene from the eyes of the frusta.
    pub occluders: bool,
    pub cull: Cull,
    /// Of the scene those of these materials alone: a condition of the columns of their table.
    pub materials: Option<Expr>,
    /// Of the scene what belongs to nodes of these names, and what lies below them.
    pub nodes: Vec<Name>,
    /// How far simplified surfaces may lie off, metres; 0 or `None`: none is simplified.
    pub tolerance: Option<Expr>,
    /// Targets whose content is kept.
    pub load: Vec<Name>,
    pub clear: Vec<(Name, [f64; 4])>,
    /// Targets of several samples a texel, each with the target that takes their mean.
    pub resolve: Vec<(Name, Name)>,
    /// How a target takes what is drawn, where it doesn't replace what is there.
    pub blend: Vec<(Name, wgpu_types::BlendState)>,
    pub layer: Option<Expr>,
    /// Layers that each member draws to at once, through a view each.
    pub views: Option<Expr>,
}

impl Raster {
    /// One triangle over the targets of a shader, which are overwritten.
    pub fn over(shader: Name) -> Raster {
        Raster {
            shader,
            color: None,
            depth: None,
            depth_compare: wgpu_types::CompareFunction::Less,
            depth_write: true,
            vertices: None,
            frusta: None,
            occluders: false,
            cull: Cull::None,
            materials: None,
            nodes: vec![],
            tolerance: None,
            load: vec![],
            clear: vec![],
            resolve: vec![],
            blend: vec![],
            layer: None,
            views: None,
        }
    }
}

/// Vertices that a vertex entry makes up from their numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Vertices {
    /// Of one instance.
    pub count: Expr,
    /// `None`: one.
    pub instances: Option<Expr>,
    pub topology: wgpu_types::PrimitiveTopology,
    /// A buffer of what is drawn, which earlier passes write: vertices, instances, the first of each.
    pub indirect: Option<Name>,
}

impl Vertices {
    /// The expressions in it.
    pub fn exprs(&self) -> impl Iterator<Item = &Expr> {
        std::iter::once(&self.count).chain(&self.instances)
    }
}

impl PassKind {
    /// The word the graph file uses.
    pub fn word(&self) -> &'static str {
        match self {
            PassKind::Draw(_) => "Draw",
            PassKind::Screen(_) => "Screen",
            PassKind::Compute { .. } => "Compute",
            PassKind::Reduce { .. } => "Reduce",
            PassKind::Scan { .. } => "Scan",
            PassKind::Copy { .. } => "Copy",
            PassKind::Clear { .. } => "Clear",
            PassKind::Mips { .. } => "Mips",
            PassKind::Loop { .. } => "Loop",
            PassKind::For { .. } => "For",
            PassKind::Fastest { .. } => "Fastest",
        }
    }

    /// The shader it runs.
    pub fn shader(&self) -> Option<&Name> {
        match self {
            PassKind::Draw(r) | PassKind::Screen(r) => Some(&r.shader),
            PassKind::Compute { shader, .. } | PassKind::Reduce { shader, .. } => Some(shader),
            PassKind::Scan { .. }
            | PassKind::Copy { .. }
            | PassKind::Clear { .. }
            | PassKind::Mips { .. }
            | PassKind::Loop { .. }
            | PassKind::For { .. }
            | PassKind::Fastest { .. } => None,
        }
    }

    /// Whether it stands for alternatives of one pass of this name, which differ in definitions alone.
    pub fn is_tuned(&self, name: &Name) -> bool {
        let first = self.bodies().first().and_then(|body| body.first());
        matches!(self, PassKind::Fastest { .. }) && first.is_some_and(|pass| pass.name == *name)
    }

    /// The buffer from which the device takes how much it does.
    pub fn indirect(&self) -> Option<&Name> {
        match self {
            PassKind::Draw(r) => r.vertices.as_ref()?.indirect.as_ref(),
            PassKind::Compute { indirect, .. } => indirect.as_ref(),
            _ => None,
        }
    }

    /// The lists of passes in it: of a loop its body, of alternatives each.
    pub fn bodies(&self) -> &[Vec<Pass>] {
        match self {
            PassKind::Loop { passes, .. } | PassKind::For { passes, .. } => std::slice::from_ref(passes),
            PassKind::Fastest { of, .. } => of,
            _ => &[],
        }
    }

    /// As [`PassKind::bodies`], for edits.
    pub fn bodies_mut(&mut self) -> &mut [Vec<Pass>] {
        match self {
            PassKind::Loop { passes, .. } | PassKind::For { passes, .. } => std::slice::from_mut(passes),
            PassKind::Fastest { of, .. } => of,
            _ => &mut [],
        }
    }
}

impl ResourceDecl {
    /// Whether it holds something before any pass of a frame writes it.
    pub fn is_given(&self) -> bool {
        self.history || self.initial.is_some() || matches!(self.kind, ResourceKind::Image(_))
    }

    /// The expressions in it: of its extent, which may name other resources, and of its counts.
    pub fn exprs(&self) -> (Vec<&Expr>, Vec<&Expr>) {
        let mut sizes: Vec<&Expr> = vec![];
        let mut counts: Vec<&Expr> = self.members.iter().collect();
        match &self.kind {
            ResourceKind::Texture { size, layers, mips, samples, .. } => {
                sizes.extend(size.exprs());
                counts.extend(layers.iter().chain(mips).chain(samples));
            }
            ResourceKind::Cube { size, count, mips, .. } => {
                sizes.extend(size.exprs());
                counts.extend(count.iter().chain(mips));
            }
            ResourceKind::Texture3d { size, mips, .. } => {
                sizes.extend(size.exprs());
                counts.extend(mips.iter());
            }
            ResourceKind::Atlas { tile, count, .. } => counts.extend([tile, count]),
            ResourceKind::Buffer { stride, count } => {
                sizes.push(count);
                counts.extend(stride.expr());
            }
            ResourceKind::Image(_) | ResourceKind::Table { .. } | ResourceKind::Sampler(_) => {}
        }
        (sizes, counts)
    }
}

impl Stride {
    /// The number of bytes, where the graph says one.
    pub fn expr(&self) -> Option<&Expr> {
        match self {
            Stride::Bytes(e) => Some(e),
            Stride::Of(_) | Stride::Any => None,
        }
    }
}

impl Size {
    /// The expressions in it.
    pub fn exprs(&self) -> &[Expr] {
        match self {
            Size::One(e) => std::slice::from_ref(e),
            Size::Axes(v, _) => v,
        }
    }

    /// As [`Size::exprs`], for edits.
    pub fn exprs_mut(&mut self) -> &mut [Expr] {
        match self {
            Size::One(e) => std::slice::from_mut(e),
            Size::Axes(v, _) => v,
        }
    }
}
