//! What was learned of shader texts, kept for the next time the same is asked: module names, what a file may
//! reach, where its words are, composed shaders. Nothing here changes a result; it only saves making it again.

use super::{
    compose::{Defs, Shader},
    lex::{self, TokenKind},
    library::Library,
    link::find_module,
    oil::Oil,
    scan::scan,
};
use crate::diag::Source;
use crate::lru::Lru;
use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Shaders kept at most.
const MOST_SHADERS: usize = 512;

/// Libraries whose module names are kept at most.
const MOST_INDICES: usize = 4;

/// A store that libraries share: clones are the same store.
#[derive(Debug, Clone, Default)]
pub struct Memo(Arc<Mutex<Store>>);

#[derive(Debug)]
struct Store {
    indices: Lru<Arc<Index>>,
    shaders: Lru<Kept>,
    /// Idle ones: each takes longer to make than most shaders.
    oils: Vec<Oil>,
}

impl Default for Store {
    fn default() -> Store {
        Store { indices: Lru::new(MOST_INDICES), shaders: Lru::new(MOST_SHADERS), oils: vec![] }
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

/// What a library's files say of each other and which words stand in them, under any definitions. Faults in them are
/// ignored.
#[derive(Debug)]
pub struct Index {
    files: BTreeMap<String, Known>,
    pub(super) modules: Arc<Modules>,
}

#[derive(Debug)]
struct Known {
    source: Arc<Source>,
    outlook: Arc<Outlook>,
    /// Library paths of the files that it may import.
    links: Arc<BTreeSet<String>>,
}

/// What one file may ask for.
#[derive(Debug)]
struct Outlook {
    module: Option<String>,
    /// Definitions.
    mentioned: BTreeSet<String>,
    /// Names that may be those of modules or of their items.
    words: BTreeSet<String>,
    /// Where each word of its code, directives included, stands first, in bytes.
    places: HashMap<String, usize>,
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
        store.indices.insert(index.clone());
        index
    }

    /// Runs `work` with a composer that nobody else uses.
    pub(super) fn with_oil<T>(&self, work: impl FnOnce(&mut Oil) -> T) -> T {
        let mut oil = self.store().oils.pop().unwrap_or_default();
        let result = work(&mut oil);
        self.store().oils.push(oil);
        result
    }

    /// A shader composed before from the same texts, with the same definitions and entry points.
    pub(super) fn shader(&self, library: &Library, path: &str, defs: &Defs, wanted: &[String]) -> Option<Arc<Shader>> {
        let modules = self.index(library).modules.clone();
        let same = |kept: &Kept| {
            kept.shader.path == path
                && kept.shader.defs == *defs
                && kept.shader.wanted == wanted
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
        self.store().shaders.insert(Kept { shader: shader.clone(), sources, modules });
    }
}

impl Index {
    fn new(library: &Library, earlier: &Lru<Arc<Index>>) -> Index {
        let known = |path: &String, source: &Arc<Source>| {
            let found = earlier.iter().filter_map(|i| i.files.get(path)).find(|k| Arc::ptr_eq(&k.source, source));
            found.map_or_else(|| Arc::new(Outlook::of(source)), |k| k.outlook.clone())
        };
        let outlooks: Vec<Arc<Outlook>> = library.files.iter().map(|(path, source)| known(path, source)).collect();
        let mut modules = Modules::new();
        for (path, outlook) in library.files.keys().zip(&outlooks) {
            let name = outlook.module.clone().unwrap_or_else(|| format!("\"{path}\""));
            modules.entry(name).or_default().push(path.clone());
        }
        let same = earlier.iter().map(|i| &i.modules).find(|m| ***m == modules).cloned();
        let modules = same.unwrap_or_else(|| Arc::new(modules));
        let links = |path: &String, outlook: &Arc<Outlook>| {
            let alike = earlier.iter().filter(|i| Arc::ptr_eq(&i.modules, &modules));
            let found = alike.filter_map(|i| i.files.get(path)).find(|k| Arc::ptr_eq(&k.outlook, outlook));
            found.map_or_else(|| Arc::new(outlook.links(&modules)), |k| k.links.clone())
        };
        let one = |((path, source), outlook): ((&String, &Arc<Source>), Arc<Outlook>)| {
            let links = links(path, &outlook);
            (path.clone(), Known { source: source.clone(), outlook, links })
        };
        let files = library.files.iter().zip(outlooks).map(one).collect();
        Index { files, modules }
    }

    fn is_of(&self, library: &Library) -> bool {
        self.files.len() == library.files.len()
            && self.files.iter().zip(&library.files).all(|((a, x), (b, y))| Arc::ptr_eq(&x.source, y) && a == b)
    }

    /// Library paths of these files and of all that they may import, whatever branches are taken.
    pub fn reachable<'a>(&'a self, paths: impl IntoIterator<Item = &'a str>) -> BTreeSet<&'a str> {
        let mut seen = BTreeSet::new();
        let mut open: Vec<&str> = paths.into_iter().collect();
        while let Some(path) = open.pop() {
            if let Some(known) = self.files.get(path)
                && seen.insert(path)
            {
                open.extend(known.links.iter().map(String::as_str));
            }
        }
        seen
    }

    /// Library paths of the files that are imported by a name: more than one where they are told apart badly.
    pub fn module(&self, name: &str) -> &[String] {
        self.modules.get(name).map_or(&[], Vec::as_slice)
    }

    /// The names to import files by.
    pub fn module_names(&self) -> impl Iterator<Item = &str> {
        self.modules.keys().map(String::as_str)
    }

    /// The definitions that these files and all that they may import ask for (`#ifdef`, `#if`, `#{NAME}`), whatever
    /// branches are taken. None for an unknown path; faults in the files are left to [`super::compose()`].
    pub fn mentioned<'a>(&'a self, paths: impl IntoIterator<Item = &'a str>) -> BTreeSet<&'a str> {
        let known = self.reachable(paths).into_iter().filter_map(|path| self.files.get(path));
        known.flat_map(|k| k.outlook.mentioned.iter().map(String::as_str)).collect()
    }

    /// Where a word first stands in the code of a file, in bytes; in comments it does not count.
    pub fn place(&self, path: &str, word: &str) -> Option<usize> {
        self.files.get(path)?.outlook.places.get(word).copied()
    }
}

impl Outlook {
    fn of(source: &Arc<Source>) -> Outlook {
        let scan = scan(source, None, &mut vec![]);
        let words = lex::tokens(&scan.text, 0..scan.text.len());
        let inline = words.iter().filter(|w| w.kind == TokenKind::Name).map(|w| w.text(&scan.text).to_owned());
        let words = inline.chain(scan.imports.into_iter().map(|i| i.path)).collect();
        let module = scan.module.map(|(name, _)| name);
        Outlook { module, mentioned: scan.mentioned, words, places: places(&source.text) }
    }

    fn links(&self, modules: &Modules) -> BTreeSet<String> {
        let named = self.words.iter().filter_map(|word| find_module(modules, word));
        named.flat_map(|(_, paths)| paths).cloned().collect()
    }
}

/// The words of a text, each with the byte where it first stands outside of comments.
fn places(text: &str) -> HashMap<String, usize> {
    let mut places = HashMap::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split("//").next().unwrap_or("");
        for word in code.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|w| !w.is_empty()) {
            if !places.contains_key(word) {
                places.insert(word.to_owned(), start + (word.as_ptr() as usize - code.as_ptr() as usize));
            }
        }
        start += line.len();
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stand_where_they_first_are_in_code() {
        let text = "// size\nlet sizes = 1; // size\n\tlet size = sizes;\n";
        let places = places(text);
        assert_eq!(places.get("size").copied(), text.find("size = sizes"));
        assert_eq!(places.get("sizes").copied(), text.find("sizes = 1"));
        assert_eq!(places.get("ize"), None);
    }

    #[test]
    fn what_changed_is_looked_at_again_and_nothing_else() {
        let library = |a: &str| {
            let mut library = Library::default();
            for (path, text) in [("a.wgsl", a), ("b.wgsl", "#define_import_path b\nconst B = 1;")] {
                library.files.insert(path.into(), Source::new(path, text));
            }
            library
        };
        let first = library("#import b::B\nconst A = B;");
        let before = first.index();
        assert_eq!(before.reachable(["a.wgsl"]), BTreeSet::from(["a.wgsl", "b.wgsl"]));
        let second = library("#ifdef ON\nconst A = 1;\n#endif").after(&first);
        let after = second.index();
        assert_eq!(after.reachable(["a.wgsl"]), BTreeSet::from(["a.wgsl"]));
        assert_eq!(after.mentioned(["a.wgsl"]), BTreeSet::from(["ON"]));
        let of = |index: &Index, path: &str| index.files[path].outlook.clone();
        assert!(Arc::ptr_eq(&of(&before, "b.wgsl"), &of(&after, "b.wgsl")));
        assert!(!Arc::ptr_eq(&of(&before, "a.wgsl"), &of(&after, "a.wgsl")));
    }
}
