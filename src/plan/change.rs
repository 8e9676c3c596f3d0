//! What changed since the last frame, and which steps must run because of it. No device.
//!
//! Every content of a resource has a version: a hash of the step that made it and of everything that step read, the
//! versions of its inputs among them. So the version a resource should have is known before anything runs. A
//! step runs only when a version that someone needs is not already in memory; a loop is one unit. Nobody marks
//! anything as changed by hand.

use super::tables::pack;
use super::{Action, Binding, Node, Plan, ResourceId, StepId};
use crate::diag::Checked;
use crate::scene::Table;
use crate::value::Values;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};

/// Identifies a content. [`UNDEFINED`]: nothing has been written.
type Version = u128;

const UNDEFINED: Version = 0;

/// What the memory of a plan holds, and what its units read when they last ran.
#[derive(Debug, Clone, Default)]
pub struct Held {
    /// By slot: whose content it is, and which.
    slots: Vec<Option<(ResourceId, Version)>>,
    /// By place in the plan's order.
    ran: BTreeMap<usize, Ingredients>,
    /// By index of [`Plan::tables`].
    tables: Vec<u64>,
}

/// What a unit's result depends on, by the name to show.
type Ingredients = BTreeMap<Ingredient, u64>;

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Ingredient {
    Value(String),
    Table(String),
    Input(ResourceId),
}

/// Why a unit runs or does not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Why {
    /// Runs: nothing is known of an earlier run.
    First,
    /// Runs: these values, tables or inputs differ from those of its last run.
    Changed(Vec<String>),
    /// Runs: what it made has been overwritten since, in memory it shares.
    Overwritten,
    /// Does not run: it would make what it made before.
    Unchanged,
    /// Does not run: nothing that runs reads its result.
    NotNeeded,
}

impl std::fmt::Display for Why {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Why::First => f.write_str("first run"),
            Why::Changed(names) => write!(f, "changed: {}", names.join(", ")),
            Why::Overwritten => f.write_str("its result was overwritten in shared memory"),
            Why::Unchanged => f.write_str("nothing it reads has changed"),
            Why::NotNeeded => f.write_str("nothing that runs reads it"),
        }
    }
}

/// The choice for one frame.
#[derive(Debug, Clone)]
pub struct Selection {
    /// By step.
    pub run: Vec<bool>,
    /// By step.
    pub why: Vec<Why>,
    next: Held,
}

impl Selection {
    /// What is held once the selected steps have run.
    pub fn done(self) -> Held {
        self.next
    }

    /// As [`Selection::done`], while the selection is still needed.
    pub fn held(&self) -> &Held {
        &self.next
    }

    /// How many steps run.
    pub fn count(&self) -> usize {
        self.run.iter().filter(|r| **r).count()
    }
}

impl Held {
    /// The version of a resource, when its memory holds it.
    pub fn version(&self, plan: &Plan, id: ResourceId) -> Option<u128> {
        let slot = plan.resources.get(id.0)?.slot;
        self.slots.get(slot).copied().flatten().filter(|(holder, _)| *holder == id).map(|(_, v)| v)
    }
}

/// A step, or a loop as a whole.
struct Unit {
    steps: Vec<StepId>,
    /// Read before the unit itself wrote them, or written in part only.
    needs: BTreeSet<ResourceId>,
    writes: BTreeSet<ResourceId>,
}

/// Chooses the steps of a frame. `tables` are the scene's tables when they may differ from the last frame's.
///
/// # Errors
/// A table that lacks a column; the planner has checked that, so it is a fault of the caller.
pub fn select(plan: &Plan, held: &Held, values: &Values, tables: Option<&[Table]>) -> Checked<Selection> {
    let units = units(plan);
    let next = begin(plan, held, tables)?;
    let (ingredients, versions) = versions(plan, &units, &next, values);
    let run = required(plan, &units, &next, &versions);
    Ok(selection(plan, &units, next, ingredients, &versions, &run))
}

/// Chooses all steps, for memory that is to be compared with that of [`select`].
///
/// # Errors
/// As [`select`].
pub fn everything(plan: &Plan, held: &Held, values: &Values, tables: Option<&[Table]>) -> Checked<Selection> {
    let units = units(plan);
    let next = begin(plan, held, tables)?;
    let (ingredients, versions) = versions(plan, &units, &next, values);
    let run = (0..units.len()).collect();
    Ok(selection(plan, &units, next, ingredients, &versions, &run))
}

/// What is held before the frame, with the tables that it brings.
fn begin(plan: &Plan, held: &Held, tables: Option<&[Table]>) -> Checked<Held> {
    let mut next = held.clone();
    next.slots.resize(plan.slots.len(), None);
    if let Some(tables) = tables {
        next.tables = hash_tables(plan, tables)?;
    }
    Ok(next)
}

fn selection(
    plan: &Plan,
    units: &[Unit],
    next: Held,
    ingredients: Vec<Ingredients>,
    versions: &Versions,
    run: &BTreeSet<usize>,
) -> Selection {
    let mut selection = Selection { run: vec![false; plan.steps.len()], why: vec![Why::First; plan.steps.len()], next };
    let mut ingredients = ingredients.into_iter();
    for (i, unit) in units.iter().enumerate() {
        let Some(now) = ingredients.next() else { break };
        let before = selection.next.ran.get(&i);
        let same = before == Some(&now);
        let why = match (run.contains(&i), before) {
            (true, None) => Why::First,
            (true, Some(_)) if same => Why::Overwritten,
            (true, Some(before)) => Why::Changed(differences(plan, before, &now)),
            (false, _) if same => Why::Unchanged,
            (false, _) => Why::NotNeeded,
        };
        for s in &unit.steps {
            selection.run[s.0] = run.contains(&i);
            selection.why[s.0] = why.clone();
        }
        if run.contains(&i) {
            for r in &unit.writes {
                selection.next.slots[plan.resources[r.0].slot] = Some((*r, versions.after[i][r]));
            }
            selection.next.ran.insert(i, now);
        }
    }
    selection
}

/// The versions that resources should have, if every unit ran.
struct Versions {
    /// By unit: of what it needs.
    before: Vec<BTreeMap<ResourceId, Version>>,
    /// By unit: of what it writes.
    after: Vec<BTreeMap<ResourceId, Version>>,
    /// At the end of the frame.
    end: BTreeMap<ResourceId, Version>,
}

fn versions(plan: &Plan, units: &[Unit], held: &Held, values: &Values) -> (Vec<Ingredients>, Versions) {
    let mut now: BTreeMap<ResourceId, Version> = BTreeMap::new();
    for (i, r) in plan.resources.iter().enumerate().filter(|(_, r)| r.history) {
        let holds = held.slots.get(r.slot).copied().flatten();
        now.insert(ResourceId(i), holds.map_or(UNDEFINED, |(_, v)| v));
    }
    let mut all = Versions { before: vec![], after: vec![], end: BTreeMap::new() };
    let mut ingredients = vec![];
    for (i, unit) in units.iter().enumerate() {
        let before: BTreeMap<_, _> =
            unit.needs.iter().map(|r| (*r, now.get(r).copied().unwrap_or(UNDEFINED))).collect();
        let mut parts = Ingredients::new();
        for s in &unit.steps {
            outside(plan, *s, held, values, &mut parts);
        }
        for (r, v) in &before {
            parts.insert(Ingredient::Input(*r), hash(v));
        }
        let after: BTreeMap<_, _> = unit.writes.iter().map(|r| (*r, version(i, *r, &parts, &before))).collect();
        now.extend(after.iter().map(|(r, v)| (*r, *v)));
        all.before.push(before);
        all.after.push(after);
        ingredients.push(parts);
    }
    all.end = now;
    (ingredients, all)
}

/// What a step reads besides resources and besides what can't change within a plan: values of the frame, tables.
fn outside(plan: &Plan, step: StepId, held: &Held, values: &Values, parts: &mut Ingredients) {
    for binding in &plan.steps[step.0].bindings {
        match binding {
            Binding::Uniform { layout, extra } => {
                for m in layout.members.iter().filter(|m| !extra.contains_key(&m.name)) {
                    if let Some(v) = values.get(&m.name) {
                        parts.insert(Ingredient::Value(m.name.clone()), hash(&v.bytes()));
                    }
                }
            }
            Binding::Table(i) => {
                let name = plan.tables.get(*i).map_or(String::new(), |t| t.table.clone());
                // Two rows of one table differ in what they read: both count.
                let there = parts.get(&Ingredient::Table(name.clone())).copied().unwrap_or(0);
                let new = hash(&(there, held.tables.get(*i)));
                parts.insert(Ingredient::Table(name), new);
            }
            Binding::Resource(_) | Binding::SceneTextures | Binding::Report | Binding::Sampler(_) => {}
        }
    }
}

/// The units that must run so that the outputs, and what the next frame begins with, are in memory.
fn required(plan: &Plan, units: &[Unit], held: &Held, versions: &Versions) -> BTreeSet<usize> {
    let mut run = BTreeSet::new();
    let kept = plan.resources.iter().enumerate().filter(|(_, r)| r.history).map(|(i, _)| ResourceId(i));
    let end: BTreeSet<ResourceId> = plan.outputs.iter().map(|o| o.1).chain(kept).collect();
    loop {
        let mut slots = held.slots.clone();
        let mut more = BTreeSet::new();
        for (i, unit) in units.iter().enumerate().filter(|(i, _)| run.contains(i)) {
            for (r, v) in &versions.before[i] {
                if *v != UNDEFINED && slots[plan.resources[r.0].slot] != Some((*r, *v)) {
                    more.extend(producer(units, *r, i));
                }
            }
            for r in &unit.writes {
                slots[plan.resources[r.0].slot] = Some((*r, versions.after[i][r]));
            }
        }
        for r in &end {
            let wanted = versions.end.get(r).copied().unwrap_or(UNDEFINED);
            if wanted != UNDEFINED && slots[plan.resources[r.0].slot] != Some((*r, wanted)) {
                more.extend(producer(units, *r, units.len()));
            }
        }
        let before = run.len();
        run.append(&mut more);
        if run.len() == before {
            return run;
        }
    }
}

/// The last unit before a place that writes a resource.
fn producer(units: &[Unit], resource: ResourceId, before: usize) -> Option<usize> {
    (0..before).rev().find(|i| units[*i].writes.contains(&resource))
}

fn units(plan: &Plan) -> Vec<Unit> {
    plan.order
        .iter()
        .map(|node| {
            let mut unit = Unit { steps: vec![], needs: BTreeSet::new(), writes: BTreeSet::new() };
            gather(plan, node, &mut unit);
            unit
        })
        .collect()
}

fn gather(plan: &Plan, node: &Node, unit: &mut Unit) {
    match node {
        Node::Step(s) => {
            let step = &plan.steps[s.0];
            unit.steps.push(*s);
            unit.needs.extend(step.reads.iter().filter(|r| !unit.writes.contains(r)));
            if !overwrites(&step.action) {
                unit.needs.extend(step.writes.iter().filter(|r| !unit.writes.contains(r)));
            }
            unit.writes.extend(&step.writes);
        }
        Node::Loop(l) => l.body.iter().for_each(|n| gather(plan, n, unit)),
    }
}

/// Whether nothing of the old content is left for certain.
fn overwrites(action: &Action) -> bool {
    matches!(action, Action::Copy { .. } | Action::Clear { .. })
}

fn differences(plan: &Plan, before: &Ingredients, now: &Ingredients) -> Vec<String> {
    let changed = now.iter().filter(|(k, v)| before.get(k) != Some(v));
    let name = |k: &Ingredient| match k {
        Ingredient::Value(n) => n.clone(),
        Ingredient::Table(n) => format!("table {n}"),
        Ingredient::Input(r) => plan.resources[r.0].name.clone(),
    };
    changed.map(|(k, _)| name(k)).collect()
}

fn hash_tables(plan: &Plan, tables: &[Table]) -> Checked<Vec<u64>> {
    let one = |wanted: &super::TableUse| match tables.iter().find(|t| t.name == wanted.table) {
        Some(table) => Ok(hash(&pack(wanted, table)?)),
        None => Ok(0),
    };
    plan.tables.iter().map(one).collect()
}

/// The same for equal values in every run of the program.
fn hash(value: &impl Hash) -> u64 {
    let mut h = DefaultHasher::new();
    value.hash(&mut h);
    h.finish()
}

/// 128 bits, so that two contents never share a version by chance. Never [`UNDEFINED`].
fn version(unit: usize, resource: ResourceId, parts: &Ingredients, before: &BTreeMap<ResourceId, Version>) -> Version {
    let half = |salt: u8| u128::from(hash(&(salt, unit, resource, parts.values().collect::<Vec<_>>(), before)));
    (half(0) << 64 | half(1)).max(1)
}
