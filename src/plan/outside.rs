//! What the scene gives to a plan, hashed: of a frame's tables as much as has changed. No device.

use super::alike::{Alike, AlikeParts};
use super::keys::{UNDEFINED, Version};
use super::masked::Settled;
use super::member::Members;
use super::region;
use super::tables::pack;
use super::window::Windows;
use super::{Plan, Rows};
use crate::content::hash;
use crate::diag::Checked;
use crate::scene::{AssetHashes, Table};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

/// What the scene gives to a plan, hashed.
#[derive(Debug, Clone, Default)]
pub struct Outside {
    pub assets: AssetHashes,
    /// How many frames came before the plan's first.
    pub began: u32,
    /// By index of [`Plan::tables`].
    pub(super) tables: Vec<u128>,
    /// Of tables that members read rows of: a version of what all rows have in common, and by member one of its rows.
    pub(super) rows: BTreeMap<Rows, (Version, Members)>,
    /// By step that runs member by member: what each of its members sees.
    pub members: BTreeMap<usize, region::Seen>,
    /// Results that came out as they were before.
    pub alike: Alike,
    /// The same of parts of results.
    pub parts: AlikeParts,
    /// By unit whose members read parts that a mask chooses: versions of those that read what they read.
    pub settled: BTreeMap<String, Settled>,
    /// Of draws whose members go over parts of what they drew, if these run.
    pub windows: Windows,
}

impl Outside {
    /// As it is, but that draws go over all of their places.
    pub fn without_windows(&self) -> Cow<'_, Outside> {
        match self.windows.is_empty() {
            true => Cow::Borrowed(self),
            false => Cow::Owned(Outside { windows: Windows::new(), ..self.clone() }),
        }
    }

    /// # Errors
    /// A table that lacks a column; the planner has checked that, so it is a fault of the caller.
    pub fn new(plan: &Plan, assets: AssetHashes, began: u32, tables: &[Table]) -> Checked<Outside> {
        let owns = plan.steps.iter().filter_map(|s| s.own.as_ref());
        let rows = owns.flat_map(|own| &own.rows).map(|rows| (*rows, (UNDEFINED, Members::default()))).collect();
        let mut outside = Outside { assets, began, tables: vec![0; plan.tables.len()], rows, ..Outside::default() };
        outside.follow(plan, &[], tables)?;
        Ok(outside)
    }

    /// Goes on from the tables `before` to others of the same scene; those that are the same cost nothing.
    ///
    /// # Errors
    /// As [`Outside::new`].
    pub fn follow(&mut self, plan: &Plan, before: &[Table], tables: &[Table]) -> Checked<()> {
        let AssetHashes { geometry, order, .. } = self.assets;
        let places = tables.iter().find_map(Table::places);
        // What tables of places follow from beside these: they are large, and it is little.
        let levels: Vec<u32> = plan.levels.iter().map(|level| level.tolerance.to_bits()).collect();
        let beside = |table: &str| match table {
            "nodes" => Some(0),
            "triangles" | "bvh" => Some(hash(&(geometry, order))),
            "clusters" => Some(hash(&(geometry, order, &levels))),
            _ => None,
        };
        for (index, (wanted, hashed)) in plan.tables.iter().zip(&mut self.tables).enumerate() {
            let Some(table) = tables.iter().find(|t| t.name == wanted.table) else { continue };
            if before.iter().any(|b| b.is_clone(table)) {
                continue;
            }
            let columns: Vec<_> = wanted.row.members.iter().map(|m| (m.name.as_str(), m.offset)).collect();
            let layout = (table.name, &columns, wanted.stride, wanted.rows);
            *hashed = match places.zip(beside(table.name)) {
                Some(follows) => hash(&(follows, layout)),
                None => hash(&pack(wanted, table)?),
            };
            let names: Vec<&str> = columns.iter().map(|c| c.0).collect();
            for (rows, (common, members)) in self.rows.iter_mut().filter(|(rows, _)| rows.table == index) {
                let then = before.iter().find(|b| b.name == table.name).filter(|_| !members.is_empty());
                *common = hash(&(layout, table.rows, geometry, order)).max(1);
                let changed = then.and_then(|then| table.differs(then));
                *members = rows.versions(members, changed, |range| table.version_of(&names, range));
            }
        }
        Ok(())
    }
}

impl Rows {
    /// The versions of before, but for members some of whose rows are in `changed`; `None`: all are new. `version` gives that of some
    /// rows.
    fn versions(
        &self,
        before: &Members,
        changed: Option<Vec<Range<usize>>>,
        version: impl Fn(Range<usize>) -> u64,
    ) -> Members {
        let (count, each) = (self.members as usize, self.each as usize);
        let mut versions = match &changed {
            Some(_) => before.each().to_vec(),
            None => vec![0; count],
        };
        let mut other = vec![changed.is_none(); count];
        for rows in changed.into_iter().flatten() {
            let members = rows.start / each..rows.end.div_ceil(each);
            other.iter_mut().take(members.end).skip(members.start).for_each(|other| *other = true);
        }
        for (i, v) in versions.iter_mut().enumerate().filter(|(i, _)| other.get(*i) == Some(&true)) {
            *v = version(i * each..(i + 1) * each);
        }
        Members::of(versions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_changed_give_their_members_a_new_version() {
        let rows = Rows { table: 0, members: 4, each: 10 };
        let held = std::cell::RefCell::new(vec![1; 70]);
        let version = |range: Range<usize>| held.borrow()[range].iter().sum();
        let first = rows.versions(&Members::default(), None, version);
        assert_eq!(first.each(), [10, 10, 10, 10]);
        for row in [9, 25, 30] {
            held.borrow_mut()[row] = 2;
        }
        let changed = || vec![9..10, 25..31];
        let second = rows.versions(&first, Some(changed()), version);
        assert_eq!(second.each(), [11, 10, 11, 11]);
        // Those of others are not asked for; rows past the members are nobody's.
        let never = |range: Range<usize>| panic!("{range:?}");
        assert_eq!(rows.versions(&second, Some(vec![]), never).each(), second.each());
        assert_eq!(rows.versions(&second, Some(vec![40..60, 69..70]), never).each(), second.each());
        held.borrow_mut().fill(1);
        assert!(rows.versions(&second, Some(changed()), version) == first, "the same rows have the same version");
    }
}
