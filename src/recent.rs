//! A small store of what was made lately.

use std::collections::VecDeque;

/// At most so many things, the one asked for last first; beyond that the one asked for longest ago goes.
#[derive(Debug, Clone)]
pub struct Recent<T> {
    things: VecDeque<T>,
    most: usize,
}

impl<T> Recent<T> {
    pub fn new(most: usize) -> Recent<T> {
        Recent { things: VecDeque::new(), most }
    }

    /// The thing that passes a test, from now on the last asked for.
    pub fn find(&mut self, test: impl FnMut(&T) -> bool) -> Option<&T> {
        let at = self.things.iter().position(test)?;
        let found = self.things.remove(at)?;
        self.things.push_front(found);
        self.things.front()
    }

    pub fn keep(&mut self, thing: T) {
        self.things.push_front(thing);
        self.things.truncate(self.most);
    }

    /// The last asked for first.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.things.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_asked_for_longest_ago_goes_first() {
        let mut recent = Recent::new(2);
        recent.keep(1);
        recent.keep(2);
        assert_eq!(recent.find(|n| *n == 1), Some(&1));
        recent.keep(3);
        assert_eq!(recent.iter().copied().collect::<Vec<_>>(), [3, 1]);
        assert_eq!(recent.find(|n| *n == 2), None);
    }
}
