//! Steps whose members read some of the parts that members of another step make, each those of its row of a mask: they run again for
//! members alone that read a part which came out otherwise, or have something else of their own. No device.

use super::change::{Held, Ran, still_standing};
use super::keys::{Keys, Version};
use super::member::Members;
use super::outside::Outside;
use super::{Plan, ResourceId};
use crate::content::hash;
use crate::value::Values;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What the members of a unit should read.
#[derive(Debug, Clone)]
pub struct Reads {
    /// Of its own, by member.
    pub own: Members,
    /// The same with all that masks choose from, as if each read all of it.
    pub all: Members,
    /// What masks choose from.
    pub parts: Vec<Made>,
    /// The masks, in the same order.
    pub masks: Vec<Made>,
}

/// A resource that members of a unit make part by part.
#[derive(Debug, Clone)]
pub struct Made {
    pub resource: ResourceId,
    /// A version of what its parts have in common.
    pub common: Version,
    pub parts: Members,
}

/// What the members of a unit read in its last run.
#[derive(Debug, Clone)]
pub struct Read {
    own: Members,
    all: u128,
    /// By resource: a version of what its parts have in common, and of each alone.
    parts: Vec<(Version, Members)>,
}

impl Reads {
    /// As of now.
    pub fn read(&self) -> Read {
        let parts = self.parts.iter().map(|made| (made.common, made.parts.clone())).collect();
        Read { own: self.own.clone(), all: self.all.all(), parts }
    }
}

/// A version of each part that members make, of what these have in common and each alone.
fn parts(common: Version, members: &Members) -> Vec<u64> {
    members.each().iter().map(|member| hash(&(common, member)) as u64).collect()
}

/// The versions of members that stand in for those of [`Reads::all`].
#[derive(Debug, Clone)]
pub struct Settled {
    /// [`Reads::all`], whose place they take.
    all: u128,
    members: Members,
    /// The run that they were settled by.
    by: Arc<Ran>,
}

impl Settled {
    pub fn members(&self, all: &Members) -> Option<Members> {
        (self.all == all.all()).then(|| self.members.clone())
    }
}

/// What the host has read of masks.
pub type Masks = BTreeMap<ResourceId, Mask>;

/// A row of bits for each member of who reads by it.
#[derive(Debug, Clone)]
pub struct Mask {
    /// A version of each row.
    pub rows: Vec<u64>,
    pub words: Vec<u32>,
}

impl Mask {
    /// The versions that the rows of so many members should have.
    fn rows(made: &Made, count: usize) -> Vec<u64> {
        if made.parts.len() == count { parts(made.common, &made.parts) } else { vec![made.common as u64; count] }
    }

    /// Whether it is as it should be, but for the rows of a few members: they then count as `other` ones too.
    fn stands_in(&self, rows: &[u64], other: &mut [bool]) -> bool {
        if self.rows.len() != rows.len() {
            return false;
        }
        let stale = |i: &usize| !other[*i] && rows[*i] != self.rows[*i];
        let stale: Vec<usize> = (0..rows.len()).filter(stale).collect();
        let few = stale.len() * STALE_ONE_IN <= rows.len();
        if few {
            stale.into_iter().for_each(|i| other[i] = true);
        }
        few
    }
}

/// The share of members for whose sake a mask is not read anew: one in so many.
const STALE_ONE_IN: usize = 32;

/// Gives back the versions of before to members that read what they read. What masks tell is asked for only where it may save
/// something: the result is masks that are needed and not `known` as they should be, with the versions of their rows.
///
/// A version of before stands for other parts that the member does not read: only while nothing else differs either, so this is asked
/// anew in every frame.
pub fn settle(
    plan: &Plan,
    keys: &Keys,
    held: &Held,
    outside: &mut Outside,
    values: &Values,
    known: &Masks,
) -> Vec<(ResourceId, Vec<u64>)> {
    let mut wanted = vec![];
    for (i, unit) in keys.units.iter().enumerate().filter(|(_, unit)| !unit.masked().is_empty()) {
        let earlier = outside.settled.remove(&unit.name);
        let versions = keys.versions(plan, held.history(plan), outside, values);
        let Some(reads) = &versions.reads[i] else { continue };
        let ran = still_standing(plan, keys, held, (outside, values), (&versions, i));
        let Some((ran, then)) = ran.and_then(|ran| Some((ran, ran.read.as_ref()?))) else { continue };
        let all = reads.all.all();
        let earlier = earlier.filter(|e| e.all == all && Arc::ptr_eq(&e.by, ran));
        let members = if let Some(earlier) = earlier {
            Some(earlier.members)
        } else if then.all == all {
            Some(ran.members.clone())
        } else {
            kept(reads, &reads.read(), then, &ran.members, |made, other| {
                let (id, rows) = (made.resource, Mask::rows(made, other.len()));
                if keys.changes_history(plan, id) {
                    return None;
                }
                let mask = known.get(&id).filter(|mask| mask.stands_in(&rows, other));
                wanted.extend(mask.is_none().then_some((id, rows)));
                mask
            })
        };
        let settled = members.map(|members| (unit.name.clone(), Settled { all, members, by: ran.clone() }));
        outside.settled.extend(settled);
    }
    wanted
}

/// The share of parts above which so many members read another one that it is not worth to ask which: one in so many.
const ONE_IN: usize = 8;

/// The versions of before of members that read what they read, and new ones of the others. `mask` gives one where one is needed, with
/// good rows of all that are not `other` ones, as it may make them: what these have of their own is the same, so that they read the same
/// parts. `None`: that can't be told.
fn kept<'m>(
    reads: &Reads,
    now: &Read,
    then: &Read,
    members: &Members,
    mut mask: impl FnMut(&Made, &mut [bool]) -> Option<&'m Mask>,
) -> Option<Members> {
    let count = reads.all.len();
    let counts = [members.len(), now.own.len(), then.own.len()];
    if then.parts.len() != now.parts.len() || counts.iter().any(|c| *c != count) {
        return None;
    }
    let mut other: Vec<bool> = now.own.each().iter().zip(then.own.each()).map(|(now, then)| now != then).collect();
    for (((common, now), (before, then)), made) in now.parts.iter().zip(&then.parts).zip(&reads.masks) {
        if common != before || now.is_empty() || now.len() != then.len() {
            return None;
        }
        if now == then {
            continue;
        }
        let pairs = now.each().iter().zip(then.each()).enumerate();
        let changed: Vec<usize> = pairs.filter(|(_, (now, then))| now != then).map(|(part, _)| part).collect();
        if changed.len() * ONE_IN > now.len() {
            return None;
        }
        let words = &mask(made, &mut other)?.words;
        let row = words.len() / count.max(1);
        if row == 0 {
            return None;
        }
        // A bit stands for as many parts as it takes.
        let run = now.len().div_ceil(32 * row);
        let mut bits = vec![0_u32; row];
        for bit in changed.into_iter().map(|part| part / run) {
            bits[bit / 32] |= 1 << (bit % 32);
        }
        let reads_one = |row: &[u32]| row.iter().zip(&bits).any(|(row, bits)| row & bits != 0);
        other.iter_mut().zip(words.chunks_exact(row)).for_each(|(other, row)| *other |= reads_one(row));
    }
    if !other.contains(&true) {
        return Some(members.clone());
    }
    let versions = other.iter().zip(reads.all.each().iter().zip(members.each()));
    Some(Members::of(versions.map(|(other, (now, then))| if *other { *now } else { *then }).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Members that read of their own and by a mask.
    fn reads(own: &[u64], parts: &[u64]) -> Reads {
        let (own, parts) = (Members::of(own.to_vec()), Members::of(parts.to_vec()));
        let from = vec![(1, own.clone()), (parts.all(), Members::default())];
        let all = Members::reading(own.len(), from);
        let made = |resource, parts| Made { resource: ResourceId(resource), common: 7, parts };
        Reads { parts: vec![made(0, parts)], masks: vec![made(1, own.clone())], own, all }
    }

    fn settled(then: &Reads, now: &Reads, words: &[u32]) -> Option<Members> {
        let mask = Mask { rows: vec![], words: words.to_vec() };
        kept(now, &now.read(), &then.read(), &then.all, |_, _| Some(&mask))
    }

    fn same(a: &Members, b: &Members) -> Vec<bool> {
        a.each().iter().zip(b.each()).map(|(a, b)| a == b).collect()
    }

    /// Eight parts, of which one may be another one.
    fn parts_with(other: Option<usize>) -> Vec<u64> {
        (0..8).map(|part| if Some(part as usize) == other { 99 } else { part }).collect()
    }

    #[test]
    fn members_keep_their_version_while_what_they_read_is_the_same() {
        let then = reads(&[5, 6, 7], &parts_with(None));
        // The second part is another one, which the first member reads; the third has something else of its own.
        let now = reads(&[5, 6, 8], &parts_with(Some(1)));
        let members = settled(&then, &now, &[0b0010, 0b1101, 0]).unwrap();
        assert_eq!(same(&members, &then.all), [false, true, false]);
        assert_eq!(same(&members, &now.all), [true, false, true]);
        let nobody = reads(&[5, 6, 7], &parts_with(Some(3)));
        assert!(settled(&then, &nobody, &[0b0111, 0b0011, 0]).unwrap() == then.all, "they need not run at all");
        assert_eq!(same(&settled(&then, &nobody, &[0, 0, 0b1000]).unwrap(), &then.all), [true, true, false]);
    }

    #[test]
    fn a_mask_that_cannot_be_had_tells_nothing() {
        let (then, now) = (reads(&[5, 6], &parts_with(None)), reads(&[5, 6], &parts_with(Some(1))));
        assert!(kept(&now, &now.read(), &then.read(), &then.all, |_, _| None).is_none());
        assert!(settled(&then, &now, &[]).is_none() && settled(&then, &reads(&[5, 6], &[1]), &[0, 0]).is_none());
        let two: Vec<u64> = (0..8).map(|part| part / 6 * 90 + part).collect();
        assert!(settled(&then, &reads(&[5, 6], &two), &[0, 0]).is_none(), "too many parts are others");
        // Nor is one asked for where no part is another one.
        let own = reads(&[5, 9], &parts_with(None));
        let kept = kept(&own, &own.read(), &then.read(), &then.all, |_, _| panic!("asked")).unwrap();
        assert_eq!(same(&kept, &then.all), [true, false]);
    }

    #[test]
    fn a_mask_stands_in_but_for_the_rows_of_a_few_members() {
        let mask = Mask { rows: (0..64).collect(), words: vec![] };
        let mut rows = mask.rows.clone();
        rows[3] = 99;
        rows[9] = 99;
        let mut other = vec![false; 64];
        other[3] = true;
        assert!(mask.stands_in(&rows, &mut other));
        let others = |other: &[bool]| (0..64).filter(|i| other[*i]).collect::<Vec<_>>();
        assert_eq!(others(&other), [3, 9]);
        rows[20..24].fill(99);
        assert!(!mask.stands_in(&rows, &mut other) && !mask.stands_in(&rows[..63], &mut other));
        assert_eq!(others(&other), [3, 9]);
    }

    #[test]
    fn bits_stand_for_as_many_parts_as_it_takes() {
        // 70 parts, 32 bits: three a bit.
        let parts: Vec<u64> = (0..70).collect();
        let then = reads(&[5, 6], &parts);
        for part in [0, 2, 3, 65, 69] {
            let mut other = parts.clone();
            other[part] = 99;
            let members = settled(&then, &reads(&[5, 6], &other), &[1 << (part / 3), !(1 << (part / 3))]).unwrap();
            assert_eq!(same(&members, &then.all), [false, true], "part {part}");
        }
    }
}
