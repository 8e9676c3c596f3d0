//! Shaders as naga_oil joined them, in a folder: who starts again need not join them again. A file that is missing or
//! broken is made anew.

use super::write::Written;
use crate::content::hash;
use crate::diag::Checked;
use crate::image::file::write_atomically;
use naga::{
    Module,
    compact::{KeepUnused, compact},
};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

/// What made the modules, in which form they are written.
const MAKER: &str = "naga 30.0.1, naga_oil 0.23.0, postcard 1";

/// Files kept at most; the oldest go first.
const MOST: usize = 1024;

/// How a file is called after its key.
const ENDING: &str = "module";

static FOLDER: OnceLock<PathBuf> = OnceLock::new();

/// From now on this program keeps joined shaders in a folder, and takes them from there. What is composed is the same. Only the
/// first call counts.
pub fn keep_joined_in(folder: PathBuf) {
    let _ = FOLDER.set(folder);
}

/// The module of these texts: from the folder, or by `join`.
///
/// # Errors
/// Those of `join`.
pub(super) fn joined(written: &[Written], join: impl FnOnce() -> Checked<Module>) -> Checked<Module> {
    match FOLDER.get() {
        Some(folder) => joined_in(folder, written, join),
        None => join(),
    }
}

fn joined_in(folder: &Path, written: &[Written], join: impl FnOnce() -> Checked<Module>) -> Checked<Module> {
    let texts: Vec<&str> = written.iter().map(|w| w.text.as_str()).collect();
    let file = folder.join(format!("{:032x}.{ENDING}", hash(&(MAKER, texts))));
    if let Some(module) = read(&file) {
        return Ok(module);
    }
    let mut module = join()?;
    compact(&mut module, KeepUnused::No);
    if let Ok(bytes) = postcard::to_allocvec(&module) {
        let sealed = [&hash(&bytes).to_le_bytes()[..], &bytes].concat();
        // What can't be kept is joined again next time; nothing else depends on it.
        let _ = write_atomically(&file, &sealed);
        thin(folder);
    }
    Ok(module)
}

/// A hash of the rest stands first: a file that was cut off or written to is no module.
fn read(file: &Path) -> Option<Module> {
    let sealed = fs::read(file).ok()?;
    let (seal, bytes) = sealed.split_first_chunk()?;
    (hash(bytes) == u128::from_le_bytes(*seal)).then(|| postcard::from_bytes(bytes).ok())?
}

/// Removes the oldest files, a quarter of all, when there are too many.
fn thin(folder: &Path) {
    let ours = |path: &PathBuf| path.extension().is_some_and(|e| e == ENDING);
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut files: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(ours).collect();
    if files.len() <= MOST {
        return;
    }
    files.sort_by_cached_key(|f| fs::metadata(f).and_then(|m| m.modified()).unwrap_or(SystemTime::UNIX_EPOCH));
    for file in files.iter().take(MOST / 4) {
        let _ = fs::remove_file(file);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{compose::Defs, library::Library, link::gather, oil::join, write::write};
    use super::*;
    use crate::diag::{Diagnostic, Source};

    const LIGHT: &str = "#define_import_path light\nfn half(x: vec2f) -> vec2f { return 0.5 * x; }\nfn idle() {}";
    const SHADER: &str =
        "#import light::half\nvar<uniform> scale1: vec2f;\nvar<storage, read_write> out_: array<vec2f>;
@compute @workgroup_size(8) fn main(@builtin(global_invocation_id) id: vec3u) { out_[id.x] = half(scale1); }";

    fn texts(library: &Library) -> (Vec<super::super::link::Unit>, Vec<Written>) {
        let units = gather(library, "a.wgsl", &Defs::new()).unwrap();
        let mut bindings = 0;
        let written = units.iter().enumerate().map(|(i, u)| write(u, &Defs::new(), i, &mut bindings)).collect();
        (units, written)
    }

    fn library() -> Library {
        let mut library = Library::default();
        for (path, text) in [("light.wgsl", LIGHT), ("a.wgsl", SHADER)] {
            library.files.insert(path.into(), Source::new(path, text));
        }
        library
    }

    #[test]
    fn what_is_kept_is_what_was_joined() {
        let library = library();
        let (units, written) = texts(&library);
        let folder = std::env::temp_dir().join(format!("lightgraph-kept-{}", std::process::id()));
        let join = || library.memo.with_oil(|oil| join(oil, &units, &written));
        let never = || Err(Diagnostic::error("joined again").into());
        let first = joined_in(&folder, &written, join).unwrap();
        let again = joined_in(&folder, &written, never).unwrap();
        let bytes = |m: &Module| postcard::to_allocvec(m).unwrap();
        assert_eq!(bytes(&first), bytes(&again));
        assert!(first.functions.iter().all(|(_, f)| !f.name.as_deref().unwrap_or("").contains("idle")));

        let file = fs::read_dir(&folder).unwrap().next().unwrap().unwrap().path();
        let whole = fs::read(&file).unwrap();
        let mut other = whole.clone();
        other[40] ^= 1;
        for broken in [&whole[..whole.len() - 1], &whole[..7], &other, &[]] {
            fs::write(&file, broken).unwrap();
            assert!(joined_in(&folder, &written, never).is_err(), "{} bytes", broken.len());
            assert_eq!(bytes(&joined_in(&folder, &written, join).unwrap()), bytes(&first));
            assert_eq!(fs::read(&file).unwrap(), whole, "made anew");
        }
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn the_oldest_go_when_there_are_too_many() {
        let folder = std::env::temp_dir().join(format!("lightgraph-thin-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        for i in 0..=MOST {
            fs::write(folder.join(format!("{i}.{ENDING}")), []).unwrap();
        }
        fs::write(folder.join("notes.txt"), []).unwrap();
        let old = fs::File::options().write(true).open(folder.join(format!("{}.{ENDING}", MOST / 2))).unwrap();
        old.set_modified(SystemTime::UNIX_EPOCH).unwrap();
        thin(&folder);
        let left: Vec<PathBuf> = fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect();
        assert_eq!(left.len(), MOST + 2 - MOST / 4);
        assert!(left.contains(&folder.join("notes.txt")));
        assert!(!left.contains(&folder.join(format!("{}.{ENDING}", MOST / 2))));
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn the_maker_is_the_one_that_is_built_with() {
        let lock = include_str!("../../Cargo.lock");
        for part in MAKER.split(", ") {
            let (name, version) = part.split_once(' ').unwrap();
            let found = lock.split("[[package]]").any(|p| {
                p.contains(&format!("\nname = \"{name}\"\n")) && p.contains(&format!("\nversion = \"{version}"))
            });
            assert!(found, "{part}: give the version of Cargo.lock");
        }
    }
}
