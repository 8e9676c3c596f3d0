//! The files of a workspace and what they name, each looked at once for a text.

use crate::graphs;
use crate::mentions::GraphFile;
use crate::texts::Texts;
use crate::wgsl::ShaderFile;
use lightgraph::internals::builtin;
use lightgraph::internals::diag::Source;
use lightgraph::internals::project::shader_folders;
use lightgraph::internals::shader::{Library, report};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What is known of the files of a workspace. Files are looked at when they are asked for.
pub struct Workspace {
    pub texts: Arc<Texts>,
    shaders: Vec<PathBuf>,
    roots: Vec<PathBuf>,
    /// Shaders that the program carries.
    carried: Vec<(String, Arc<Source>)>,
    /// The module by which shaders check themselves: every graph has it.
    report: Arc<Source>,
    graphs: BTreeMap<PathBuf, Arc<GraphFile>>,
    files: BTreeMap<PathBuf, Arc<ShaderFile>>,
    libraries: BTreeMap<Vec<PathBuf>, Library>,
    found: Option<BTreeSet<PathBuf>>,
    now: Now,
}

/// A graph file and what it names.
pub type MentionedFile = (PathBuf, Arc<GraphFile>);

/// What holds until the next change.
#[derive(Default)]
struct Now {
    all: Option<BTreeSet<PathBuf>>,
    graphs: BTreeMap<PathBuf, Option<Arc<GraphFile>>>,
    roots: BTreeMap<PathBuf, PathBuf>,
    families: BTreeMap<PathBuf, Arc<Vec<MentionedFile>>>,
    libraries: BTreeMap<Vec<PathBuf>, Library>,
}

impl Workspace {
    pub fn new(texts: Arc<Texts>, shaders: Vec<PathBuf>, roots: Vec<PathBuf>) -> Workspace {
        Workspace {
            texts,
            shaders,
            roots,
            carried: builtin::shaders().map(|(name, source)| (name.to_string(), source)).collect(),
            report: report::source(),
            graphs: BTreeMap::new(),
            files: BTreeMap::new(),
            libraries: BTreeMap::new(),
            found: None,
            now: Now::default(),
        }
    }

    /// A document has changed.
    pub fn changed(&mut self) {
        self.now = Now::default();
    }

    /// Files came or went.
    pub fn forget(&mut self) {
        self.changed();
        self.found = None;
        self.graphs.clear();
        self.files.clear();
    }

    /// The graphs of the workspace and those that are open.
    pub fn all(&mut self) -> BTreeSet<PathBuf> {
        if let Some(all) = &self.now.all {
            return all.clone();
        }
        let found = self.found.get_or_insert_with(|| graphs::find(&self.roots, &self.texts));
        let mut all = found.clone();
        let graph = |p: &PathBuf| {
            graphs::is_ron(p) && self.texts.document(p).is_some_and(|d| graphs::may_be_graph(&d.source.text))
        };
        all.extend(self.texts.open().into_iter().filter(graph));
        self.now.all = Some(all.clone());
        all
    }

    /// What a graph file names; of the program's own too.
    pub fn graph(&mut self, path: &Path) -> Option<Arc<GraphFile>> {
        if let Some(known) = self.now.graphs.get(path) {
            return known.clone();
        }
        let source = match (builtin::is_builtin(path), self.graphs.get(path)) {
            (true, Some(known)) => Ok(known.source.clone()),
            _ => builtin::read(path).unwrap_or_else(|| self.texts.read(path)),
        };
        let file = source.ok().map(|source| match self.graphs.get(path) {
            Some(known) if Arc::ptr_eq(&known.source, &source) => known.clone(),
            _ => Arc::new(GraphFile::new(&source)),
        });
        if let Some(file) = &file {
            self.graphs.insert(path.into(), file.clone());
        }
        self.now.graphs.insert(path.into(), file.clone());
        file
    }

    /// The shaders that a graph may use.
    pub fn sources(&mut self, graph: &Path) -> Library {
        let usual = shader_folders(graph);
        let mut folders: Vec<PathBuf> = self.shaders.iter().cloned().chain(usual).filter(|f| f.is_dir()).collect();
        // As a project has it: those of the program for what is made of its graphs.
        let carried = self.carries(graph);
        folders.extend(carried.then(|| PathBuf::from(builtin::PREFIX)));
        if let Some(known) = self.now.libraries.get(&folders) {
            return known.clone();
        }
        let texts = self.texts.clone();
        let read = |path: &Path| texts.read(path);
        let mut sources =
            Library::load_with(&folders[..folders.len() - usize::from(carried)], &read).unwrap_or_default();
        sources.files.entry(report::PATH.into()).or_insert_with(|| self.report.clone());
        for (name, source) in self.carried.iter().filter(|_| carried) {
            sources.files.entry(name.clone()).or_insert_with(|| source.clone());
        }
        if let Some(earlier) = self.libraries.get(&folders) {
            sources = sources.after(earlier);
        }
        self.libraries.insert(folders.clone(), sources.clone());
        self.now.libraries.insert(folders, sources.clone());
        sources
    }

    /// Whether a graph is made of one that the program carries.
    fn carries(&mut self, graph: &Path) -> bool {
        let root = self.root(graph);
        let used =
            |file: &GraphFile| file.passes.iter().filter_map(|p| p.graph.clone()).any(|g| builtin::is_builtin(&g));
        builtin::is_builtin(&root)
            || [graph, root.as_path()].iter().any(|g| self.graph(g).is_some_and(|file| used(&file)))
    }

    /// What a shader among the sources names.
    pub fn shader(&mut self, sources: &Library, path: &str) -> Option<Arc<ShaderFile>> {
        let source = sources.files.get(path)?;
        let key = PathBuf::from(&source.path);
        if let Some(known) = self.files.get(&key).filter(|k| Arc::ptr_eq(&k.source, source)) {
            return Some(known.clone());
        }
        let file = Arc::new(ShaderFile::new(source));
        self.files.insert(key, file.clone());
        Some(file)
    }

    /// The last base of a graph: graphs with the same one share their names.
    pub fn root(&mut self, graph: &Path) -> PathBuf {
        if let Some(root) = self.now.roots.get(graph) {
            return root.clone();
        }
        let mut chain = vec![graph.to_path_buf()];
        while let Some(base) = self.graph(&chain[chain.len() - 1]).and_then(|g| g.base.clone()) {
            if chain.contains(&base) || self.graph(&base).is_none() {
                break;
            }
            chain.push(base);
        }
        let root = chain.swap_remove(chain.len() - 1);
        self.now.roots.insert(graph.into(), root.clone());
        root
    }

    /// The graphs with this last base, itself first.
    pub fn family(&mut self, root: &Path) -> Arc<Vec<MentionedFile>> {
        if let Some(family) = self.now.families.get(root) {
            return family.clone();
        }
        let mut paths = vec![root.to_path_buf()];
        for path in self.all() {
            if path != root && self.root(&path) == root {
                paths.push(path);
            }
        }
        let family: Arc<Vec<MentionedFile>> =
            Arc::new(paths.into_iter().filter_map(|path| Some((path.clone(), self.graph(&path)?))).collect());
        self.now.families.insert(root.into(), family.clone());
        family
    }

    /// A graph that uses a shader file.
    pub fn user(&mut self, shader: &Path) -> Option<PathBuf> {
        let open = self.texts.open();
        let mut graphs: Vec<PathBuf> = self.all().into_iter().collect();
        // What the user looks at is what is meant.
        graphs.sort_by_key(|g| !open.contains(g));
        graphs.into_iter().find(|graph| self.reach(graph).iter().any(|f| f.source.path == shader.to_string_lossy()))
    }

    /// The shader files that the passes of a graph and of its bases run, with all that they import.
    pub fn reach(&mut self, graph: &Path) -> Vec<Arc<ShaderFile>> {
        let sources = self.sources(graph);
        let mut shaders = BTreeSet::new();
        let mut open = Some(graph.to_path_buf());
        let mut seen = BTreeSet::new();
        while let Some(path) = open.take().filter(|p| seen.insert(p.clone())) {
            if let Some(file) = self.graph(&path) {
                shaders.extend(file.passes.iter().filter_map(|p| p.shader.clone()));
                open.clone_from(&file.base);
            }
        }
        self.reachable(&sources, shaders.iter().map(String::as_str))
    }

    /// These shaders and all that they import.
    pub fn reachable<'s>(&mut self, sources: &Library, shaders: impl Iterator<Item = &'s str>) -> Vec<Arc<ShaderFile>> {
        let index = sources.index();
        let shaders: Vec<&str> = shaders.collect();
        let paths: Vec<String> = index.reachable(shaders).into_iter().map(String::from).collect();
        paths.iter().filter_map(|path| self.shader(sources, path)).collect()
    }
}
