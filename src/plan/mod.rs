//! The plan: ordered steps over concrete resources, as plain data. No device.
//!
//! Everything is decided here: sizes, order, what is left out and why, which resources share memory, what each
//! variable is bound to. The executor only walks it.

mod bind;
pub mod build;
pub mod change;
pub mod cull;
mod dispatch;
pub mod draw;
pub mod expand;
pub mod fastest;
pub mod inputs;
pub mod keys;
pub mod live;
pub mod memory;
pub mod order;
mod partial;
pub mod request;
mod shaders;
pub mod sizes;
mod sums;
pub mod tables;
mod targets;
#[cfg(test)]
mod tests;
pub mod text;
pub mod wire;

pub use memory::{Desc, Resource, Slot, TextureDesc, TextureKind, Tiles, clear_usage};
pub use partial::Frames;

pub use crate::graph::ast::{Cull, SamplerDesc};

use crate::shader::{Layout, Shader};
use crate::value::{Value, Values};
use std::sync::Arc;

/// Index into [`Plan::resources`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ResourceId(pub usize);

/// Index into [`Plan::steps`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StepId(pub usize);

/// A graph made concrete for one set of parameters, facts, sizes and outputs.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Path of the graph, as shown.
    pub graph: String,
    /// Names of the parameters, in the graph's order.
    pub params: Vec<String>,
    /// Parameters, derived values and facts: all that is known before a frame.
    pub values: Values,
    pub resources: Vec<Resource>,
    /// Memory that resources share; each resource names its slot.
    pub slots: Vec<Slot>,
    pub shaders: Vec<Arc<Shader>>,
    /// Scene tables that shaders read, each in the byte layout one shader expects.
    pub tables: Vec<TableUse>,
    /// Simplified triangles that draws ask for, in the order in which their clusters stand in the table.
    pub levels: Vec<LevelUse>,
    pub steps: Vec<Step>,
    /// The order of execution.
    pub order: Vec<OrderNode>,
    /// Passes that do not run, and why, in the order of the graph.
    pub skipped: Vec<(String, String)>,
    /// Groups of which another alternative could run and leave the same results.
    pub alternatives: Vec<fastest::Alternatives>,
    /// What whoever runs the graph may lend memory for.
    pub inputs: Vec<ResourceId>,
    /// Requested outputs by name.
    pub outputs: Vec<(String, ResourceId)>,
}

/// A place in the order: a step or a loop over more of them.
#[derive(Debug, Clone, PartialEq)]
pub enum OrderNode {
    Step(StepId),
    Loop(Loop),
}

/// The steps of nodes in their order, those in loops among them.
pub fn steps_of(nodes: &[OrderNode]) -> Vec<StepId> {
    let of = |node: &OrderNode| match node {
        OrderNode::Step(id) => vec![*id],
        OrderNode::Loop(l) => steps_of(&l.body),
    };
    nodes.iter().flat_map(of).collect()
}

/// A body repeated `count` times, or until a number on the device passes a test.
#[derive(Debug, Clone, PartialEq)]
pub struct Loop {
    /// Also the name under which shaders read the iteration's index, from 0.
    pub name: String,
    pub count: u32,
    pub until: Option<Until>,
    pub body: Vec<OrderNode>,
}

/// Ends a loop after an iteration that makes it true.
#[derive(Debug, Clone, PartialEq)]
pub struct Until {
    /// A buffer whose first four bytes are the `f32` tested.
    pub buffer: ResourceId,
    pub comparison: Comparison,
    pub value: f32,
    pub ending: Ending,
}

/// Who ends a loop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// The device, without a word to the host: what is handed over for later iterations does nothing.
    Device,
    /// The host, which waits for the number after each iteration; and why it must.
    Host { why: String },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Comparison {
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
}

impl Comparison {
    /// `a ⋄ b`.
    pub fn holds(self, a: f32, b: f32) -> bool {
        match self {
            Comparison::Less => a < b,
            Comparison::LessEqual => a <= b,
            Comparison::Greater => a > b,
            Comparison::GreaterEqual => a >= b,
        }
    }
}

/// A scene table in the layout of one shader's row type.
#[derive(Debug, Clone, PartialEq)]
pub struct TableUse {
    /// One of [`crate::scene::TABLES`].
    pub table: String,
    pub row: Layout,
    /// Bytes from row to row.
    pub stride: u32,
    /// Rows of a shader's array of fixed length: rows of zeros make the table as long. `None`: as many as there are.
    pub rows: Option<u32>,
    /// They lie in a texture of [`tables::ACROSS`] texels across, four words a texel, and not in a buffer.
    pub texels: bool,
}

/// One thing the device does.
#[derive(Debug, Clone)]
pub struct Step {
    /// The pass's name; `name[i]` for a member, `name.i` for a reduction's stage.
    pub name: String,
    /// Name of the pass in the graph.
    pub pass: String,
    /// The heading under which reports sum steps up.
    pub group: Option<String>,
    /// Those in which it runs; in others what it writes stays as it is.
    pub frames: Frames,
    pub action: Action,
    /// What each variable of the shader is bound to, by its index in the interface. Empty without a shader.
    pub bindings: Vec<Binding>,
    pub reads: Vec<ResourceId>,
    pub writes: Vec<ResourceId>,
    /// `None`: the step runs in full whenever it runs.
    pub only: Option<Only>,
    /// Steps that must come before, for reasons of data.
    pub after: Vec<StepId>,
}

/// A step over instances that can run for some of them: where nothing changed but these inputs, for those whose bit is
/// set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Only {
    pub instances: u32,
    /// A buffer of one bit an instance.
    pub bits: ResourceId,
    /// Inputs whose changes the bits account for.
    pub resources: Vec<ResourceId>,
    /// The same of tables, by index of [`Plan::tables`].
    pub tables: Vec<usize>,
}

#[derive(Debug, Clone)]
pub enum Action {
    /// Scene geometry (or one full-screen triangle) into targets.
    Draw(Draw),
    /// `shader` indexes [`Plan::shaders`]. With `instances`, `groups` are those of one instance; with `indirect`, a
    /// buffer says how many there are, none of them more than `groups`.
    Compute { shader: usize, entry: String, groups: [u32; 3], instances: Option<u32>, indirect: Option<ResourceId> },
    /// All of one resource to another of the same shape.
    Copy { from: ResourceId, to: ResourceId },
    /// Every texel (or, for buffers, every `f32`) to a value.
    Clear { target: ResourceId, value: [f64; 4] },
}

impl Action {
    /// Index into [`Plan::shaders`].
    pub fn shader(&self) -> Option<usize> {
        match self {
            Action::Draw(draw) => Some(draw.shader),
            Action::Compute { shader, .. } => Some(*shader),
            Action::Copy { .. } | Action::Clear { .. } => None,
        }
    }

    /// The buffer of the draws that the device makes up for it.
    pub fn draws(&self) -> Option<ResourceId> {
        match self {
            Action::Draw(draw) => draw.indirect.map(|indirect| indirect.buffer),
            Action::Compute { .. } | Action::Copy { .. } | Action::Clear { .. } => None,
        }
    }
}

/// A render pass.
#[derive(Debug, Clone)]
pub struct Draw {
    pub shader: usize,
    /// `None`: the built-in vertex stage that covers the screen with one triangle.
    pub vertex: Option<String>,
    /// `None`: depth only.
    pub fragment: Option<String>,
    pub geometry: DrawGeometry,
    /// In the order of the fragment's locations.
    pub color: Vec<ColorTarget>,
    pub depth: Option<DepthTarget>,
    /// One draw for each; the instance index of each is its `index`.
    pub members: Vec<DrawMember>,
    /// `None`: each member draws the whole scene.
    pub indirect: Option<Indirect>,
    /// Of each texel of the targets.
    pub samples: u32,
    /// Layers that each member draws to at once; a member's place is the first of them. 1 without `views`.
    pub views: u32,
    /// The level of the scene that it draws, by place in [`Plan::levels`]; `None`: the scene as it is.
    pub level: Option<usize>,
}

/// Simplified triangles that the plan draws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelUse {
    /// Metres; 0: none is simplified.
    pub tolerance: f32,
    /// What they are of the scene's triangles, hashed.
    pub key: u128,
    /// How far off a surface lies, metres.
    pub error: f32,
    pub triangles: u32,
    /// The first of its clusters in the table of them, how many there are, and how many of these are single-sided;
    /// those come first.
    pub first_cluster: u32,
    pub clusters: u32,
    pub one_sided_clusters: u32,
}

/// Draws that the device makes up: of each member those of one range after the other of the scene's indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Indirect {
    /// The arguments of indexed indirect draws: for each place in [`Draw::members`] first those of the single-sided
    /// triangles (of all, unless culling goes by material), then those of the others.
    pub buffer: ResourceId,
    /// Draws of a member's first part.
    pub first: u32,
    /// Draws of its second part.
    pub second: u32,
    pub frusta: Frusta,
    /// What can hide nothing from the eye is left out.
    pub occluders: bool,
    /// The first of all clusters that a member draws, those of its first part, and those of its second, which follow.
    pub clusters: [u32; 3],
}

/// Where the frusta of the members of a draw are, by their index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frusta {
    /// Index into [`Plan::tables`].
    Table(usize),
    Buffer(ResourceId),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DrawGeometry {
    Scene {
        cull: Cull,
    },
    Screen,
    /// What the vertex entry makes up. Never culled by material.
    Vertices {
        count: u32,
        instances: u32,
        topology: wgpu_types::PrimitiveTopology,
        cull: Cull,
        /// The buffer that says which of them are drawn.
        indirect: Option<ResourceId>,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub struct ColorTarget {
    pub resource: ResourceId,
    pub mip: u32,
    pub location: u32,
    pub format: wgpu_types::TextureFormat,
    /// `None`: what is there is kept.
    pub clear: Option<[f64; 4]>,
    pub blend: Option<wgpu_types::BlendState>,
    /// What takes the mean of its samples.
    pub resolve: Option<ResourceId>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct DepthTarget {
    pub resource: ResourceId,
    pub format: wgpu_types::TextureFormat,
    /// `None`: what is there is kept.
    pub clear: Option<f32>,
    pub compare: wgpu_types::CompareFunction,
    pub write: bool,
}

/// One draw of a render pass, and where it goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DrawMember {
    /// The instance index.
    pub index: u32,
    pub place: Place,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Place {
    /// The whole of a target without layers.
    Whole,
    /// This layer (or cube face, or slice) of the targets.
    Layer(u32),
    /// The layer given by the index of the innermost loop, plus an offset.
    LoopLayer(u32),
    /// This rectangle (x, y, width, height) in texels.
    Rect([u32; 4]),
}

/// What a shader's variable is bound to.
#[derive(Debug, Clone)]
pub enum Binding {
    /// The whole resource, in the dimension that the variable asks for.
    Resource(ResourceId),
    /// One level of a texture.
    Level(ResourceId, u32),
    /// Packed from [`Plan::values`], the frame's values, the loops' indices and `extra`, in that order of weakness.
    Uniform {
        layout: Arc<Layout>,
        extra: Values,
    },
    /// Index into [`Plan::tables`].
    Table(usize),
    /// The base-colour textures of the scene: a 2D array, sRGB, with mips.
    SceneTextures,
    /// What the step's shader reports of itself: memory of the step's own.
    Report,
    /// The numbers of the instances that a dispatch works for, after a few words on how they are laid out.
    Instances,
    Sampler(SamplerDesc),
}

impl Plan {
    /// The value of a name known before a frame.
    pub fn value(&self, name: &str) -> Option<Value> {
        self.values.get(name).copied()
    }

    /// The inputs of a unit that its dirty bits account for.
    fn only(&self, unit: &keys::Unit) -> Option<&Only> {
        let [step] = unit.steps[..] else { return None };
        self.steps[step.0].only.as_ref()
    }

    /// Bytes of all resources: as allocated, and if each had memory of its own.
    pub fn bytes(&self) -> (u64, u64) {
        (self.slots.iter().map(|s| s.bytes).sum(), self.resources.iter().map(|r| r.desc.bytes()).sum())
    }
}

/// Bytes of a texel of four floats, the unit in which contents count.
const TEXEL: u64 = 16;

impl Plan {
    /// Invocations of compute shaders, texels under draws, and for each step all that it may write, in texels of 16
    /// bytes; loops go all of their rounds. What one invocation does is not in it.
    pub fn work(&self) -> u64 {
        self.work_of(&self.order)
    }

    fn work_of(&self, nodes: &[OrderNode]) -> u64 {
        let work = |node: &OrderNode| match node {
            OrderNode::Step(id) => self.steps.get(id.0).map_or(0, |s| self.work_of_step(s)),
            OrderNode::Loop(l) => self.work_of(&l.body).saturating_mul(l.count.into()),
        };
        nodes.iter().map(work).fold(0, u64::saturating_add)
    }

    fn work_of_step(&self, step: &Step) -> u64 {
        let content = |id: &ResourceId| self.resources.get(id.0).map_or(0, |r| r.desc.bytes() / TEXEL);
        let written = step.writes.iter().map(content).fold(0, u64::saturating_add);
        let run = match &step.action {
            Action::Compute { shader, entry, groups, instances, indirect: _ } => {
                let entries = self.shaders.get(*shader).map_or(&[][..], |s| s.interface.entries.as_slice());
                let size = entries.iter().find(|e| e.name == *entry).map_or([1; 3], |e| e.workgroup_size);
                groups.iter().chain(&size).chain(instances).fold(1, |all: u64, n| all.saturating_mul((*n).into()))
            }
            Action::Draw(draw) => {
                let target = draw.color.first().map(|c| c.resource).or(draw.depth.as_ref().map(|d| d.resource));
                let area = |place: &Place| match place {
                    Place::Rect([_, _, width, height]) => u64::from(*width) * u64::from(*height),
                    Place::Whole | Place::Layer(_) | Place::LoopLayer(_) => target.map_or(0, |id| self.layer(id)),
                };
                let views = draw.members.iter().map(|m| area(&m.place)).fold(0, u64::saturating_add);
                views.saturating_mul(draw.views.into())
            }
            Action::Copy { .. } | Action::Clear { .. } => 0,
        };
        run.saturating_add(written)
    }

    /// Texels of one layer.
    fn layer(&self, id: ResourceId) -> u64 {
        match self.resources.get(id.0).map(|r| &r.desc) {
            Some(Desc::Texture(t)) => u64::from(t.width) * u64::from(t.height),
            Some(Desc::Buffer { .. }) | None => 0,
        }
    }
}
