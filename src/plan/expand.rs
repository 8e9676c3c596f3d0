//! Expands wired passes into steps: unrolls sets and counts workgroups.
//!
//! `draw` handles draw and screen passes, `dispatch` compute passes, `sums` the stages of reductions and prefix sums.

use super::dispatch::Most;
use super::draw::PartRequest;
use super::order::{OrderBlock, OrderEntry};
use super::sizes::{MOST_STEPS, Sizes};
use super::wire::{How, Mode, Wire, Wired, WiredItem, passes_of};
use super::{
    Action, Binding, Desc, DrawGeometry, Ending, LevelUse, Only, Resource, ResourceId, Step, StepId, TextureKind, Until,
};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Name, PassKind};
use crate::shader::{Shader, Stage};
use crate::value::{Value, Values};
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The steps of a plan, in the order of the file.
pub struct Expanded {
    pub resources: Vec<Resource>,
    pub steps: Vec<Step>,
    pub block: OrderBlock,
    /// The first resource of each name.
    pub ids: FxHashMap<String, ResourceId>,
}

/// What a step binds, reads and writes.
type StepUses = (Vec<Binding>, Vec<ResourceId>, Vec<ResourceId>);

/// Expands live items.
pub fn expand(
    items: &[WiredItem],
    sizes: &Sizes,
    values: &Values,
    shaders: &[Arc<Shader>],
    (limits, features, (levels, asked)): (&wgpu_types::Limits, wgpu_types::Features, (&[LevelUse], &[PartRequest])),
    faults: &mut Vec<Diagnostic>,
) -> Expanded {
    let out = Expanded { resources: vec![], steps: vec![], block: OrderBlock::default(), ids: FxHashMap::default() };
    let bits = passes_of(items).iter().filter_map(|w| Some(w.pass.only.as_ref()?.bits.value.clone())).collect();
    let mut e = Expander { sizes, values, shaders, limits, features, levels, asked, bits, faults, out, counts: vec![] };
    let block = e.block(items);
    e.out.block = block;
    e.out
}

/// What the expansion works with.
pub(super) struct Expander<'a, 'f> {
    pub(super) sizes: &'a Sizes<'a>,
    pub(super) values: &'a Values,
    pub(super) shaders: &'a [Arc<Shader>],
    pub(super) limits: &'a wgpu_types::Limits,
    pub(super) features: wgpu_types::Features,
    pub(super) levels: &'a [LevelUse],
    /// What they were asked for by.
    pub(super) asked: &'a [PartRequest],
    /// Names of buffers of dirty bits.
    bits: BTreeSet<String>,
    pub(super) faults: &'f mut Vec<Diagnostic>,
    pub(super) out: Expanded,
    /// Iterations of the loops around, outermost first.
    pub(super) counts: Vec<u32>,
}

impl Expander<'_, '_> {
    pub(super) fn keep<T>(&mut self, result: Result<T, Diagnostic>) -> Option<T> {
        result.map_err(|d| self.faults.push(d)).ok()
    }

    fn block(&mut self, items: &[WiredItem]) -> OrderBlock {
        let mut block = OrderBlock::default();
        let mut group = 0;
        let mut last_each = None;
        for (i, item) in items.iter().enumerate() {
            match item {
                WiredItem::Pass(w) => {
                    // Neighbours over equal sets go member by member, so that a member's memory is free for the next.
                    if w.each.is_none() || w.each != last_each {
                        group = i;
                    }
                    last_each = w.each;
                    for (member, step) in self.pass(w) {
                        block.push(OrderEntry::Step(step), (group, member, i));
                    }
                }
                WiredItem::Loop { pass, count, until, body } => {
                    last_each = None;
                    self.counts.push(*count);
                    let body = self.block(body);
                    self.counts.pop();
                    let until = until.as_ref().and_then(|(buffer, comparison, value)| {
                        let buffer = self.id(buffer, 0, &pass.span)?;
                        // The plan as a whole decides better.
                        let ending = Ending::Host { why: "nothing is known of the steps around it".into() };
                        Some(Until { buffer, comparison: *comparison, value: *value, ending })
                    });
                    block.push(
                        OrderEntry::Loop { name: pass.name.value.clone(), count: *count, until, body },
                        (i, 0, i),
                    );
                }
            }
        }
        block
    }

    /// The resource of a name; for sets, its member.
    pub(super) fn id(&mut self, name: &str, member: u32, span: &Span) -> Option<ResourceId> {
        if let Some(first) = self.out.ids.get(name).copied() {
            let single = member == 0 && self.out.resources[first.0].name == name;
            let members = if single { None } else { self.sizes.of(name)?.ok()?.members };
            return self.member(name, first, members, member, span);
        }
        let declared = self.sizes.declared(name)?;
        let sized = self.sizes.of(name)?;
        let sized = self.keep(sized)?;
        let first = ResourceId(self.out.resources.len());
        let bits = self.bits.contains(name);
        self.out.ids.insert(name.to_string(), first);
        for m in 0..sized.members.unwrap_or(1) {
            let name = if sized.members.is_some() { format!("{name}[{m}]") } else { name.to_string() };
            let made = Resource::declared(name, sized.desc.clone(), declared);
            self.out.resources.push(Resource { bits, ..made });
        }
        self.member(name, first, sized.members, member, span)
    }

    fn member(
        &mut self,
        name: &str,
        first: ResourceId,
        members: Option<u32>,
        member: u32,
        span: &Span,
    ) -> Option<ResourceId> {
        match members {
            None => Some(first),
            Some(n) if member < n => Some(ResourceId(first.0 + member as usize)),
            Some(n) => {
                let d = Diagnostic::error(format!("`{name}` has {n} members, the pass asks for number {member}"));
                self.faults.push(d.at(span, "").help(format!("give the pass `each` of {n}")));
                None
            }
        }
    }

    /// A resource that no graph declares.
    pub(super) fn made(&mut self, (name, desc): (String, Desc), span: &Span) -> Option<ResourceId> {
        let fits = super::sizes::limits(&name, &desc, span, self.limits);
        self.keep(fits)?;
        self.out.resources.push(Resource::new(name, desc));
        Some(ResourceId(self.out.resources.len() - 1))
    }

    /// Adds a step of a pass.
    fn push(
        &mut self,
        w: &Wired,
        (name, action): (String, Action),
        (bindings, reads, writes): StepUses,
        only: Option<Only>,
    ) {
        self.out.steps.push(Step {
            name,
            pass: w.pass.name.value.clone(),
            group: w.pass.group.as_ref().map(|g| g.value.clone()),
            frames: w.frames,
            action,
            bindings,
            reads,
            writes,
            only,
            after: vec![],
        });
    }

    /// Adds a step that the planner makes for a pass: a dispatch of one of the plan's shaders.
    pub(super) fn dispatch(
        &mut self,
        w: &Wired,
        name: String,
        (shader, groups): (usize, [u32; 3]),
        bound: StepUses,
    ) -> Option<()> {
        let entry = self.shaders[shader].interface.entry(Stage::Compute)?.name.clone();
        self.push(w, (name, Action::Compute { shader, entry, groups, instances: None, indirect: None }), bound, None);
        Some(())
    }

    /// The steps of a pass with the member each belongs to.
    fn pass(&mut self, w: &Wired) -> Vec<(u32, StepId)> {
        let sets = w.uses.iter().any(|u| self.sizes.declared(&u.resource).is_some_and(|r| r.members.is_some()));
        let listed = w.bindings.iter().any(|b| matches!(b, Wire::Fixed(Binding::Instances)));
        if listed && sets {
            let d = Diagnostic::error(format!("the instances of `{}` have resources of their own", w.pass.name.value));
            let help =
                "a dispatch for all `instances` binds the same for each; without them each has a dispatch of its own";
            self.faults.push(d.at(&w.pass.name.span, "").help(help));
            return vec![];
        }
        let batched = listed || matches!(w.pass.kind, PassKind::Draw(_) | PassKind::Screen(_)) && !sets;
        let before = self.out.steps.len();
        let mut members = vec![];
        let count = if batched { 1 } else { w.each.unwrap_or(1) };
        if count > MOST_STEPS {
            let d = Diagnostic::error(format!("`{}` would run {count} times in a frame", w.pass.name.value));
            let span = w.pass.each.as_ref().map_or(&w.pass.span, |e| &e.span);
            let help = format!("the most is {MOST_STEPS}; let one dispatch do the work of many members");
            self.faults.push(d.at(span, "").help(help));
            return vec![];
        }
        for member in 0..count {
            let at = self.out.steps.len();
            if self.step(w, member, batched).is_none() {
                self.out.steps.truncate(before);
                return vec![];
            }
            members.extend((at..self.out.steps.len()).map(|s| (member, StepId(s))));
        }
        members
    }

    fn step(&mut self, w: &Wired, member: u32, batched: bool) -> Option<()> {
        let pass = w.pass;
        let name = match (w.each, batched) {
            (Some(_), false) => format!("{}[{member}]", pass.name.value),
            _ => pass.name.value.clone(),
        };
        match pass.kind {
            PassKind::Reduce { .. } => return self.reduce(w, member, &name),
            PassKind::Scan { .. } => return self.scan(w, member, &name),
            _ => {}
        }
        let (mut reads, mut writes) = (vec![], vec![]);
        for u in &w.uses {
            let id = self.id(&u.resource, member, &u.span)?;
            self.usage(id, u.how);
            if u.mode != Mode::Size && u.mode.reads() {
                reads.push(id);
            }
            if u.mode.writes() && w.copies.iter().all(|(_, to)| to.value != u.resource) {
                writes.push(id);
            }
        }
        let action = match &pass.kind {
            PassKind::Draw(r) | PassKind::Screen(r) => {
                let draw = self.draw(w, r, &name, member, batched)?;
                reads.extend(draw.indirect.map(|i| i.buffer));
                if let DrawGeometry::Vertices { indirect, .. } = draw.geometry {
                    reads.extend(indirect);
                }
                Action::Draw(draw)
            }
            PassKind::Compute { shader, over, .. } => {
                let index = w.shader?;
                let instances = w.each.filter(|_| batched);
                let over = match over {
                    Some(over) => self.said(index, over)?,
                    None => self.written(w, instances.is_some())?,
                };
                let groups = match instances {
                    Some(instances) => self.groups_of_instances(index, &over, instances, &shader.span)?,
                    None => self.groups(index, &over, &shader.span)?,
                };
                let entry = self.shaders[index].interface.entry(Stage::Compute)?.name.clone();
                let indirect = match &w.counts {
                    Some(counts) => Some(self.counted(w, counts, &name, Most::Groups(groups))?),
                    None => None,
                };
                reads.extend(indirect);
                Action::Compute { shader: index, entry, groups, instances, indirect }
            }
            PassKind::Copy { from, to } => {
                let (a, b) = (self.id(&from.value, member, &from.span)?, self.id(&to.value, member, &to.span)?);
                let (da, db) = (self.out.resources[a.0].desc.shape(), self.out.resources[b.0].desc.shape());
                if da != db {
                    let d = Diagnostic::error(format!(
                        "`{}` and `{}` differ in {}",
                        from.value,
                        to.value,
                        differ(&da, &db)
                    ));
                    let d = d.at(&to.span, shape(&db)).at(&from.span, shape(&da));
                    self.faults.push(d.help("a copy takes all of one resource to another like it"));
                    return None;
                }
                Action::Copy { from: a, to: b }
            }
            PassKind::Clear { target, value } => {
                Action::Clear { target: self.id(&target.value, member, &target.span)?, value: *value }
            }
            PassKind::Reduce { .. }
            | PassKind::Scan { .. }
            | PassKind::Mips { .. }
            | PassKind::Loop { .. }
            | PassKind::For { .. }
            | PassKind::Fastest { .. } => {
                return None;
            }
        };
        let bindings = self.bindings(w, member, &name, &BTreeMap::new())?;
        let only = self.only(w, batched, &action)?;
        self.push(w, (name, action), (bindings, reads, writes), only);
        for (from, to) in &w.copies {
            self.copied(w, member, from, to)?;
        }
        Some(())
    }

    /// Adds the copy of a target of one sample to what it would resolve to.
    fn copied(&mut self, w: &Wired, member: u32, from: &Name, to: &Name) -> Option<()> {
        let (from, to) = (self.id(&from.value, member, &from.span)?, self.id(&to.value, member, &to.span)?);
        self.usage(from, How::CopySource);
        let name = format!("{}.copy", w.pass.name.value);
        self.push(w, (name, Action::Copy { from, to }), (vec![], vec![from], vec![to]), None);
        Some(())
    }

    /// Which instances run when little changed. `None` after a fault.
    fn only(&mut self, w: &Wired, batched: bool, action: &Action) -> Option<Option<Only>> {
        let (Some(dirty), Some(instances)) = (&w.pass.only, w.each) else { return Some(None) };
        if !batched {
            let d = Diagnostic::error(format!("the instances of `{}` are steps of their own", w.pass.name.value));
            let help = "let the shader do the work of all `instances` in one dispatch, or leave `only` out";
            self.faults.push(d.at(&dirty.bits.span, "").help(help));
            return None;
        }
        let bits = self.id(&dirty.bits.value, 0, &dirty.bits.span)?;
        let mut resources = vec![];
        for name in &w.dirty {
            resources.push(self.id(&name.value, 0, &name.span)?);
        }
        if let Action::Draw(draw) = action {
            if !super::draw::splits(&self.out.resources, draw) {
                let what = format!("the instances of `{}` draw over each other", w.pass.name.value);
                let help = "give each a tile or a layer of its own that is cleared first, or leave `only` out";
                self.faults.push(Diagnostic::error(what).at(&dirty.bits.span, "").help(help));
                return None;
            }
            // What is culled follows from where things are.
            let places = dirty.of.iter().any(|name| super::partial::CULLED_BY.contains(&name.value.as_str()));
            resources.extend(draw.indirect.filter(|_| places).map(|indirect| indirect.buffer));
        }
        Some(Some(Only { instances, bits, resources, tables: w.dirty_tables.clone() }))
    }

    pub(super) fn bindings(
        &mut self,
        w: &Wired,
        member: u32,
        _name: &str,
        stage: &BTreeMap<&str, ResourceId>,
    ) -> Option<Vec<Binding>> {
        let mut bindings = vec![];
        for wire in &w.bindings {
            bindings.push(match wire {
                Wire::Resource(name) => Binding::Resource(self.id(name, member, &w.pass.span)?),
                Wire::Level(name, mip) => Binding::Level(self.id(name, member, &w.pass.span)?, *mip),
                Wire::Source => Binding::Resource(*stage.get("source")?),
                Wire::Result => Binding::Resource(*stage.get("result")?),
                Wire::Fixed(Binding::Uniform { layout, extra }) => {
                    let mut extra = extra.clone();
                    if extra.contains_key("member") {
                        extra.insert("member".into(), Value::Uint(member));
                    }
                    self.stage_facts(stage, &mut extra);
                    Binding::Uniform { layout: layout.clone(), extra }
                }
                Wire::Fixed(other) => other.clone(),
            });
        }
        Some(bindings)
    }

    pub(super) fn usage(&mut self, id: ResourceId, how: How) {
        match &mut self.out.resources[id.0].desc {
            Desc::Texture(t) => {
                t.usage |= match how {
                    How::Sampled | How::Uniform => wgpu_types::TextureUsages::TEXTURE_BINDING,
                    How::Storage => wgpu_types::TextureUsages::STORAGE_BINDING,
                    How::Target => wgpu_types::TextureUsages::RENDER_ATTACHMENT,
                    How::CopySource => wgpu_types::TextureUsages::COPY_SRC,
                    How::CopyTarget => wgpu_types::TextureUsages::COPY_DST,
                    How::Cleared => super::clear_usage(t),
                }
            }
            Desc::Buffer { usage, .. } => {
                *usage |= match how {
                    How::CopySource => wgpu_types::BufferUsages::COPY_SRC,
                    How::CopyTarget | How::Cleared => wgpu_types::BufferUsages::COPY_DST,
                    How::Uniform => wgpu_types::BufferUsages::UNIFORM,
                    How::Sampled | How::Storage | How::Target => wgpu_types::BufferUsages::STORAGE,
                }
            }
        }
    }
}

/// What differs between two descriptions.
fn differ(a: &Desc, b: &Desc) -> String {
    let (Desc::Texture(a), Desc::Texture(b)) = (a, b) else {
        let buffers = matches!((a, b), (Desc::Buffer { .. }, Desc::Buffer { .. }));
        return if buffers { "size".into() } else { "kind: one is a buffer".into() };
    };
    let parts = [
        ("format", a.format != b.format),
        ("size", (a.width, a.height) != (b.width, b.height)),
        ("kind", a.kind != b.kind),
        ("layers", a.kind == b.kind && a.layers != b.layers),
        ("mips", a.mips != b.mips),
        ("samples", a.samples != b.samples),
    ];
    let differing: Vec<&str> = parts.into_iter().filter(|(_, differs)| *differs).map(|(name, _)| name).collect();
    differing.join(", ")
}

/// A description in words.
pub fn shape(desc: &Desc) -> String {
    match desc {
        Desc::Buffer { size, .. } => format!("{size} bytes"),
        Desc::Texture(t) => {
            let tiles = t.tiles.map_or(String::new(), |t| format!(" ({} tiles of {}²)", t.count, t.edge));
            let kind = match t.kind {
                TextureKind::D2 { array: false } => String::new(),
                TextureKind::D2 { array: true } => format!(" × {} layers", t.layers),
                TextureKind::Cube { array: false } => " × 6 faces".into(),
                TextureKind::Cube { array: true } => format!(" × {} × 6 faces", t.layers / 6),
                TextureKind::D3 => format!("×{}", t.layers),
            };
            let mips = if t.mips > 1 { format!(", {} mips", t.mips) } else { String::new() };
            let samples = if t.samples > 1 { format!(", {} samples", t.samples) } else { String::new() };
            format!("{:?} {}×{}{kind}{tiles}{mips}{samples}", t.format, t.width, t.height)
        }
    }
}
