//! Wired passes to steps: sets unrolled, reductions staged, places and workgroups counted.

use super::order::{Block, Entry};
use super::request;
use super::sizes::{self, Sizes};
use super::wire::{How, Item, Mode, Wire, Wired};
use super::{
    Action, Binding, ColorTarget, DepthTarget, Desc, Draw, Geometry, Member, Place, Resource, ResourceId, Step, StepId,
    TextureDesc, TextureKind, Tiles, Until,
};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{PassKind, Raster, Size};
use crate::graph::expr::{Expr, ExprKind, Val};
use crate::shader::{Shader, Stage};
use crate::value::{Value, Values};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The steps of a plan, in the order of the file.
pub struct Expanded {
    pub resources: Vec<Resource>,
    pub steps: Vec<Step>,
    pub block: Block,
    /// The first resource of each name.
    pub ids: BTreeMap<String, ResourceId>,
}

/// Expands live items.
pub fn expand(
    items: &[Item],
    sizes: &Sizes,
    values: &Values,
    shaders: &[Arc<Shader>],
    limits: &wgpu::Limits,
    faults: &mut Vec<Diagnostic>,
) -> Expanded {
    let out = Expanded { resources: vec![], steps: vec![], block: Block::default(), ids: BTreeMap::new() };
    let mut e = Expander { sizes, values, shaders, limits, faults, out, counts: vec![] };
    let block = e.block(items);
    e.out.block = block;
    e.out
}

/// More members of one pass than this are taken for a slip: 64³ probes with six faces each are 1,572,864.
pub const MOST_DRAWS: u32 = 1 << 21;

/// More steps of one pass, or members of one set of resources, than this are taken for a slip.
pub const MOST_STEPS: u32 = 4096;

struct Expander<'a, 'f> {
    sizes: &'a Sizes<'a>,
    values: &'a Values,
    shaders: &'a [Arc<Shader>],
    limits: &'a wgpu::Limits,
    faults: &'f mut Vec<Diagnostic>,
    out: Expanded,
    /// Iterations of the loops around, outermost first.
    counts: Vec<u32>,
}

impl Expander<'_, '_> {
    fn keep<T>(&mut self, result: Result<T, Diagnostic>) -> Option<T> {
        result.map_err(|d| self.faults.push(d)).ok()
    }

    fn block(&mut self, items: &[Item]) -> Block {
        let mut block = Block::default();
        let mut group = 0;
        let mut last_each = None;
        for (i, item) in items.iter().enumerate() {
            match item {
                Item::Pass(w) => {
                    // Neighbours over equal sets go member by member, so that a member's memory is free for the next.
                    if w.each.is_none() || w.each != last_each {
                        group = i;
                    }
                    last_each = w.each;
                    for (member, step) in self.pass(w) {
                        block.push(Entry::Step(step), (group, member, i));
                    }
                }
                Item::Loop { pass, count, until, body } => {
                    last_each = None;
                    self.counts.push(*count);
                    let body = self.block(body);
                    self.counts.pop();
                    let until = until.as_ref().and_then(|(buffer, comparison, value)| {
                        Some(Until { buffer: self.id(buffer, 0, &pass.span)?, comparison: *comparison, value: *value })
                    });
                    block.push(Entry::Loop { name: pass.name.value.clone(), count: *count, until, body }, (i, 0, i));
                }
            }
        }
        block
    }

    /// The resource of a name; for sets, its member.
    fn id(&mut self, name: &str, member: u32, span: &Span) -> Option<ResourceId> {
        if let Some(first) = self.out.ids.get(name) {
            let members = self.sizes.of(name)?.ok()?.members;
            return self.member(name, *first, members, member, span);
        }
        let declared = self.sizes.declared(name)?;
        let sized = self.sizes.of(name)?;
        let sized = self.keep(sized)?;
        let first = ResourceId(self.out.resources.len());
        self.out.ids.insert(name.to_string(), first);
        for m in 0..sized.members.unwrap_or(1) {
            let name = if sized.members.is_some() { format!("{name}[{m}]") } else { name.to_string() };
            let initial = if declared.history { Some(declared.initial.unwrap_or([0.0; 4])) } else { declared.initial };
            self.out.resources.push(Resource {
                name,
                desc: sized.desc.clone(),
                slot: 0,
                alive: (0, 0),
                history: declared.history,
                initial,
            });
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

    /// The steps of a pass with the member each belongs to.
    fn pass(&mut self, w: &Wired) -> Vec<(u32, StepId)> {
        let sets = w.uses.iter().any(|u| matches!(self.sizes.of(&u.resource), Some(Ok(s)) if s.members.is_some()));
        let batched = matches!(w.pass.kind, PassKind::Draw(_) | PassKind::Screen(_)) && !sets;
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
        if let PassKind::Reduce { .. } = pass.kind {
            return self.reduce(w, member, &name);
        }
        let (mut reads, mut writes) = (vec![], vec![]);
        for u in &w.uses {
            let id = self.id(&u.resource, member, &u.span)?;
            self.usage(id, u.how);
            if u.mode != Mode::Size && u.mode.reads() {
                reads.push(id);
            }
            if u.mode.writes() {
                writes.push(id);
            }
        }
        let action = match &pass.kind {
            PassKind::Draw(r) | PassKind::Screen(r) => Action::Draw(self.draw(w, r, member, batched)?),
            PassKind::Compute { shader, over } => {
                let index = w.shader?;
                let groups = self.groups(index, over, &shader.span)?;
                let entry = self.shaders[index].interface.entry(Stage::Compute)?.name.clone();
                Action::Compute { shader: index, entry, groups }
            }
            PassKind::Copy { from, to } => {
                let (a, b) = (self.id(&from.value, member, &from.span)?, self.id(&to.value, member, &to.span)?);
                let (da, db) = (self.out.resources[a.0].desc.shape(), self.out.resources[b.0].desc.shape());
                if da != db {
                    let d = Diagnostic::error(format!("`{}` and `{}` differ in shape", from.value, to.value));
                    self.faults.push(d.at(&to.span, shape(&db)).at(&from.span, shape(&da)));
                    return None;
                }
                Action::Copy { from: a, to: b }
            }
            PassKind::Clear { target, value } => {
                Action::Clear { target: self.id(&target.value, member, &target.span)?, value: *value }
            }
            PassKind::Reduce { .. } | PassKind::Loop { .. } => return None,
        };
        let bindings = self.bindings(w, member, &name, &BTreeMap::new())?;
        self.out.steps.push(Step {
            name,
            pass: pass.name.value.clone(),
            action,
            bindings,
            reads,
            writes,
            after: vec![],
        });
        Some(())
    }

    fn bindings(
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

    /// The tiling of a reduction's present source and target.
    fn stage_facts(&self, stage: &BTreeMap<&str, ResourceId>, extra: &mut Values) {
        for (variable, id) in stage {
            if let Desc::Texture(TextureDesc { tiles: Some(t), .. }) = &self.out.resources[id.0].desc {
                for (suffix, n) in [("tile", t.edge), ("columns", t.columns), ("count", t.count)] {
                    if let Some(v) = extra.get_mut(&format!("{variable}_{suffix}")) {
                        *v = Value::Uint(n);
                    }
                }
            }
        }
    }

    fn usage(&mut self, id: ResourceId, how: How) {
        match &mut self.out.resources[id.0].desc {
            Desc::Texture(t) => {
                t.usage |= match how {
                    How::Sampled => wgpu::TextureUsages::TEXTURE_BINDING,
                    How::Storage => wgpu::TextureUsages::STORAGE_BINDING,
                    How::Target => wgpu::TextureUsages::RENDER_ATTACHMENT,
                    How::CopySource => wgpu::TextureUsages::COPY_SRC,
                    How::CopyTarget => wgpu::TextureUsages::COPY_DST,
                    How::Cleared => super::clear_usage(t),
                }
            }
            Desc::Buffer { usage, .. } => {
                *usage |= match how {
                    How::CopySource => wgpu::BufferUsages::COPY_SRC,
                    How::CopyTarget | How::Cleared => wgpu::BufferUsages::COPY_DST,
                    How::Sampled | How::Storage | How::Target => wgpu::BufferUsages::STORAGE,
                }
            }
        }
    }

    fn groups(&mut self, shader: usize, over: &Size, span: &Span) -> Option<[u32; 3]> {
        let threads = match over {
            Size::One(Expr { kind: ExprKind::Name(name), span }) if self.sizes.declared(name).is_some() => {
                let Some(sized) = self.sizes.of(name) else {
                    self.faults.push(Diagnostic::error(format!("`{name}` has no extent")).at(span, ""));
                    return None;
                };
                let sized = self.keep(sized)?;
                match sized.desc {
                    Desc::Texture(t) => [t.width, t.height, t.layers],
                    Desc::Buffer { .. } => [sized.elements, 1, 1],
                }
            }
            Size::One(e) => {
                let value = e.eval(&|n| self.sizes.name(n));
                let axes = match self.keep(value)? {
                    Val::Ints(v) => v.len(),
                    _ => 1,
                };
                self.threads(over, axes)?
            }
            Size::Axes(axes, _) => self.threads(over, axes.len())?,
        };
        self.in_groups(shader, threads, span)
    }

    fn threads(&mut self, over: &Size, axes: usize) -> Option<[u32; 3]> {
        let e = self.sizes.extent(over, axes);
        let e = self.keep(e)?;
        Some([e.first().copied()?, e.get(1).copied().unwrap_or(1), e.get(2).copied().unwrap_or(1)])
    }

    fn in_groups(&mut self, shader: usize, threads: [u32; 3], span: &Span) -> Option<[u32; 3]> {
        let size = self.shaders[shader].interface.entry(Stage::Compute)?.workgroup_size;
        let groups = [0, 1, 2].map(|i| threads[i].div_ceil(size[i].max(1)));
        let most = self.limits.max_compute_workgroups_per_dimension;
        if groups.iter().any(|g| *g > most) {
            let d = Diagnostic::error(format!("{groups:?} workgroups exceed the adapter's limit of {most} an axis"));
            self.faults.push(d.at(span, "").help("choose a larger workgroup or a smaller size"));
            return None;
        }
        let (x, l) = (size, self.limits);
        let ours = x[0].saturating_mul(x[1]).saturating_mul(x[2]);
        if ours > l.max_compute_invocations_per_workgroup
            || x[0] > l.max_compute_workgroup_size_x
            || x[1] > l.max_compute_workgroup_size_y
            || x[2] > l.max_compute_workgroup_size_z
        {
            let most = l.max_compute_invocations_per_workgroup;
            let d =
                Diagnostic::error(format!("a workgroup of {size:?} exceeds the adapter's limit of {most} invocations"));
            self.faults.push(d.at(span, ""));
            return None;
        }
        Some(groups)
    }

    fn reduce(&mut self, w: &Wired, member: u32, name: &str) -> Option<()> {
        let PassKind::Reduce { from, to, factor, until, shader } = &w.pass.kind else { return None };
        let written = factor;
        let factors: Vec<Result<u32, Diagnostic>> =
            written.iter().map(|e| request::count(e, self.values, "a factor")).collect();
        let mut factor = [1; 3];
        for (i, f) in factors.into_iter().enumerate() {
            factor[i] = self.keep(f)?;
            if factor[i] == 0 {
                let d = Diagnostic::error("a reduction divides by 0").at(&written[i].span, "must be at least 1");
                self.faults.push(d);
                return None;
            }
        }
        if let [_] = written[..] {
            factor = [factor[0]; 3];
        }
        let until = request::count(until, self.values, "the size at which to stop");
        let until = self.keep(until)?.max(1);
        let source = self.id(&from.value, member, &from.span)?;
        let target = self.id(&to.value, member, &to.span)?;
        let (Desc::Texture(first), Desc::Texture(last)) =
            (self.out.resources[source.0].desc.clone(), self.out.resources[target.0].desc.clone())
        else {
            return None;
        };
        let stages = self.stages(first, factor, until, last.format, &w.pass.span)?;
        let end = stages.last()?;
        if (end.width, end.height, end.layers, end.tiles, end.kind)
            != (last.width, last.height, last.layers, last.tiles, last.kind)
        {
            let made = shape(&Desc::Texture(end.clone()));
            let d = Diagnostic::error(format!(
                "the reduction ends with {made}, `{}` is {}",
                to.value,
                shape(&Desc::Texture(last))
            ));
            self.faults.push(d.at(&to.span, "").help(format!("declare `{}` with that size", to.value)));
            return None;
        }
        let mut from_id = source;
        for (i, desc) in stages.iter().enumerate() {
            let to_id = if i + 1 == stages.len() { target } else { self.intermediate(name, i, desc, &w.pass.span)? };
            self.usage(from_id, How::Sampled);
            self.usage(to_id, How::Storage);
            let stage = BTreeMap::from([("source", from_id), ("result", to_id)]);
            let bindings = self.bindings(w, member, name, &stage)?;
            let (mut reads, mut writes) = (vec![from_id], vec![to_id]);
            for u in w.uses.iter().filter(|u| u.resource != from.value && u.resource != to.value) {
                let id = self.id(&u.resource, member, &u.span)?;
                self.usage(id, u.how);
                if u.mode.reads() {
                    reads.push(id);
                }
                if u.mode.writes() {
                    writes.push(id);
                }
            }
            let index = w.shader?;
            let groups = self.in_groups(index, [desc.width, desc.height, desc.layers], &shader.span)?;
            let entry = self.shaders[index].interface.entry(Stage::Compute)?.name.clone();
            self.out.steps.push(Step {
                name: if stages.len() > 1 { format!("{name}.{i}") } else { name.to_string() },
                pass: w.pass.name.value.clone(),
                action: Action::Compute { shader: index, entry, groups },
                bindings,
                reads,
                writes,
                after: vec![],
            });
            from_id = to_id;
        }
        Some(())
    }

    /// The extents after each stage of a reduction.
    fn stages(
        &mut self,
        first: TextureDesc,
        factor: [u32; 3],
        until: u32,
        format: wgpu::TextureFormat,
        span: &Span,
    ) -> Option<Vec<TextureDesc>> {
        let mut at = TextureDesc { format, usage: wgpu::TextureUsages::empty(), mips: 1, ..first };
        let mut stages = vec![];
        loop {
            let next = match at.tiles {
                Some(t) => {
                    let edge = t.edge.div_ceil(factor[0].max(1));
                    let rows = t.count.div_ceil(t.columns);
                    let tiles = Tiles { edge, ..t };
                    TextureDesc { width: t.columns * edge, height: rows * edge, tiles: Some(tiles), ..at.clone() }
                }
                None => {
                    let depth = if at.kind == TextureKind::D3 { factor[2] } else { 1 };
                    TextureDesc {
                        width: at.width.div_ceil(factor[0].max(1)),
                        height: at.height.div_ceil(factor[1].max(1)),
                        layers: at.layers.div_ceil(depth.max(1)),
                        ..at.clone()
                    }
                }
            };
            let done = match next.tiles {
                Some(t) => t.edge <= until,
                None => {
                    next.width <= until
                        && next.height <= until
                        && (next.kind != TextureKind::D3 || next.layers <= until)
                }
            };
            if next == at && !done {
                let d = Diagnostic::error("the reduction never reaches its end: a factor is 1").at(span, "");
                self.faults.push(d);
                return None;
            }
            stages.push(next.clone());
            at = next;
            if done {
                return Some(stages);
            }
        }
    }

    fn intermediate(&mut self, name: &str, stage: usize, desc: &TextureDesc, span: &Span) -> Option<ResourceId> {
        let desc = Desc::Texture(desc.clone());
        let name = format!("{name}.{stage}");
        let fits = sizes::limits(&name, &desc, span, self.limits);
        self.keep(fits)?;
        self.out.resources.push(Resource { name, desc, slot: 0, alive: (0, 0), history: false, initial: None });
        Some(ResourceId(self.out.resources.len() - 1))
    }

    fn draw(&mut self, w: &Wired, r: &Raster, member: u32, batched: bool) -> Option<Draw> {
        let index = w.shader?;
        let interface = &self.shaders[index].interface;
        let geometry = match w.pass.kind {
            PassKind::Draw(_) => Geometry::Scene { cull: r.cull },
            _ => Geometry::Screen,
        };
        let screen = geometry == Geometry::Screen;
        let vertex = if screen { None } else { Some(interface.entry(Stage::Vertex)?.name.clone()) };
        let fragment = interface.entry(Stage::Fragment).map(|e| e.name.clone());
        let clear_of = |name: &str| r.clear.iter().find(|c| c.0.value == name).map(|c| c.1);
        let loads = |name: &str| r.load.iter().any(|n| n.value == name);
        let mut color = vec![];
        let mut extents: Vec<(ResourceId, String)> = vec![];
        for (location, name) in &w.color {
            let id = self.id(name, member, &w.pass.span)?;
            let Desc::Texture(t) = &self.out.resources[id.0].desc else { return None };
            let clear = (!loads(name)).then(|| clear_of(name).unwrap_or([0.0; 4]));
            color.push(ColorTarget { resource: id, location: *location, format: t.format, clear, blend: r.blend });
            extents.push((id, name.clone()));
        }
        let mut depth = None;
        if let Some(name) = &r.depth {
            let id = self.id(&name.value, member, &name.span)?;
            let Desc::Texture(t) = &self.out.resources[id.0].desc else { return None };
            let clear = (!loads(&name.value)).then(|| clear_of(&name.value).map_or(1.0, |c| c[0] as f32));
            depth = Some(DepthTarget {
                resource: id,
                format: t.format,
                clear,
                compare: r.depth_compare,
                write: r.depth_write,
            });
            extents.push((id, name.value.clone()));
        }
        let members = self.places(w, r, member, batched, &extents)?;
        Some(Draw { shader: index, vertex, fragment, geometry, color, depth, members })
    }

    fn places(
        &mut self,
        w: &Wired,
        r: &Raster,
        member: u32,
        batched: bool,
        targets: &[(ResourceId, String)],
    ) -> Option<Vec<Member>> {
        let texture = |id: ResourceId| match &self.out.resources[id.0].desc {
            Desc::Texture(t) => Some(t.clone()),
            Desc::Buffer { .. } => None,
        };
        let first = texture(targets.first()?.0)?;
        for (id, name) in &targets[1..] {
            let t = texture(*id)?;
            if (t.width, t.height, t.tiles) != (first.width, first.height, first.tiles) {
                let d = Diagnostic::error(format!("the targets `{}` and `{name}` differ in size", targets[0].1));
                let d =
                    d.at(&w.pass.name.span, format!("{}×{} and {}×{}", first.width, first.height, t.width, t.height));
                self.faults.push(d);
                return None;
            }
        }
        let indices = if batched { 0..w.each.unwrap_or(1) } else { member..member + 1 };
        if let Some(layer) = &r.layer {
            let place = self.layer(w, layer, &first)?;
            return Some(indices.map(|index| Member { index, place }).collect());
        }
        let room = match first.tiles {
            Some(t) => Some(t.count),
            None if first.kind == (TextureKind::D2 { array: false }) => None,
            None => Some(first.layers),
        };
        if let Some(room) = room
            && batched
        {
            let n = w.each.unwrap_or(1);
            let what = if first.tiles.is_some() { "tiles" } else { "layers" };
            if n > room || w.each.is_none() && room > 1 {
                let d = Diagnostic::error(format!("`{}` has {room} {what}, the pass draws {n}", targets[0].1));
                self.faults
                    .push(d.at(&w.pass.name.span, "").help(format!("give the pass `each` of {room}, or `layer`")));
                return None;
            }
        }
        let place = |index: u32| match (first.tiles, first.kind) {
            (Some(t), _) if batched => {
                Place::Rect([index % t.columns * t.edge, index / t.columns * t.edge, t.edge, t.edge])
            }
            (None, TextureKind::D2 { array: true } | TextureKind::Cube { .. } | TextureKind::D3) => {
                Place::Layer(if batched { index } else { 0 })
            }
            _ => Place::Whole,
        };
        Some(indices.map(|index| Member { index, place: place(index) }).collect())
    }

    /// A layer that is fixed, or the innermost loop's index plus a number.
    fn layer(&mut self, w: &Wired, layer: &Expr, target: &TextureDesc) -> Option<Place> {
        let inner = w.loops.last();
        let at = |i: i64| {
            layer.eval(&|n| {
                if Some(n) == inner.map(String::as_str) {
                    Some(Val::Int(i))
                } else {
                    self.values.get(n).map(|v| Val::from(*v))
                }
            })
        };
        let end = i64::from(self.counts.last().copied().unwrap_or(1)) - 1;
        let (a, b, last) = (at(0), at(1), at(end));
        let (a, b, last) = (self.keep(a)?, self.keep(b)?, self.keep(last)?);
        let place = match (&a, &b) {
            (Val::Int(x), Val::Int(y)) if x == y => {
                u32::try_from(*x).ok().filter(|x| *x < target.layers).map(Place::Layer)
            }
            (Val::Int(x), Val::Int(y)) if x.checked_add(1) == Some(*y) && last == Val::Int(x.saturating_add(end)) => {
                let last = x.saturating_add(end);
                if last >= target.layers.into() {
                    let d = Diagnostic::error(format!("the loop's last iteration draws to layer {last}"));
                    let d = d.at(&layer.span, format!("the target has {} layers", target.layers));
                    self.faults.push(d.help("give the target more layers, or the loop fewer iterations"));
                    return None;
                }
                u32::try_from(*x).ok().map(Place::LoopLayer)
            }
            _ => None,
        };
        if place.is_none() {
            let d = Diagnostic::error(
                "a layer is a number below the target's layers, or the innermost loop's index plus a number",
            );
            self.faults.push(d.at(&layer.span, format!("the target has {} layers", target.layers)));
        }
        place
    }
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
                TextureKind::Cube { .. } => format!(" × {} faces", t.layers),
                TextureKind::D3 => format!("×{}", t.layers),
            };
            format!("{:?} {}×{}{kind}{tiles}", t.format, t.width, t.height)
        }
    }
}
