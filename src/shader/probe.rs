//! What one invocation of a shader computes: a copy of the shader that notes values where they come to be, and how the
//! notes are read.
//!
//! The copy has one more variable, a buffer. Its first words name the invocation that is asked for and count how many
//! there were (a pixel may be covered by several triangles, a dispatch repeated by a loop); behind them each of the
//! last [`RUNS`] has a region, in which each [`Site`] keeps how often it was reached and its last [`RING`] values.

mod instrument;
mod ir;
mod notes;
mod value;

pub use instrument::instrument;
pub use value::{Number, ValueShape};

use super::{Shader, Stage};

/// Invocations that are kept, the last ones.
pub const RUNS: u32 = 8;
/// Values of a site that are kept, the last ones.
pub const RING: u32 = 4;
/// Words of the buffer before the first region: what is asked for, and how many there were.
const HEAD: u32 = 4;
/// Words of a region before its first site. Word 0 of all is no place: an invocation that isn't asked for has it.
const FIRST: u32 = 1;
/// A region has no more words than this; sites beyond are left out.
const MOST_WORDS: u32 = 1 << 16;

/// A shader that notes what one invocation of an entry point computes.
#[derive(Debug, Clone)]
pub struct Probe {
    /// The instrumented copy. Its last variable is the buffer.
    pub shader: Shader,
    pub stage: Stage,
    pub sites: Vec<Site>,
    /// Values that found no room.
    pub left_out: usize,
    /// Words of a region.
    region: u32,
}

/// A place of a shader where a value comes to be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Site {
    pub role: Role,
    /// The function that it is in, as the text calls it.
    pub function: String,
    /// The value's name, or a path to it, where `[]` stands for an index that is noted too.
    pub name: String,
    pub indices: Vec<ValueShape>,
    pub shape: ValueShape,
    /// Its first word in a region.
    at: u32,
}

/// What a value is to its invocation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// An argument of the entry point: what the stages before hand over.
    Argument,
    /// All of a `var<uniform>`.
    Uniform,
    /// Read from a buffer or a texture.
    Read,
    /// A `let`.
    Let,
    /// Stored to a `var` of the function or the invocation.
    Var,
    /// Written to a buffer or a texture.
    Write,
    /// What the entry point returns.
    Return,
}

/// What one invocation did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Invocation {
    /// Of the sites that it reached.
    pub readings: Vec<Reading>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reading {
    /// Index into [`Probe::sites`].
    pub site: usize,
    /// How often the site was reached.
    pub count: u32,
    /// Words of the last values, the newest last: of each the indices, then the value.
    pub words: Vec<Vec<u32>>,
}

impl Site {
    /// Words of one value with its indices.
    fn words(&self) -> u32 {
        self.indices.iter().map(ValueShape::words).sum::<u32>() + self.shape.words()
    }

    /// Words of the site in a region.
    fn room(&self) -> u32 {
        2 + RING * self.words()
    }

    /// The path with its indices, and the value.
    pub fn show(&self, words: &[u32]) -> (String, String) {
        let mut words = words.iter().copied();
        let mut pieces = self.name.split("[]");
        let mut path = pieces.next().unwrap_or_default().to_owned();
        let mut indices = self.indices.iter();
        for piece in pieces {
            let index = indices.next().map_or(String::new(), |shape| shape.show(&mut words));
            path.push_str(&format!("[{}]", index.trim_matches(['(', ')'])));
            path.push_str(piece);
        }
        (path, self.shape.show(&mut words))
    }

    /// The words of the value alone.
    pub fn value<'w>(&self, words: &'w [u32]) -> &'w [u32] {
        words.get(words.len().saturating_sub(self.shape.words() as usize)..).unwrap_or_default()
    }
}

impl Probe {
    /// Bytes of the buffer.
    pub fn bytes(&self) -> u64 {
        4 * (u64::from(HEAD) + u64::from(FIRST) + u64::from(RUNS) * u64::from(self.region))
    }

    /// The first words of the buffer, by which an invocation is asked for.
    pub fn ask(at: [u32; 3]) -> [u32; 4] {
        [at[0], at[1], at[2], 0]
    }

    /// Reads the buffer after a run: how many invocations there were, and the last of them.
    pub fn read(&self, words: &[u32]) -> (u32, Vec<Invocation>) {
        let runs = words.get(HEAD as usize - 1).copied().unwrap_or(0);
        let words = words.get(HEAD as usize..).unwrap_or_default();
        let word = |at: u32| words.get(at as usize).copied().unwrap_or(0);
        let invocation = |run: u32| {
            let base = FIRST + run % RUNS * self.region;
            let reached = self.sites.iter().enumerate().filter(|(_, s)| word(base + s.at) == run + 1);
            let reading = |(site, s): (usize, &Site)| {
                let count = word(base + s.at + 1);
                let value = |n: u32| {
                    let from = base + s.at + 2 + n % RING * s.words();
                    (from..from + s.words()).map(word).collect()
                };
                Reading { site, count, words: (count.saturating_sub(RING)..count).map(value).collect() }
            };
            Invocation { readings: reached.map(reading).collect() }
        };
        (runs, (runs.saturating_sub(RUNS)..runs).map(invocation).collect())
    }
}
