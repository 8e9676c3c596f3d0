//! Files that change: one call for the many events that a save makes.

use crate::diag::{Checked, Diagnostic, Faults};
use notify_debouncer_full::notify::{RecommendedWatcher, RecursiveMode};
use notify_debouncer_full::{DebounceEventResult, Debouncer, RecommendedCache, new_debouncer};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// Editors save in several steps (truncate and write, or write and rename); what happens within this time is one change.
const SETTLE: Duration = Duration::from_millis(20);

/// Files that are saved together come to rest one after the other.
pub const TOGETHER: Duration = Duration::from_millis(15);

/// What never comes to rest is taken as it is after this time.
pub const LONGEST: Duration = Duration::from_secs(1);

/// Endings of the files that graphs and scenes are made of.
const ENDINGS: [&str; 8] = ["ron", "wgsl", "gltf", "glb", "bin", "png", "jpg", "jpeg"];

/// Watches folders and all below them.
pub struct Watcher {
    debouncer: Debouncer<RecommendedWatcher, RecommendedCache>,
    watched: BTreeSet<PathBuf>,
}

impl Watcher {
    /// Calls `changed`, on a thread of its own, with the files of graphs and scenes that were written, made, renamed or
    /// removed; with none of them when the system has lost count.
    ///
    /// # Errors
    /// The system gives no file events.
    pub fn new(mut changed: impl FnMut(BTreeSet<PathBuf>) + Send + 'static) -> Checked<Watcher> {
        let told = move |events: DebounceEventResult| match events {
            Ok(batch) => {
                let written = batch.iter().filter(|e| !e.kind.is_access());
                let files: BTreeSet<PathBuf> = written.flat_map(|e| &e.paths).filter(|p| matters(p)).cloned().collect();
                if !files.is_empty() {
                    changed(files);
                }
            }
            Err(_) => changed(BTreeSet::new()),
        };
        let debouncer = new_debouncer(SETTLE, None, told).map_err(|e| fault(&e))?;
        Ok(Watcher { debouncer, watched: BTreeSet::new() })
    }

    /// Watches these folders too.
    ///
    /// # Errors
    /// A folder that can't be watched.
    pub fn watch(&mut self, folders: &BTreeSet<PathBuf>) -> Checked<()> {
        for folder in folders {
            if !self.watched.contains(folder) {
                self.debouncer.watch(folder, RecursiveMode::Recursive).map_err(|e| fault(&e))?;
                self.watched.insert(folder.clone());
            }
        }
        Ok(())
    }
}

/// Waits for a change, and then for those that come with it. `ours` are files that the program itself writes: they change
/// nothing. False when no more can come.
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

/// The folders that a graph, its shaders and a scene are read from, as far as they are there. `shaders` are the folders that
/// the user names besides the usual ones.
pub fn folders(graph: &Path, scene: &Path, shaders: &[PathBuf]) -> BTreeSet<PathBuf> {
    let beside = graph.parent().unwrap_or(Path::new(""));
    let usual = ["shaders", "../shaders"].map(|f| beside.join(f));
    let mut folders: BTreeSet<PathBuf> = usual.iter().chain(shaders).filter_map(|f| f.canonicalize().ok()).collect();
    folders.extend([graph, scene].into_iter().filter_map(folder_of));
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
}
