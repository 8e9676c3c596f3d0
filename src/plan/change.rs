//! Decides what changed since the last frame and which steps must run because of it. Needs no device.
//!
//! The version of each content is known before anything runs (see [`super::keys`]). A step runs only if some consumer
//! needs a version that memory does not hold; a loop counts as one unit. No caller marks anything as dirty.
//!
//! A step with [`Only`](super::Only) is skipped like any other, or runs in full, or runs for the instances whose dirty
//! bits are set. It runs in part if the only inputs that changed are those its bits account for, and memory still
//! holds its last result.
//!
//! Memory is described by versions alone, so it outlives the plan: the next plan takes over memory that holds what it
//! needs, and runs only what differs.

mod select;

pub use select::{everything, full, select};

use super::inputs::ReadInputs;
use super::keys::{Keys, UNDEFINED, Version, initial};
use super::tables::SceneInputs;
use super::{Desc, Plan, ResourceId, StepId, TextureDesc};
use crate::content::hash;
use crate::scene::CONTENT_HASH;
use crate::value::{Value, Values};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};

/// What the memory of a plan holds, and what its units read when they last ran.
#[derive(Debug, Clone, Default)]
pub struct Held {
    /// By slot.
    cells: Vec<HeldSlot>,
    /// By the unit's name.
    ran: BTreeMap<Arc<str>, Arc<LastRun>>,
    /// Frames so far, those of earlier plans among them.
    frames: u32,
    /// How often everything was forgotten.
    forgotten: u32,
    /// By unit: its fingerprint in the last frame of this plan, and what it is without inputs that change in part.
    /// Empty before the first.
    previous: Vec<(Version, Version)>,
}

/// A piece of memory.
#[derive(Debug, Clone)]
struct HeldSlot {
    /// As it was allocated.
    desc: Desc,
    content: Content,
    /// The resource whose content it keeps from frame to frame.
    history: Option<String>,
    /// Of memory from outside: how many came before it.
    lent: Option<u64>,
    /// It holds an image of files, whatever fails.
    fixed: bool,
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
struct LastRun {
    key: Version,
    inputs: ReadInputs,
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
    /// Runs for the instances whose dirty bits are set: these things differ from those of the last frame.
    ChangedInPart(Vec<String>),
    /// Runs: it writes dirty bits that another step goes by.
    Marks,
    /// Runs: what it made has been overwritten since, in memory it shares.
    Overwritten,
    /// Runs: so does every step.
    Asked,
    /// Does not run: it would make what it made before, in the frame of this number (from 0, reloads do not begin
    /// anew).
    Unchanged { since: u32 },
    /// Does not run: nothing that runs reads its result.
    NotNeeded,
    /// Does not run: its condition is for other frames.
    OtherFrames,
}

impl Why {
    /// Whether the unit runs.
    pub fn runs(&self) -> bool {
        match self {
            Why::First | Why::Changed(_) | Why::ChangedInPart(_) | Why::Marks | Why::Overwritten | Why::Asked => true,
            Why::Unchanged { .. } | Why::NotNeeded | Why::OtherFrames => false,
        }
    }
}

impl Why {
    /// Whether code runs that has not run before, as far as is known.
    pub fn is_new(&self) -> bool {
        match self {
            Why::First => true,
            Why::Changed(names) => names.iter().any(|name| name.starts_with("shader ")),
            _ => false,
        }
    }
}

impl std::fmt::Display for Why {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Why::First => f.write_str("first run"),
            Why::Changed(names) => write!(f, "changed: {}", names.join(", ")),
            Why::ChangedInPart(names) => write!(f, "changed in part: {}", names.join(", ")),
            Why::Marks => f.write_str("it writes dirty bits that are asked for"),
            Why::Overwritten => f.write_str("its result was overwritten in shared memory"),
            Why::Asked => f.write_str("every step runs"),
            Why::Unchanged { since } => write!(f, "unchanged since frame {since}"),
            Why::NotNeeded => f.write_str("nothing that runs reads it"),
            Why::OtherFrames => f.write_str("its condition is for other frames"),
        }
    }
}

/// Where the dirty bits of a frame come from; of several the greatest holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Bits {
    /// None is set: the inputs of the steps that go by them are unchanged.
    Clear,
    /// A pass writes them, over cleared ones.
    Written,
    /// All are set: something else changed than what they account for.
    Set,
}

/// The choice for one frame.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// By step.
    pub run: Vec<bool>,
    /// By step.
    pub why: Vec<Why>,
    /// Steps that run for the instances whose dirty bits are set.
    pub partial: BTreeSet<StepId>,
    /// Dirty bits that someone reads in the frame, and where they come from.
    pub bits: BTreeMap<ResourceId, Bits>,
    /// What the units that run write, in their order: slot, content.
    writes: Vec<(usize, Version)>,
    ran: Vec<(Arc<str>, Arc<LastRun>)>,
    /// Of the whole frame, by unit.
    keys: Vec<(Version, Version)>,
}

impl Selection {
    /// These steps in full, whatever memory holds.
    pub fn of(run: &[bool]) -> Selection {
        Selection { run: run.to_vec(), ..Selection::default() }
    }

    /// How many steps run.
    pub fn count(&self) -> usize {
        self.run.iter().filter(|r| **r).count()
    }
}

impl Held {
    /// The memory of a plan that has run nothing yet: what `carried` takes over of an earlier plan's memory (by slot,
    /// its slot there), and new memory.
    pub fn new(plan: &Plan, keys: &Keys, carried: &[Option<usize>], earlier: Option<&Held>) -> Held {
        let cell = |slot: usize| {
            let mut tenants = plan.resources.iter().filter(|r| r.slot == slot);
            if let Some(image) = tenants.clone().find_map(|r| r.image.as_ref()) {
                let content = Content::default();
                content.set(image.hash.max(1));
                return HeldSlot {
                    desc: plan.slots[slot].desc.clone(),
                    content,
                    history: None,
                    lent: None,
                    fixed: true,
                };
            }
            let tenant = tenants.find(|r| r.history);
            let history = tenant.map(|r| r.name.clone());
            let old = carried.get(slot).copied().flatten().and_then(|j| earlier?.cells.get(j));
            if let Some(old) = old {
                return HeldSlot { history, ..old.clone() };
            }
            let content = Content::default();
            if let Some((number, value)) = tenant.and_then(|r| Some((r.number, r.initial?))) {
                content.set(initial(&plan.slots[slot].desc, number, value));
            }
            HeldSlot { desc: plan.slots[slot].desc.clone(), content, history, lent: None, fixed: false }
        };
        let (frames, forgotten) = earlier.map_or((0, 0), |e| (e.frames, e.forgotten));
        let mut ran = earlier.map(|e| e.ran.clone()).unwrap_or_default();
        // Other plans' units are remembered for a while: one may come back.
        let units: BTreeSet<&str> = keys.units.iter().map(|u| &*u.name).collect();
        ran.retain(|name, ran| units.contains(&**name) || frames - ran.frame < REMEMBERED);
        Held { cells: (0..plan.slots.len()).map(cell).collect(), ran, frames, forgotten, previous: vec![] }
    }

    /// How many frames ran, those of earlier plans among them.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// What a slot holds; [`UNDEFINED`] when nothing is known of it.
    pub fn version(&self, slot: usize) -> Version {
        self.cells.get(slot).map_or(UNDEFINED, |c| c.content.get())
    }

    /// What each slot holds.
    fn slots(&self) -> Vec<Version> {
        self.cells.iter().map(|c| c.content.get()).collect()
    }

    /// Before the selected steps run: nothing is known of what they are about to write.
    pub fn start(&self, selection: &Selection) {
        for (slot, _) in &selection.writes {
            self.cells[*slot].content.set(UNDEFINED);
        }
    }

    /// The selected steps have run.
    pub fn finish(&mut self, selection: &Selection) {
        for (slot, version) in &selection.writes {
            self.cells[*slot].content.set(*version);
        }
        self.ran.extend(selection.ran.iter().cloned());
        self.previous.clone_from(&selection.keys);
        self.frames += 1;
    }

    /// From now on a slot is memory from outside that holds this version of its content; `other`: none that it was
    /// before.
    pub fn lend(&mut self, slot: usize, version: u64, other: bool) {
        let Some(cell) = self.cells.get_mut(slot) else { return };
        let before = match cell.lent {
            Some(before) => before + u64::from(other),
            None => 0,
        };
        if other {
            cell.content = Content::default();
        }
        cell.lent = Some(before);
        cell.content.set(hash(&("lent", before, version)).max(1));
    }

    /// The resources of memory from outside.
    pub fn lent(&self) -> impl Iterator<Item = &str> {
        self.cells.iter().filter(|c| c.lent.is_some()).filter_map(|c| c.history.as_deref())
    }

    /// After a fault nothing is known of any memory, but of that from outside.
    pub fn forget(&mut self) {
        let own = self.cells.iter().filter(|c| c.lent.is_none() && !c.fixed);
        own.for_each(|c| c.content.set(UNDEFINED));
        self.ran.clear();
        self.previous.clear();
        self.forgotten += 1;
    }

    /// The value [`CONTENT_HASH`] of a frame with the other values.
    pub fn content(&self, plan: &Plan, keys: &Keys, scene: &SceneInputs, values: &Values) -> (String, Value) {
        let hash = hash(&(self.forgotten, keys.content(plan, self.history(plan), scene, values))) as u32;
        (CONTENT_HASH.into(), Value::Uint(hash.max(1)))
    }

    /// The contents of history.
    pub(super) fn history<'a>(&'a self, plan: &'a Plan) -> impl Fn(ResourceId) -> Version + 'a {
        |id| self.version(plan.resources[id.0].slot)
    }
}

/// By slot of a plan the slot of earlier memory to take over: history by name, and whatever holds a content that the
/// plan wants, if the next frame is given these values. Each piece of memory is taken once.
pub fn carry(plan: &Plan, keys: &Keys, earlier: &Held, scene: &SceneInputs, values: &Values) -> Vec<Option<usize>> {
    let mut carried = carry_history(plan, keys, earlier);
    let mut free: BTreeMap<Version, Vec<usize>> = BTreeMap::new();
    for (j, cell) in earlier.cells.iter().enumerate().filter(|(j, _)| !carried.contains(&Some(*j))) {
        free.entry(cell.content.get()).or_default().push(j);
    }
    free.remove(&UNDEFINED);
    let soon = Held::new(plan, keys, &carried, Some(earlier));
    let mut values = values.clone();
    values.extend([soon.content(plan, keys, scene, &values)]);
    let versions = keys.versions(plan, soon.history(plan), scene, &values);
    // Of those that share memory the last to write is there at the end.
    for (unit, after) in keys.units.iter().zip(&versions.after).rev() {
        // History is what the frame begins with, not what it makes.
        let made = unit.writes.iter().zip(after).filter(|(r, _)| !plan.resources[r.0].history);
        for (r, version) in made {
            let slot = plan.resources[r.0].slot;
            let Some(cells) = free.get_mut(version) else { continue };
            let fits = |j: &usize| fits(&plan.slots[slot].desc, &earlier.cells[*j].desc);
            if let (None, Some(at)) = (carried[slot], cells.iter().position(fits)) {
                carried[slot] = Some(cells.swap_remove(at));
            }
        }
    }
    carried
}

/// As [`carry`], history only. What depends on one another comes over together or not at all: an image that begins
/// anew, say, and the count of frames that it holds.
pub fn carry_history(plan: &Plan, keys: &Keys, earlier: &Held) -> Vec<Option<usize>> {
    let mut carried = vec![None; plan.slots.len()];
    let found = |id: &ResourceId| {
        let r = &plan.resources[id.0];
        let same = |c: &HeldSlot| c.history.as_ref() == Some(&r.name) && fits(&plan.slots[r.slot].desc, &c.desc);
        Some((r.slot, earlier.cells.iter().position(same)?))
    };
    for group in bound_together(plan, keys) {
        let all: Option<Vec<(usize, usize)>> = group.iter().map(found).collect();
        for (slot, there) in all.unwrap_or_default() {
            carried[slot] = Some(there);
        }
    }
    carried
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
