//! A bounded cache for one thread.

use std::collections::VecDeque;

/// A least-recently-used list of bounded length.
#[derive(Debug, Clone)]
pub struct Lru<T> {
    /// The entry used last comes first.
    entries: VecDeque<T>,
    capacity: usize,
}

impl<T> Lru<T> {
    pub fn new(capacity: usize) -> Lru<T> {
        Lru { entries: VecDeque::new(), capacity }
    }

    /// Finds the entry that passes a test and makes it the one used last.
    pub fn find(&mut self, test: impl FnMut(&T) -> bool) -> Option<&T> {
        let at = self.entries.iter().position(test)?;
        let found = self.entries.remove(at)?;
        self.entries.push_front(found);
        self.entries.front()
    }

    /// Adds an entry; beyond the capacity, evicts the one used longest ago.
    pub fn insert(&mut self, entry: T) {
        self.entries.push_front(entry);
        self.entries.truncate(self.capacity);
    }

    /// Drops all entries.
    #[cfg(feature = "gpu")]
    pub fn clear(&mut self) {
        self.entries.clear();
    }

    /// The entries, the one used last first.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.entries.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_entry_used_longest_ago_is_evicted() {
        let mut lru = Lru::new(2);
        lru.insert(1);
        lru.insert(2);
        assert_eq!(lru.find(|n| *n == 1), Some(&1));
        lru.insert(3);
        assert_eq!(lru.iter().copied().collect::<Vec<_>>(), [3, 1]);
        assert_eq!(lru.find(|n| *n == 2), None);
    }
}
