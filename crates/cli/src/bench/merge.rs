//! Joins the parts of a bench that machines have measured.

use super::host::Machine;
use super::jobs::Part;
use super::report;
use super::results::{Entry, JOURNAL, Results};
use crate::shard::Shard;
use lightgraph::{Checked, Diagnostic, Faults};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A folder of results, and what part of the whole they are.
struct Piece {
    folder: PathBuf,
    results: Results,
    part: Part,
}

/// The results of all parts in the order in which one machine would have measured them, with their pictures copied to
/// `out`. Nothing is written where a fault is found.
///
/// # Errors
/// Folders without a finished part; parts of different benches; a job that is there twice or not at all.
pub fn merge(folders: &[PathBuf], out: &Path) -> Checked<Results> {
    let (mut pieces, mut faults): (Vec<Piece>, Vec<Diagnostic>) = (vec![], vec![]);
    for folder in folders {
        if folder.canonicalize().is_ok_and(|f| out.canonicalize().is_ok_and(|o| o == f)) {
            let d = Diagnostic::error(format!("{} is a part and the place of the whole", folder.display()));
            faults.push(d.help("give another folder as --out"));
        }
        match piece(folder) {
            Ok(piece) => pieces.push(piece),
            Err(Faults(more)) => faults.extend(more),
        }
    }
    let order = Faults::check(faults, ()).and_then(|()| complete(&pieces))?;
    for piece in &pieces {
        piece.results.entries.iter().try_for_each(|e| report::copy(e, &piece.folder, out))?;
    }
    let mut entries: Vec<Entry> = order.into_values().flatten().cloned().collect();
    // What a folder held besides its part, from before a `--resume`.
    for entry in pieces.iter().flat_map(|p| &p.results.entries) {
        if entries.iter().all(|e| e.key() != entry.key()) {
            entries.push(entry.clone());
        }
    }
    let Some(first) = pieces.first() else { return Err(Diagnostic::error("there are no parts to join").into()) };
    let mut absent = vec![];
    for a in pieces.iter().flat_map(|p| &p.results.absent) {
        if !absent.contains(a) {
            absent.push(a.clone());
        }
    }
    let machine = usual(&pieces).unwrap_or_else(|| first.results.machine.clone());
    Ok(Results { entries, absent, machine, part: None, ..first.results.clone() })
}

fn piece(folder: &Path) -> Checked<Piece> {
    let file = folder.join("results.json");
    if !file.exists() && folder.join(JOURNAL).exists() {
        let d = Diagnostic::error(format!("{} holds a part that is not finished", folder.display()));
        return Err(d.help("finish it: run its command again with `--resume`").into());
    }
    let results = Results::read(&file)?;
    let Some(part) = results.part.clone() else {
        let d = Diagnostic::error(format!("{} holds no part of a bench", file.display()));
        return Err(d.help("parts are measured by `lightgraph bench --shard K/N --out DIR`").into());
    };
    part.check(&file.display().to_string(), results.entries.len())?;
    Ok(Piece { folder: folder.into(), results, part })
}

/// The entries of each job, by its number.
fn complete(pieces: &[Piece]) -> Checked<BTreeMap<usize, &[Entry]>> {
    let mut faults = vec![];
    let Some(first) = pieces.first() else { return Ok(BTreeMap::new()) };
    for piece in pieces.iter().filter(|p| p.part.whole != first.part.whole) {
        let (a, b) = (first.folder.display(), piece.folder.display());
        let d = Diagnostic::error(format!("{a} and {b} hold parts of different benches"));
        faults.push(d.help("join parts that the same files, program and options made"));
    }
    Faults::check(std::mem::take(&mut faults), ())?;
    let mut found: BTreeMap<usize, (&Piece, &[Entry])> = BTreeMap::new();
    for piece in pieces {
        let mut rest = piece.results.entries.as_slice();
        let mut twice = None;
        for done in &piece.part.done {
            let (own, after) = rest.split_at_checked(done.entries).unwrap_or((rest, &[]));
            rest = after;
            if let Some((other, _)) = found.insert(done.job, (piece, own)) {
                twice = Some(other);
            }
        }
        if let Some(other) = twice {
            let (a, b) = (other.folder.display(), piece.folder.display());
            let d = Diagnostic::error(format!("{a} and {b} hold the same jobs"));
            faults.push(d.help("leave one of them out"));
        }
    }
    let missing: Vec<usize> = (0..first.part.jobs).filter(|job| !found.contains_key(job)).collect();
    if !missing.is_empty() {
        let of = first.part.shard.of;
        let shards = (1..=of).map(|number| Shard { number, of });
        let lacking = shards.filter(|s| missing.iter().any(|job| s.has(*job))).map(|s| s.to_string());
        let text = format!("{} of {} jobs are in none of the parts", missing.len(), first.part.jobs);
        let list = lacking.collect::<Vec<_>>().join(", ");
        faults.push(Diagnostic::error(text).help(format!("measure and give `--shard` {list}, too")));
    }
    Faults::check(faults, found.into_iter().map(|(job, (_, entries))| (job, entries)).collect())
}

/// The machine of most entries.
fn usual(pieces: &[Piece]) -> Option<Machine> {
    let mut counts: BTreeMap<&Machine, usize> = BTreeMap::new();
    for piece in pieces {
        for entry in &piece.results.entries {
            *counts.entry(piece.results.machine_of(entry)).or_default() += 1;
        }
    }
    counts.into_iter().max_by_key(|(_, n)| *n).map(|(machine, _)| machine.clone())
}
