//! Names that must differ.

use std::collections::{HashMap, HashSet};

/// Bytes of a name at most, where many things may have it from one place of a file.
const MOST: usize = 256;

/// The names that are taken.
#[derive(Default)]
pub(super) struct TakenNames {
    taken: HashSet<String>,
    /// By name: the number to try next behind it.
    next: HashMap<String, usize>,
}

impl TakenNames {
    pub fn of<'a>(names: impl Iterator<Item = &'a str>) -> TakenNames {
        TakenNames { taken: names.map(String::from).collect(), next: HashMap::new() }
    }

    /// Takes a name. `false`: it is taken already.
    pub fn take(&mut self, name: &str) -> bool {
        self.taken.insert(name.to_owned())
    }

    /// Takes a name, or the first of `name 2`, `name 3` and so on that is free.
    pub fn take_numbered(&mut self, name: String) -> String {
        if self.take(&name) {
            return name;
        }
        let mut number = self.next.get(&name).copied().unwrap_or(2);
        let found = loop {
            let numbered = format!("{name} {number}");
            number += 1;
            if self.take(&numbered) {
                break numbered;
            }
        };
        self.next.insert(name, number);
        found
    }
}

/// A name, or the start of a long one.
pub(super) fn short(name: &str) -> &str {
    &name[..name.floor_char_boundary(MOST)]
}

#[test]
fn a_name_that_is_taken_gets_the_first_free_number() {
    let mut names = TakenNames::of(["a", "a 3"].into_iter());
    let found = ["a", "a", "b", "b", "a 2"].map(|name| names.take_numbered(name.into()));
    assert_eq!(found, ["a 2", "a 4", "b", "b 2", "a 2 2"]);
    assert!(names.take("c") && !names.take("c") && !names.take("a 4"));
    assert_eq!(short(&"ä".repeat(200)), "ä".repeat(128));
    assert_eq!(short("b"), "b");
}
