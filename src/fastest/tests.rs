//! Which times make a choice, and the file they are kept in.

use super::*;
use known::KnownChoice;
use std::path::PathBuf;

/// A file in a folder of its own, removed in the end.
struct Home(PathBuf);

impl Home {
    fn new(name: &str) -> Home {
        Home(std::env::temp_dir().join(format!("lightgraph-fastest-{name}-{}", std::process::id())))
    }

    fn file(&self) -> PathBuf {
        self.0.join("cache/fastest.json")
    }
}

impl Drop for Home {
    fn drop(&mut self) {
        // It lies among the system's temporary files.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn entry(key: &str, ms: &[f64]) -> KnownChoice {
    KnownChoice { key: key.into(), adapter: "some adapter".into(), group: "way".into(), ms: ms.to_vec() }
}

#[test]
fn the_first_stays_unless_another_is_clearly_faster() {
    assert_eq!(fastest(&[10.0, 9.9]), 0);
    assert_eq!(fastest(&[10.0, 9.0]), 1);
    assert_eq!(fastest(&[10.0, 9.0, 8.0, 8.5]), 2);
    assert_eq!(fastest(&[10.0, 20.0]), 0);
    assert_eq!(fastest(&[0.0, 0.0]), 0);
    assert_eq!(why(&[Ok(12.0), Ok(20.25)], 0, "it"), "measured, 12.00 ms against 20.25 ms on it");
    assert_eq!(why(&[Ok(3.0), Ok(2.0), Ok(4.0)], 1, "it"), "measured, 2.00 ms against 3.00 ms and 4.00 ms on it");
}

#[test]
fn what_is_refused_never_wins() {
    assert_eq!(fastest(&[f64::INFINITY, 20.0]), 1);
    assert_eq!(fastest(&[20.0, f64::INFINITY]), 0);
    let refused = Err(crate::diag::Faults::from(Diagnostic::error("can't run `other`")));
    assert_eq!(why(&[refused, Ok(2.0)], 1, "it"), "measured, 2.00 ms against a refusal on it");
}

#[test]
fn what_was_measured_is_found_again() {
    let home = Home::new("found");
    let file = home.file();
    assert_eq!(known::find(Some(&file), "a"), None, "there is no file yet");
    known::keep(Some(&file), entry("a", &[1.0, 2.0]));
    known::keep(Some(&file), entry("b", &[3.0]));
    known::keep(Some(&file), entry("a", &[5.0, 4.0]));
    assert_eq!(known::find(Some(&file), "a"), Some(vec![5.0, 4.0]));
    assert_eq!(known::find(Some(&file), "b"), Some(vec![3.0]));
    assert_eq!(known::find(Some(&file), "c"), None);
    assert_eq!(known::find(None, "a"), None);
    for i in 0..300 {
        known::keep(Some(&file), entry(&format!("n{i}"), &[1.0]));
    }
    assert_eq!(known::find(Some(&file), "b"), None, "the oldest go");
    assert_eq!(known::find(Some(&file), "n299"), Some(vec![1.0]));
}

#[test]
fn a_broken_file_is_as_none() {
    let home = Home::new("broken");
    let file = home.file();
    known::keep(Some(&file), entry("a", &[1.0, 2.0]));
    for text in ["", "[{\"key\": \"a\"", "{}", "[{\"key\": \"a\", \"ms\": \"fast\"}]", "\u{0}\u{1}"] {
        std::fs::write(&file, text).unwrap();
        assert_eq!(known::find(Some(&file), "a"), None, "{text}");
    }
    known::keep(Some(&file), entry("a", &[2.0, 1.0]));
    assert_eq!(known::find(Some(&file), "a"), Some(vec![2.0, 1.0]));
    // A folder in its place can be neither read nor written: then nothing is remembered.
    std::fs::remove_file(&file).unwrap();
    std::fs::create_dir(&file).unwrap();
    known::keep(Some(&file), entry("a", &[2.0, 1.0]));
    assert_eq!(known::find(Some(&file), "a"), None);
}
