//! Results that came out as they were before. A step that runs again for some of its members often leaves the same bits: what moved lies
//! in the dark, say. Its new result then counts as the old one, and nothing that reads it runs. No device.

use super::change::Selection;
use super::keys::{Keys, Unit, Version};
use super::member::Members;
use super::{Desc, Plan, ResourceId, Step};
use std::collections::{BTreeMap, BTreeSet};

/// Versions of contents that were found equal, bit for bit, to others.
#[derive(Debug, Clone, Default)]
pub struct Alike(BTreeMap<Version, Version>);

impl Alike {
    /// The version that stands for the content of this one.
    pub fn of(&self, version: Version) -> Version {
        self.0.get(&version).copied().unwrap_or(version)
    }

    /// From now on `earlier`, which stands for itself, stands for `version` too, and for no other. What stands for others is forgotten
    /// where it is not `held` any more.
    pub fn add(&mut self, version: Version, earlier: Version, held: impl Fn(Version) -> bool) {
        if version != earlier {
            self.0.retain(|_, e| *e != earlier && held(*e));
            self.0.insert(version, earlier);
        }
    }
}

/// The parts of a result that members made: a version of what they have in common, and one of each.
pub type Parts = (Version, Members);

/// Parts of results that came out as they were, by resource.
#[derive(Debug, Clone, Default)]
pub struct AlikeParts(BTreeMap<ResourceId, Stands>);

#[derive(Debug, Clone)]
struct Stands {
    /// As they were made last.
    made: Parts,
    /// By part: the version that stands for its content.
    content: Members,
}

impl AlikeParts {
    /// The versions that stand for the contents of these.
    pub fn of(&self, id: ResourceId, common: Version, made: &Members) -> Members {
        let Some(known) = self.0.get(&id).filter(|known| known.made.0 == common) else { return made.clone() };
        if known.made.1 == *made {
            return known.content.clone();
        }
        let (then, content) = (known.made.1.each(), known.content.each());
        if then.len() != made.len() {
            return made.clone();
        }
        let each = made.each().iter().zip(then.iter().zip(content));
        Members::of(each.map(|(now, (then, content))| if now == then { *content } else { *now }).collect())
    }

    /// Learns which parts of a resource came out as they were, from its bytes before and after, one part behind another. How many were
    /// made anew, and how many of these are other ones.
    pub fn learn(
        &mut self,
        id: ResourceId,
        then: &Parts,
        now: &Parts,
        was: &[u8],
        is: &[u8],
    ) -> Option<(usize, usize)> {
        let count = now.1.len();
        let size = is.len().checked_div(count).filter(|size| *size > 0)?;
        if then.0 != now.0 || then.1.len() != count || was.len() != is.len() || size * count != is.len() {
            return None;
        }
        let mut content = self.of(id, then.0, &then.1).each().to_vec();
        let (mut ran, mut other) = (0, 0);
        let bytes = was.chunks_exact(size).zip(is.chunks_exact(size));
        for ((content, (then, now)), (was, is)) in
            content.iter_mut().zip(then.1.each().iter().zip(now.1.each())).zip(bytes)
        {
            ran += usize::from(then != now);
            if was != is {
                other += 1;
                *content = *now;
            }
        }
        self.0.insert(id, Stands { made: now.clone(), content: Members::of(content) });
        Some((ran, other))
    }
}

/// When to look at results: each look in vain makes the next ones wait a little longer. A look costs far less than what it may
/// save, so that they stay frequent.
#[derive(Debug, Default)]
pub struct Looks(BTreeMap<String, Wait>);

#[derive(Debug, Default)]
struct Wait {
    /// Looks in vain since one that paid.
    vain: u32,
    /// Frames until the next one.
    left: u32,
}

/// Frames that a look waits at most.
const LONGEST_WAIT: u32 = 8;

impl Looks {
    /// Whether to look at the result of a unit in a frame in which that might pay; counts the frame.
    pub fn due(&mut self, unit: &str) -> bool {
        let Some(wait) = self.0.get_mut(unit).filter(|w| w.left > 0) else { return true };
        wait.left -= 1;
        false
    }

    /// What a look found.
    pub fn learn(&mut self, unit: &str, same: bool) {
        let wait = self.0.entry(unit.into()).or_default();
        wait.vain = if same { 0 } else { wait.vain.saturating_add(1) };
        wait.left = (wait.vain / 2).min(LONGEST_WAIT);
    }
}

/// Bytes of a result that the host compares, at most: those that it has sooner than a step like those that read them is done.
const MOST_BYTES: u64 = 1 << 20;

/// Whether the results of a step may be compared with those of before. What members make of rows of a table is another thing with the
/// rows, most likely.
pub(super) fn comparable(step: &Step, written: &Desc) -> bool {
    let own = step.own.as_ref().is_some_and(|own| own.rows.is_empty());
    (own || step.sight.is_some()) && written.bytes() <= MOST_BYTES
}

/// Whether the host compares digests of a resource's parts in place of its bytes: of an atlas, some tiles of which members read as their
/// own, or by a mask.
pub fn digested(plan: &Plan, keys: &Keys, id: ResourceId) -> bool {
    let Some(Desc::Texture(t)) = plan.resources.get(id.0).map(|r| &r.desc) else { return false };
    let bits = !matches!(t.format.sample_type(None, None), None | Some(wgpu::TextureSampleType::Depth));
    bits && t.tiles.is_some() && keys.units.iter().any(|unit| unit.reads_parts(id))
}

/// Of a frame's steps that run for some of their members those whose result it pays to look at before the rest: others that run read
/// it, and it can be read back. The number of the unit, and what it writes.
pub fn candidates<'a>(
    plan: &'a Plan,
    keys: &'a Keys,
    selection: &'a Selection,
) -> impl Iterator<Item = (usize, BTreeSet<ResourceId>)> + 'a {
    keys.units.iter().enumerate().filter_map(move |(i, unit)| {
        let [step] = unit.steps[..] else { return None };
        selection.partly.members.get(&step.0).filter(|m| m.contains(&true) && m.contains(&false))?;
        let runs = |reader: &Unit| reader.steps.iter().any(|s| selection.run[s.0]);
        keys.units.iter().find(|reader| reader.makers.contains(&Some(i)) && runs(reader))?;
        let compared = |r: &&ResourceId| {
            if keys.changes_history(plan, **r) {
                return false;
            }
            if digested(plan, keys, **r) {
                return keys.last[r.0] == Some(i);
            }
            let desc = &plan.resources[r.0].desc;
            let readable = match desc {
                Desc::Texture(t) => t.usage.contains(wgpu::TextureUsages::COPY_SRC),
                Desc::Buffer { usage, .. } => usage.contains(wgpu::BufferUsages::COPY_SRC),
            };
            readable && comparable(&plan.steps[step.0], desc) && keys.last[r.0] == Some(i)
        };
        let written: BTreeSet<ResourceId> = unit.writes.iter().filter(compared).copied().collect();
        (!written.is_empty()).then_some((i, written))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_stands_for_the_last_found_equal_to_it() {
        let mut alike = Alike::default();
        alike.add(2, 1, |_| true);
        alike.add(8, 7, |_| true);
        alike.add(5, 5, |_| true);
        assert_eq!([1, 2, 5, 8].map(|v| alike.of(v)), [1, 1, 5, 7]);
        alike.add(3, 1, |held| held == 1);
        assert_eq!([2, 3, 8].map(|v| alike.of(v)), [2, 1, 8]);
    }

    #[test]
    fn parts_that_come_out_as_they_were_stand_for_those_of_before() {
        let (id, mut alike) = (ResourceId(0), AlikeParts::default());
        let parts = |each: [u64; 3]| (7, Members::of(each.to_vec()));
        let stand = |alike: &AlikeParts, each: [u64; 3]| alike.of(id, 7, &parts(each).1).each().to_vec();
        let learned = alike.learn(id, &parts([1, 2, 3]), &parts([1, 12, 13]), b"aabbcc", b"aabbdd");
        assert_eq!(learned, Some((2, 1)));
        assert_eq!(stand(&alike, [1, 12, 13]), [1, 2, 13]);
        let learned = alike.learn(id, &parts([1, 12, 13]), &parts([1, 22, 13]), b"aabbdd", b"aabbdd");
        assert_eq!(learned, Some((1, 0)));
        assert_eq!(stand(&alike, [1, 22, 13]), [1, 2, 13]);
        assert_eq!(stand(&alike, [1, 12, 14]), [1, 12, 14], "what was made last counts");
        let made = parts([1, 22, 13]).1;
        assert!(alike.of(ResourceId(1), 7, &made) == made && alike.of(id, 8, &made) == made);
        let uneven = (7, Members::of(vec![1, 2]));
        assert_eq!(alike.learn(id, &uneven, &uneven, b"aab", b"aab"), None, "no equal parts");
        let none = (7, Members::default());
        assert_eq!(alike.learn(id, &none, &none, b"", b""), None);
    }

    #[test]
    fn looks_in_vain_become_rare() {
        let mut looks = Looks::default();
        let mut seen = vec![];
        for frame in 0..200 {
            if looks.due("step") {
                seen.push(frame);
                looks.learn("step", false);
            }
        }
        assert_eq!(seen[..9], [0, 1, 3, 5, 8, 11, 15, 19, 24]);
        assert!(seen.windows(2).skip(16).all(|two| two[1] - two[0] == LONGEST_WAIT + 1), "{seen:?}");
        looks.learn("step", true);
        assert!(looks.due("step") && looks.due("step"));
    }
}
