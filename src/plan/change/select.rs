//! Selects the steps of a frame that run, in full or in part, each with its reason.

use super::{Bits, Held, LastRun, Selection, Why};
use crate::plan::keys::{Keys, UNDEFINED, Unit, Version, Versions};
use crate::plan::tables::SceneInputs;
use crate::plan::{Plan, ResourceId};
use crate::value::Values;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Chooses the steps of a frame.
pub fn select(plan: &Plan, keys: &Keys, held: &Held, scene: &SceneInputs, values: &Values) -> Selection {
    let versions = keys.versions(plan, held.history(plan), scene, values);
    let bits = bits(plan, keys, held, &versions);
    let run = required(plan, keys, held, &versions, &bits);
    let why = |i: usize| {
        let unit = &keys.units[i];
        let before = held.ran.get(&unit.name);
        let same = before.filter(|ran| ran.key == versions.keys[i]);
        match (run.contains(&i), before) {
            _ if versions.off[i] => Why::OtherFrames,
            (true, _) if unit.writes.is_empty() => Why::Marks,
            (true, None) => Why::First,
            (true, Some(_)) if same.is_some() => Why::Overwritten,
            (true, Some(ran)) => Why::Changed(versions.inputs(keys, i).differences(&ran.inputs)),
            (false, _) => {
                // Under another name it may have run too.
                let any = || held.ran.values().find(|ran| ran.key == versions.keys[i]);
                same.or_else(any).map_or(Why::NotNeeded, |ran| Why::Unchanged { since: ran.frame })
            }
        }
    };
    let why = (0..keys.units.len()).map(why).collect();
    selection(plan, keys, held, versions, why, bits)
}

/// Chooses all steps that the outputs take.
pub fn full(plan: &Plan, keys: &Keys, held: &Held, scene: &SceneInputs, values: &Values) -> Selection {
    let versions = keys.versions(plan, held.history(plan), scene, values);
    let maker = |r: &ResourceId, last| versions.maker(keys, *r, last);
    let mut open: Vec<usize> = lasting(plan).iter().filter_map(|r| maker(r, keys.last[r.0])).collect();
    let reason = |off: &bool| if *off { Why::OtherFrames } else { Why::NotNeeded };
    let mut why: Vec<Why> = versions.off.iter().map(reason).collect();
    while let Some(i) = open.pop() {
        if why[i] != Why::Asked {
            why[i] = Why::Asked;
            let unit = &keys.units[i];
            open.extend(unit.needs.iter().zip(&unit.makers).filter_map(|(r, last)| maker(r, *last)));
        }
    }
    selection(plan, keys, held, versions, why, AllBits::new())
}

/// Chooses all steps but those that write dirty bits: nothing goes by them.
pub fn everything(plan: &Plan, keys: &Keys, held: &Held, scene: &SceneInputs, values: &Values) -> Selection {
    let versions = keys.versions(plan, held.history(plan), scene, values);
    let why = |(unit, off): (&Unit, &bool)| match unit.writes.is_empty() {
        _ if *off => Why::OtherFrames,
        true => Why::NotNeeded,
        false => Why::Asked,
    };
    let why = keys.units.iter().zip(&versions.off).map(why).collect();
    selection(plan, keys, held, versions, why, AllBits::new())
}

/// The dirty bits of a plan.
type AllBits = BTreeMap<ResourceId, Bits>;

/// The selection that runs the units whose reason says so; in part where there are bits to go by.
fn selection(plan: &Plan, keys: &Keys, held: &Held, versions: Versions, why: Vec<Why>, bits: AllBits) -> Selection {
    let steps = plan.steps.len();
    let mut all = Selection {
        run: vec![false; steps],
        why: vec![Why::NotNeeded; steps],
        keys: versions.keys.iter().copied().zip(versions.rest.iter().copied()).collect(),
        ..Selection::default()
    };
    let mut slots = held.slots();
    for (i, (unit, mut why)) in keys.units.iter().zip(why).enumerate() {
        if let (Why::Changed(names), [step], false) = (&mut why, &unit.steps[..], bits.is_empty())
            && partly(plan, held, &versions, (i, unit), &slots)
        {
            all.partial.insert(*step);
            why = Why::ChangedInPart(std::mem::take(names));
        }
        for s in &unit.steps {
            all.run[s.0] = why.runs();
            all.why[s.0] = why.clone();
        }
        if why.runs() {
            for (r, version) in unit.writes.iter().zip(&versions.after[i]) {
                let slot = plan.resources[r.0].slot;
                slots[slot] = *version;
                all.writes.push((slot, *version));
            }
            let ran = LastRun { key: versions.keys[i], inputs: versions.inputs(keys, i), frame: held.frames };
            all.ran.push((unit.name.clone(), Arc::new(ran)));
        }
    }
    let runs = |i: usize| keys.units[i].steps.iter().any(|s| all.run[s.0]);
    let partial = all.partial.iter().filter_map(|s| Some(plan.steps[s.0].only.as_ref()?.bits));
    let read = (0..keys.units.len()).filter(|i| runs(*i)).flat_map(|i| keys.units[i].bits.iter().copied());
    let wanted: BTreeSet<ResourceId> = partial.chain(read).collect();
    all.bits = bits.into_iter().filter(|(id, _)| wanted.contains(id)).collect();
    all
}

/// Where all dirty bits come from in a frame, whoever runs: what changed since the last one decides.
fn bits(plan: &Plan, keys: &Keys, held: &Held, versions: &Versions) -> AllBits {
    let mut all = AllBits::new();
    for (i, unit) in keys.units.iter().enumerate() {
        let Some(only) = plan.only(unit) else { continue };
        let now = match held.previous.get(i) {
            Some((key, _)) if *key == versions.keys[i] => Bits::Clear,
            Some((_, rest)) if *rest == versions.rest[i] => Bits::Written,
            _ => Bits::Set,
        };
        let there = all.entry(only.bits).or_insert(now);
        *there = now.max(*there);
    }
    all
}

/// Whether a unit can run for some of its instances, with these contents of memory before it.
fn partly(plan: &Plan, held: &Held, versions: &Versions, (i, unit): (usize, &Unit), slots: &[Version]) -> bool {
    let Some((key, rest)) = held.previous.get(i).filter(|_| plan.only(unit).is_some()) else { return false };
    let there = |r: &ResourceId| slots[plan.resources[r.0].slot] == unit.content(*key, *r);
    *rest == versions.rest[i] && unit.writes.iter().all(there)
}

/// What the outputs, and what the next frame begins with, are.
fn lasting(plan: &Plan) -> BTreeSet<ResourceId> {
    let history = plan.resources.iter().enumerate().filter(|(_, r)| r.history).map(|(i, _)| ResourceId(i));
    plan.outputs.iter().map(|o| o.1).chain(history).collect()
}

/// The units that must run so that these resources are in memory at the end.
fn required(plan: &Plan, keys: &Keys, held: &Held, versions: &Versions, bits: &AllBits) -> BTreeSet<usize> {
    let end = lasting(plan);
    let marker = |id: &ResourceId| keys.markers.get(id).filter(|_| bits.get(id) == Some(&Bits::Written));
    let slot = |r: &ResourceId| plan.resources[r.0].slot;
    let there = held.slots();
    let mut run: BTreeSet<usize> = BTreeSet::new();
    loop {
        // With all that is known to run, what is missing when it is wanted? Memory is shared: what was there may be
        // gone.
        let mut slots = there.clone();
        let mut more: Vec<usize> = vec![];
        for i in &run {
            let unit = &keys.units[*i];
            for ((r, v), maker) in unit.needs.iter().zip(&versions.before[*i]).zip(&unit.makers) {
                if *v != UNDEFINED && slots[slot(r)] != *v {
                    more.extend(versions.maker(keys, *r, *maker));
                }
            }
            more.extend(unit.bits.iter().filter_map(marker));
            if partly(plan, held, versions, (*i, unit), &slots) {
                more.extend(plan.only(unit).and_then(|only| marker(&only.bits)));
            }
            for (r, v) in unit.writes.iter().zip(&versions.after[*i]) {
                slots[slot(r)] = *v;
            }
        }
        for r in &end {
            let wanted = versions.end[r.0];
            if wanted != UNDEFINED && slots[slot(r)] != wanted {
                more.extend(versions.maker(keys, *r, keys.last[r.0]));
            }
        }
        let before = run.len();
        // What even the memory of the last frame lacks must be made in any case.
        while let Some(i) = more.pop() {
            if run.insert(i) {
                let unit = &keys.units[i];
                let needs = unit.needs.iter().zip(&versions.before[i]).zip(&unit.makers);
                let lacking = needs.filter(|((r, v), _)| **v != UNDEFINED && there[slot(r)] != **v);
                more.extend(lacking.filter_map(|((r, _), maker)| versions.maker(keys, *r, *maker)));
            }
        }
        if run.len() == before {
            return run;
        }
    }
}
