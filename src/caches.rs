//! The user's folder for what can be made again.
//!
//! What stands in it is believed only as far as nobody else can have put it there: the folders are this user's own,
//! closed to all others, and no link is followed. Any doubt is as if nothing were kept. In a browser a cache is held in
//! memory.

use crate::files;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// `None` where the system names no such folder.
pub fn folder() -> Option<PathBuf> {
    let named = |variable| std::env::var_os(variable).map(PathBuf::from).filter(|p| p.is_absolute());
    let home = || std::env::home_dir().filter(|p| p.is_absolute());
    let all = if cfg!(windows) {
        named("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        home().map(|h| h.join("Library/Caches"))
    } else {
        named("XDG_CACHE_HOME").or_else(|| home().map(|h| h.join(".cache")))
    };
    all.map(|f| f.join("lightgraph"))
}

/// What a file of a cache holds; `None` when it is not there, is a link, is somebody else's or longer than `most`
/// bytes.
pub fn read(file: &Path, most: u64) -> Option<Vec<u8>> {
    if cfg!(target_arch = "wasm32") {
        return files::read(file, most).ok();
    }
    if !is_ours(file.parent()?) {
        return None;
    }
    let opened = files::open_itself(file).ok()?;
    let found = opened.metadata().ok()?;
    if !owned(&found) || found.len() > most {
        return None;
    }
    let mut bytes = vec![];
    files::limited(opened, most, &mut bytes).ok()?;
    Some(bytes)
}

/// Puts a file into a cache, whole or not at all. A link that stands there is replaced, not followed.
///
/// # Errors
/// The folder can't be made or is not this user's own; the file can't be written.
pub fn write(file: &Path, bytes: &[u8]) -> io::Result<()> {
    if cfg!(target_arch = "wasm32") {
        files::hold(file, bytes);
        return Ok(());
    }
    let folder = file.parent().ok_or(io::ErrorKind::InvalidInput)?;
    if let Some(above) = folder.parent() {
        fs::create_dir_all(above)?;
    }
    make(folder)?;
    if !is_ours(folder) {
        return Err(io::ErrorKind::PermissionDenied.into());
    }
    let mut temporary = tempfile::Builder::new().prefix(".").suffix(".tmp").tempfile_in(folder)?;
    temporary.write_all(bytes)?;
    temporary.persist(file)?;
    Ok(())
}

#[cfg(unix)]
fn make(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
    match fs::DirBuilder::new().mode(0o700).create(folder) {
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {
            // An earlier version made it readable for others.
            let found = fs::symlink_metadata(folder)?;
            if found.is_dir() && owned(&found) && found.mode() & 0o077 != 0 {
                fs::set_permissions(folder, fs::Permissions::from_mode(0o700))?;
            }
            Ok(())
        }
        made => made,
    }
}

#[cfg(not(unix))]
fn make(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)
}

/// A folder itself, not a link to one, that is this user's and closed to others.
#[cfg(unix)]
fn is_ours(folder: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    fs::symlink_metadata(folder).is_ok_and(|found| found.is_dir() && owned(&found) && found.mode() & 0o077 == 0)
}

/// Elsewhere the system's folder of caches is the user's own.
#[cfg(not(unix))]
fn is_ours(folder: &Path) -> bool {
    fs::symlink_metadata(folder).is_ok_and(|found| found.is_dir())
}

#[cfg(unix)]
fn owned(found: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    found.uid() == rustix::process::geteuid().as_raw()
}

#[cfg(not(unix))]
fn owned(_: &fs::Metadata) -> bool {
    true
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::image::file::tests::Folder;
    use std::os::unix::fs::{PermissionsExt, symlink};

    #[test]
    fn what_was_written_is_read_and_the_folder_is_closed_to_others() {
        let folder = Folder::new("caches");
        let file = folder.0.join("deep/cache/a");
        write(&file, b"one").unwrap();
        write(&file, b"two").unwrap();
        assert_eq!(read(&file, 3).as_deref(), Some(&b"two"[..]));
        assert_eq!(read(&file, 2), None, "too long");
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(file.parent().unwrap()), 0o700);
        assert_eq!(mode(&file), 0o600);
    }

    #[test]
    fn links_are_neither_written_through_nor_read() {
        let folder = Folder::new("caches-links");
        let (cache, victim) = (folder.0.join("cache"), folder.0.join("victim"));
        fs::write(&victim, b"kept").unwrap();
        write(&cache.join("b"), b"b").unwrap();
        let file = cache.join("a");
        symlink(&victim, &file).unwrap();
        assert_eq!(read(&file, 100), None);
        write(&file, b"new").unwrap();
        assert_eq!(fs::read(&victim).unwrap(), b"kept");
        assert_eq!(read(&file, 100).as_deref(), Some(&b"new"[..]));

        let alias = folder.0.join("alias");
        symlink(&cache, &alias).unwrap();
        assert_eq!(read(&alias.join("a"), 100), None, "a folder that is a link");
        assert!(write(&alias.join("a"), b"other").is_err());
    }

    #[test]
    fn a_folder_that_others_may_write_to_is_not_believed() {
        let folder = Folder::new("caches-open");
        let file = folder.0.join("cache/a");
        write(&file, b"one").unwrap();
        fs::set_permissions(file.parent().unwrap(), fs::Permissions::from_mode(0o777)).unwrap();
        assert_eq!(read(&file, 100), None);
        write(&file, b"two").unwrap();
        assert_eq!(read(&file, 100).as_deref(), Some(&b"two"[..]), "closed again");
    }
}
