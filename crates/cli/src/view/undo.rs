//! A value with its past: what was can be had back.

/// The most that is remembered.
const MOST: usize = 1000;

/// A value, what it was, and what it was before that was taken back.
#[derive(Debug, Clone)]
pub struct Undo<T> {
    now: T,
    past: Vec<T>,
    future: Vec<T>,
    /// What the last change was about, while more of it may come.
    open: Option<String>,
}

impl<T: Clone + PartialEq> Undo<T> {
    pub fn new(now: T) -> Undo<T> {
        Undo { now, past: vec![], future: vec![], open: None }
    }

    pub fn now(&self) -> &T {
        &self.now
    }

    /// Changes the value. Changes about the same thing without a [`Undo::rest`] between them are taken back together.
    pub fn edit(&mut self, about: &str, change: impl FnOnce(&mut T)) {
        let mut next = self.now.clone();
        change(&mut next);
        if next == self.now {
            return;
        }
        let before = std::mem::replace(&mut self.now, next);
        self.future.clear();
        if self.open.as_deref() != Some(about) {
            self.past.push(before);
            if self.past.len() > MOST {
                self.past.remove(0);
            }
            self.open = Some(about.into());
        }
    }

    /// The gesture has ended: the next change is one by itself.
    pub fn rest(&mut self) {
        self.open = None;
    }

    /// Takes the last change back. False when there is none.
    pub fn undo(&mut self) -> bool {
        let Some(before) = self.past.pop() else { return false };
        self.future.push(std::mem::replace(&mut self.now, before));
        self.open = None;
        true
    }

    /// Makes the change again that was taken back last. False when there is none.
    pub fn redo(&mut self) -> bool {
        let Some(after) = self.future.pop() else { return false };
        self.past.push(std::mem::replace(&mut self.now, after));
        self.open = None;
        true
    }

    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gesture_is_taken_back_as_a_whole() {
        let mut u = Undo::new((0, 0));
        for x in 1..=5 {
            u.edit("x", |v| v.0 = x);
        }
        u.rest();
        u.edit("x", |v| v.0 = 9);
        u.edit("y", |v| v.1 = 1);
        assert!(u.undo());
        assert_eq!(*u.now(), (9, 0));
        assert!(u.undo());
        assert_eq!(*u.now(), (5, 0));
        assert!(u.undo());
        assert_eq!(*u.now(), (0, 0));
        assert!(!u.undo());
        assert!(u.redo() && u.redo() && u.redo());
        assert_eq!(*u.now(), (9, 1));
        assert!(!u.redo());
    }

    #[test]
    fn a_change_after_undo_forgets_what_was_taken_back() {
        let mut u = Undo::new(0);
        u.edit("a", |v| *v = 1);
        u.undo();
        u.edit("b", |v| *v = 2);
        assert!(!u.can_redo());
        assert!(u.undo());
        assert_eq!(*u.now(), 0);
    }

    #[test]
    fn what_changes_nothing_leaves_no_trace() {
        let mut u = Undo::new(3);
        u.edit("a", |v| *v = 3);
        assert!(!u.can_undo());
    }

    #[test]
    fn the_past_is_bounded() {
        let mut u = Undo::new(0);
        for i in 1..=2 * MOST {
            u.edit("a", |v| *v = i);
            u.rest();
        }
        let mut steps = 0;
        while u.undo() {
            steps += 1;
        }
        assert_eq!((steps, *u.now()), (MOST, MOST));
    }
}
