//! The entries of a bench that is not over yet.

use super::results::{Entry, Results};
use lightgraph::internals::files;
use lightgraph::{Checked, Diagnostic};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Where a run keeps its entries until it is over.
pub const JOURNAL: &str = "entries.jsonl";

/// Entries as they come, a line of JSON each, so that an interruption loses none.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Begins in a folder. To go on, with what its results and the journal of an interrupted run hold; a line that
    /// was cut off is left out, and `notes` tell of it.
    ///
    /// # Errors
    /// Files that can't be read or written, results that are none.
    pub fn open(folder: &Path, go_on: bool, notes: &mut Vec<Diagnostic>) -> Checked<(Journal, Vec<Entry>)> {
        let path = folder.join(JOURNAL);
        let fault = |e: &dyn std::fmt::Display| Diagnostic::error(format!("can't write {}: {e}", path.display()));
        let results = folder.join("results.json");
        let mut kept = match go_on && results.exists() {
            true => Results::read(&results)?.entries,
            false => vec![],
        };
        let bytes = if go_on { written(&path)? } else { vec![] };
        let mut lost = 0;
        // Bytes, no text: a line may be cut off within a character.
        for line in bytes.split(|b| *b == b'\n').filter(|line| !line.is_empty()) {
            let Ok(entry) = serde_json::from_slice::<Entry>(line) else {
                lost += 1;
                continue;
            };
            // A later round's holds what was measured before.
            kept.retain(|e| e.key() != entry.key() || e.inputs != entry.inputs);
            kept.push(entry);
        }
        if lost > 0 {
            let d = Diagnostic::warning(format!("{lost} lines of {} hold no whole entry", path.display()));
            notes.push(d.help("what they held is measured again"));
        }
        std::fs::create_dir_all(folder).map_err(|e| fault(&e))?;
        let file = File::options().create(true).append(go_on).write(true).truncate(!go_on).open(&path);
        let mut journal = Journal { file: file.map_err(|e| fault(&e))?, path: path.clone() };
        if bytes.last().is_some_and(|b| *b != b'\n') {
            journal.line("")?;
        }
        Ok((journal, kept))
    }

    /// Keeps an entry.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn add(&mut self, entry: &Entry) -> Checked<()> {
        let json = serde_json::to_string(entry);
        self.line(&json.map_err(|e| Diagnostic::error(format!("can't write the results: {e}")))?)
    }

    /// The results hold it all now.
    ///
    /// # Errors
    /// A file that can't be removed.
    pub fn close(self) -> Checked<()> {
        let Journal { path, file } = self;
        drop(file);
        std::fs::remove_file(&path)
            .map_err(|e| Diagnostic::error(format!("can't remove {}: {e}", path.display())).into())
    }

    fn line(&mut self, text: &str) -> Checked<()> {
        let written = self.file.write_all(format!("{text}\n").as_bytes());
        written.map_err(|e| Diagnostic::error(format!("can't write {}: {e}", self.path.display())).into())
    }
}

/// What a journal holds: nothing where there is none.
fn written(path: &Path) -> Checked<Vec<u8>> {
    match files::read(path, files::TABLE) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(vec![]),
        read => read.map_err(|e| {
            let d = Diagnostic::error(format!("can't read {}: {e}", path.display()));
            d.help("make it readable, or measure everything anew: leave out `--resume`").into()
        }),
    }
}
