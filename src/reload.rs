//! Files that change: one call for the many events that a save makes.

use crate::diag::{Checked, Diagnostic, Faults};
use crate::project::shader_folders;
use notify_debouncer_full::notify::event::{EventKind, ModifyKind};
use notify_debouncer_full::notify::{RecommendedWatcher, RecursiveMode};
use notify_debouncer_full::{DebounceEventResult, DebouncedEvent, Debouncer, RecommendedCache, new_debouncer};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Editors save in several steps (truncate and write, or write and rename); what happens within this time is one
/// change.
const SETTLE: Duration = Duration::from_millis(20);

/// Files that are saved together come to rest one after the other.
pub const TOGETHER: Duration = Duration::from_millis(15);

/// What never comes to rest is taken as it is after this time.
pub const LONGEST: Duration = Duration::from_secs(1);

/// Endings of the files that graphs and scenes are made of.
const ENDINGS: [&str; 13] =
    ["ron", "wgsl", "gltf", "glb", "bin", "png", "jpg", "jpeg", "webp", "ktx2", "hdr", "exr", "cube"];

/// Watches folders and all below them, those too that go and come again.
pub struct Watcher {
    debouncer: Debouncer<RecommendedWatcher, RecommendedCache>,
    homes: Arc<Mutex<Homes>>,
    watched: BTreeSet<PathBuf>,
    /// Where a folder that is gone will be seen to come: the nearest above it that is there.
    above: BTreeSet<PathBuf>,
}

/// What the thread that hears of changes shares with the watcher.
#[derive(Default)]
struct Homes {
    /// All folders that were ever asked for.
    folders: BTreeSet<PathBuf>,
    /// Those that went or came. The system watches the folder that was there, not its name.
    moved: BTreeSet<PathBuf>,
}

impl Watcher {
    /// Calls `changed`, on a thread of its own, with the files of graphs and scenes that were written, made, renamed or
    /// removed; with none of them when the system has lost count, or a folder went or came.
    ///
    /// # Errors
    /// The system gives no file events.
    pub fn new(mut changed: impl FnMut(BTreeSet<PathBuf>) + Send + 'static) -> Checked<Watcher> {
        let homes = Arc::new(Mutex::new(Homes::default()));
        let shared = homes.clone();
        let told = move |events: DebounceEventResult| match events {
            Ok(batch) => {
                let moved = lock(&shared).note(&batch);
                let written = batch.iter().filter(|e| !e.kind.is_access());
                let files: BTreeSet<PathBuf> = written.flat_map(|e| &e.paths).filter(|p| matters(p)).cloned().collect();
                if moved {
                    changed(BTreeSet::new());
                } else if !files.is_empty() {
                    changed(files);
                }
            }
            Err(_) => changed(BTreeSet::new()),
        };
        let debouncer = new_debouncer(SETTLE, None, told).map_err(|e| fault(&e))?;
        Ok(Watcher { debouncer, homes, watched: BTreeSet::new(), above: BTreeSet::new() })
    }

    /// Watches these folders too. To be called after each load: true when a folder has come again, whose files may have
    /// changed unseen since, so that all is to be loaded once more.
    ///
    /// # Errors
    /// A folder that is there and can't be watched.
    pub fn watch(&mut self, folders: &BTreeSet<PathBuf>) -> Checked<bool> {
        let (known, all, moved) = {
            let mut homes = lock(&self.homes);
            let known = homes.folders.clone();
            homes.folders.extend(folders.iter().cloned());
            (known, homes.folders.clone(), std::mem::take(&mut homes.moved))
        };
        let stale: Vec<PathBuf> = moved.into_iter().filter(|f| self.watched.remove(f)).collect();
        for folder in stale.into_iter().chain(std::mem::take(&mut self.above)) {
            // The system may have dropped the watch with the folder.
            let _ = self.debouncer.unwatch(folder);
        }
        let mut came = false;
        let mut gone = vec![];
        let unwatched: Vec<&PathBuf> = all.iter().filter(|f| !self.watched.contains(*f)).collect();
        for folder in unwatched {
            match self.debouncer.watch(folder, RecursiveMode::Recursive) {
                Ok(()) => {
                    came |= known.contains(folder);
                    self.watched.insert(folder.clone());
                }
                Err(_) if !folder.is_dir() => gone.push(folder),
                Err(e) => return Err(fault(&e)),
            }
        }
        for folder in gone {
            came |= self.expect(folder)?;
        }
        Ok(came)
    }

    /// Watches for a folder to come. True when something has come meanwhile.
    fn expect(&mut self, folder: &Path) -> Checked<bool> {
        let nearest = || folder.ancestors().find(|a| a.is_dir());
        let Some(above) = nearest() else { return Ok(false) };
        let seen = self.above.contains(above) || self.watched.iter().any(|w| above.starts_with(w));
        if !seen {
            match self.debouncer.watch(above, RecursiveMode::NonRecursive) {
                Ok(()) => drop(self.above.insert(above.to_path_buf())),
                Err(_) if !above.is_dir() => return Ok(true),
                Err(e) => return Err(fault(&e)),
            }
        }
        Ok(nearest() != Some(above))
    }
}

impl Homes {
    /// Notes the folders that went or came, with those above them. Whether there are any.
    fn note(&mut self, events: &[DebouncedEvent]) -> bool {
        let moves = |kind: &EventKind| {
            matches!(kind, EventKind::Create(_) | EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(_)))
        };
        let paths: BTreeSet<&PathBuf> = events.iter().filter(|e| moves(&e.kind)).flat_map(|e| &e.paths).collect();
        let moved: Vec<PathBuf> =
            self.folders.iter().filter(|f| paths.iter().any(|p| f.starts_with(p))).cloned().collect();
        self.moved.extend(moved.iter().cloned());
        !moved.is_empty()
    }
}

fn lock(homes: &Mutex<Homes>) -> MutexGuard<'_, Homes> {
    // Each change of it is whole before the next may panic.
    homes.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits for a change, and then for those that come with it. `ours` are files that the program itself writes: they
/// change nothing. False when no more can come.
pub fn settled(changes: &Receiver<BTreeSet<PathBuf>>, ours: &BTreeSet<PathBuf>) -> bool {
    loop {
        let Ok(files) = changes.recv() else { return false };
        // Without names, anything may have changed.
        if files.is_empty() || !files.is_subset(ours) {
            break;
        }
    }
    let first = Instant::now();
    while first.elapsed() < LONGEST && changes.recv_timeout(TOGETHER).is_ok() {}
    true
}

/// The folders that a graph, its shaders and a scene are read from, as far as they are there. `shaders` are the folders
/// that the user names besides the usual ones.
pub fn folders(graph: &Path, scene: Option<&Path>, shaders: &[PathBuf]) -> BTreeSet<PathBuf> {
    let usual = shader_folders(graph);
    let mut folders: BTreeSet<PathBuf> = usual.iter().chain(shaders).filter_map(|f| f.canonicalize().ok()).collect();
    folders.extend([graph].into_iter().chain(scene).filter_map(folder_of));
    folders
}

/// The folder that a file lies in, when it is there.
pub fn folder_of(file: &Path) -> Option<PathBuf> {
    file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new(".")).canonicalize().ok()
}

fn matters(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    ending.is_some_and(|e| ENDINGS.contains(&e.as_str()))
}

fn fault(e: &impl std::fmt::Display) -> Faults {
    Diagnostic::error(format!("can't watch files: {e}")).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn images_of_every_kind_that_scenes_name_are_watched() {
        let all = ["a.png", "a.jpg", "a.JPEG", "a.webp", "a.ktx2", "a.hdr", "a.exr"];
        assert!(all.iter().all(|name| matters(Path::new(name))) && !matters(Path::new("a.txt")));
    }

    #[test]
    fn what_comes_together_is_one_change_and_our_own_files_are_none() {
        let (send, changes) = channel();
        let files = |names: &[&str]| names.iter().map(PathBuf::from).collect::<BTreeSet<_>>();
        let ours = files(&["out.png"]);
        for names in [&["out.png"][..], &["a.ron"], &["b.wgsl", "out.png"], &[]] {
            send.send(files(names)).unwrap();
        }
        assert!(settled(&changes, &ours));
        assert!(changes.try_recv().is_err(), "all of it was one change");
        send.send(files(&["out.png"])).unwrap();
        drop(send);
        assert!(!settled(&changes, &ours), "nothing but our own file changed");
    }

    #[test]
    fn a_folder_that_goes_and_comes_again_is_watched_as_before() {
        // With all links resolved, as `folders` gives them.
        let temp = std::env::temp_dir().canonicalize().unwrap();
        let root = temp.join(format!("lightgraph-watched-{}", std::process::id()));
        let folder = root.join("project/shaders");
        std::fs::create_dir_all(&folder).unwrap();
        let (send, changes) = channel();
        let mut watcher = Watcher::new(move |files| send.send(files).unwrap()).unwrap_or_else(|f| panic!("{f}"));
        let all = BTreeSet::from([folder.clone()]);
        let mut watch = || watcher.watch(&all).unwrap_or_else(|f| panic!("{f}"));
        assert!(!watch(), "it was there");
        // As `watch` and the window do: after each change all is loaded, then watched, until nothing has come
        // meanwhile.
        let mut change = |what: &str| {
            changes.recv_timeout(Duration::from_secs(20)).unwrap_or_else(|_| panic!("nobody says: {what}"));
            while watch() || changes.recv_timeout(Duration::from_millis(60)).is_ok() {}
        };
        for again in 0..2 {
            std::fs::write(folder.join("a.wgsl"), "1").unwrap();
            change("a file was written");
            std::fs::remove_dir_all(root.join("project")).unwrap();
            change("the folder went");
            std::fs::create_dir_all(&folder).unwrap();
            change("the folder came");
            std::fs::write(folder.join("b.wgsl"), again.to_string()).unwrap();
            change("a file was written where the folder is new");
        }
        std::fs::remove_dir_all(&root).unwrap();
    }
}
