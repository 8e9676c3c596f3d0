//! Open documents over the files of the disk.

use lightgraph::Checked;
use lightgraph::internals::diag::Source;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

/// The texts of files: of open documents as the editor has them, else as the disk has them. An unchanged file is the
/// same source each time it is read.
#[derive(Debug, Default)]
pub struct Texts {
    open: Mutex<BTreeMap<PathBuf, OpenDocument>>,
    disk: Mutex<BTreeMap<PathBuf, CachedFile>>,
}

/// A document that an editor has open.
#[derive(Debug, Clone)]
pub struct OpenDocument {
    pub source: Arc<Source>,
    pub version: i32,
}

/// A file as it was read, and what tells that it has changed since.
#[derive(Debug)]
struct CachedFile {
    modified: Option<SystemTime>,
    length: u64,
    source: Arc<Source>,
}

/// Files of the disk kept at most; they are small.
const MOST_KEPT: usize = 4096;

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Each change is whole before the next may panic.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Texts {
    /// A document was opened, or has changed.
    pub fn set(&self, path: &Path, text: String, version: i32) {
        let source = Source::new(path.display().to_string(), text);
        lock(&self.open).insert(path.into(), OpenDocument { source, version });
    }

    /// A document was closed: its file counts again.
    pub fn close(&self, path: &Path) {
        lock(&self.open).remove(path);
    }

    /// A file was written: what tells changes on the disk may be too coarse.
    pub fn forget(&self, path: &Path) {
        lock(&self.disk).remove(path);
    }

    pub fn document(&self, path: &Path) -> Option<OpenDocument> {
        lock(&self.open).get(path).cloned()
    }

    /// Paths of the open documents, in their order.
    pub fn open(&self) -> Vec<PathBuf> {
        lock(&self.open).keys().cloned().collect()
    }

    /// # Errors
    /// A file can't be read.
    pub fn read(&self, path: &Path) -> Checked<Arc<Source>> {
        if let Some(document) = self.document(path) {
            return Ok(document.source);
        }
        let told = std::fs::metadata(path).ok();
        let (modified, length) = told.map_or((None, 0), |m| (m.modified().ok(), m.len()));
        if let Some(kept) = lock(&self.disk).get(path)
            && modified.is_some()
            && (kept.modified, kept.length) == (modified, length)
        {
            return Ok(kept.source.clone());
        }
        let source = Source::read(path)?;
        let mut disk = lock(&self.disk);
        if disk.len() >= MOST_KEPT {
            disk.clear();
        }
        // What reads the same is the same: nothing that was made of it has to be made again.
        let source = match disk.get(path) {
            Some(kept) if kept.source.text == source.text => kept.source.clone(),
            _ => source,
        };
        disk.insert(path.into(), CachedFile { modified, length, source: source.clone() });
        Ok(source)
    }

    /// Whether a place in this source is still a place in its file.
    pub fn is_current(&self, source: &Arc<Source>) -> bool {
        let current = self.document(Path::new(&source.path));
        current.is_none_or(|d| Arc::ptr_eq(&d.source, source) || d.source.text == source.text)
    }
}
