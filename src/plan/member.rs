//! Versions of the members of a unit, many of them: cheap to hand on and to compare, and worked out one by one only where somebody asks.

use super::keys::Version;
use crate::content::hash;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, OnceLock};

/// A version of what each member of a unit alone depends on; none for a unit that runs as a whole.
#[derive(Debug, Clone, Default)]
pub struct Members(Option<Arc<Listed>>);

#[derive(Debug)]
struct Listed {
    count: usize,
    /// Of all of them together.
    all: u128,
    /// What each reads a part of: a version of what the parts have in common, and those of the parts.
    from: Vec<(Version, Members)>,
    each: OnceLock<Vec<u64>>,
}

impl Members {
    /// Members of known versions.
    pub fn of(each: Vec<u64>) -> Members {
        if each.is_empty() {
            return Members::default();
        }
        let (count, all) = (each.len(), hash(&each));
        Members(Some(Arc::new(Listed { count, all, from: vec![], each: OnceLock::from(each) })))
    }

    /// So many members, each of which reads its own part of some contents. Where those have no members whose number goes into
    /// theirs, it reads what they have in common.
    pub fn reading(count: usize, from: Vec<(Version, Members)>) -> Members {
        if count == 0 {
            return Members::default();
        }
        let all = hash(&(count, from.iter().map(|(common, parts)| (common, parts.all())).collect::<Vec<_>>()));
        Members(Some(Arc::new(Listed { count, all, from, each: OnceLock::new() })))
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    pub fn len(&self) -> usize {
        self.0.as_ref().map_or(0, |l| l.count)
    }

    /// Of all of them together; 0 for none.
    pub fn all(&self) -> u128 {
        self.0.as_ref().map_or(0, |l| l.all)
    }

    /// By member.
    pub fn each(&self) -> &[u64] {
        let Some(listed) = &self.0 else { return &[] };
        listed.each.get_or_init(|| {
            let one = |member: usize| {
                let mut h = DefaultHasher::new();
                for (common, parts) in &listed.from {
                    (common, shares(parts.each(), listed.count, member)).hash(&mut h);
                }
                h.finish()
            };
            (0..listed.count).map(one).collect()
        })
    }

    /// Whether each of so many members has its own of these, or shares one with a few.
    pub fn go_into(&self, members: usize) -> bool {
        let (more, fewer) = (self.len().max(members), self.len().min(members));
        fewer > 0 && more % fewer == 0
    }
}

impl PartialEq for Members {
    fn eq(&self, other: &Members) -> bool {
        self.len() == other.len() && self.all() == other.all()
    }
}

/// What one of so many members has of some parts: a few in a row, or one that a few members share. `None`: they don't go into
/// each other.
fn shares(parts: &[u64], members: usize, member: usize) -> Option<&[u64]> {
    let (parts_each, members_each) = (parts.len() / members.max(1), members / parts.len().max(1));
    if parts_each > 0 && parts_each * members == parts.len() {
        parts.get(parts_each * member..parts_each * (member + 1))
    } else if members_each > 0 && members_each * parts.len() == members {
        parts.get(member / members_each..=member / members_each)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_that_read_parts_change_with_their_own() {
        let read = |parts: &[u64]| Members::reading(2, vec![(7, Members::of(parts.to_vec()))]);
        let before = read(&[1, 2, 3, 4]);
        let after = read(&[1, 2, 3, 5]);
        assert_eq!((before.len(), before.each().len()), (2, 2));
        assert_eq!(before.each()[0], after.each()[0]);
        assert_ne!(before.each()[1], after.each()[1]);
        assert!(before == read(&[1, 2, 3, 4]) && before != after);
        // One part for two members each.
        let shared = |parts: &[u64]| Members::reading(4, vec![(7, Members::of(parts.to_vec()))]);
        let (a, b) = (shared(&[1, 2]), shared(&[1, 3]));
        let same: Vec<bool> = a.each().iter().zip(b.each()).map(|(a, b)| a == b).collect();
        assert_eq!(same, [true, true, false, false]);
    }

    #[test]
    fn members_share_parts_in_their_order() {
        let parts = [10, 11, 12, 13, 14, 15];
        assert_eq!(shares(&parts, 6, 4), Some(&[14][..]));
        assert_eq!(shares(&parts, 2, 1), Some(&[13, 14, 15][..]), "three parts each");
        assert_eq!(shares(&parts, 12, 7), Some(&[13][..]), "two members a part");
        assert_eq!(shares(&parts, 4, 0), None, "neither goes into the other");
        assert_eq!(shares(&[], 4, 0), None);
    }

    #[test]
    fn parts_go_into_members_or_members_into_parts() {
        let three = Members::of(vec![1, 2, 3]);
        assert!(three.go_into(3) && three.go_into(1) && three.go_into(6));
        assert!(!three.go_into(2) && !three.go_into(0) && !Members::default().go_into(3));
    }
}
