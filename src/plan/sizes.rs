//! Evaluates declared resources to concrete extents, counts and limits.

use super::request::{Request, count_with};
use super::targets::sampled;
use super::{Desc, TextureDesc, TextureKind, Tiles};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Name, ResourceDecl, ResourceKind, Size, Stride};
use crate::graph::expr::{Expr, Val};
use crate::image::texture::Shape;
use crate::shader::plain_bytes;
use crate::value::Values;
use rustc_hash::FxHashMap;
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;

/// A resource's description before it is known how it is used (no usages yet).
#[derive(Debug, Clone, PartialEq)]
pub struct Sized {
    pub desc: Desc,
    /// Elements of a buffer; 0 otherwise.
    pub elements: u32,
    /// Bytes from one to the next; 0 where nothing says.
    pub stride: u32,
    /// How many the set has; `None`: not a set.
    pub members: Option<u32>,
}

impl Sized {
    /// The extent that a size expression sees.
    fn extent(&self) -> Val {
        match &self.desc {
            Desc::Texture(t) => {
                let mut v = vec![i64::from(t.width), i64::from(t.height)];
                if t.kind == TextureKind::D3 {
                    v.push(i64::from(t.layers));
                }
                Val::Ints(v)
            }
            Desc::Buffer { .. } => Val::Int(self.elements.into()),
        }
    }
}

/// Descriptions of the graph's resources, computed when asked for.
pub struct Sizes<'a> {
    request: &'a Request<'a>,
    values: &'a Values,
    declared: FxHashMap<&'a str, DeclaredSize<'a>>,
    /// The structs of shaders that buffers are bound to arrays of: buffer, struct, stride.
    structs: RefCell<Vec<(String, String, u32)>>,
    /// How many sizes are being computed, each for the one before.
    open: Cell<usize>,
}

/// So many sizes follow from each other at most: each takes some of the stack.
const LONGEST_CHAIN: usize = 200;

struct DeclaredSize<'a> {
    resource: &'a ResourceDecl,
    /// What came out when it was asked for.
    sized: RefCell<SizeState>,
}

enum SizeState {
    Unasked,
    /// Being computed: who asks for it now asks in a circle.
    Open,
    Known(Result<Sized, Diagnostic>),
}

impl<'a> Sizes<'a> {
    /// Nothing is computed yet.
    pub fn new(request: &'a Request<'a>, values: &'a Values) -> Sizes<'a> {
        // Of two with the same name the first counts; the other is a fault of the graph.
        let unasked = |resource| DeclaredSize { resource, sized: RefCell::new(SizeState::Unasked) };
        let declared = request.graph.resources.iter().rev().map(|(n, r)| (n.value.as_str(), unasked(r))).collect();
        Sizes { request, values, declared, structs: RefCell::default(), open: Cell::new(0) }
    }

    /// The declaration of a resource.
    pub fn declared(&self, name: &str) -> Option<&'a ResourceDecl> {
        self.declared.get(name).map(|d| d.resource)
    }

    /// Whether the size of some buffer waits for [`Sizes::learn`].
    pub fn asks_for_structs(&self) -> bool {
        self.declared.values().any(|d| {
            matches!(&d.resource.kind,
            ResourceKind::Buffer { stride: Stride::Of(name), .. } if plain_bytes(&name.value).is_none())
        })
    }

    /// Tells the stride of a struct that a shader has as elements of a buffer.
    pub fn learn(&self, buffer: &str, element: &str, stride: u32) {
        self.structs.borrow_mut().push((buffer.into(), element.into(), stride));
    }

    /// The stride of a buffer's elements.
    fn stride_of(&self, buffer: &str, element: &Name) -> Result<u32, Diagnostic> {
        let structs = self.structs.borrow();
        let mut bound = structs.iter().filter(|(name, ..)| name == buffer);
        let found = plain_bytes(&element.value).or_else(|| Some(bound.clone().find(|b| b.1 == element.value)?.2));
        found.ok_or_else(|| {
            let what = format!("no shader that runs binds `{buffer}` to an array of `{}`", element.value);
            let d = Diagnostic::error(what).at(&element.span, "");
            let d = d.nearest(&element.value, bound.clone().map(|b| b.1.as_str()));
            let others = bound.by_ref().map(|b| format!("`{}`", b.1)).collect::<BTreeSet<_>>();
            let found = others.into_iter().collect::<Vec<_>>().join(", ");
            let plain = "a plain type (`u32`, `vec4f`, …)";
            d.help(if found.is_empty() {
                format!("or name {plain}")
            } else {
                format!("they have {found}; or name {plain}")
            })
        })
    }

    /// The description of a texture or buffer; `None` for tables, samplers and unknown names.
    ///
    /// # Errors
    /// Zero, negative, overflowing sizes; limits of the adapter exceeded; sizes in a circle or a chain too long.
    pub fn of(&self, name: &str) -> Option<Result<Sized, Diagnostic>> {
        let DeclaredSize { resource, sized } = self.declared.get(name)?;
        if matches!(resource.kind, ResourceKind::Table { .. } | ResourceKind::Sampler(_)) {
            return None;
        }
        match &*sized.borrow() {
            SizeState::Known(known) => return Some(known.clone()),
            SizeState::Open => {
                let d = Diagnostic::error(format!("the size of `{name}` depends on itself"));
                return Some(Err(d.at(&resource.span, "")));
            }
            SizeState::Unasked => {}
        }
        if self.open.get() == LONGEST_CHAIN {
            let d = Diagnostic::error(format!("more than {LONGEST_CHAIN} sizes follow from each other"));
            let d = d.at(&resource.span, "the last of them");
            return Some(Err(d.help("give one between them by a parameter, `screen` or a number")));
        }
        sized.replace(SizeState::Open);
        self.open.update(|n| n + 1);
        let found = self.compute(name, resource);
        self.open.update(|n| n - 1);
        sized.replace(SizeState::Known(found.clone()));
        Some(found)
    }

    /// A name in a size expression: a value, or a resource's extent.
    pub fn name(&self, name: &str) -> Option<Val> {
        match self.values.get(name) {
            Some(v) => Some(Val::from(*v)),
            None => self.of(name)?.ok().map(|s| s.extent()),
        }
    }

    fn count(&self, e: &Expr, what: &str) -> Result<u32, Diagnostic> {
        self.first_fault(e)?;
        let n = count_with(e, &|n| self.name(n), what)?;
        if n == 0 {
            return Err(Diagnostic::error(format!("{what} is 0")).at(&e.span, "must be at least 1"));
        }
        Ok(n)
    }

    /// The fault of a resource that an expression takes its size from, rather than "has no value".
    fn first_fault(&self, e: &Expr) -> Result<(), Diagnostic> {
        let mut fault = None;
        e.names(&mut |n, _| {
            if fault.is_none() && !self.values.contains_key(n) {
                fault = self.of(n).and_then(Result::err);
            }
        });
        fault.map_or(Ok(()), Err)
    }

    /// An extent of `axes` axes; a scalar stands for all axes.
    pub fn extent(&self, size: &Size, axes: usize) -> Result<Vec<u32>, Diagnostic> {
        match size {
            Size::Axes(exprs, span) if exprs.len() == axes => {
                let _ = span;
                exprs.iter().map(|e| self.count(e, "a size")).collect()
            }
            Size::Axes(exprs, span) => {
                Err(Diagnostic::error(format!("expected {axes} axes, found {}", exprs.len())).at(span, ""))
            }
            Size::One(e) => {
                self.first_fault(e)?;
                let parts = match e.eval(&|n| self.name(n))? {
                    Val::Int(i) => vec![i; axes],
                    Val::Ints(v) if v.len() == axes => v,
                    _ => {
                        let d = Diagnostic::error(format!("expected an integer or a vector of {axes} integers"));
                        return Err(d.at(&e.span, ""));
                    }
                };
                let part = |i: i64| match u32::try_from(i) {
                    Ok(0) => Err(Diagnostic::error("a size is 0").at(&e.span, "must be at least 1")),
                    Ok(n) => Ok(n),
                    Err(_) => Err(super::request::absurd(&e.span, "a size", i)),
                };
                parts.into_iter().map(part).collect()
            }
        }
    }

    fn compute(&self, name: &str, r: &ResourceDecl) -> Result<Sized, Diagnostic> {
        let members = r.members.as_ref().map(|e| self.count(e, "a number of members")).transpose()?;
        if let (Some(n), Some(e)) = (members, &r.members)
            && n > MOST_STEPS
        {
            let d = Diagnostic::error(format!("`{name}` is a set of {n} members")).at(&e.span, "");
            return Err(d.help(format!("the most is {MOST_STEPS}; use layers or tiles for more")));
        }
        let optional = |e: &Option<Expr>, what| e.as_ref().map_or(Ok(1), |e| self.count(e, what));
        let texture = |kind, format, width, height, layers, mips, tiles| {
            let usage = wgpu_types::TextureUsages::empty();
            Desc::Texture(TextureDesc { kind, format, width, height, layers, mips, samples: 1, usage, tiles })
        };
        let (mut elements, mut stride) = (0, 0);
        let desc = match &r.kind {
            ResourceKind::Texture { format, size, layers, mips, samples } => {
                let (e, n) = (self.extent(size, 2)?, optional(layers, "a number of layers")?);
                let kind = TextureKind::D2 { array: layers.is_some() };
                let desc = texture(kind, *format, e[0], e[1], n, optional(mips, "a number of mips")?, None);
                match (desc, samples) {
                    (Desc::Texture(t), Some(said)) => {
                        let samples = self.count(said, "a number of samples")?;
                        Desc::Texture(sampled(name, r, t, (samples, said), self.request.features)?)
                    }
                    (desc, _) => desc,
                }
            }
            ResourceKind::Texture3d { format, size, mips } => {
                let e = self.extent(size, 3)?;
                texture(TextureKind::D3, *format, e[0], e[1], e[2], optional(mips, "a number of mips")?, None)
            }
            ResourceKind::Cube { format, size, count, mips } => {
                let (e, n) = (self.extent(size, 2)?, optional(count, "a number of cubes")?);
                if e[0] != e[1] {
                    return Err(Diagnostic::error("the faces of a cube are square").at(&r.span, ""));
                }
                let layers = n.checked_mul(6).ok_or_else(|| too_big(name, &r.span))?;
                let kind = TextureKind::Cube { array: count.is_some() };
                texture(kind, *format, e[0], e[1], layers, optional(mips, "a number of mips")?, None)
            }
            ResourceKind::Atlas { format, tile, count } => {
                let (edge, count) = (self.count(tile, "a tile's edge")?, self.count(count, "a number of tiles")?);
                let columns = (1..=count).find(|c| u64::from(*c) * u64::from(*c) >= u64::from(count)).unwrap_or(count);
                let tiles = Tiles { edge, columns, count };
                let side = |n: u32| n.checked_mul(edge).ok_or_else(|| too_big(name, &r.span));
                let (w, h) = (side(columns)?, side(count.div_ceil(columns))?);
                texture(TextureKind::D2 { array: false }, *format, w, h, 1, 1, Some(tiles))
            }
            ResourceKind::Buffer { stride: said, count } => {
                let bytes = match said {
                    Stride::Bytes(e) => self.count(e, "a stride")?,
                    Stride::Of(element) => self.stride_of(name, element)?,
                    Stride::Any => 1,
                };
                stride = if *said == Stride::Any { 0 } else { bytes };
                elements = self.count(count, "a number of elements")?;
                let size = u64::from(bytes) * u64::from(elements);
                Desc::Buffer { size: size.next_multiple_of(4), usage: wgpu_types::BufferUsages::empty() }
            }
            ResourceKind::Image(image) => {
                let kind = match image.shape {
                    Shape::Flat => TextureKind::D2 { array: false },
                    Shape::Cube => TextureKind::Cube { array: false },
                    Shape::Solid => TextureKind::D3,
                };
                let mips = image.levels.len() as u32;
                texture(kind, image.format, image.width, image.height, image.layers, mips, None)
            }
            ResourceKind::Table { .. } | ResourceKind::Sampler(_) => {
                return Err(Diagnostic::error(format!("`{name}` has no size of its own")).at(&r.span, ""));
            }
        };
        limits(name, &desc, &r.span, self.request.limits).map_err(|d| self.with_facts(d, r))?;
        Ok(Sized { desc, elements, stride, members })
    }

    /// Says which numbers of the scene a size comes from: no parameter makes those smaller.
    fn with_facts(&self, fault: Diagnostic, r: &ResourceDecl) -> Diagnostic {
        let Request { graph, facts, .. } = self.request;
        let (sizes, counts) = r.exprs();
        let mut open: Vec<&Expr> = sizes.into_iter().chain(counts).collect();
        let mut seen = BTreeSet::new();
        while let Some(e) = open.pop() {
            e.names(&mut |name, _| {
                if seen.insert(name) {
                    open.extend(graph.lets.iter().filter(|(n, _)| n.value == name).map(|(_, e)| e));
                }
            });
        }
        let found: Vec<String> =
            seen.iter().filter_map(|name| Some(format!("`{name}` is {}", facts.get(*name)?))).collect();
        if found.is_empty() {
            return fault;
        }
        fault.help(format!(
            "in this scene {}: where parameters don't do, take a graph that needs less of it",
            found.join(", ")
        ))
    }
}

fn too_big(name: &str, span: &Span) -> Diagnostic {
    Diagnostic::error(format!("`{name}` is larger than any adapter allows")).at(span, "")
}

/// More members of one pass than this are taken for a slip: 64³ probes with six faces each are 1,572,864.
pub const MOST_DRAWS: u32 = 1 << 21;

/// More steps of one pass, or members of one set of resources, than this are taken for a slip.
pub const MOST_STEPS: u32 = 4096;

/// The largest texture or buffer that is not taken for a slip, in bytes.
pub const LARGEST: u64 = 8 << 30;

fn gib(bytes: u64) -> f64 {
    bytes as f64 / (1u64 << 30) as f64
}

/// Checks a description against an adapter's limits; the fault says the limit's number and ours.
pub fn limits(name: &str, desc: &Desc, span: &Span, limits: &wgpu_types::Limits) -> Result<(), Diagnostic> {
    let over = |what: &str, ours: u64, limit: u64| {
        let d = Diagnostic::error(format!("`{name}`: {what} {ours} exceeds the adapter's limit of {limit}"));
        Err(d.at(span, "").help("choose smaller parameters"))
    };
    if desc.bytes() > LARGEST {
        let d = Diagnostic::error(format!(
            "`{name}` takes {:.1} GiB; at most {} GiB are allowed",
            gib(desc.bytes()),
            LARGEST >> 30
        ));
        return Err(d.at(span, "").help("choose smaller parameters"));
    }
    match desc {
        Desc::Texture(t) => {
            let side = match t.kind {
                TextureKind::D3 => limits.max_texture_dimension_3d,
                _ => limits.max_texture_dimension_2d,
            };
            for (axis, n) in [("width", t.width), ("height", t.height)] {
                if n > side {
                    return over(axis, n.into(), side.into());
                }
            }
            let (what, most) = match t.kind {
                TextureKind::D3 => ("depth", side),
                TextureKind::D2 { .. } => ("layers", limits.max_texture_array_layers),
                TextureKind::Cube { .. } => ("faces", limits.max_texture_array_layers),
            };
            if t.layers > most {
                return over(what, t.layers.into(), most.into());
            }
            let most = t.width.max(t.height).ilog2() + 1;
            if t.mips > most {
                let d = Diagnostic::error(format!("`{name}` can't have {} mips: its size has {most}", t.mips));
                return Err(d.at(span, "").help("take fewer: `log2(n) + 1` of n texels"));
            }
        }
        Desc::Buffer { size, .. } => {
            let most = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
            if *size > most {
                return over("bytes", *size, most);
            }
        }
    }
    Ok(())
}
