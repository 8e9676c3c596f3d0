//! How files are read: regular ones only, and up to a size.
//!
//! A pipe or a device in the place of a file would be waited for, or read without end. Where there is no disk, as in a
//! browser, files are held in memory ([`hold`]).

use crate::diag::{Checked, Source};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError, RwLock};

/// How files of text are read: from disk, or from anywhere else.
pub type ReadFile<'a> = &'a dyn Fn(&Path) -> Checked<Arc<Source>>;

/// Bytes of a graph, shader, scene RON or test at most.
pub const TEXT: u64 = 4 << 20;

/// Bytes of results and other tables of figures at most, unpacked.
pub const TABLE: u64 = 256 << 20;

/// Bytes of an image file at most.
pub const IMAGE: u64 = 1 << 30;

/// Bytes of a scene's geometry at most.
pub const GEOMETRY: u64 = 4 << 30;

/// Files in memory, by the path that names them.
static HELD: RwLock<BTreeMap<PathBuf, Arc<[u8]>>> = RwLock::new(BTreeMap::new());

/// From now on this program reads `content` where it reads the file of this path, whether the disk has one or not.
pub fn hold(path: impl Into<PathBuf>, content: impl Into<Arc<[u8]>>) {
    HELD.write().unwrap_or_else(PoisonError::into_inner).insert(path.into(), content.into());
}

/// Undoes [`hold`].
pub fn release(path: &Path) {
    HELD.write().unwrap_or_else(PoisonError::into_inner).remove(path);
}

fn held(path: &Path) -> Option<Arc<[u8]>> {
    HELD.read().unwrap_or_else(PoisonError::into_inner).get(path).cloned()
}

/// The paths of files in memory that lie in a folder or below it, sorted.
pub fn held_below(folder: &Path) -> Vec<PathBuf> {
    let all = HELD.read().unwrap_or_else(PoisonError::into_inner);
    all.keys().filter(|path| path.starts_with(folder)).cloned().collect()
}

/// Whether a file is there, in memory or on the disk.
pub fn is_file(path: &Path) -> bool {
    held(path).is_some() || path.is_file()
}

/// Whether a folder is there, in memory or on the disk.
pub fn is_folder(path: &Path) -> bool {
    !held_below(path).is_empty() || path.is_dir()
}

/// Reads a file.
///
/// # Errors
/// It can't be read, is no regular file, or is longer than `most` bytes.
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    if let Some(held) = held(path) {
        return if held.len() as u64 > most { Err(too_large(most)) } else { Ok(held.to_vec()) };
    }
    let file = open(path)?;
    let length = file.metadata()?.len();
    if length > most {
        return Err(too_large(most));
    }
    let mut bytes = vec![];
    bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX))?;
    limited(file, most, &mut bytes)?;
    Ok(bytes)
}

/// Whether files may name others outside of their folder.
static OUTSIDE: AtomicBool = AtomicBool::new(false);

/// From now on, files may name others that lie outside of their folder.
pub fn allow_outside() {
    OUTSIDE.store(true, Ordering::Relaxed);
}

/// The file that a file in `folder` names by a relative path. Neither `..` nor a link leads out of the folder, unless
/// the user allows it.
///
/// # Errors
/// What is wrong with the path, to stand behind it.
pub fn inside(folder: &Path, named: &str) -> Result<PathBuf, &'static str> {
    const OUT: &str = "leads out of the folder of the file that names it; `--allow-outside` follows it";
    let path = folder.join(named);
    if OUTSIDE.load(Ordering::Relaxed) {
        return Ok(path);
    }
    let plain = |c: Component| matches!(c, Component::Normal(_) | Component::CurDir);
    if !Path::new(named).components().all(plain) {
        return Err(OUT);
    }
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    // A file that is not there is reported when it is read.
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(file), Ok(folder)) if !file.starts_with(&folder) => Err(OUT),
        _ => Ok(path),
    }
}

/// Reads a file of UTF-8 text.
///
/// # Errors
/// As [`read`], and text that is not UTF-8.
pub fn read_text(path: &Path, most: u64) -> io::Result<String> {
    let not_utf8 = |_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text");
    String::from_utf8(read(path, most)?).map_err(not_utf8)
}

/// Opens a regular file. Where another kind of file stands, nothing is waited for.
///
/// # Errors
/// It can't be opened, or is no regular file.
pub fn open(path: &Path) -> io::Result<File> {
    opened(path, true)
}

/// As [`open`], and a link is refused.
///
/// # Errors
/// As [`open`], and a link.
pub fn open_itself(path: &Path) -> io::Result<File> {
    opened(path, false)
}

fn opened(path: &Path, follow: bool) -> io::Result<File> {
    let file = options(follow).open(path)?;
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file")),
    }
}

#[cfg(unix)]
fn options(follow: bool) -> OpenOptions {
    use rustix::fs::OFlags;
    use std::os::unix::fs::OpenOptionsExt;
    let itself = if follow { OFlags::empty() } else { OFlags::NOFOLLOW };
    let mut options = OpenOptions::new();
    // A pipe is opened without a writer, a terminal without becoming this program's own.
    options.read(true).custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY | itself).bits().cast_signed());
    options
}

#[cfg(not(unix))]
fn options(_: bool) -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true);
    options
}

/// Appends what `from` gives to `bytes`.
///
/// # Errors
/// It can't be read, or gives more than `most` bytes.
pub fn limited(from: impl Read, most: u64, bytes: &mut Vec<u8>) -> io::Result<()> {
    let read = from.take(most.saturating_add(1)).read_to_end(bytes)?;
    if read as u64 > most { Err(too_large(most)) } else { Ok(()) }
}

fn too_large(most: u64) -> io::Error {
    let size = match most >> 20 {
        0 => format!("{most} bytes"),
        mebibytes => format!("{mebibytes} MiB"),
    };
    io::Error::new(io::ErrorKind::FileTooLarge, format!("it is larger than {size}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::file::tests::Folder;

    #[test]
    fn a_file_in_memory_stands_in_the_place_of_one_on_the_disk() {
        let folder = Folder::new("files_held");
        let (disk, memory) = (folder.0.join("a.wgsl"), folder.0.join("below/b.wgsl"));
        std::fs::write(&disk, "disk").unwrap();
        hold(&disk, *b"edit");
        hold(&memory, *b"new");
        assert_eq!(read_text(&disk, 4).unwrap(), "edit");
        assert_eq!(read(&disk, 3).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        assert!(is_file(&memory) && is_folder(memory.parent().unwrap()));
        let library = crate::shader::Library::load(std::slice::from_ref(&folder.0)).unwrap();
        let texts = library.files.iter().map(|(p, s)| (p.as_str(), s.text.as_str()));
        let texts: Vec<(&str, &str)> = texts.filter(|(p, _)| !p.starts_with("lightgraph/")).collect();
        assert_eq!(texts, [("a.wgsl", "edit"), ("below/b.wgsl", "new")]);
        release(&disk);
        release(&memory);
        assert_eq!(read_text(&disk, 4).unwrap(), "disk");
        assert!(!is_file(&memory) && !is_folder(memory.parent().unwrap()));
    }

    #[test]
    fn a_file_is_read_up_to_its_limit() {
        let folder = Folder::new("files-limit");
        let path = folder.0.join("a.txt");
        std::fs::write(&path, "four").unwrap();
        assert_eq!(read(&path, 4).unwrap(), b"four");
        assert_eq!(read_text(&path, 4).unwrap(), "four");
        assert!(read(&path, 3).unwrap_err().to_string().contains("larger than 3 bytes"));
        assert!(limited(io::repeat(0), 1000, &mut vec![]).is_err(), "what never ends");
        std::fs::write(&path, [0xff]).unwrap();
        assert!(read_text(&path, 4).unwrap_err().to_string().contains("UTF-8"));
    }

    #[test]
    fn a_path_stays_in_its_folder() {
        let folder = Folder::new("files-inside");
        let (scene, other) = (folder.0.join("scene"), folder.0.join("other"));
        for folder in [&scene.join("textures"), &other] {
            std::fs::create_dir_all(folder).unwrap();
            std::fs::write(folder.join("a.png"), "").unwrap();
        }
        assert_eq!(inside(&scene, "textures/a.png"), Ok(scene.join("textures/a.png")));
        assert_eq!(inside(&scene, "./missing.png"), Ok(scene.join("./missing.png")));
        for out in ["../other/a.png", "textures/../../other/a.png", "/etc/passwd"] {
            assert!(inside(&scene, out).is_err(), "{out}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&other, scene.join("link")).unwrap();
            assert!(inside(&scene, "link/a.png").is_err());
        }
    }

    #[test]
    fn a_folder_a_device_and_a_pipe_are_refused_at_once() {
        let folder = Folder::new("files-kinds");
        let refused = |path: &Path| {
            let message = read(path, TEXT).unwrap_err().to_string();
            assert!(message.contains("not a regular file"), "{}: {message}", path.display());
        };
        refused(&folder.0);
        #[cfg(unix)]
        {
            refused(Path::new("/dev/zero"));
            let pipe = folder.0.join("pipe");
            let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
            assert!(made.success());
            refused(&pipe);
            let socket = folder.0.join("socket");
            let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
            assert!(read(&socket, TEXT).is_err());
        }
    }
}
