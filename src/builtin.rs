//! What the binary carries: the graphs, their shaders, and the files of a new project.
//!
//! A path that begins with `lightgraph:` names one of these files, wherever the binary stands: a variant can name such
//! a graph as its base, a command as its graph.

use crate::diag::{Checked, Diagnostic, Source};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// By path in a new project: content.
pub const FILES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/project_files.rs"));

/// The reference of the language, which lists its words.
pub const REFERENCE: &str = include_str!("../docs/reference.md");

/// What a path to one of these files begins with.
pub const PREFIX: &str = "lightgraph:";

/// Whether a path names a file of the binary.
pub fn is_builtin(path: &Path) -> bool {
    path.to_str().is_some_and(|p| p.starts_with(PREFIX))
}

/// What `named` is, written in a file of this folder.
pub fn join(folder: &Path, named: &str) -> PathBuf {
    if named.starts_with(PREFIX) { PathBuf::from(named) } else { folder.join(named) }
}

/// The text of a file of the binary. `None`: the path names another.
///
/// # Errors
/// The binary has no such file.
pub fn read(path: &Path) -> Option<Checked<Arc<Source>>> {
    let name = path.to_str()?.strip_prefix(PREFIX)?;
    let found = texts("").find(|(known, _)| *known == name);
    Some(found.map(|(_, text)| Source::new(format!("{PREFIX}{name}"), text)).ok_or_else(|| {
        let d = Diagnostic::error(format!("lightgraph comes with no `{name}`"));
        d.nearest(name, texts("graphs/").map(|f| f.0)).into()
    }))
}

/// The bytes of a file of the binary, if it has it.
pub fn bytes(path: &Path) -> Option<&'static [u8]> {
    let name = path.to_str()?.strip_prefix(PREFIX)?;
    FILES.iter().find(|f| f.0 == name).map(|f| f.1)
}

/// The shaders, by their path below the shader folder.
pub fn shaders() -> impl Iterator<Item = (&'static str, Arc<Source>)> {
    texts("shaders/")
        .filter_map(|(path, text)| Some((path.strip_prefix("shaders/")?, Source::new(format!("{PREFIX}{path}"), text))))
}

fn texts(folder: &str) -> impl Iterator<Item = (&'static str, &'static str)> {
    FILES.iter().filter(move |f| f.0.starts_with(folder)).filter_map(|f| Some((f.0, std::str::from_utf8(f.1).ok()?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_the_binary_have_names_of_their_own() {
        let found = read(Path::new("lightgraph:graphs/gi/uniform_grid.ron")).unwrap().unwrap();
        assert!(found.text.starts_with("// ") || found.text.starts_with("Graph("), "{}", found.text);
        assert_eq!(read(Path::new("graphs/gi/uniform_grid.ron")), None);
        let faults = read(Path::new("lightgraph:graphs/uniform_gird.ron")).unwrap().unwrap_err();
        assert!(faults.to_string().contains("did you mean `graphs/gi/uniform_grid.ron`?"), "{faults}");
        assert!(shaders().any(|s| s.0 == "lib/sh.wgsl"));
        assert_eq!(join(Path::new("a"), "b.ron"), Path::new("a/b.ron"));
        assert_eq!(join(Path::new("a"), "lightgraph:b.ron"), Path::new("lightgraph:b.ron"));
    }
}
