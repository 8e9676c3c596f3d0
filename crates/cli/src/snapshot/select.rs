//! Which tests there are, and which of them are meant.

use crate::paths::gather;
use lightgraph::{Checked, Diagnostic};
use std::path::{Path, PathBuf};

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
