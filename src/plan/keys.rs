//! Computes the fingerprint of each unit (a step, or a whole loop), and from it the version of every content. Needs no
//! device.
//!
//! A fingerprint hashes all [`inputs`] of a unit. It contains no index into the plan and no name from the graph, so
//! equal work has equal versions in any two plans.

use super::inputs::{self, Contents, InputKind, Moving, Named, ReadInputs, ResourceAccess, StepInput, add};
use super::tables::SceneInputs;
use super::{Desc, Frames, Loop, OrderNode, Plan, ResourceId, StepId, Until};
use crate::content::hash;
use crate::scene::CONTENT_HASH;
use crate::value::Type;
use crate::value::{Value, Values};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Identifies a content. [`UNDEFINED`]: nothing has been written.
pub type Version = u128;

/// The version of a content that nobody has defined.
pub const UNDEFINED: Version = 0;

/// A step, or a loop as a whole.
#[derive(Debug)]
pub struct Unit {
    pub name: Arc<str>,
    pub steps: Vec<StepId>,
    /// Those in which it runs.
    pub frames: Frames,
    /// Read before the unit itself wrote them, or written in part only; in the order of their roles.
    pub needs: Vec<ResourceId>,
    /// For each of `needs` the last unit before that writes it.
    pub makers: Vec<Option<usize>>,
    /// In the order of their roles; dirty bits excepted, whose content holds for one frame.
    pub writes: Vec<ResourceId>,
    /// Dirty bits that the unit reads.
    pub bits: Vec<ResourceId>,
    /// Resources by the order in which the unit comes to them: its own names for them.
    roles: BTreeMap<ResourceId, usize>,
    /// Inputs known with the plan, to show.
    fixed: Arc<Contents>,
    /// All of `fixed` in its order.
    start: u128,
    given: Vec<Given>,
    /// Of `given`, then of `needs`.
    names: Arc<[Named]>,
}

/// An input that a frame brings.
#[derive(Debug)]
enum Given {
    /// A value of the frame; without one, that of the plan.
    Value(Option<Value>),
    /// Index into [`Plan::tables`].
    Table(usize),
    Geometry,
    Textures,
    /// When the plan began.
    Began,
    /// The frame's number.
    Frame,
}

/// The units of a plan, in their order.
#[derive(Debug)]
pub struct Keys {
    pub units: Vec<Unit>,
    /// By resource: the last unit that writes it.
    pub last: Vec<Option<usize>>,
    /// By resource: it follows from dirty bits, and so from which instances ran in earlier frames.
    pub from_bits: Vec<bool>,
    /// The unit that writes dirty bits, by their buffer.
    pub markers: BTreeMap<ResourceId, usize>,
    /// By unit: history follows from what it makes. Nothing where no unit asks for [`CONTENT_HASH`].
    remembered: Vec<bool>,
    without: Option<InputKind>,
}

/// The versions that resources should have, if every unit ran.
#[derive(Debug, Default)]
pub struct Versions {
    /// By unit: its fingerprint.
    pub keys: Vec<Version>,
    /// By unit: the fingerprint without the inputs whose changes its dirty bits account for.
    pub rest: Vec<Version>,
    /// By unit: of the inputs that the frame brings.
    given: Vec<Vec<u128>>,
    /// By unit: of what it needs, in that order.
    pub before: Vec<Vec<Version>>,
    /// By unit: of what it writes, in that order.
    pub after: Vec<Vec<Version>>,
    /// By unit: it does not run in this frame, whose content is as it was.
    pub off: Vec<bool>,
    /// By resource: at the end of the frame.
    pub end: Vec<Version>,
}

impl Keys {
    /// The fingerprints of a plan's units as far as they are known without a frame. `without` leaves a kind of input
    /// out of all of them: contents will be wrong, and a test can see that the proof notices.
    pub fn of(plan: &Plan, without: Option<InputKind>) -> Keys {
        let mut units: Vec<Unit> = plan.order.iter().map(|node| unit(plan, node, without)).collect();
        let mut last = vec![None; plan.resources.len()];
        let mut markers = BTreeMap::new();
        let mut from_bits: Vec<bool> = plan.resources.iter().map(|r| r.bits).collect();
        for (i, unit) in units.iter_mut().enumerate() {
            unit.makers = unit.needs.iter().map(|r| last[r.0]).collect();
            unit.writes.iter().for_each(|r| last[r.0] = Some(i));
            if !unit.bits.is_empty() || unit.needs.iter().any(|r| from_bits[r.0]) {
                unit.writes.iter().for_each(|r| from_bits[r.0] = true);
            }
            let marks = |id: &&ResourceId| plan.resources[id.0].bits;
            let written = unit.steps.iter().flat_map(|s| &plan.steps[s.0].writes);
            markers.extend(written.filter(marks).map(|id| (*id, i)));
        }
        let mut remembered = vec![false; units.len()];
        let asked = units.iter().any(|unit| unit.names.iter().any(|named| named.name == CONTENT_HASH));
        for (i, unit) in units.iter().enumerate().rev().filter(|_| asked) {
            remembered[i] |= unit.writes.iter().any(|r| plan.resources[r.0].history);
            if remembered[i] {
                unit.makers.iter().flatten().for_each(|maker| remembered[*maker] = true);
            }
        }
        Keys { units, last, from_bits, markers, remembered, without }
    }

    /// A hash of all that history follows from, but the values that a frame brings and history itself.
    pub fn content(
        &self,
        plan: &Plan,
        history: impl Fn(ResourceId) -> Version,
        scene: &SceneInputs,
        values: &Values,
    ) -> Version {
        let of = |unit: &Unit| {
            let given = unit.given.iter().zip(&*unit.names).filter(|(given, named)| match given {
                Given::Value(_) => inputs::value(plan, &named.name) == Moving::default(),
                Given::Table(_) | Given::Geometry | Given::Textures => true,
                Given::Began | Given::Frame => false,
            });
            hash(&(unit.start, given.map(|(given, named)| given.hash(&named.name, scene, values)).collect::<Vec<_>>()))
        };
        let units = self.units.iter().zip(&self.remembered).filter(|(_, remembered)| **remembered);
        let lent = plan.inputs.iter().map(|r| history(*r));
        hash(&(units.map(|(unit, _)| of(unit)).collect::<Vec<_>>(), lent.collect::<Vec<_>>()))
    }

    /// The versions of a frame that begins with these contents of history.
    pub fn versions(
        &self,
        plan: &Plan,
        history: impl Fn(ResourceId) -> Version,
        scene: &SceneInputs,
        values: &Values,
    ) -> Versions {
        let mut now = vec![UNDEFINED; plan.resources.len()];
        for (i, _) in plan.resources.iter().enumerate().filter(|(_, r)| r.history || r.image.is_some()) {
            now[i] = history(ResourceId(i));
        }
        let mut all = Versions::default();
        for unit in &self.units {
            let before: Vec<Version> = unit.needs.iter().map(|r| now[r.0]).collect();
            all.off.push(!unit.frames.include(values));
            if all.off.last() == Some(&true) {
                all.keys.push(UNDEFINED);
                all.rest.push(UNDEFINED);
                all.given.push(vec![]);
                all.before.push(before);
                all.after.push(unit.writes.iter().map(|r| now[r.0]).collect());
                continue;
            }
            let counts = |kind: InputKind| Some(kind) != self.without;
            let hash_of = |(given, named): (&Given, &Named)| given.hash(&named.name, scene, values);
            let hashes: Vec<u128> = unit.given.iter().zip(&*unit.names).map(hash_of).collect();
            let kinds = unit.names.iter().map(|named| named.kind);
            let given = || unit.given.iter().zip(kinds.clone()).zip(&hashes).filter(|((_, kind), _)| counts(*kind));
            let needs = || unit.needs.iter().zip(&before).filter(|_| counts(InputKind::Resource));
            let of = |given: Vec<u128>, versions: Vec<Version>| hash(&(unit.start, given, versions));
            let key = of(given().map(|(_, h)| *h).collect(), needs().map(|(_, v)| *v).collect()).max(1);
            let rest = match plan.only(unit) {
                Some(only) => {
                    let other = |g: &Given| !matches!(g, Given::Table(i) if only.tables.contains(i));
                    let given = given().filter(|((g, _), _)| other(g)).map(|(_, h)| *h);
                    let needs = needs().filter(|(r, _)| !only.resources.contains(r)).map(|(_, v)| *v);
                    of(given.collect(), needs.collect())
                }
                None => UNDEFINED,
            };
            let after: Vec<Version> = unit.writes.iter().map(|r| unit.content(key, *r)).collect();
            unit.writes.iter().zip(&after).for_each(|(r, v)| now[r.0] = *v);
            all.keys.push(key);
            all.rest.push(rest);
            all.given.push(hashes);
            all.before.push(before);
            all.after.push(after);
        }
        all.end = now;
        all
    }
}

impl Versions {
    /// All that the result of a unit, by its number, depends on.
    pub fn inputs(&self, keys: &Keys, unit: usize) -> ReadInputs {
        let Unit { fixed, names, .. } = &keys.units[unit];
        let hashes = self.given[unit].iter().chain(&self.before[unit]).copied().collect();
        ReadInputs { fixed: fixed.clone(), names: names.clone(), hashes }
    }

    /// The unit that makes a resource in this frame, by the last that writes it in any.
    pub fn maker(&self, keys: &Keys, resource: ResourceId, last: Option<usize>) -> Option<usize> {
        let mut maker = last;
        while let Some(i) = maker.filter(|i| self.off[*i]) {
            // One that runs in some frames needs what it writes.
            let unit = &keys.units[i];
            let role = unit.needs.iter().position(|r| *r == resource);
            maker = role.and_then(|role| unit.makers[role]);
        }
        maker
    }
}

impl Unit {
    /// The version of what it writes to a resource when it has this fingerprint.
    pub fn content(&self, key: Version, resource: ResourceId) -> Version {
        hash(&(key, self.roles.get(&resource))).max(1)
    }

    /// The volatility of the unit's own inputs: values and tables, not results of other units.
    pub fn moving(&self, plan: &Plan) -> Moving {
        self.given.iter().zip(&*self.names).fold(Moving::default(), |all, (given, named)| match given {
            Given::Value(_) => all | inputs::value(plan, &named.name),
            Given::Table(i) => all | inputs::table(plan, *i),
            Given::Geometry | Given::Textures | Given::Began | Given::Frame => all,
        })
    }

    /// What it runs again for, besides results of others: the code, values, tables and the like, by name.
    pub fn depends(&self) -> Vec<String> {
        let all: BTreeSet<&Named> = self.fixed.keys().chain(&self.names[..self.given.len()]).collect();
        let telling = |i: &&Named| {
            !matches!(i.kind, InputKind::Resource | InputKind::Size | InputKind::Target | InputKind::Extent)
        };
        all.into_iter().filter(telling).map(Named::to_string).collect()
    }
}

impl Given {
    fn hash(&self, name: &str, scene: &SceneInputs, values: &Values) -> u128 {
        match self {
            Given::Value(known) => hash(&values.get(name).or(known.as_ref()).map(|v| (v.ty(), v.bytes()))),
            Given::Table(i) => scene.tables.get(*i).copied().unwrap_or(0),
            Given::Geometry => scene.assets.geometry,
            Given::Textures => scene.assets.textures,
            Given::Began => scene.began.into(),
            Given::Frame => scene.frame.into(),
        }
    }
}

/// The version of a content that memory is given when it is allocated.
pub fn initial(desc: &Desc, number: Type, value: [f64; 4]) -> Version {
    hash(&("initial", desc.shape(), number, value.map(f64::to_bits))).max(1)
}

/// What a step does, as far as its time depends on it and a plan knows: code, sizes, how much it does, how it draws.
pub fn work(plan: &Plan, id: StepId) -> u128 {
    let takes_time =
        |kind: InputKind| matches!(kind, InputKind::Shader | InputKind::Size | InputKind::Extent | InputKind::Target);
    let unit = unit(plan, &OrderNode::Step(id), None);
    let fixed = unit.fixed.iter().filter(|(i, _)| takes_time(i.kind));
    hash(&fixed.map(|(i, content)| (i.kind, *content)).collect::<Vec<_>>())
}

fn unit(plan: &Plan, node: &OrderNode, without: Option<InputKind>) -> Unit {
    let name = match node {
        OrderNode::Step(s) => &plan.steps[s.0].name,
        OrderNode::Loop(l) => &l.name,
    };
    let unit = Unit {
        name: name.as_str().into(),
        steps: vec![],
        frames: Frames::All,
        needs: vec![],
        makers: vec![],
        writes: vec![],
        bits: vec![],
        roles: BTreeMap::new(),
        fixed: Arc::default(),
        start: 0,
        given: vec![],
        names: Arc::default(),
    };
    let (written, needed) = (BTreeSet::new(), BTreeSet::new());
    let (fixed, names) = (Contents::new(), vec![]);
    let mut gather = UnitBuilder { plan, without, around: vec![], order: vec![], written, needed, fixed, names, unit };
    gather.node(node);
    gather.done()
}

/// Walks a unit.
struct UnitBuilder<'p> {
    plan: &'p Plan,
    without: Option<InputKind>,
    /// Names of the loops around, outermost first.
    around: Vec<&'p str>,
    /// What `start` is made of.
    order: Vec<u128>,
    written: BTreeSet<ResourceId>,
    needed: BTreeSet<ResourceId>,
    fixed: Contents,
    names: Vec<Named>,
    unit: Unit,
}

impl<'p> UnitBuilder<'p> {
    fn done(self) -> Unit {
        let UnitBuilder { plan, mut unit, order, written, needed, fixed, mut names, .. } = self;
        let by_role = |set: BTreeSet<ResourceId>| {
            let mut list: Vec<ResourceId> = set.into_iter().collect();
            list.sort_by_key(|r| unit.roles.get(r));
            list
        };
        let content = written.into_iter().filter(|id| !plan.resources[id.0].bits);
        (unit.needs, unit.writes) = (by_role(needed), by_role(content.collect()));
        unit.start = hash(&order);
        let resource = |id: &ResourceId| Named { kind: InputKind::Resource, name: plan.resources[id.0].name.clone() };
        names.extend(unit.needs.iter().map(resource));
        (unit.fixed, unit.names) = (Arc::new(fixed), names.into());
        unit
    }

    fn fix(&mut self, kind: InputKind, name: &str, content: u128) {
        if self.without != Some(kind) {
            self.order.push(content);
            add(&mut self.fixed, Named { kind, name: name.into() }, content);
        }
    }

    fn give(&mut self, kind: InputKind, name: &str, given: Given) {
        self.unit.given.push(given);
        self.names.push(Named { kind, name: name.into() });
    }

    fn role(&mut self, id: ResourceId) -> usize {
        let next = self.unit.roles.len();
        *self.unit.roles.entry(id).or_insert(next)
    }

    fn node(&mut self, node: &'p OrderNode) {
        match node {
            OrderNode::Step(id) => {
                self.unit.steps.push(*id);
                let plan = self.plan;
                self.unit.frames = plan.steps[id.0].frames;
                let inputs = inputs::of(plan, &plan.steps[id.0], &self.around);
                inputs.into_iter().for_each(|input| self.input(input));
            }
            OrderNode::Loop(Loop { name, count, until, body }) => {
                self.fix(InputKind::Loop, name, hash(count));
                // Who ends it makes no difference to the result.
                if let Some(Until { buffer, comparison, value, ending: _ }) = until {
                    let role = self.role(*buffer);
                    self.fix(InputKind::Loop, name, hash(&(role, comparison, value.to_bits())));
                }
                self.around.push(name);
                body.iter().for_each(|n| self.node(n));
                self.around.pop();
                self.fix(InputKind::Loop, name, hash(&"end"));
            }
        }
    }

    fn input(&mut self, input: StepInput<'p>) {
        match input {
            StepInput::Fixed { kind, name, content } => self.fix(kind, name, content),
            StepInput::Value { name, known } => self.give(InputKind::Value, name, Given::Value(known)),
            StepInput::Table(i) => {
                let name = self.plan.tables.get(i).map_or("", |t| t.table.as_str());
                self.give(InputKind::Table, name, Given::Table(i));
            }
            StepInput::Geometry => self.give(InputKind::Geometry, "", Given::Geometry),
            StepInput::Textures => self.give(InputKind::Textures, "", Given::Textures),
            StepInput::Began => self.give(InputKind::Value, "the plan, as the shader checks itself", Given::Began),
            StepInput::Bits(id) => {
                self.give(InputKind::Value, &self.plan.resources[id.0].name, Given::Frame);
                self.unit.bits.push(id);
            }
            StepInput::Resource { id, access } => self.resource(id, access),
        }
    }

    fn resource(&mut self, id: ResourceId, access: ResourceAccess) {
        let role = self.role(id);
        match access {
            ResourceAccess::Bound => {
                let resource = &self.plan.resources[id.0];
                self.fix(InputKind::Extent, "", hash(&role));
                self.fix(InputKind::Size, &resource.name, hash(&resource.desc.shape()));
            }
            ResourceAccess::Read | ResourceAccess::Part if !self.written.contains(&id) => drop(self.needed.insert(id)),
            ResourceAccess::Read | ResourceAccess::Part | ResourceAccess::Whole => {}
        }
        if matches!(access, ResourceAccess::Part | ResourceAccess::Whole) {
            self.written.insert(id);
        }
    }
}
