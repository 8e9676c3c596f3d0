//! The graphs that can take another's place: those of its folder that share an output with it.

use lightgraph::internals::diag::Source;
use lightgraph::internals::{files, graph};
use std::path::{Path, PathBuf};

/// A graph to choose.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Variant {
    pub path: PathBuf,
    /// The file's name without its ending.
    pub name: String,
    pub about: String,
    pub outputs: Vec<String>,
    /// It has faults, and can't be chosen until they are mended.
    pub broken: bool,
}

/// The graphs of a graph's folder, by name, the graph itself among them. Broken ones are there as well, for what their
/// outputs are nobody knows; files that are no graphs are not.
pub fn beside(graph: &Path) -> Vec<Variant> {
    let folder = graph.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
    // Named as the graph is, so that a graph is the same by its path.
    let named = |p: PathBuf| Some(graph.with_file_name(p.file_name()?));
    let ron = |p: &PathBuf| p.extension().is_some_and(|e| e == "ron");
    let mut paths: Vec<PathBuf> = entries.filter(ron).filter_map(named).collect();
    paths.sort();
    let all: Vec<Variant> = paths.into_iter().filter_map(read).collect();
    let same = |v: &&Variant| v.path.file_name() == graph.file_name();
    let outputs = all.iter().find(same).map(|v| v.outputs.clone()).unwrap_or_default();
    let fits = |v: &Variant| v.broken || outputs.is_empty() || v.outputs.iter().any(|o| outputs.contains(o));
    all.into_iter().filter(fits).collect()
}

fn read(path: PathBuf) -> Option<Variant> {
    let name = path.file_stem()?.to_string_lossy().into_owned();
    match graph::load(&path, &Source::read) {
        Ok(graph) => {
            let outputs = graph.outputs.iter().map(|o| o.0.value.clone()).collect();
            Some(Variant { path, name, about: graph.about, outputs, broken: false })
        }
        Err(_) => {
            let text = files::read_text(&path, files::TEXT).ok()?;
            let starts = |word: &str| text.lines().any(|l| l.trim_start().starts_with(word));
            (starts("Graph(") || starts("Variant(")).then(|| Variant {
                path,
                name,
                about: "has faults".into(),
                outputs: vec![],
                broken: true,
            })
        }
    }
}

/// The files with one of these endings in a folder, by name.
pub fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
    let fits = |p: &PathBuf| p.extension().is_some_and(|e| endings.iter().any(|x| e.eq_ignore_ascii_case(x)));
    let mut files: Vec<PathBuf> = entries.filter(fits).collect();
    files.sort();
    files
}

/// The scenes of a folder, each once: the scene RON where there is one, else the glTF.
pub fn scenes(folder: &Path) -> Vec<PathBuf> {
    let all = files(folder, &["ron", "glb", "gltf"]);
    let described = |p: &PathBuf| all.iter().any(|o| *o == p.with_extension("ron"));
    all.iter().filter(|p| p.extension().is_some_and(|e| e == "ron") || !described(p)).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn graphs_that_share_an_output_are_found_by_name() {
        let root = crate::repository("");
        let found = beside(&root.join("graphs/gi/direct.ron"));
        let names: Vec<&str> = found.iter().map(|v| v.name.as_str()).collect();
        assert!(names.len() > 1, "{names:?}");
        assert!(names.is_sorted());
        assert!(found.iter().any(|v| v.path == root.join("graphs/gi/direct.ron")));
        let shares = |v: &Variant| v.outputs.iter().any(|o| o == "color" || o == "direct");
        assert!(found.iter().all(|v| v.broken || shares(v)), "{found:?}");
    }

    #[test]
    fn a_scene_with_a_description_is_listed_once() {
        let found = scenes(&crate::repository("scenes"));
        let halls: Vec<_> = found.iter().filter(|p| p.file_stem().is_some_and(|s| s == "hall")).collect();
        assert_eq!(halls.len(), 1);
        assert!(halls[0].ends_with("hall.ron"));
    }
}
