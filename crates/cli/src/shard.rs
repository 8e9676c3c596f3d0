//! Parts of work that several machines share.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// One of several parts of a list of jobs or tests: `2/8` is the second of eight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// From 1.
    pub number: usize,
    pub of: usize,
}

/// Shards at most: more is a slip.
const MOST_SHARDS: usize = 10_000;

impl Shard {
    pub const WHOLE: Shard = Shard { number: 1, of: 1 };

    /// Whether `number` is one of `of` parts: a file may say anything.
    pub fn is_valid(self) -> bool {
        (1..=self.of).contains(&self.number) && self.of <= MOST_SHARDS
    }

    /// Whether an entry, by number, is this shard's.
    pub fn has(self, entry: usize) -> bool {
        Shard::owner(entry, self.of) == self
    }

    /// The shard, of so many, whose an entry is. Entries are dealt out to and fro: the groups of a graph often come
    /// cheap and dear in turn, and no shard should get the dear ones alone.
    pub fn owner(entry: usize, of: usize) -> Shard {
        let (round, place) = (entry / of, entry % of);
        Shard { number: 1 + if round % 2 == 0 { place } else { of - 1 - place }, of }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let parts = text.split_once('/').and_then(|(k, n)| Some((k.trim().parse().ok()?, n.trim().parse().ok()?)));
        let shard = parts.map(|(number, of)| Shard { number, of });
        shard
            .filter(|s| s.is_valid())
            .ok_or_else(|| format!("write it as 2/8: the second of eight parts, of {MOST_SHARDS} at most"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_read() {
        assert_eq!("2/8".parse(), Ok(Shard { number: 2, of: 8 }));
        assert_eq!(Shard { number: 2, of: 8 }.to_string(), "2/8");
        for bad in ["", "2", "0/3", "4/3", "1/0", "a/b", "-1/2", "1/99999", "1/2/3"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
