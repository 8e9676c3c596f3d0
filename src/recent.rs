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

    pub fn clear(&mut self) {
        self.things.clear();
    }

    /// The last asked for first.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.things.iter()
    }
}

/// Things that were asked for in the last so many turns: what a turn asks for is never dropped in it, however much it
/// is.
#[derive(Debug, Clone)]
pub struct InUse<T> {
    /// With the turn in which they were asked for last.
    things: Vec<(u64, T)>,
    turn: u64,
    turns: u64,
}

impl<T> InUse<T> {
    pub fn new(turns: u64) -> InUse<T> {
        InUse { things: vec![], turn: 0, turns }
    }

    /// Begins a turn. What none of the last turns asked for goes.
    pub fn next(&mut self) {
        self.turn += 1;
        let (turn, turns) = (self.turn, self.turns);
        self.things.retain(|(last, _)| last + turns >= turn);
    }

    /// The thing that passes a test, which this turn has now asked for.
    pub fn find(&mut self, mut test: impl FnMut(&T) -> bool) -> Option<&T> {
        let (last, found) = self.things.iter_mut().find(|(_, thing)| test(thing))?;
        *last = self.turn;
        Some(found)
    }

    pub fn keep(&mut self, thing: T) {
        self.things.push((self.turn, thing));
    }

    pub fn clear(&mut self) {
        self.things.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_late_turn_asked_for_goes() {
        let mut used = InUse::new(2);
        used.next();
        used.keep('a');
        used.keep('b');
        used.next();
        assert_eq!(used.find(|c| *c == 'a'), Some(&'a'));
        used.next();
        used.next();
        assert_eq!(used.find(|c| *c == 'b'), None);
        assert_eq!(used.find(|c| *c == 'a'), Some(&'a'));
    }

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
