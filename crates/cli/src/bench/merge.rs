//! Joins the parts of a bench that machines have measured.

use super::host::Machine;
use super::jobs::Part;
use super::journal::JOURNAL;
use super::report;
use super::results::{Entry, Results};
use crate::shard::Shard;
use lightgraph::{Checked, Diagnostic, Faults};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A folder of results, and what part of the whole they are.
struct Piece {
    folder: PathBuf,
    results: Results,
    part: Part,
}

/// Shards that a fault names.
const NAMED: usize = 20;

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
    for piece in pieces.iter().filter(|p| (&p.part.whole, p.part.jobs) != (&first.part.whole, first.part.jobs)) {
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
    let Part { jobs, shard, .. } = first.part;
    let missing = (0..jobs).filter(|job| !found.contains_key(job));
    let lacking: BTreeSet<usize> = missing.map(|job| Shard::owner(job, shard.of).number).collect();
    if !lacking.is_empty() {
        let text = format!("{} of {jobs} jobs are in none of the parts", jobs - found.len());
        let named = lacking.iter().take(NAMED).map(|number| Shard { number: *number, ..shard }.to_string());
        let mut list = named.collect::<Vec<_>>().join(", ");
        if let Some(more @ 1..) = lacking.len().checked_sub(NAMED) {
            list += &format!(" and {more} more");
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::jobs::Done;

    fn said(parts: &[Part]) -> String {
        let machine = Machine {
            adapter: String::new(),
            driver: String::new(),
            backend: String::new(),
            software: true,
            cpu: String::new(),
            cores: 1,
            os: String::new(),
        };
        let results = Results {
            version: String::new(),
            commit: None,
            machine,
            repeat: 1,
            size: [8, 8],
            main_output: None,
            published: vec![],
            entries: vec![],
            absent: vec![],
            part: None,
        };
        let piece = |part: &Part| Piece { folder: "part".into(), results: results.clone(), part: part.clone() };
        complete(&parts.iter().map(piece).collect::<Vec<_>>()).unwrap_err().to_string()
    }

    #[test]
    fn missing_jobs_are_counted_and_some_of_their_shards_named() {
        let done = vec![Done { job: 2, entries: 0 }];
        let part = Part { jobs: 1_000_000, done, ..Part::new(Shard { number: 3, of: 10_000 }, &[], &[]) };
        let text = said(std::slice::from_ref(&part));
        assert!(text.contains("999999 of 1000000 jobs are in none of the parts"), "{text}");
        assert!(text.contains("`--shard` 1/10000, 2/10000, 3/10000, ") && text.contains(", 20/10000 and 9980 more"));
        let other = said(&[Part { jobs: 3, done: vec![], ..part.clone() }, part]);
        assert!(other.contains("parts of different benches"), "{other}");
    }
}
