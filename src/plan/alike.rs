//! Results that came out as they were before. A step that runs again for some of its members often leaves the same bits: what moved lies
//! in the dark, say. Its new result then counts as the old one, and nothing that reads it runs. No device.

use super::change::Selection;
use super::keys::{Keys, Unit, Version};
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

/// Of a frame's steps that run for some of their members those whose result it pays to look at before the rest: others that run read
/// it, and it can be read back. The number of the unit, and what it writes.
pub fn candidates<'a>(
    plan: &'a Plan,
    keys: &'a Keys,
    selection: &'a Selection,
) -> impl Iterator<Item = (usize, BTreeSet<ResourceId>)> + 'a {
    keys.units.iter().enumerate().filter_map(move |(i, unit)| {
        let [step] = unit.steps[..] else { return None };
        selection.members.get(&step.0).filter(|m| m.contains(&true) && m.contains(&false))?;
        let runs = |reader: &Unit| reader.steps.iter().any(|s| selection.run[s.0]);
        keys.units.iter().find(|reader| reader.makers.contains(&Some(i)) && runs(reader))?;
        let compared = |r: &&ResourceId| {
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
