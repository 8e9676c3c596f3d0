//! The file of times that were measured earlier on this machine. Without it, or with a broken one, all is measured
//! anew.

use crate::caches;
use crate::files;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Groups kept at most; those measured last stay.
const MOST: usize = 256;

/// What was measured of one group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KnownChoice {
    /// Stands for the adapter and for what each alternative does.
    pub key: String,
    /// For people who read the file.
    pub adapter: String,
    pub group: String,
    /// Milliseconds of each alternative.
    pub ms: Vec<f64>,
}

/// The file in the user's folder of caches; `None` where the system names no such folder.
pub fn usual() -> Option<PathBuf> {
    Some(caches::folder()?.join("fastest.json"))
}

/// The times under a key.
pub fn find(file: Option<&Path>, key: &str) -> Option<Vec<f64>> {
    let found = read(file?).into_iter().rfind(|e| e.key == key)?;
    Some(found.ms).filter(|ms| ms.iter().all(|ms| ms.is_finite() && *ms >= 0.0))
}

/// Adds an entry, in place of one of the same key.
pub fn keep(file: Option<&Path>, entry: KnownChoice) {
    let Some(file) = file else { return };
    let mut all = read(file);
    all.retain(|e| e.key != entry.key);
    all.push(entry);
    let surplus = all.len().saturating_sub(MOST);
    all.drain(..surplus);
    if let Ok(text) = serde_json::to_vec_pretty(&all) {
        // What can't be kept is measured again next time; nothing else depends on it.
        let _ = caches::write(file, &text);
    }
}

/// What can be read of it.
fn read(file: &Path) -> Vec<KnownChoice> {
    caches::read(file, files::TEXT).and_then(|text| serde_json::from_slice(&text).ok()).unwrap_or_default()
}
