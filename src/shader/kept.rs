//! Shaders as naga_oil joined them, in a folder: who starts again need not join them again. A file that is missing or
//! broken is made anew. Another build of the program has files of its own: only the one that wrote a module knows its
//! form.

use super::{limits::on_deep_stack, oil::capabilities, write::Written};
use crate::caches;
use crate::caught::caught;
use crate::content::hash;
use crate::diag::Checked;
use naga::{
    Module,
    compact::{KeepUnused, compact},
    valid::{ValidationFlags, Validator},
};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

/// Files kept at most, some 12 KiB each; the oldest go first. To check all graphs that ship takes 630.
const MOST: usize = 8192;

/// Bytes of a module at most: a file of shaders has a mebibyte.
const LONGEST: u64 = 64 << 20;

/// How a file is called after its key.
const ENDING: &str = "module";

/// The folder, and what tells this build from others.
static KEPT: OnceLock<(PathBuf, u128)> = OnceLock::new();

/// From now on this program keeps joined shaders in a folder, and takes them from there. What is composed is the same.
/// Only the first call counts, and none where the program's own file can't be found.
pub fn keep_joined_in(folder: PathBuf) {
    let program = std::env::current_exe().and_then(fs::metadata);
    if let Some((length, modified)) = program.ok().and_then(|m| Some((m.len(), m.modified().ok()?))) {
        let _ = KEPT.set((folder, hash(&(length, modified))));
    }
}

/// The module of these texts: from the folder, or by `join`.
///
/// # Errors
/// Those of `join`.
pub(super) fn joined(written: &[Written], join: impl FnOnce() -> Checked<Module>) -> Checked<Module> {
    match KEPT.get() {
        Some((folder, build)) => joined_in(folder, *build, written, join),
        None => join(),
    }
}

fn joined_in(
    folder: &Path,
    build: u128,
    written: &[Written],
    join: impl FnOnce() -> Checked<Module>,
) -> Checked<Module> {
    let texts: Vec<&str> = written.iter().map(|w| w.text.as_str()).collect();
    let key = hash(&(build, texts));
    let file = folder.join(format!("{key:032x}.{ENDING}"));
    if let Some(module) = read(&file, key) {
        return Ok(module);
    }
    let mut module = join()?;
    compact(&mut module, KeepUnused::No);
    if let Ok(bytes) = postcard::to_allocvec(&module) {
        // What can't be kept is joined again next time; nothing else depends on it.
        if caches::write(&file, &[&seal(key, &bytes)[..], &bytes].concat()).is_ok() {
            thin(folder);
        }
    }
    Ok(module)
}

/// Stands first in a file: one that was cut off, written to or is another key's is no module.
fn seal(key: u128, bytes: &[u8]) -> [u8; 16] {
    hash(&(key, bytes)).to_le_bytes()
}

/// A file with the right seal may still have been made by somebody who knows how: what it holds is checked as if it
/// were new, and any doubt is as if there were no file.
fn read(file: &Path, key: u128) -> Option<Module> {
    let sealed = caches::read(file, LONGEST)?;
    let (stated, bytes) = sealed.split_first_chunk()?;
    if seal(key, bytes) != *stated {
        return None;
    }
    kept_module(bytes)
}

/// The module that a kept file holds behind its seal; `None` where there is any doubt.
pub fn kept_module(bytes: &[u8]) -> Option<Module> {
    // naga may index past its arenas in a module that no writer made; nothing outlives the call.
    let checked = || {
        let (module, rest) = postcard::take_from_bytes::<Module>(bytes).ok()?;
        Validator::new(ValidationFlags::all(), capabilities()).validate(&module).ok()?;
        rest.is_empty().then_some(module)
    };
    // Reading descends as deep as blocks nest: a shader's limits don't hold here.
    on_deep_stack(|| caught(checked).flatten()).ok().flatten()
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
    use super::super::{
        compose::Defs,
        library::Library,
        link::{LinkUnit, gather},
        oil::join,
        write::write,
    };
    use super::*;
    use crate::diag::{Diagnostic, Source};
    use crate::image::file::tests::Folder;

    const LIGHT: &str = "#define_import_path light\nfn half(x: vec2f) -> vec2f { return 0.5 * x; }\nfn idle() {}";
    const SHADER: &str =
        "#import light::half\nvar<uniform> scale1: vec2f;\nvar<storage, read_write> out_: array<vec2f>;
@compute @workgroup_size(8) fn main(@builtin(global_invocation_id) id: vec3u) { out_[id.x] = half(scale1); }";

    fn texts(library: &Library) -> (Vec<LinkUnit>, Vec<Written>) {
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
        let folder = Folder::new("kept");
        let join = || library.memo.with_oil(|oil| join(oil, &units, &written));
        let never = || Err(Diagnostic::error("joined again").into());
        let first = joined_in(&folder.0, 1, &written, join).unwrap();
        let again = joined_in(&folder.0, 1, &written, never).unwrap();
        let bytes = |m: &Module| postcard::to_allocvec(m).unwrap();
        assert_eq!(bytes(&first), bytes(&again));
        assert!(first.functions.iter().all(|(_, f)| !f.name.as_deref().unwrap_or("").contains("idle")));
        assert!(joined_in(&folder.0, 2, &written, never).is_err(), "another build");
        assert!(joined_in(&folder.0, 1, &written[1..], never).is_err(), "other texts");

        let file = folder.0.join(&folder.names()[0]);
        let whole = fs::read(&file).unwrap();
        let mut other = whole.clone();
        other[40] ^= 1;
        for broken in [&whole[..whole.len() - 1], &whole[..7], &other, &[]] {
            fs::write(&file, broken).unwrap();
            assert!(joined_in(&folder.0, 1, &written, never).is_err(), "{} bytes", broken.len());
            assert_eq!(bytes(&joined_in(&folder.0, 1, &written, join).unwrap()), bytes(&first));
            assert_eq!(fs::read(&file).unwrap(), whole, "made anew");
        }
    }

    #[test]
    fn a_module_under_another_name_and_a_resealed_one_are_joined_anew() {
        let library = library();
        let (units, written) = texts(&library);
        let folder = Folder::new("kept-swapped");
        let join = || library.memo.with_oil(|oil| join(oil, &units, &written));
        let first = joined_in(&folder.0, 1, &written, join).unwrap();
        let file = folder.0.join(&folder.names()[0]);
        let whole = fs::read(&file).unwrap();
        let bytes = |m: &Module| postcard::to_allocvec(m).unwrap();

        // Another build's module under this one's name: valid, and sealed for its own key.
        joined_in(&folder.0, 2, &written, join).unwrap();
        let other = folder.names().into_iter().map(|n| folder.0.join(n)).find(|f| *f != file).unwrap();
        fs::copy(&other, &file).unwrap();
        let key = u128::from_str_radix(file.file_stem().unwrap().to_str().unwrap(), 16).unwrap();
        assert!(read(&file, key).is_none());

        // Every byte changed in turn, with a seal that fits: refused, or valid.
        for at in 16..whole.len() {
            for flip in [0x01, 0x80, 0xff] {
                let mut hostile = whole[16..].to_vec();
                hostile[at - 16] ^= flip;
                caches::write(&file, &[&seal(key, &hostile)[..], &hostile].concat()).unwrap();
                let _ = read(&file, key);
            }
        }
        fs::write(&file, &whole).unwrap();
        assert_eq!(bytes(&joined_in(&folder.0, 1, &written, join).unwrap()), bytes(&first));
    }

    #[test]
    fn the_oldest_go_when_there_are_too_many() {
        let Folder(path) = &Folder::new("thin");
        for i in 0..=MOST {
            fs::write(path.join(format!("{i}.{ENDING}")), []).unwrap();
        }
        fs::write(path.join("notes.txt"), []).unwrap();
        let oldest = path.join(format!("{}.{ENDING}", MOST / 2));
        fs::File::options().write(true).open(&oldest).unwrap().set_modified(SystemTime::UNIX_EPOCH).unwrap();
        thin(path);
        assert_eq!(fs::read_dir(path).unwrap().count(), MOST + 2 - MOST / 4);
        assert!(path.join("notes.txt").exists() && !oldest.exists());
    }
}
