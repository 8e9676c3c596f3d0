//! What changed since the last frame, and which steps must run because of it. No device.
//!
//! The version that a content should have is known before anything runs: see [`super::keys`]. A step runs only when a
//! version that someone needs is not already in memory; a loop is one unit. Nobody marks anything as changed by hand.
//!
//! What memory holds is known by version alone, so it outlives the plan: another plan takes over the memory that holds
//! what it wants, and runs only what differs.

use super::alike::Parts;
use super::ingredient::{Ingredient, Ingredients, Kind};
use super::keys::{Keys, UNDEFINED, Unit, Version, Versions, initial};
use super::masked::{Read, Reads};
use super::member::Members;
use super::outside::Outside;
use super::region::{self, Seen};
use super::window::{Windows, share};
use super::{Desc, Plan, ResourceId, Step, TextureDesc};
use crate::diag::Checked;
use crate::image::Image;
use crate::scene::Bounds;
use crate::value::Values;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};

/// What the memory of a plan holds, and what its units read when they last ran.
#[derive(Debug, Clone, Default)]
pub struct Held {
    /// By slot.
    cells: Vec<Cell>,
    /// By the unit's name.
    ran: BTreeMap<String, Arc<Ran>>,
    /// Frames so far, those of earlier plans among them.
    frames: u32,
}

/// A piece of memory.
#[derive(Debug, Clone)]
struct Cell {
    /// As it was allocated.
    desc: Desc,
    content: Content,
    /// The resource whose content it keeps from frame to frame.
    history: Option<String>,
}

/// Which content is in a piece of memory. Plans that share the memory share this too: each knows when the other has
/// written there.
#[derive(Debug, Clone, Default)]
struct Content(Arc<Mutex<Version>>);

impl Content {
    /// [`UNDEFINED`] when nothing is known of it.
    fn get(&self) -> Version {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set(&self, version: Version) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = version;
    }
}

/// The last run of a unit.
#[derive(Debug)]
pub(super) struct Ran {
    key: Version,
    /// Of its key what all members have in common.
    common: Version,
    ingredients: Ingredients,
    /// What each of its members alone depended on.
    pub(super) members: Members,
    /// What its members read by masks.
    pub(super) read: Option<Read>,
    /// What the members of a draw saw.
    seen: Option<Seen>,
    frame: u32,
}

/// Frames for which the last run of a unit is remembered that the plan no longer has.
const REMEMBERED: u32 = 1000;

/// Why a unit runs or does not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Why {
    /// Runs: nothing is known of an earlier run.
    First,
    /// Runs: these things differ from those of its last run.
    Changed(Vec<String>),
    /// Runs: what it made has been overwritten since, in memory it shares.
    Overwritten,
    /// Runs: so does every step.
    Asked,
    /// Does not run: it would make what it made before, in the frame of this number (from 0, reloads do not begin anew).
    Unchanged { since: u32 },
    /// Does not run: nothing that runs reads its result.
    NotNeeded,
}

impl Why {
    /// Whether the unit runs.
    pub fn runs(&self) -> bool {
        match self {
            Why::First | Why::Changed(_) | Why::Overwritten | Why::Asked => true,
            Why::Unchanged { .. } | Why::NotNeeded => false,
        }
    }
}

impl std::fmt::Display for Why {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Why::First => f.write_str("first run"),
            Why::Changed(names) => write!(f, "changed: {}", names.join(", ")),
            Why::Overwritten => f.write_str("its result was overwritten in shared memory"),
            Why::Asked => f.write_str("every step runs"),
            Why::Unchanged { since } => write!(f, "unchanged since frame {since}"),
            Why::NotNeeded => f.write_str("nothing that runs reads it"),
        }
    }
}

/// What steps do in part.
#[derive(Debug, Clone, Default)]
pub struct Partly {
    /// By index of a step that runs for some of its members only: whether each does.
    pub members: BTreeMap<usize, Vec<bool>>,
    /// By index of such a step, if that is known of all of them: boxes outside of which they show what they showed.
    pub moved: BTreeMap<usize, Vec<Bounds>>,
    /// The parts of their places that members of draws go over, among those that run.
    pub windows: Windows,
}

/// The choice for one frame.
#[derive(Debug, Clone)]
pub struct Selection {
    /// By step.
    pub run: Vec<bool>,
    /// By step.
    pub why: Vec<Why>,
    pub partly: Partly,
    /// What the units that run write, in their order: slot, content.
    writes: Vec<(usize, Version)>,
    ran: Vec<(String, Arc<Ran>)>,
}

impl Selection {
    /// How many steps run.
    pub fn count(&self) -> usize {
        self.run.iter().filter(|r| **r).count()
    }
}

impl Held {
    /// The memory of a plan that has run nothing yet: what `kept` takes over of an earlier plan's memory (by slot, its slot
    /// there), and new memory.
    pub fn new(plan: &Plan, keys: &Keys, kept: &[Option<usize>], earlier: Option<&Held>) -> Held {
        let cell = |slot: usize| {
            let tenant = plan.resources.iter().find(|r| r.slot == slot && r.history);
            let history = tenant.map(|r| r.name.clone());
            let old = kept.get(slot).copied().flatten().and_then(|j| earlier?.cells.get(j));
            if let Some(old) = old {
                return Cell { history, ..old.clone() };
            }
            let content = Content::default();
            if let Some(value) = tenant.and_then(|r| r.initial) {
                content.set(initial(&plan.slots[slot].desc, value));
            }
            Cell { desc: plan.slots[slot].desc.clone(), content, history }
        };
        let frames = earlier.map_or(0, |e| e.frames);
        let mut ran = earlier.map(|e| e.ran.clone()).unwrap_or_default();
        // Other plans' units are remembered for a while: one may come back.
        let units: BTreeSet<&str> = keys.units.iter().map(|u| u.name.as_str()).collect();
        ran.retain(|name, ran| units.contains(name.as_str()) || frames - ran.frame < REMEMBERED);
        Held { cells: (0..plan.slots.len()).map(cell).collect(), ran, frames }
    }

    /// How many frames ran, those of earlier plans among them.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// What a slot holds; [`UNDEFINED`] when nothing is known of it.
    pub fn version(&self, slot: usize) -> Version {
        self.cells.get(slot).map_or(UNDEFINED, |c| c.content.get())
    }

    /// Before the selected steps run: nothing is known of what they are about to write.
    pub fn start(&self, selection: &Selection) {
        for (slot, _) in &selection.writes {
            self.cells[*slot].content.set(UNDEFINED);
        }
    }

    /// The selected steps have run.
    pub fn finish(&mut self, selection: Selection) {
        for (slot, version) in selection.writes {
            self.cells[slot].content.set(version);
        }
        self.ran.extend(selection.ran);
        self.frames += 1;
    }

    /// Whether any memory holds this content.
    pub fn holds(&self, version: Version) -> bool {
        self.cells.iter().any(|c| c.content.get() == version)
    }

    /// A slot holds what another version stands for, too.
    pub fn stands(&self, slot: usize, version: Version) {
        if let Some(cell) = self.cells.get(slot) {
            cell.content.set(version);
        }
    }

    /// As [`Held::finish`], for a part of a frame.
    pub fn finish_part(&mut self, selection: Selection) {
        self.finish(selection);
        self.frames -= 1;
    }

    /// After a fault nothing is known of any memory.
    pub fn forget(&mut self) {
        self.cells.iter().for_each(|c| c.content.set(UNDEFINED));
        self.ran.clear();
    }

    /// The parts of a resource, as the last run of a unit left them; `None`: memory holds something else, or it has no parts.
    pub fn parts(&self, plan: &Plan, unit: &Unit, id: ResourceId, outside: &Outside) -> Option<Parts> {
        let ran = self.ran.get(&unit.name).filter(|ran| !ran.members.is_empty())?;
        let there = self.version(plan.resources[id.0].slot) == outside.alike.of(unit.content(ran.key, id));
        there.then(|| (unit.content(ran.common, id), ran.members.clone()))
    }

    /// The contents of history.
    pub(super) fn history<'a>(&'a self, plan: &'a Plan) -> impl Fn(ResourceId) -> Version + 'a {
        |id| self.version(plan.resources[id.0].slot)
    }
}

/// By slot of a plan the slot of earlier memory to take over: history by name, and whatever holds a content that the
/// plan wants, if the next frame is given these values. Each piece of memory is taken once.
pub fn carry(plan: &Plan, keys: &Keys, earlier: &Held, outside: &Outside, values: &Values) -> Vec<Option<usize>> {
    let mut kept = carry_history(plan, keys, earlier);
    let mut free: BTreeMap<Version, Vec<usize>> = BTreeMap::new();
    for (j, cell) in earlier.cells.iter().enumerate().filter(|(j, _)| !kept.contains(&Some(*j))) {
        free.entry(cell.content.get()).or_default().push(j);
    }
    free.remove(&UNDEFINED);
    let soon = Held::new(plan, keys, &kept, Some(earlier));
    let versions = keys.versions(plan, soon.history(plan), outside, values);
    // Of those that share memory the last to write is there at the end.
    for (unit, after) in keys.units.iter().zip(&versions.after).rev() {
        // History is what the frame begins with, not what it makes.
        let made = unit.writes.iter().zip(after).filter(|(r, _)| !plan.resources[r.0].history);
        for (r, version) in made {
            let slot = plan.resources[r.0].slot;
            let Some(cells) = free.get_mut(version) else { continue };
            let fits = |j: &usize| fits(&plan.slots[slot].desc, &earlier.cells[*j].desc);
            if let (None, Some(at)) = (kept[slot], cells.iter().position(fits)) {
                kept[slot] = Some(cells.swap_remove(at));
            }
        }
    }
    kept
}

/// As [`carry`], history only. What depends on one another comes over together or not at all: an image that begins anew, say,
/// and the count of frames that it holds.
pub fn carry_history(plan: &Plan, keys: &Keys, earlier: &Held) -> Vec<Option<usize>> {
    let mut kept = vec![None; plan.slots.len()];
    let found = |id: &ResourceId| {
        let r = &plan.resources[id.0];
        let same = |c: &Cell| c.history.as_ref() == Some(&r.name) && fits(&plan.slots[r.slot].desc, &c.desc);
        Some((r.slot, earlier.cells.iter().position(same)?))
    };
    for group in bound_together(plan, keys) {
        let all: Option<Vec<(usize, usize)>> = group.iter().map(found).collect();
        for (slot, there) in all.unwrap_or_default() {
            kept[slot] = Some(there);
        }
    }
    kept
}

/// All history, in groups: what one of a group holds after a frame depends on what another held before it.
fn bound_together(plan: &Plan, keys: &Keys) -> Vec<BTreeSet<ResourceId>> {
    let history: BTreeSet<ResourceId> =
        (0..plan.resources.len()).map(ResourceId).filter(|r| plan.resources[r.0].history).collect();
    let mut from: BTreeMap<ResourceId, BTreeSet<ResourceId>> =
        history.iter().map(|r| (*r, BTreeSet::from([*r]))).collect();
    for unit in &keys.units {
        let needs: BTreeSet<ResourceId> = unit.needs.iter().filter_map(|r| from.get(r)).flatten().copied().collect();
        if !needs.is_empty() {
            unit.writes.iter().for_each(|r| from.entry(*r).or_default().extend(&needs));
        }
    }
    let mut groups: Vec<BTreeSet<ResourceId>> = vec![];
    for of in history.iter().filter_map(|r| from.remove(r)) {
        let (with, mut others): (Vec<_>, Vec<_>) = groups.into_iter().partition(|g| !g.is_disjoint(&of));
        others.push(with.into_iter().flatten().chain(of).collect());
        groups = others;
    }
    groups
}

/// Whether memory that was allocated as `there` can serve as `wanted`.
fn fits(wanted: &Desc, there: &Desc) -> bool {
    wanted.shape() == there.shape()
        && match (wanted, there) {
            (Desc::Texture(TextureDesc { usage: a, .. }), Desc::Texture(TextureDesc { usage: b, .. })) => {
                b.contains(*a)
            }
            (Desc::Buffer { usage: a, .. }, Desc::Buffer { usage: b, .. }) => b.contains(*a),
            _ => false,
        }
}

/// Chooses the steps of a frame.
pub fn select(plan: &Plan, keys: &Keys, held: &Held, outside: &Outside, values: &Values) -> Selection {
    select_for(plan, keys, held, outside, values, &lasting(plan))
}

/// Chooses of the steps of a frame those that some resources take.
pub fn select_for(
    plan: &Plan,
    keys: &Keys,
    held: &Held,
    outside: &Outside,
    values: &Values,
    wanted: &BTreeSet<ResourceId>,
) -> Selection {
    let versions = keys.versions(plan, held.history(plan), outside, values);
    let run = required(plan, keys, held, &versions, wanted);
    let why = |i: usize| {
        let unit = &keys.units[i];
        let before = held.ran.get(&unit.name);
        let same = before.filter(|ran| ran.key == versions.keys[i]);
        match (run.contains(&i), before) {
            (true, None) => Why::First,
            (true, Some(_)) if same.is_some() => Why::Overwritten,
            (true, Some(ran)) => {
                let now = unit.ingredients(plan, (&versions, i), outside, values);
                Why::Changed(differences(&ran.ingredients, &now))
            }
            (false, _) => {
                // Under another name it may have run too.
                let any = || held.ran.values().find(|ran| ran.key == versions.keys[i]);
                same.or_else(any).map_or(Why::NotNeeded, |ran| Why::Unchanged { since: ran.frame })
            }
        }
    };
    let why = (0..keys.units.len()).map(why).collect();
    let chosen = selection(plan, keys, held, (outside, values), &versions, why);
    // What lay round a part has been lost since: all of it is drawn.
    let lost = |(i, step): (usize, &Step)| {
        let draws = step.action.draws().filter(|draws| outside.windows.contains_key(draws));
        draws.is_some() && chosen.run[i] && !chosen.partly.members.contains_key(&i)
    };
    if plan.steps.iter().enumerate().any(lost) {
        return select_for(plan, keys, held, &outside.without_windows(), values, wanted);
    }
    chosen
}

/// Chooses all steps that the outputs take.
pub fn full(plan: &Plan, keys: &Keys, held: &Held, outside: &Outside, values: &Values) -> Selection {
    let outside = &*outside.without_windows();
    let mut open: Vec<usize> = lasting(plan).iter().filter_map(|r| keys.last[r.0]).collect();
    let mut why = vec![Why::NotNeeded; keys.units.len()];
    while let Some(i) = open.pop() {
        if why[i] != Why::Asked {
            why[i] = Why::Asked;
            open.extend(keys.units[i].makers.iter().flatten());
        }
    }
    selection(plan, keys, held, (outside, values), &keys.versions(plan, held.history(plan), outside, values), why)
}

/// Chooses all steps.
pub fn everything(plan: &Plan, keys: &Keys, held: &Held, outside: &Outside, values: &Values) -> Selection {
    let outside = &*outside.without_windows();
    let versions = keys.versions(plan, held.history(plan), outside, values);
    let why = vec![Why::Asked; keys.units.len()];
    selection(plan, keys, held, (outside, values), &versions, why)
}

/// The selection that runs the units whose reason says so.
fn selection(
    plan: &Plan,
    keys: &Keys,
    held: &Held,
    (outside, values): (&Outside, &Values),
    versions: &Versions,
    why: Vec<Why>,
) -> Selection {
    let steps = plan.steps.len();
    let mut all = Selection {
        run: vec![false; steps],
        why: vec![Why::NotNeeded; steps],
        partly: Partly { windows: outside.windows.clone(), ..Partly::default() },
        writes: vec![],
        ran: vec![],
    };
    for (i, (unit, mut why)) in keys.units.iter().zip(why).enumerate() {
        let step = if let [step] = unit.steps[..] { Some(step.0) } else { None };
        let members = &versions.members[i];
        let ingredients = || unit.ingredients(plan, (versions, i), outside, values);
        if let (Why::Changed(names), Some(step)) = (&mut why, step)
            && let Some(some) = outdated(plan, unit, held, (&all, outside), &ingredients(), members)
        {
            let (count, verb) = (some.iter().filter(|m| **m).count(), unit.verb());
            let windows = plan.steps[step].action.draws().and_then(|draws| outside.windows.get(&draws));
            *names = vec![format!("what {count} of {} members {verb}", some.len())];
            names.extend(windows.map(|w| format!("within {:.1} % of their texels", 100.0 * share(w, &some))));
            let saw = held.ran.get(&unit.name).and_then(|ran| ran.seen.as_ref());
            let boxes =
                outside.members.get(&step).zip(saw).and_then(|(seen, saw)| seen.moved(saw, &some, keys.without));
            all.partly.moved.extend(boxes.map(|boxes| (step, boxes)));
            all.partly.members.insert(step, some);
        }
        for s in &unit.steps {
            all.run[s.0] = why.runs();
            all.why[s.0] = why.clone();
        }
        if why.runs() {
            let slots = unit.writes.iter().map(|r| plan.resources[r.0].slot);
            all.writes.extend(slots.zip(versions.after[i].iter().copied()));
            let seen = step.and_then(|s| outside.members.get(&s)).cloned();
            let (key, common, members) = (versions.keys[i], versions.common[i], members.clone());
            let read = versions.reads[i].as_ref().map(Reads::read);
            let ran = Ran { key, common, ingredients: ingredients(), members, read, seen, frame: held.frames };
            all.ran.push((unit.name.clone(), Arc::new(ran)));
        }
    }
    all
}

/// Which members of a unit must run, when the others' part of its last run is in memory still and nothing but what tells them
/// apart is new since. `before` is what the frame has chosen so far.
fn outdated(
    plan: &Plan,
    unit: &Unit,
    held: &Held,
    (before, outside): (&Selection, &Outside),
    now: &Ingredients,
    members: &Members,
) -> Option<Vec<bool>> {
    let ran = standing(plan, unit, held, outside, now)?;
    let untouched = |r: &ResourceId| before.writes.iter().all(|(slot, _)| *slot != plan.resources[r.0].slot);
    let fits = !members.is_empty() && ran.members.len() == members.len() && unit.writes.iter().all(untouched);
    fits.then(|| members.each().iter().zip(ran.members.each()).map(|(now, then)| now != then).collect())
}

/// The last run of unit number `index`, when it stands with these versions.
pub(super) fn still_standing<'h>(
    plan: &Plan,
    keys: &Keys,
    held: &'h Held,
    (outside, values): (&Outside, &Values),
    (versions, index): (&Versions, usize),
) -> Option<&'h Arc<Ran>> {
    let unit = &keys.units[index];
    standing(plan, unit, held, outside, &unit.ingredients(plan, (versions, index), outside, values))
}

/// The last run of a unit, when what it made is in memory still and nothing but what tells its members apart is new since.
fn standing<'h>(
    plan: &Plan,
    unit: &Unit,
    held: &'h Held,
    outside: &Outside,
    now: &Ingredients,
) -> Option<&'h Arc<Ran>> {
    let ran = held.ran.get(&unit.name)?;
    let whole = |i: &&Ingredient| i.kind != Kind::Member;
    let same = ran.ingredients.keys().filter(whole).eq(now.keys().filter(whole))
        && now.iter().filter(|(i, _)| whole(i)).all(|(i, content)| ran.ingredients.get(i) == Some(content));
    let made = |r: &ResourceId| outside.alike.of(unit.content(ran.key, *r));
    let there = unit.writes.iter().all(|r| held.version(plan.resources[r.0].slot) == made(r));
    (same && there).then_some(ran)
}

/// Takes back what is no change to what members see: what moved shows neither where it was nor where it is. Of draws that it is one
/// to, finds the parts to go over, and the squares that stay as they are. `depths` gives the depths that a resource holds in the version
/// that memory has of it.
///
/// A version of before stands for another place of what moved, but for the same content: only while nothing else differs
/// either, so this is asked anew in every frame.
///
/// # Errors
/// The depths can't be had.
pub fn settle(
    plan: &Plan,
    keys: &Keys,
    held: &Held,
    outside: &mut Outside,
    values: &Values,
    mut depths: impl FnMut(ResourceId, Version) -> Checked<Arc<Image>>,
) -> Checked<()> {
    outside.windows.clear();
    for (i, unit) in keys.units.iter().enumerate() {
        let [id] = unit.steps[..] else { continue };
        let Some(mut seen) = outside.members.get(&id.0).cloned() else { continue };
        let Some(saw) = held.ran.get(&unit.name).and_then(|ran| ran.seen.as_ref()) else { continue };
        let moved = seen.unsettled(saw) && {
            let versions = keys.versions(plan, held.history(plan), outside, values);
            still_standing(plan, keys, held, (outside, values), (&versions, i)).is_some()
        };
        let (mut windows, step) = (vec![], &plan.steps[id.0]);
        if moved {
            let target = region::depths(plan, step);
            let image = target.map(|id| depths(id, held.version(plan.resources[id.0].slot))).transpose()?;
            seen.settle(saw, plan, step, image.as_deref());
        }
        if let Some(draws) = step.action.draws().filter(|_| moved) {
            windows = seen.windows(saw, plan, step, keys.without);
            outside.windows.extend(windows.iter().any(Option::is_some).then(|| (draws, Arc::new(windows.clone()))));
        }
        seen.keep_squares(saw, plan, step, &windows);
        outside.members.insert(id.0, seen);
    }
    Ok(())
}

/// The version that each resource has at the end of a frame.
pub fn end(plan: &Plan, keys: &Keys, held: &Held, outside: &Outside, values: &Values) -> Vec<Version> {
    keys.versions(plan, held.history(plan), outside, values).end
}

/// What the outputs, and what the next frame begins with, are.
fn lasting(plan: &Plan) -> BTreeSet<ResourceId> {
    let kept = plan.resources.iter().enumerate().filter(|(_, r)| r.history).map(|(i, _)| ResourceId(i));
    plan.outputs.iter().map(|o| o.1).chain(kept).collect()
}

/// The units that must run so that these resources are in memory at the end.
fn required(plan: &Plan, keys: &Keys, held: &Held, versions: &Versions, end: &BTreeSet<ResourceId>) -> BTreeSet<usize> {
    let slot = |r: &ResourceId| plan.resources[r.0].slot;
    let there: Vec<Version> = (0..held.cells.len()).map(|s| held.version(s)).collect();
    let mut run: BTreeSet<usize> = BTreeSet::new();
    loop {
        // With all that is known to run, what is missing when it is wanted? Memory is shared: what was there may be gone.
        let mut slots = there.clone();
        let mut more: Vec<usize> = vec![];
        for i in &run {
            let unit = &keys.units[*i];
            for ((r, v), maker) in unit.needs.iter().zip(&versions.before[*i]).zip(&unit.makers) {
                if *v != UNDEFINED && slots[slot(r)] != *v {
                    more.extend(maker);
                }
            }
            for (r, v) in unit.writes.iter().zip(&versions.after[*i]) {
                slots[slot(r)] = *v;
            }
        }
        for r in end {
            let wanted = versions.end[r.0];
            if wanted != UNDEFINED && slots[slot(r)] != wanted {
                more.extend(keys.last[r.0]);
            }
        }
        let before = run.len();
        // What even the memory of the last frame lacks must be made in any case.
        while let Some(i) = more.pop() {
            if run.insert(i) {
                let unit = &keys.units[i];
                let needs = unit.needs.iter().zip(&versions.before[i]).zip(&unit.makers);
                let lacking = needs.filter(|((r, v), _)| **v != UNDEFINED && there[slot(r)] != **v);
                more.extend(lacking.filter_map(|(_, maker)| *maker));
            }
        }
        if run.len() == before {
            return run;
        }
    }
}

/// What is new or different, and what is gone.
fn differences(before: &Ingredients, now: &Ingredients) -> Vec<String> {
    let changed = now.iter().filter(|(k, v)| before.get(k) != Some(v)).map(|(k, _)| k.to_string());
    let gone = before.keys().filter(|k| !now.contains_key(k)).map(|k| format!("no {k} any more"));
    changed.chain(gone).collect()
}
