//! Files that are written whole or not at all.

use crate::diag::{Checked, Diagnostic, Faults};
use std::{
    ffi::{OsStr, OsString},
    fs::{self, File, OpenOptions},
    io::{self, Write},
    path::{Path, PathBuf},
};

/// Writes `bytes` to `path`: a temporary file in the same folder is filled and then takes the name, so that a reader
/// sees the old content or the new, never a part; so does the next start when the power fails. Missing folders are
/// made. A link stays a link: what it names is replaced. A device or pipe can't be replaced and is written to directly.
///
/// # Errors
/// A fault that names the path and the reason; then no temporary file and no new folder is left.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Checked<()> {
    // A link that leads nowhere can't be followed: the rename then puts the file in its place.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    match fs::metadata(&target) {
        Ok(found) if found.is_dir() => return Err(fault(path, "it is a folder")),
        // The rename would succeed all the same: it asks about the folder only.
        Ok(found) if found.is_file() && found.permissions().readonly() => return Err(fault(path, "it is read-only")),
        Ok(found) if !found.is_file() => {
            return OpenOptions::new()
                .write(true)
                .open(&target)
                .and_then(|mut f| f.write_all(bytes))
                .map_err(|e| fault(path, e));
        }
        _ => {}
    }
    let Some(name) = target.file_name() else { return Err(fault(path, "it names no file")) };
    let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let missing: Vec<PathBuf> =
        folder.ancestors().take_while(|p| !p.as_os_str().is_empty() && !p.exists()).map(Path::to_path_buf).collect();
    let written = fs::create_dir_all(folder).and_then(|()| put(folder, name, &target, bytes));
    written.map_err(|e| {
        for made in &missing {
            // Only empty folders go, the innermost first.
            let _ = fs::remove_dir(made);
        }
        fault(path, e)
    })
}

/// Fills a new file, whose name nobody can foresee, and renames it. Nothing of it is left on failure.
fn put(folder: &Path, name: &OsStr, target: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(".");
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".tmp");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any new file; by itself a temporary one is closed to others.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(bytes)?;
    // The name must not reach the disk before the content.
    file.as_file().sync_all()?;
    file.persist(target)?;
    sync_folder(folder);
    Ok(())
}

/// Where a folder can't be brought to the disk by itself, the system does so in time.
fn sync_folder(folder: &Path) {
    let _ = File::open(folder).and_then(|f| f.sync_all());
}

fn fault(path: &Path, reason: impl std::fmt::Display) -> Faults {
    Diagnostic::error(format!("can't write {}: {reason}", path.display()))
        .help("name a file in a folder that you may write to")
        .into()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An empty folder of a test's own, gone when dropped.
    pub(crate) struct Folder(pub PathBuf);

    impl Folder {
        pub(crate) fn new(test: &str) -> Folder {
            let path = std::env::temp_dir().join(format!("lightgraph-{test}-{}", std::process::id()));
            let _ = fs::remove_dir_all(&path);
            fs::create_dir_all(&path).unwrap();
            Folder(path)
        }

        pub(crate) fn names(&self) -> Vec<String> {
            let mut names: Vec<String> =
                fs::read_dir(&self.0).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
            names.sort();
            names
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn content_is_replaced_and_nothing_else_is_left() {
        let folder = Folder::new("file-replace");
        let path = folder.0.join("a.json");
        write_atomically(&path, b"one").unwrap();
        write_atomically(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(folder.names(), ["a.json"]);
    }

    #[test]
    fn missing_folders_are_made() {
        let folder = Folder::new("file-folders");
        let path = folder.0.join("x/y/a.json");
        write_atomically(&path, b"one").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"one");
    }

    #[test]
    fn a_failure_is_a_fault_and_leaves_nothing() {
        let folder = Folder::new("file-failure");
        fs::write(folder.0.join("plain"), b"").unwrap();
        fs::create_dir(folder.0.join("folder")).unwrap();
        for path in ["plain/a.json", "folder", "new/deeper/..", ""] {
            let faults = write_atomically(&folder.0.join(path), b"one").unwrap_err();
            assert!(faults.0[0].message.starts_with("can't write "), "{faults}");
        }
        // A name too long for the file system: the new folders are there already when the write fails.
        assert!(write_atomically(&folder.0.join("new/deeper").join("n".repeat(300)), b"one").is_err());
        assert_eq!(folder.names(), ["folder", "plain"]);
    }

    #[test]
    fn what_a_killed_process_left_stands_in_nobodys_way() {
        let folder = Folder::new("file-stale");
        // As names were before they were random: the process and a count.
        for count in 0..100 {
            fs::write(folder.0.join(format!(".a.png.{}.{count}.tmp", std::process::id())), b"stale").unwrap();
        }
        write_atomically(&folder.0.join("a.png"), b"new").unwrap();
        assert_eq!(fs::read(folder.0.join("a.png")).unwrap(), b"new");
        assert_eq!(folder.names().len(), 101);
    }

    #[cfg(unix)]
    #[test]
    fn a_new_file_may_be_read_by_those_who_may_read_any_new_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = Folder::new("file-mode");
        fs::write(folder.0.join("usual"), b"").unwrap();
        write_atomically(&folder.0.join("ours"), b"").unwrap();
        let mode = |name: &str| fs::metadata(folder.0.join(name)).unwrap().permissions().mode();
        assert_eq!(mode("ours"), mode("usual"));
    }

    #[test]
    fn a_read_only_file_is_kept() {
        let folder = Folder::new("file-readonly");
        let path = folder.0.join("a.json");
        fs::write(&path, b"old").unwrap();
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        assert!(write_atomically(&path, b"new").unwrap_err().0[0].message.contains("read-only"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_a_device_stays_a_device() {
        use std::os::unix::fs::FileTypeExt;
        let folder = Folder::new("file-link");
        fs::write(folder.0.join("real"), b"old").unwrap();
        let link = folder.0.join("link");
        std::os::unix::fs::symlink("real", &link).unwrap();
        write_atomically(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(folder.0.join("real")).unwrap(), b"new");
        write_atomically(Path::new("/dev/null"), b"gone").unwrap();
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    }
}
