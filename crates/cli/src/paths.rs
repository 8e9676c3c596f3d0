//! The `.ron` files that a command line names.

use lightgraph::{Checked, Diagnostic, Graph};
use std::path::{Path, PathBuf};

/// Files, and of folders every `.ron` file in them and below, by name.
///
/// # Errors
/// A folder that can't be read, or holds none.
pub fn ron_files(given: &[PathBuf]) -> Checked<Vec<PathBuf>> {
    let mut found = vec![];
    for path in given {
        let before = found.len();
        gather(path, &mut found)?;
        if found.len() == before {
            return Err(Diagnostic::error(format!("{} holds no .ron file", path.display())).into());
        }
    }
    Ok(found)
}

/// Whether a graph is meant to run by itself. A graph that was named is. Of a folder, those are that take nothing from
/// another graph.
pub fn is_whole(given: &[PathBuf], path: &Path, graph: &Graph) -> bool {
    graph.inputs.is_empty() || given.iter().any(|g| g == path)
}

/// A file, or every `.ron` file of a folder and below it, by name.
///
/// # Errors
/// A folder that can't be read.
pub fn gather(path: &Path, found: &mut Vec<PathBuf>) -> Checked<()> {
    if !path.is_dir() {
        found.push(path.into());
        return Ok(());
    }
    let fault = |e| Diagnostic::error(format!("can't read {}: {e}", path.display()));
    let entries = std::fs::read_dir(path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let mut entries: Vec<PathBuf> = entries.map_err(fault)?.into_iter().map(|e| e.path()).collect();
    entries.sort();
    for entry in entries {
        // A link to a folder may lead back here.
        if entry.is_dir() && !entry.is_symlink() {
            gather(&entry, found)?;
        } else if entry.extension().is_some_and(|e| e == "ron") {
            found.push(entry);
        }
    }
    Ok(())
}
