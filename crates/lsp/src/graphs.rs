//! The graphs of a workspace: which there are, and the files that each is made of.

use crate::texts::Texts;
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph::ast::walk;
use lightgraph::internals::plan::request::all_sample_facts;
use lightgraph::internals::shader::Library;
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, Faults, Project};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Graph files of a workspace that are looked at, at most.
const MOST_GRAPHS: usize = 1000;

/// Folders in folders that are looked into.
const DEEPEST: usize = 12;

/// Files and folders that are looked at while graphs are searched, at most.
const MOST_ENTRIES: usize = 50_000;

/// First words of RON files that are no graphs.
const OTHERS: [&str; 4] = ["Test", "Scene", "Gallery", "("];

/// The first word of a RON file, or its first mark.
fn first_word(text: &str) -> &str {
    let mut rest = text.trim_start();
    loop {
        let skipped = match rest {
            _ if rest.starts_with("//") => rest.find('\n'),
            _ if rest.starts_with("/*") => rest.find("*/").map(|at| at + 2),
            _ if rest.starts_with("#!") => rest.find(']').map(|at| at + 1),
            _ => break,
        };
        rest = skipped.map_or("", |at| rest[at..].trim_start());
    }
    let name = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
    let end = if name > 0 { name } else { rest.chars().next().map_or(0, char::len_utf8) };
    &rest[..end]
}

/// Whether an open RON document is checked as a graph. One that says nothing yet is.
pub fn may_be_graph(text: &str) -> bool {
    !OTHERS.contains(&first_word(text))
}

pub fn is_ron(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "ron")
}

/// Every graph and variant below these folders.
pub fn find(roots: &[PathBuf], texts: &Texts) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut looked = 0;
    for root in roots {
        below(root, 0, &mut looked, &mut |path| {
            if found.len() < MOST_GRAPHS
                && let Ok(source) = texts.read(path)
                && ["Graph", "Variant"].contains(&first_word(&source.text))
            {
                found.insert(path.to_path_buf());
            }
        });
    }
    found
}

fn below(folder: &Path, depth: usize, looked: &mut usize, graph: &mut dyn FnMut(&Path)) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let mut entries: Vec<_> = entries.flatten().collect();
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        *looked += 1;
        let (path, name) = (entry.path(), entry.file_name());
        let left_out = name.to_string_lossy().starts_with('.') || ["target", "node_modules"].iter().any(|n| name == *n);
        if left_out || *looked > MOST_ENTRIES {
            continue;
        }
        // Links are not followed: they may lead round.
        match entry.file_type() {
            Ok(kind) if kind.is_dir() && depth < DEEPEST => below(&path, depth + 1, looked, graph),
            Ok(kind) if kind.is_file() && is_ron(&path) => graph(&path),
            _ => {}
        }
    }
}

/// What the user has set for checks.
#[derive(Debug, Clone, Default)]
pub struct CheckSettings {
    /// Folders of shaders besides the usual ones.
    pub shaders: Vec<PathBuf>,
    /// The facts of the scene that is checked for; `None`: scenes that together have everything and nothing.
    pub facts: Option<Values>,
}

impl CheckSettings {
    pub fn all_facts(&self) -> Vec<Values> {
        self.facts.clone().map_or_else(all_sample_facts, |facts| vec![facts])
    }
}

/// A graph that was opened, or the faults that stand in its way; and its files.
#[derive(Debug, Clone)]
pub struct Opened {
    pub project: Result<Arc<Project>, Vec<Diagnostic>>,
    /// The files that it is made of; of one that can't be opened every file that was read for it.
    pub files: BTreeSet<PathBuf>,
}

/// Opens a graph from the texts of open documents and files.
pub fn open(path: &Path, settings: &CheckSettings, texts: &Texts, earlier: &Library) -> Opened {
    let read = RefCell::new(BTreeSet::from([path.to_path_buf()]));
    let reader = |path: &Path| -> Checked<Arc<Source>> {
        read.borrow_mut().insert(path.to_path_buf());
        texts.read(path)
    };
    match Project::open_with(path, &settings.shaders, &reader, earlier) {
        Ok(project) => {
            let mut files: BTreeSet<PathBuf> = project.graph.files.iter().cloned().collect();
            files.extend(shader_files(&project));
            Opened { project: Ok(Arc::new(project)), files }
        }
        Err(Faults(faults)) => Opened { project: Err(faults), files: read.into_inner() },
    }
}

/// The files of the shaders of a graph and of what they may import.
fn shader_files(project: &Project) -> BTreeSet<PathBuf> {
    let mut shaders = BTreeSet::new();
    walk(&project.graph.passes, &mut |p| shaders.extend(p.kind.shader().map(|s| s.value.as_str())));
    let index = project.texts.index();
    let sources = index.reachable(shaders.iter().copied()).into_iter().filter_map(|path| project.texts.files.get(path));
    sources.map(|source| PathBuf::from(&source.path)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_word_says_what_a_file_is() {
        for (text, word) in [
            ("// a\n\n/* b */ Graph(", "Graph"),
            ("#![enable(implicit_some)]\nVariant(", "Variant"),
            ("[", "["),
            ("", ""),
            ("// only", ""),
            ("é", "é"),
        ] {
            assert_eq!(first_word(text), word);
        }
        assert!(may_be_graph("Grap(") && may_be_graph("") && !may_be_graph("Scene("));
    }
}
