//! The shader files that a graph may use.

use super::{
    compose::{Defs, Shader, compose},
    memo::{Index, Memo},
    report,
};
use crate::diag::{Checked, Diagnostic, Faults, Source};
use crate::files;
use crate::files::ReadFile;
use std::{
    collections::{BTreeMap, BTreeSet, btree_map::Entry},
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

/// The shader that makes a level of a texture from the one above.
pub const HALVE: &str = "lightgraph/halve.wgsl";

/// The WGSL texts that a graph may use, by their path relative to the shader folder (`/` separated).
#[derive(Debug, Clone, Default)]
pub struct Library {
    pub files: BTreeMap<String, Arc<Source>>,
    /// What was made of such texts before. Clones share it.
    pub memo: Memo,
}

impl Library {
    /// Reads every `*.wgsl` in the folders and the folders in them. A file hides those of the same relative path in
    /// later folders. Links that lead out of a folder are not followed. The language's own shaders, in `lightgraph/`,
    /// are there too.
    ///
    /// # Errors
    /// Every folder and file that can't be read, and every file that isn't UTF-8.
    pub fn load(dirs: &[PathBuf]) -> Checked<Library> {
        Library::load_with(dirs, &Source::read)
    }

    /// As [`Library::load`], with the texts of the files from anywhere else.
    ///
    /// # Errors
    /// As [`Library::load`].
    pub fn load_with(dirs: &[PathBuf], read: ReadFile) -> Checked<Library> {
        let mut library = Library::default();
        let mut faults = vec![];
        for dir in dirs {
            let held = files::held_below(dir);
            library.hold(dir, &held, read, &mut faults);
            match dir.canonicalize() {
                Ok(root) => {
                    let seen = BTreeSet::from([root.clone()]);
                    let mut walk = ImportWalk { root: &root, seen, read, texts: &mut library, faults: &mut faults };
                    walk.folder(dir, "");
                }
                Err(_) if !held.is_empty() => {}
                Err(e) => faults.push(unreadable(dir, &e)),
            }
        }
        for (path, source) in own() {
            library.files.entry(path.into()).or_insert(source);
        }
        Faults::check(faults, library)
    }

    /// Adds the files in memory that lie below a shader folder.
    fn hold(&mut self, dir: &Path, held: &[PathBuf], read: ReadFile, faults: &mut Vec<Diagnostic>) {
        for path in held.iter().filter(|path| path.extension().is_some_and(|e| e == "wgsl")) {
            let Ok(below) = path.strip_prefix(dir) else { continue };
            let names: Vec<_> = below.iter().map(|name| name.to_string_lossy()).collect();
            let relative = names.join("/");
            if let Entry::Vacant(place) = self.files.entry(relative) {
                match read(path) {
                    Ok(source) => drop(place.insert(source)),
                    Err(unread) => faults.extend(unread.0),
                }
            }
        }
    }

    /// The same files, where an earlier library knows their texts already: nothing it made of them is made again.
    #[must_use]
    pub fn after(mut self, earlier: &Library) -> Library {
        for (path, source) in &mut self.files {
            if let Some(known) = earlier.files.get(path).filter(|known| *known == source) {
                source.clone_from(known);
            }
        }
        Library { memo: earlier.memo.clone(), ..self }
    }

    /// What its files say of each other and which words stand in them, made once for the same texts.
    pub fn index(&self) -> Arc<Index> {
        self.memo.index(self)
    }

    /// As [`compose`], once for the same texts, definitions and entry points.
    ///
    /// # Errors
    /// As [`compose`].
    pub fn shader(&self, path: &str, defs: &Defs, wanted: &[String]) -> Checked<Arc<Shader>> {
        if let Some(shader) = self.memo.shader(self, path, defs, wanted) {
            return Ok(shader);
        }
        let shader = Arc::new(compose(self, path, defs, wanted)?);
        self.memo.keep(self, &shader);
        Ok(shader)
    }
}

/// What every project has: the module of checks, and the shader of passes that the language writes itself.
fn own() -> [(&'static str, Arc<Source>); 2] {
    let mips = || Source::new(format!("{}{HALVE}", crate::builtin::PREFIX), include_str!("halve.wgsl"));
    [(report::PATH, report::source()), (HALVE, mips())]
}

fn unreadable(path: &Path, error: &std::io::Error) -> Diagnostic {
    Diagnostic::error(format!("can't read {}: {error}", path.display()))
}

struct ImportWalk<'a> {
    /// With all links resolved.
    root: &'a Path,
    /// Folders with all links resolved: a link to a folder above must not lead round for ever.
    seen: BTreeSet<PathBuf>,
    read: ReadFile<'a>,
    texts: &'a mut Library,
    faults: &'a mut Vec<Diagnostic>,
}

impl ImportWalk<'_> {
    /// Reads `folder`, whose path relative to the root is `prefix` (empty, or ending in `/`).
    fn folder(&mut self, folder: &Path, prefix: &str) {
        let entries = match fs::read_dir(folder).and_then(|entries| entries.collect::<Result<Vec<_>, _>>()) {
            Ok(entries) => entries,
            Err(e) => return self.faults.push(unreadable(folder, &e)),
        };
        let mut entries: Vec<(PathBuf, bool)> =
            entries.iter().map(|e| (e.path(), e.file_type().is_ok_and(|kind| kind.is_file()))).collect();
        entries.sort();
        for (path, plain) in entries {
            let Some(name) = path.file_name().map(|n| n.to_string_lossy().into_owned()) else { continue };
            let relative = format!("{prefix}{name}");
            // A plain file lies where it is.
            if !plain {
                match path.canonicalize() {
                    Ok(resolved) if !resolved.starts_with(self.root) => continue,
                    Ok(resolved) if resolved.is_dir() => {
                        if self.seen.insert(resolved) {
                            self.folder(&path, &format!("{relative}/"));
                        }
                        continue;
                    }
                    Ok(_) => {}
                    // A link to nowhere matters only where it stands for a shader.
                    Err(_) if !name.ends_with(".wgsl") => continue,
                    Err(e) => {
                        self.faults.push(unreadable(&path, &e));
                        continue;
                    }
                }
            }
            if name.ends_with(".wgsl") && !self.texts.files.contains_key(&relative) {
                match (self.read)(&path) {
                    Ok(source) => {
                        self.texts.files.insert(relative, source);
                    }
                    Err(faults) => self.faults.extend(faults.0),
                }
            }
        }
    }
}
