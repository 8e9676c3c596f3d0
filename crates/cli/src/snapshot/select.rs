//! Which tests there are, and which of them are meant.

use crate::paths::gather;
use lightgraph::{Checked, Diagnostic};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The part `index` (from 1) of `count` parts: every `count`th test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    pub index: usize,
    pub count: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, count)) if index >= 1 && index <= count => Ok(Shard { index, count }),
            _ => Err("write it as I/N with 1 ≤ I ≤ N, such as 1/4".into()),
        }
    }
}

impl Shard {
    /// Its tests.
    pub fn of<T>(self, tests: Vec<T>) -> Vec<T> {
        let mine = |i: &usize| i % self.count == self.index - 1;
        tests.into_iter().enumerate().filter(|(i, _)| mine(i)).map(|(_, t)| t).collect()
    }
}

/// The tests of files and folders, by name: each `.ron` in a folder or below it is one. The name is the path below the
/// folder, or the file's own, without the ending.
///
/// # Errors
/// A path that can't be read, a folder without tests, two tests of one name.
pub fn find(paths: &[PathBuf]) -> Checked<Vec<(String, PathBuf)>> {
    let mut tests: Vec<(String, PathBuf)> = vec![];
    for path in paths {
        let before = tests.len();
        if path.is_dir() {
            let mut files = vec![];
            gather(path, &mut files)?;
            tests.extend(files.into_iter().map(|file| (name(&file, path), file)));
            tests[before..].sort();
        } else if path.is_file() {
            tests.push((name(path, path.parent().unwrap_or(Path::new(""))), path.clone()));
        } else {
            let d = Diagnostic::error(format!("there is no test {}", path.display()));
            return Err(d.help("name test files, or folders that hold them").into());
        }
        if tests.len() == before {
            let d = Diagnostic::error(format!("{} holds no tests", path.display()));
            return Err(d.help("a test is a .ron file that begins with `Test(`").into());
        }
    }
    for (i, (name, path)) in tests.iter().enumerate() {
        if let Some((_, other)) = tests[..i].iter().find(|(n, _)| n == name) {
            let message = format!("{} and {} are both called `{name}`", other.display(), path.display());
            return Err(Diagnostic::error(message).help("name a folder above both").into());
        }
    }
    Ok(tests)
}

fn name(path: &Path, root: &Path) -> String {
    path.strip_prefix(root).unwrap_or(path).with_extension("").display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_all_tests_and_overlap_nowhere() {
        let all: Vec<u32> = (0..10).collect();
        let mut joined: Vec<u32> = (1..=3).flat_map(|index| Shard { index, count: 3 }.of(all.clone())).collect();
        joined.sort();
        assert_eq!(joined, all);
        for bad in ["0/3", "4/3", "1", "a/b", "1/0"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }

    #[test]
    fn no_tests_are_a_fault() {
        assert!(find(&["no/such/folder".into()]).is_err());
        let folder = std::env::temp_dir().join(format!("lightgraph-no-tests-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let faults = find(std::slice::from_ref(&folder)).unwrap_err();
        assert!(faults.to_string().contains("holds no tests"), "{faults}");
        std::fs::write(folder.join("a.ron"), "").unwrap();
        assert_eq!(find(std::slice::from_ref(&folder)).unwrap(), [("a".to_string(), folder.join("a.ron"))]);
        let twice = find(&[folder.clone(), folder.join("a.ron")]).unwrap_err();
        assert!(twice.to_string().contains("both called"), "{twice}");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
