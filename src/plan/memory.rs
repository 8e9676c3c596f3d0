//! Assigns resources to slots of memory. Resources with disjoint lifetimes and equal descriptions share one.

use super::inputs::{self, Causes, Moving, ResourceAccess, StepInput, causes};
use super::{Action, Binding, OrderNode, Place, Plan, ResourceId, Step};
use crate::diag::Diagnostic;
use crate::graph::Graph;
use crate::graph::ast::{self, set_of};
use crate::image::texture::Texture;
use crate::shader::{BindingKind, Shader};
use crate::value::Type;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// One use of a resource at a place of the order.
#[derive(Clone, Copy)]
struct SlotUse {
    at: usize,
    /// Earlier content matters.
    keeps: bool,
}

/// Fills in `lifetime` and `slot` of every resource, and the plan's slots.
///
/// A resource holds something needed from its first write to its last read. Inside a loop that is true of one
/// iteration only when each iteration writes all of it before reading it and nothing outside uses it; otherwise it is
/// alive for the whole loop. Outputs live to the end, history for ever (in memory of its own).
///
/// What is asked for when it has not changed stays where it is: nothing comes after it into its memory, and before it
/// only what changes with it. With `share: false` every resource has memory of its own.
pub fn allocate(plan: &mut Plan, share: bool) {
    let mut accesses: Vec<Vec<SlotUse>> = vec![vec![]; plan.resources.len()];
    let mut loops: Vec<(usize, usize)> = vec![];
    let mut at = 0;
    walk(plan, &plan.order, &mut vec![], &mut at, &mut accesses, &mut loops);
    let end = at;
    for (i, accesses) in accesses.iter().enumerate() {
        let mut lifetime = match (accesses.first(), accesses.last()) {
            (Some(a), Some(b)) => (a.at, b.at),
            _ => (0, 0),
        };
        // Inner loops stand before the loops around them.
        for (start, stop) in &loops {
            let inside = |t: &&SlotUse| t.at >= *start && t.at <= *stop;
            let Some(first) = accesses.iter().find(inside) else { continue };
            let used_elsewhere = accesses.iter().any(|t| t.at < *start || t.at > *stop);
            if used_elsewhere || first.keeps {
                lifetime = (lifetime.0.min(*start), lifetime.1.max(*stop));
            }
        }
        let r = &plan.resources[i];
        if plan.outputs.iter().any(|o| o.1.0 == i) {
            lifetime.1 = end;
        }
        if r.history || r.image.is_some() {
            lifetime = (0, end);
        }
        plan.resources[i].lifetime = lifetime;
    }
    let mut order: Vec<usize> = (0..plan.resources.len()).collect();
    order.sort_by_key(|i| (plan.resources[*i].lifetime.0, *i));
    // Instances that need not run again leave what they made where it is.
    let in_parts = plan.steps.iter().filter_map(|s| Some((s, s.only.as_ref()?)));
    let in_parts: BTreeSet<usize> =
        in_parts.flat_map(|(s, only)| s.writes.iter().chain([&only.bits]).map(|r| r.0)).collect();
    let causes = causes(plan);
    // For each slot the place after which it is free; `None` when it never is.
    let mut free: Vec<Option<usize>> = vec![];
    let mut shapes: Vec<Desc> = vec![];
    let mut changed_by: Vec<Moving> = vec![];
    for i in order {
        let r = &plan.resources[i];
        // What the device made up to draw can be counted after the frame.
        let counted =
            matches!(r.desc, Desc::Buffer { usage, .. } if usage.contains(wgpu_types::BufferUsages::INDIRECT));
        let sharing = share && !r.history && r.image.is_none() && !counted && !in_parts.contains(&i);
        let Causes { of, outlived } = causes[i];
        let until = (sharing && !outlived).then_some(r.lifetime.1);
        let shape = r.desc.shape();
        let stays = |s: usize| !outlived || changed_by[s].is_among(of);
        let fits = |s: &usize| free[*s].is_some_and(|f| f < r.lifetime.0) && shapes[*s] == shape && stays(*s);
        let slot = match (0..shapes.len()).find(|s| sharing && fits(s)) {
            Some(s) => {
                unite(&mut plan.slots[s].desc, &r.desc);
                free[s] = until;
                changed_by[s] |= of;
                s
            }
            None => {
                plan.slots.push(Slot { desc: r.desc.clone(), bytes: r.desc.bytes() });
                free.push(until);
                shapes.push(shape);
                changed_by.push(of);
                plan.slots.len() - 1
            }
        };
        plan.resources[i].slot = slot;
    }
    plan.slots.iter_mut().for_each(|s| widen(&mut s.desc));
}

/// Usages that cost nothing where they are not made use of, so that the memory can serve the next plan too.
fn widen(desc: &mut Desc) {
    match desc {
        Desc::Texture(t) => {
            let able = t.format.guaranteed_format_features(wgpu_types::Features::empty()).allowed_usages;
            t.usage |= able & (wgpu_types::TextureUsages::TEXTURE_BINDING | wgpu_types::TextureUsages::COPY_SRC);
        }
        Desc::Buffer { usage, .. } => {
            *usage |= wgpu_types::BufferUsages::COPY_SRC | wgpu_types::BufferUsages::COPY_DST;
        }
    }
}

fn unite(a: &mut Desc, b: &Desc) {
    match (a, b) {
        (Desc::Texture(a), Desc::Texture(b)) => a.usage |= b.usage,
        (Desc::Buffer { usage: a, .. }, Desc::Buffer { usage: b, .. }) => *a |= *b,
        _ => {}
    }
}

fn walk<'p>(
    plan: &'p Plan,
    nodes: &'p [OrderNode],
    around: &mut Vec<&'p str>,
    at: &mut usize,
    accesses: &mut [Vec<SlotUse>],
    loops: &mut Vec<(usize, usize)>,
) {
    for node in nodes {
        match node {
            OrderNode::Step(s) => {
                let step = &plan.steps[s.0];
                let gathers = gathers(step, around);
                let mut uses: BTreeMap<ResourceId, bool> = BTreeMap::new();
                for input in inputs::of(plan, step, around) {
                    let (id, keeps) = match input {
                        StepInput::Resource { id, access } => match access {
                            // It must exist while the step runs.
                            ResourceAccess::Bound => (id, false),
                            ResourceAccess::Read => (id, true),
                            ResourceAccess::Part | ResourceAccess::Whole => (id, gathers),
                        },
                        StepInput::Bits(id) => (id, true),
                        StepInput::Fixed { .. }
                        | StepInput::Value { .. }
                        | StepInput::Table(_)
                        | StepInput::Geometry
                        | StepInput::Textures
                        | StepInput::Began => continue,
                    };
                    *uses.entry(id).or_default() |= keeps;
                }
                uses.into_iter().for_each(|(id, keeps)| accesses[id.0].push(SlotUse { at: *at, keeps }));
                *at += 1;
            }
            OrderNode::Loop(l) => {
                let start = *at;
                around.push(&l.name);
                walk(plan, &l.body, around, at, accesses, loops);
                around.pop();
                if let Some(until) = &l.until {
                    accesses[until.buffer.0].push(SlotUse { at: *at, keeps: true });
                }
                *at += 1;
                loops.push((start, *at - 1));
            }
        }
    }
}

/// Whether a step may write another part of its targets in each iteration, so that all iterations together make the
/// content: it draws to the layer of the loop's index, or its shader knows the index.
fn gathers(step: &Step, around: &[&str]) -> bool {
    let knows = |b: &Binding| match b {
        Binding::Uniform { layout, extra } => {
            layout.members.iter().any(|m| around.contains(&m.name.as_str()) && !extra.contains_key(&m.name))
        }
        _ => false,
    };
    let layered = match &step.action {
        Action::Draw(d) => d.members.iter().any(|m| matches!(m.place, Place::LoopLayer(_))),
        _ => false,
    };
    layered || step.bindings.iter().any(knows)
}

/// A texture or buffer of the plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Resource {
    /// The graph's name; `name[i]` for a member of a set, `pass.i` for a reduction's intermediate.
    pub name: String,
    pub desc: Desc,
    /// Where it lives. Valid for every resource.
    pub slot: usize,
    /// First and last place in the order (whole loops count as one range) at which it holds something needed.
    pub lifetime: (usize, usize),
    /// Keeps its content from frame to frame.
    pub history: bool,
    /// Content before anything is written; `Some` also clears it on allocation.
    pub initial: Option<[f64; 4]>,
    /// What files hold; no step writes it.
    pub image: Option<Arc<Texture>>,
    /// Holds dirty bits: what they say is for one frame.
    pub bits: bool,
    /// Of a buffer: the type of number that shaders bind it as, `f32`, `u32` or `i32`, in which it is cleared.
    pub number: Type,
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
            lifetime: (0, 0),
            history: false,
            initial: None,
            image: None,
            bits: false,
            number: Type::Float,
            min: None,
            max: None,
        }
    }

    /// One of the graph.
    pub(super) fn declared(name: String, desc: Desc, by: &ast::ResourceDecl) -> Resource {
        let image = match &by.kind {
            ast::ResourceKind::Image(image) => Some(image.clone()),
            _ => None,
        };
        // History begins with zeros where nothing is said.
        let initial = if by.history { Some(by.initial.unwrap_or([0.0; 4])) } else { by.initial };
        Resource { history: by.history, initial, image, min: by.min, max: by.max, ..Resource::new(name, desc) }
    }
}

/// Finds the type of number of each buffer that is cleared to anything but zero.
pub(super) fn find_numbers(
    graph: &Graph,
    resources: &mut [Resource],
    steps: &[Step],
    shaders: &[Arc<Shader>],
    faults: &mut Vec<Diagnostic>,
) {
    let mut cleared: BTreeMap<usize, f64> = BTreeMap::new();
    for (index, resource) in resources.iter().enumerate() {
        cleared.extend(resource.initial.map(|value| (index, value[0])));
    }
    cleared.extend(steps.iter().filter_map(|step| match &step.action {
        Action::Clear { target, value } if value[0] != 0.0 => Some((target.0, value[0])),
        _ => None,
    }));
    for (index, value) in cleared {
        let resource = &mut resources[index];
        if value == 0.0 || !matches!(resource.desc, Desc::Buffer { .. }) {
            continue;
        }
        let name = resource.name.clone();
        let found = numbers_bound(ResourceId(index), steps, shaders);
        resource.number = found.first().copied().unwrap_or(Type::Float);
        let fits = match resource.number {
            _ if found.len() > 1 => false,
            Type::Uint => value == f64::from(value as u32),
            Type::Int => value == f64::from(value as i32),
            _ => true,
        };
        if fits {
            continue;
        }
        let types = found.iter().map(|t| t.wgsl()).collect::<Vec<_>>().join(" and ");
        let fault = Diagnostic::error(format!("`{name}` can't be cleared to {value}: shaders bind it as {types}"));
        let declared = graph.resources.iter().find(|(n, _)| n.value == set_of(&name));
        let fault = declared.map_or(fault.clone(), |(n, _)| fault.at(&n.span, "declared here"));
        faults.push(fault.help("clear it to 0 or a number of its type, or let a shader write it"));
    }
}

/// The types of number, each once, that shaders bind a buffer as.
fn numbers_bound(buffer: ResourceId, steps: &[Step], shaders: &[Arc<Shader>]) -> Vec<Type> {
    let mut found = vec![];
    for step in steps {
        let Some(shader) = step.action.shader() else { continue };
        for (variable, binding) in shaders[shader].interface.variables.iter().zip(&step.bindings) {
            let (BindingKind::Storage { element, .. } | BindingKind::UniformArray { element, .. }) = &variable.kind
            else {
                continue;
            };
            if !matches!(binding, Binding::Resource(r) if *r == buffer) {
                continue;
            }
            for member in &element.members {
                let number = match member.ty {
                    Type::Int => Type::Int,
                    Type::Bool | Type::Uint | Type::UVec2 | Type::UVec3 | Type::UVec4 => Type::Uint,
                    Type::Float | Type::Vec2 | Type::Vec3 | Type::Vec4 | Type::Mat4 => Type::Float,
                };
                if !found.contains(&number) {
                    found.push(number);
                }
            }
        }
    }
    found
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
