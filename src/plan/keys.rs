//! What the result of each step is made of, and the version of every content that follows from it. No device.
//!
//! The version of a content is a hash of the key of the unit that made it: a step, or a loop as a whole. A key is made of
//! all that the unit reads: its shaders, the bytes of the values it asks for, the versions of its inputs, sizes, and
//! so on. The records that say what runs are those that the key is made from. No key names anything by its place in
//! a plan or by a name of the graph, so equal work has equal versions in any two plans.

use super::ingredient::{Ingredient, Ingredients, Kind, add};
use super::masked::{self, Reads};
use super::member::Members;
use super::outside::Outside;
use super::region;
use super::{
    Action, Binding, Comparison, Desc, Draw, Geometry, Loop, Masked, Node, Own, Plan, ResourceId, Rows, Step, StepId,
    Until,
};
use crate::content::hash;
use crate::shader::Layout;
use crate::value::{Value, Values};
use std::collections::{BTreeMap, BTreeSet};
use std::hash::Hash;

/// Identifies a content. [`UNDEFINED`]: nothing has been written.
pub type Version = u128;

/// The version of a content that nobody has defined.
pub const UNDEFINED: Version = 0;

/// A step, or a loop as a whole.
#[derive(Debug)]
pub struct Unit {
    pub name: String,
    pub steps: Vec<StepId>,
    /// Read before the unit itself wrote them, or written in part only; in the order of their roles.
    pub needs: Vec<ResourceId>,
    /// For each of `needs` the last unit before that writes it.
    pub makers: Vec<Option<usize>>,
    /// In the order of their roles.
    pub writes: Vec<ResourceId>,
    /// Resources by the order in which the unit comes to them: its own names for them.
    roles: BTreeMap<ResourceId, usize>,
    /// What is known with the plan, to show.
    fixed: Ingredients,
    /// Of `needs` those that hold nothing but what [`Kind::Member`] tells apart already.
    told: BTreeSet<ResourceId>,
    /// All of `fixed` in its order.
    start: u128,
    given: Vec<(Ingredient, Given)>,
    /// `None`: it has no members, or runs for all of them at once.
    apart: Option<Apart>,
}

/// What tells the members of a unit apart.
#[derive(Debug)]
enum Apart {
    /// What each sees; by the step.
    Seen(usize),
    /// What each reads of its own.
    Own(Own),
}

/// Who made a content part by part.
struct Made {
    unit: usize,
    /// A version of all that its parts have in common.
    common: Version,
    /// Whose members see the scene.
    step: Option<usize>,
}

/// An ingredient that a frame brings.
#[derive(Debug)]
enum Given {
    /// A value of the frame; without one, that of the plan.
    Value(Option<Value>),
    /// Index into [`Plan::tables`].
    Table(usize),
    Geometry,
    /// Of the triangles for rays.
    Order,
    Textures,
    /// When the plan began.
    Began,
    Members,
    /// Of the draws in this buffer.
    Windows(ResourceId),
}

/// The units of a plan, in their order.
#[derive(Debug)]
pub struct Keys {
    pub units: Vec<Unit>,
    /// By resource: the last unit that writes it.
    pub last: Vec<Option<usize>>,
    pub without: Option<Kind>,
}

/// The versions that resources should have, if every unit ran.
#[derive(Debug, Default)]
pub struct Versions {
    /// By unit.
    pub keys: Vec<Version>,
    /// By unit: of all that its key is made of but what tells its members apart.
    pub common: Vec<Version>,
    /// By unit that can run for some of its members: a version of what each of them alone depends on; else empty.
    pub members: Vec<Members>,
    /// By unit whose members read parts that a mask chooses.
    pub reads: Vec<Option<Reads>>,
    /// By unit: of what it needs, in that order.
    pub before: Vec<Vec<Version>>,
    /// By unit: of what it writes, in that order.
    pub after: Vec<Vec<Version>>,
    /// By resource: at the end of the frame.
    pub end: Vec<Version>,
}

impl Keys {
    /// The keys of a plan's units as far as they are known without a frame. `without` leaves a kind of ingredient out of
    /// all keys: contents will be wrong, and a test can see that the proof notices.
    pub fn of(plan: &Plan, without: Option<Kind>) -> Keys {
        let unit = |node: &Node| {
            let name = match node {
                Node::Step(s) => plan.steps[s.0].name.clone(),
                Node::Loop(l) => l.name.clone(),
            };
            let mut g = Gather::new(plan, name, without);
            g.node(node);
            g.done()
        };
        let mut units: Vec<Unit> = plan.order.iter().map(unit).collect();
        let mut last = vec![None; plan.resources.len()];
        for (i, unit) in units.iter_mut().enumerate() {
            unit.makers = unit.needs.iter().map(|r| last[r.0]).collect();
            unit.writes.iter().for_each(|r| last[r.0] = Some(i));
        }
        Keys { units, last, without }
    }

    /// Resources in the order in which they are made.
    pub fn in_order(&self, resources: impl IntoIterator<Item = ResourceId>) -> Vec<ResourceId> {
        let mut all: Vec<ResourceId> = resources.into_iter().collect();
        all.sort_by_key(|id| (self.last[id.0], *id));
        all
    }

    /// Whether a resource follows from what members of some step see.
    pub fn follows_from_views(&self, resource: ResourceId) -> bool {
        self.makers(resource).into_iter().any(|i| matches!(self.units[i].apart, Some(Apart::Seen(_))))
    }

    /// Whether what makes a resource may change what is kept from frame to frame: the rest of a frame can't begin after it.
    pub fn changes_history(&self, plan: &Plan, resource: ResourceId) -> bool {
        let kept = |r: &ResourceId| plan.resources[r.0].history;
        self.makers(resource).into_iter().any(|i| self.units[i].writes.iter().any(kept))
    }

    /// The units that a resource is made by, and what those need.
    fn makers(&self, resource: ResourceId) -> BTreeSet<usize> {
        let mut open: Vec<usize> = self.last[resource.0].into_iter().collect();
        let mut found: BTreeSet<usize> = open.iter().copied().collect();
        while let Some(i) = open.pop() {
            open.extend(self.units[i].makers.iter().flatten().filter(|maker| found.insert(**maker)));
        }
        found
    }

    /// The versions of a frame that begins with these contents of history.
    pub fn versions(
        &self,
        plan: &Plan,
        history: impl Fn(ResourceId) -> Version,
        outside: &Outside,
        values: &Values,
    ) -> Versions {
        let mut now = vec![UNDEFINED; plan.resources.len()];
        for (i, _) in plan.resources.iter().enumerate().filter(|(_, r)| r.history) {
            now[i] = history(ResourceId(i));
        }
        let mut all = Versions::default();
        let mut made: BTreeMap<ResourceId, Made> = BTreeMap::new();
        for (i, unit) in self.units.iter().enumerate() {
            let before: Vec<Version> = unit.needs.iter().map(|r| now[r.0]).collect();
            let (members, reads) = unit.members(&now, &made, &all.members, outside);
            let given = unit.given.iter().filter(|(i, g)| Some(i.kind) != self.without && !matches!(g, Given::Members));
            let given: Vec<u128> = given.map(|(i, g)| g.hash(&i.name, &members, outside, values)).collect();
            let untold = unit.needs.iter().zip(&before).filter(|(r, _)| !unit.told.contains(r)).map(|(_, v)| *v);
            let inputs = (self.without != Some(Kind::Input)).then(|| untold.collect::<Vec<_>>());
            let common = hash(&(unit.start, given, inputs)).max(1);
            let told = unit.apart.is_some() && self.without != Some(Kind::Member);
            let key = if told { hash(&(common, members.all())).max(1) } else { common };
            let after: Vec<Version> = unit.writes.iter().map(|r| outside.alike.of(unit.content(key, *r))).collect();
            for (r, v) in unit.writes.iter().zip(&after) {
                now[r.0] = *v;
                made.remove(r);
                if !members.is_empty() {
                    let step = if let Some(Apart::Seen(step)) = unit.apart { Some(step) } else { None };
                    made.insert(*r, Made { unit: i, common: unit.content(common, *r), step });
                }
            }
            all.keys.push(key);
            all.common.push(common);
            all.members.push(members);
            all.reads.push(reads);
            all.before.push(before);
            all.after.push(after);
        }
        all.end = now;
        all
    }
}

impl Unit {
    fn called(name: String) -> Unit {
        Unit {
            name,
            steps: vec![],
            needs: vec![],
            makers: vec![],
            writes: vec![],
            roles: BTreeMap::new(),
            told: BTreeSet::new(),
            fixed: Ingredients::new(),
            start: 0,
            given: vec![],
            apart: None,
        }
    }

    /// The version of what it writes to a resource when it has this key.
    pub fn content(&self, key: Version, resource: ResourceId) -> Version {
        hash(&(key, self.roles.get(&resource))).max(1)
    }

    /// What it runs again for, besides results of others: the code, values, tables and the like, by name.
    pub fn depends(&self) -> Vec<String> {
        let all: BTreeSet<&Ingredient> = self.fixed.keys().chain(self.given.iter().map(|(i, _)| i)).collect();
        let telling = |i: &&Ingredient| !matches!(i.kind, Kind::Input | Kind::Size | Kind::Target | Kind::Extent);
        all.into_iter().filter(telling).map(Ingredient::to_string).collect()
    }

    /// What its members do with what tells them apart: they see it, or read it.
    pub fn verb(&self) -> &'static str {
        if matches!(self.apart, Some(Apart::Seen(_))) { "see" } else { "read" }
    }

    /// Whether its members read parts of a resource, as its last maker has left them.
    pub fn reads_parts(&self, resource: ResourceId) -> bool {
        let Some(Apart::Own(own)) = &self.apart else { return false };
        own.reads.contains(&resource) || own.masked.iter().any(|m| m.parts == resource)
    }

    /// What masks choose from for its members.
    pub fn masked(&self) -> &[Masked] {
        if let Some(Apart::Own(own)) = &self.apart { &own.masked } else { &[] }
    }

    /// A version of what each member alone depends on, given those of the units before and what they made part by part.
    fn members(
        &self,
        now: &[Version],
        made: &BTreeMap<ResourceId, Made>,
        units: &[Members],
        outside: &Outside,
    ) -> (Members, Option<Reads>) {
        let Own { members, reads, masked, rows } = match &self.apart {
            None => return (Members::default(), None),
            Some(Apart::Seen(step)) => {
                return (outside.members.get(step).map(|s| s.versions.clone()).unwrap_or_default(), None);
            }
            Some(Apart::Own(own)) => own,
        };
        let count = *members as usize;
        let parts = |r: &ResourceId| made.get(r).map(|m| (m.common, outside.parts.of(*r, m.common, &units[m.unit])));
        let whole = |r: &ResourceId| (now[r.0], Members::default());
        let input = |r: &ResourceId| parts(r).filter(|(_, parts)| parts.go_into(count)).unwrap_or(whole(r));
        let table = |rows: &Rows| outside.rows.get(rows).cloned().unwrap_or_default();
        let mut from: Vec<(Version, Members)> = reads.iter().map(input).chain(rows.iter().map(table)).collect();
        let own = Members::reading(count, from.clone());
        if masked.is_empty() {
            return (own, None);
        }
        from.extend(masked.iter().map(|m| whole(&m.parts)));
        let all = Members::reading(count, from);
        // Of layers that a draw makes, squares.
        let squares = |resource: &ResourceId| {
            let Made { unit, common, step: Some(step) } = made.get(resource)? else { return None };
            let squares = &outside.members.get(step).filter(|seen| seen.versions == units[*unit])?.squares;
            (!squares.is_empty()).then(|| (*common, squares.clone()))
        };
        let of = |resource: ResourceId| {
            let (common, parts) = squares(&resource).or_else(|| parts(&resource)).unwrap_or_else(|| whole(&resource));
            masked::Made { resource, common, parts }
        };
        let members = outside.settled.get(&self.name).and_then(|settled| settled.members(&all));
        let (chosen, masks) = masked.iter().map(|m| (of(m.parts), of(m.mask))).unzip();
        let reads = Reads { own, all: all.clone(), parts: chosen, masks };
        (members.unwrap_or(all), Some(reads))
    }

    /// All that its result depends on in a frame, of whose versions it is unit number `index`.
    pub fn ingredients(
        &self,
        plan: &Plan,
        (versions, index): (&Versions, usize),
        outside: &Outside,
        values: &Values,
    ) -> Ingredients {
        let (before, members) = (&versions.before[index], &versions.members[index]);
        let mut all = self.fixed.clone();
        for (ingredient, given) in &self.given {
            add(&mut all, ingredient.clone(), given.hash(&ingredient.name, members, outside, values));
        }
        for (r, version) in self.needs.iter().zip(before).filter(|(r, _)| !self.told.contains(r)) {
            add(&mut all, Ingredient { kind: Kind::Input, name: plan.resources[r.0].name.clone() }, *version);
        }
        all
    }
}

impl Given {
    fn hash(&self, name: &str, members: &Members, outside: &Outside, values: &Values) -> u128 {
        match self {
            Given::Value(known) => hash(&values.get(name).or(known.as_ref()).map(|v| (v.ty(), v.bytes()))),
            Given::Table(i) => outside.tables.get(*i).copied().unwrap_or(0),
            Given::Geometry => outside.assets.geometry,
            Given::Order => outside.assets.order,
            Given::Textures => outside.assets.textures,
            Given::Began => outside.began.into(),
            Given::Members => members.all(),
            Given::Windows(draws) => match outside.windows.get(draws) {
                Some(windows) => hash(&windows.iter().map(|w| w.map(|w| w.texels)).collect::<Vec<_>>()),
                None => 0,
            },
        }
    }
}

/// The version of a content that memory is given when it is allocated.
pub fn initial(desc: &Desc, value: [f64; 4]) -> Version {
    hash(&("initial", desc.shape(), value.map(f64::to_bits))).max(1)
}

/// What a step does, as far as its time depends on it and a plan knows: code, sizes, how much it does, how it draws.
pub fn work(plan: &Plan, id: StepId) -> u128 {
    let mut g = Gather::new(plan, String::new(), None);
    g.step(&plan.steps[id.0]);
    let takes_time = |kind: Kind| matches!(kind, Kind::Shader | Kind::Size | Kind::Extent | Kind::Target);
    let fixed = g.unit.fixed.iter().filter(|(i, _)| takes_time(i.kind));
    hash(&fixed.map(|(i, content)| (i.kind, *content)).collect::<Vec<_>>())
}

/// Walks a unit.
struct Gather<'p> {
    plan: &'p Plan,
    without: Option<Kind>,
    /// Names of the loops around, outermost first.
    around: Vec<&'p str>,
    /// What `start` is made of.
    order: Vec<u128>,
    written: BTreeSet<ResourceId>,
    needed: BTreeSet<ResourceId>,
    unit: Unit,
}

// Every struct is taken apart with all its fields named: what is added to a plan is forgotten in no key.
impl<'p> Gather<'p> {
    fn new(plan: &'p Plan, name: String, without: Option<Kind>) -> Gather<'p> {
        let (written, needed) = (BTreeSet::new(), BTreeSet::new());
        Gather { plan, without, around: vec![], order: vec![], written, needed, unit: Unit::called(name) }
    }

    fn done(self) -> Unit {
        let Gather { mut unit, order, written, needed, .. } = self;
        let by_role = |set: BTreeSet<ResourceId>| {
            let mut list: Vec<ResourceId> = set.into_iter().collect();
            list.sort_by_key(|r| unit.roles.get(r));
            list
        };
        (unit.needs, unit.writes) = (by_role(needed), by_role(written));
        unit.start = hash(&order);
        unit
    }

    fn fix(&mut self, kind: Kind, name: &str, content: &impl Hash) {
        if self.without != Some(kind) {
            let content = hash(content);
            self.order.push(content);
            add(&mut self.unit.fixed, Ingredient { kind, name: name.into() }, content);
        }
    }

    fn give(&mut self, kind: Kind, name: &str, given: Given) {
        self.unit.given.push((Ingredient { kind, name: name.into() }, given));
    }

    fn role(&mut self, id: ResourceId) -> usize {
        let next = self.unit.roles.len();
        *self.unit.roles.entry(id).or_insert(next)
    }

    /// A resource that a step touches: which it is to the unit, and its size.
    fn touch(&mut self, id: ResourceId) {
        let role = self.role(id);
        let resource = &self.plan.resources[id.0];
        self.fix(Kind::Extent, "", &role);
        self.fix(Kind::Size, &resource.name, &resource.desc.shape());
    }

    fn node(&mut self, node: &'p Node) {
        match node {
            Node::Step(id) => {
                self.unit.steps.push(*id);
                self.step(&self.plan.steps[id.0]);
            }
            Node::Loop(Loop { name, count, until, body }) => {
                self.fix(Kind::Loop, name, count);
                // Who ends it makes no difference to the result.
                if let Some(Until { buffer, comparison, value, ending: _ }) = until {
                    let comparison = match comparison {
                        Comparison::Less => 0,
                        Comparison::LessEqual => 1,
                        Comparison::Greater => 2,
                        Comparison::GreaterEqual => 3,
                    };
                    let role = self.role(*buffer);
                    self.fix(Kind::Loop, name, &(role, comparison, value.to_bits()));
                }
                self.around.push(name);
                body.iter().for_each(|n| self.node(n));
                self.around.pop();
                self.fix(Kind::Loop, name, &"end");
            }
        }
    }

    fn step(&mut self, step: &'p Step) {
        // What its members see is in the parts.
        let Step { name: _, pass: _, group: _, action, bindings, reads, writes, own, sight: _, after: _ } = step;
        let mut variables = [].as_slice();
        let seen = match action {
            Action::Draw(_) | Action::Compute { .. } if self.around.is_empty() => region::parts(self.plan, step),
            _ => None,
        };
        let own = own.as_ref().filter(|_| self.around.is_empty() && region::apart(self.plan, step));
        match action {
            Action::Draw(draw) => {
                self.draw(draw);
                variables = &self.plan.shaders[draw.shader].interface.variables;
            }
            Action::Compute { shader, entry, groups } => {
                self.shader(*shader, entry);
                self.fix(Kind::Extent, "", groups);
                if seen.is_some() {
                    // Tables that hold places hold what of the triangles follows from them, in their order.
                    self.give(Kind::Geometry, "", Given::Geometry);
                    self.give(Kind::Geometry, "", Given::Order);
                }
                variables = &self.plan.shaders[*shader].interface.variables;
            }
            Action::Copy { from, to } => {
                self.touch(*from);
                self.touch(*to);
            }
            Action::Clear { target, value } => {
                self.touch(*target);
                self.fix(Kind::Extent, "", &value.map(f64::to_bits));
            }
        }
        for (at, binding) in bindings.iter().enumerate() {
            match binding {
                Binding::Resource(id) => self.touch(*id),
                Binding::Uniform { layout, extra } => self.uniform(layout, extra),
                Binding::Table(i) if seen.as_ref().is_some_and(|s| s.tables.contains(i)) => {}
                Binding::Table(i) if own.is_some_and(|own| own.rows.iter().any(|rows| rows.table == *i)) => {}
                Binding::Table(i) => {
                    let name = self.plan.tables.get(*i).map_or("", |t| t.table.as_str());
                    self.give(Kind::Table, name, Given::Table(*i));
                }
                // Which it does in a run makes no difference in the end, nor what it leaves as it is.
                Binding::Members | Binding::Moved(_) => {}
                Binding::Windows { draws, members: _ } => self.give(Kind::Extent, "", Given::Windows(*draws)),
                Binding::SceneTextures => self.give(Kind::Textures, "", Given::Textures),
                // A plan knows of no checks but those of its own runs.
                Binding::Report => self.give(Kind::Value, "the plan, as the shader checks itself", Given::Began),
                Binding::Sampler(desc) => {
                    let name = variables.get(at).map_or("", |v| v.name.as_str());
                    self.fix(Kind::Sampler, name, desc);
                }
            }
        }
        if let (Some(seen), Some(id)) = (seen, self.unit.steps.last().copied()) {
            self.give(Kind::Member, "see", Given::Members);
            self.unit.apart = Some(Apart::Seen(id.0));
            self.unit.told.extend(seen.resources);
        } else if let Some(own) = own {
            self.give(Kind::Member, "read", Given::Members);
            self.unit.apart = Some(Apart::Own(own.clone()));
            self.unit.told.extend(own.reads.iter().copied().chain(own.masked.iter().map(|m| m.parts)));
        }
        let whole = matches!(action, Action::Copy { .. } | Action::Clear { .. });
        let partly = if whole { [].iter() } else { writes.iter() };
        // What the host reads alone, it asks for.
        let bound = |id: &ResourceId| bindings.iter().any(|b| matches!(b, Binding::Resource(r) if r == id));
        let asked = |id: &ResourceId| own.is_some_and(|own| own.masked.iter().any(|m| m.mask == *id)) && !bound(id);
        for id in reads.iter().filter(|id| !asked(id)).chain(partly) {
            self.role(*id);
            if !self.written.contains(id) {
                self.needed.insert(*id);
            }
        }
        for id in writes {
            self.role(*id);
            self.written.insert(*id);
        }
    }

    fn shader(&mut self, index: usize, entries: &impl Hash) {
        let shader = &self.plan.shaders[index];
        self.fix(Kind::Shader, &shader.path, &(shader.content, entries));
    }

    fn draw(&mut self, draw: &'p Draw) {
        let Draw { shader, vertex, fragment, geometry, color, depth, members, indirect, views, level } = draw;
        self.shader(*shader, &(vertex, fragment));
        match geometry {
            Geometry::Scene { cull } => {
                self.fix(Kind::Target, "", cull);
                self.give(Kind::Geometry, "", Given::Geometry);
            }
            Geometry::Screen => self.fix(Kind::Target, "", &"screen"),
        }
        for super::ColorTarget { resource, location, format, clear, blend } in color {
            self.touch(*resource);
            let clear = clear.map(|c| c.map(f64::to_bits));
            self.fix(Kind::Target, "", &(location, format, clear, blend));
        }
        if let Some(super::DepthTarget { resource, format, clear, compare, write }) = depth {
            self.touch(*resource);
            self.fix(Kind::Target, "", &(format, clear.map(f32::to_bits), compare, write));
        }
        if let Some(super::Indirect { buffer, first, second, frusta: _, occluders: _, clusters: _ }) = indirect {
            self.touch(*buffer);
            self.fix(Kind::Extent, "", &(first, second));
        }
        self.fix(Kind::Extent, "", &(members, views));
        // The rest of a level follows from the scene's triangles.
        if let Some(level) = level.and_then(|i| self.plan.levels.get(i)) {
            self.fix(Kind::Extent, "", &level.tolerance.to_bits());
        }
    }

    /// The values in a uniform's bytes. Their places in it are the shader's.
    fn uniform(&mut self, layout: &'p Layout, extra: &Values) {
        for member in layout.members.iter().filter(|m| m.read) {
            let name = member.name.as_str();
            if let Some(value) = extra.get(name) {
                self.fix(Kind::Value, name, &(value.ty(), value.bytes()));
            } else if let Some(depth) = self.around.iter().rposition(|l| *l == name) {
                self.fix(Kind::Loop, name, &("index", depth));
            } else {
                self.give(Kind::Value, name, Given::Value(self.plan.values.get(name).copied()));
            }
        }
    }
}
