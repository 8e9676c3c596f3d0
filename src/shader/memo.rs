//! What was learned of shader texts, kept for the next time the same is asked: module names, what a file may
//! reach, composed shaders. Nothing here changes a result; it only saves making it again.

use super::{
    compose::{Defs, Shader},
    lex::{self, Kind},
    library::Library,
    link::find_module,
    scan::scan,
};
use crate::diag::Source;
use crate::recent::Recent;
use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Shaders kept at most.
const MOST_SHADERS: usize = 256;

/// Libraries whose module names are kept at most.
const MOST_INDICES: usize = 4;

/// A store that libraries share: clones are the same store.
#[derive(Debug, Clone, Default)]
pub struct Memo(Arc<Mutex<Store>>);

#[derive(Debug)]
struct Store {
    indices: Recent<Arc<Index>>,
    shaders: Recent<Kept>,
}

impl Default for Store {
    fn default() -> Store {
        Store { indices: Recent::new(MOST_INDICES), shaders: Recent::new(MOST_SHADERS) }
    }
}

/// A shader and the texts that it was composed from.
#[derive(Debug, Clone)]
struct Kept {
    shader: Arc<Shader>,
    /// In the order of [`Shader::sources`].
    sources: Vec<Arc<Source>>,
    /// What every import could have meant.
    modules: Arc<Modules>,
}

/// Library paths by the name to import them by: `#define_import_path`'s, or the path in quotes.
pub(super) type Modules = BTreeMap<String, Vec<String>>;

/// What a library's files say of each other, under any definitions. Faults in them are ignored.
#[derive(Debug)]
pub(super) struct Index {
    files: BTreeMap<String, (Arc<Source>, Arc<Outlook>)>,
    pub modules: Arc<Modules>,
}

/// What one file may ask for.
#[derive(Debug)]
struct Outlook {
    module: Option<String>,
    /// Definitions.
    mentioned: BTreeSet<String>,
    /// Names that may be those of modules or of their items.
    words: BTreeSet<String>,
}

impl Memo {
    fn store(&self) -> MutexGuard<'_, Store> {
        // Each change of the store is whole before the next may panic.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The index of a library.
    pub(super) fn index(&self, library: &Library) -> Arc<Index> {
        let mut store = self.store();
        if let Some(index) = store.indices.find(|i| i.is_of(library)) {
            return index.clone();
        }
        let index = Arc::new(Index::new(library, &store.indices));
        store.indices.keep(index.clone());
        index
    }

    /// A shader composed before from the same texts, with the same definitions.
    pub(super) fn shader(&self, library: &Library, path: &str, defs: &Defs) -> Option<Arc<Shader>> {
        let modules = self.index(library).modules.clone();
        let same = |kept: &Kept| {
            kept.shader.path == path
                && kept.shader.defs == *defs
                && (Arc::ptr_eq(&kept.modules, &modules) || kept.modules == modules)
                && kept.shader.sources.iter().zip(&kept.sources).all(|(path, source)| {
                    library.files.get(path).is_some_and(|s| Arc::ptr_eq(s, source) || s.text == source.text)
                })
        };
        self.store().shaders.find(same).map(|kept| kept.shader.clone())
    }

    /// Keeps a shader that was composed from this library.
    pub(super) fn keep(&self, library: &Library, shader: &Arc<Shader>) {
        let modules = self.index(library).modules.clone();
        let sources = shader.sources.iter().filter_map(|path| library.files.get(path).cloned()).collect();
        self.store().shaders.keep(Kept { shader: shader.clone(), sources, modules });
    }
}

impl Index {
    fn new(library: &Library, earlier: &Recent<Arc<Index>>) -> Index {
        let known = |path: &String, source: &Arc<Source>| {
            let found = earlier.iter().filter_map(|i| i.files.get(path)).find(|(s, _)| Arc::ptr_eq(s, source));
            found.map_or_else(|| Arc::new(Outlook::of(source)), |(_, outlook)| outlook.clone())
        };
        let one = |(path, source): (&String, &Arc<Source>)| (path.clone(), (source.clone(), known(path, source)));
        let files: BTreeMap<_, (_, Arc<Outlook>)> = library.files.iter().map(one).collect();
        let mut modules = Modules::new();
        for (path, (_, outlook)) in &files {
            let name = outlook.module.clone().unwrap_or_else(|| format!("\"{path}\""));
            modules.entry(name).or_default().push(path.clone());
        }
        let same = earlier.iter().map(|i| &i.modules).find(|m| ***m == modules).cloned();
        Index { files, modules: same.unwrap_or_else(|| Arc::new(modules)) }
    }

    fn is_of(&self, library: &Library) -> bool {
        self.files.len() == library.files.len()
            && self.files.iter().zip(&library.files).all(|((a, (x, _)), (b, y))| Arc::ptr_eq(x, y) && a == b)
    }

    /// Library paths of `path` and of all files it may import, whatever branches are taken.
    pub(super) fn reachable(&self, path: &str) -> BTreeSet<String> {
        let mut seen = BTreeSet::new();
        let mut open = vec![path.to_owned()];
        while let Some(path) = open.pop() {
            let Some((_, outlook)) = self.files.get(&path) else { continue };
            if !seen.insert(path) {
                continue;
            }
            let modules = outlook.words.iter().filter_map(|word| find_module(&self.modules, word));
            open.extend(modules.flat_map(|(_, paths)| paths).cloned());
        }
        seen
    }

    /// Every definition that `path` or a file it may import asks for.
    pub(super) fn mentioned(&self, path: &str) -> BTreeSet<String> {
        let files = self.reachable(path);
        let outlooks = files.iter().filter_map(|path| self.files.get(path));
        outlooks.flat_map(|(_, outlook)| outlook.mentioned.iter().cloned()).collect()
    }
}

impl Outlook {
    fn of(source: &Arc<Source>) -> Outlook {
        let scan = scan(source, None, &mut vec![]);
        let words = lex::tokens(&scan.text, 0..scan.text.len());
        let inline = words.iter().filter(|w| w.kind == Kind::Name).map(|w| w.text(&scan.text).to_owned());
        let words = inline.chain(scan.imports.into_iter().map(|i| i.path)).collect();
        Outlook { module: scan.module.map(|(name, _)| name), mentioned: scan.mentioned, words }
    }
}
