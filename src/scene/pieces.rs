//! Long lists of which a clone costs little, and so does a change of few.

use std::ops::{Index, Range};
use std::sync::Arc;

/// A list in pieces that clones share. A change copies the piece that it falls in, if another clone has it too.
#[derive(Debug, Clone, PartialEq)]
pub struct Pieces<T> {
    /// All of [`PIECE`] but the last, which is not empty.
    pieces: Vec<Arc<Vec<T>>>,
}

/// Rows of a piece. As one power of two they go evenly into the members of steps.
const PIECE: usize = 1024;

impl<T> Pieces<T> {
    pub fn len(&self) -> usize {
        self.pieces.last().map_or(0, |last| (self.pieces.len() - 1) * PIECE + last.len())
    }

    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    pub fn get(&self, at: usize) -> Option<&T> {
        self.pieces.get(at / PIECE)?.get(at % PIECE)
    }

    pub fn iter(&self) -> impl Iterator<Item = &T> + Clone {
        self.pieces.iter().flat_map(|piece| piece.iter())
    }

    /// From one place on.
    pub fn iter_from(&self, first: usize) -> impl Iterator<Item = &T> + Clone {
        self.slices(first..self.len()).flatten()
    }

    /// What lies between two places, as it is held; places past the end hold nothing.
    pub fn slices(&self, range: Range<usize>) -> impl Iterator<Item = &[T]> + Clone {
        let Range { start, end } = range;
        let pieces = self.pieces.iter().enumerate().skip(start / PIECE).take_while(move |(i, _)| i * PIECE < end);
        pieces.filter_map(move |(i, piece)| {
            let within = |at: usize| at.saturating_sub(i * PIECE).min(piece.len());
            piece.get(within(start)..within(end))
        })
    }

    /// The pieces that are not the same memory in another list of the same length: where they begin, what they hold
    /// here and there.
    pub fn apart<'a>(&'a self, other: &'a Pieces<T>) -> impl Iterator<Item = (usize, &'a [T], &'a [T])> {
        let pairs = self.pieces.iter().zip(&other.pieces).enumerate();
        pairs.filter(|(_, (a, b))| !Arc::ptr_eq(a, b)).map(|(i, (a, b))| (i * PIECE, a.as_slice(), b.as_slice()))
    }
}

impl<T: Clone> Pieces<T> {
    /// Many of one.
    pub fn repeat(one: T, len: usize) -> Pieces<T> {
        std::iter::repeat_n(one, len).collect()
    }

    pub fn push(&mut self, value: T) {
        match self.pieces.last_mut() {
            Some(last) if last.len() < PIECE => Arc::make_mut(last).push(value),
            _ => self.pieces.push(Arc::new(vec![value])),
        }
    }

    /// Changes what stands at a place below the length.
    pub fn set(&mut self, at: usize, value: T) {
        Arc::make_mut(&mut self.pieces[at / PIECE])[at % PIECE] = value;
    }
}

impl<T> Default for Pieces<T> {
    fn default() -> Pieces<T> {
        Pieces { pieces: vec![] }
    }
}

impl<T> Index<usize> for Pieces<T> {
    type Output = T;

    fn index(&self, at: usize) -> &T {
        &self.pieces[at / PIECE][at % PIECE]
    }
}

impl<T> FromIterator<T> for Pieces<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Pieces<T> {
        let mut values = values.into_iter();
        let piece = || Some(values.by_ref().take(PIECE).collect::<Vec<T>>()).filter(|piece| !piece.is_empty());
        Pieces { pieces: std::iter::from_fn(piece).map(Arc::new).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_in_pieces_is_the_list() {
        for len in [0, 1, PIECE - 1, PIECE, PIECE + 1, 3 * PIECE + 7] {
            let plain: Vec<usize> = (0..len).collect();
            let pieces: Pieces<usize> = plain.iter().copied().collect();
            let mut pushed = Pieces::default();
            plain.iter().for_each(|i| pushed.push(*i));
            assert_eq!(pieces, pushed);
            assert_eq!((pieces.len(), pieces.is_empty()), (len, len == 0));
            assert!(pieces.iter().eq(&plain));
            assert_eq!((pieces.get(len), pieces.get(len.wrapping_sub(1))), (None, plain.last()));
            for range in [0..len, 5..PIECE + 3, PIECE..2 * PIECE, len..len + 9] {
                let held = plain.get(range.start.min(len)..range.end.min(len)).unwrap_or_default();
                assert!(pieces.slices(range.clone()).flatten().eq(held), "{range:?} of {len}");
            }
            assert!(pieces.iter_from(PIECE - 2).eq(plain.iter().skip(PIECE - 2)));
        }
    }

    #[test]
    fn a_change_copies_the_piece_that_it_falls_in() {
        let before = Pieces::repeat(0u8, 3 * PIECE);
        let mut after = before.clone();
        assert_eq!(after.apart(&before).count(), 0);
        after.set(PIECE + 1, 7);
        assert_eq!((before[PIECE + 1], after[PIECE + 1]), (0, 7));
        let apart: Vec<usize> = after.apart(&before).map(|(start, ..)| start).collect();
        assert_eq!(apart, [PIECE]);
    }
}
