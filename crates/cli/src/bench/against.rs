//! Two results: what became slower or less accurate, and what came out again.
//!
//! A time is slower when the repeats don't overlap (the least of the new exceeds the greatest of the old) and the
//! median grew by more than [`SLOWER`]. Phases with fewer than two repeats on either side say nothing. Times are
//! compared on the same machine alone. An error is greater when it grew by more than [`WORSE`] of itself (on another
//! adapter or driver: [`WORSE_ELSEWHERE`]) and by more than [`LEAST`] percent of the mean.

use super::host::Machine;
use super::repeat::{Repeated, repeated};
use super::results::{Entry, Results};
use super::score::Score;
use std::collections::BTreeSet;
use std::fmt;

/// Share by which a median must grow.
pub const SLOWER: f64 = 0.05;
/// Share by which an error must grow: same adapter, same bits, so that only rounding in a changed shader is let pass.
pub const WORSE: f64 = 1e-3;
/// The same on another adapter, whose arithmetic differs.
pub const WORSE_ELSEWHERE: f64 = 1e-2;
/// Growth in percent of the mean below which an error counts as the same: half-float rounding.
pub const LEAST: f64 = 0.01;

/// What a comparison found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Verdict {
    /// A sentence for each thing that became worse.
    pub worse: Vec<String>,
    /// What could not be compared.
    pub notes: Vec<String>,
    /// Entries found in both.
    pub compared: usize,
    /// Which says nothing of better or worse.
    pub repeated: Repeated,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        for worse in &self.worse {
            writeln!(f, "worse: {worse}")?;
        }
        write!(f, "{}", self.repeated)?;
        writeln!(f, "{} entries compared, {} things became worse", self.compared, self.worse.len())
    }
}

/// Compares new results with old ones, entry by entry.
pub fn against(old: &Results, new: &Results) -> Verdict {
    let mut verdict = Verdict { repeated: repeated(old, new), ..Verdict::default() };
    let mut apart = BTreeSet::new();
    for before in old.entries.iter().filter(|e| e.peer.is_none()) {
        let Some(after) = new.entries.iter().find(|e| e.key() == before.key()) else {
            verdict.notes.push(format!("{}: not in the new results", name(before)));
            continue;
        };
        verdict.compared += 1;
        if let (None, Some(fault)) = (&before.fault, &after.fault) {
            verdict.worse.push(format!("{}: fails now: {fault}", name(before)));
        }
        let machines = [old.machine_of(before), new.machine_of(after)];
        match machines {
            [o, n] if o == n => times(before, after, &mut verdict.worse),
            both => _ = apart.insert(both.map(Machine::shown)),
        }
        let share = if machines[0].rounds_as(machines[1]) { WORSE } else { WORSE_ELSEWHERE };
        errors(&name(before), &before.scores, &after.scores, share, &mut verdict.worse);
        for old in &before.phases {
            if let Some(new) = after.phases.iter().find(|p| p.phase == old.phase) {
                let place = format!("{}, {}", name(before), old.phase.word());
                errors(&place, &old.scores, &new.scores, share, &mut verdict.worse);
            }
        }
        if let (Some(o), Some(n)) = (before.leak, after.leak)
            && n > o * (1.0 + share) + 1e-6
        {
            verdict.worse.push(format!("{}: the leak grew from {o:.2e} to {n:.2e}", name(before)));
        }
    }
    let text = |[o, n]: [String; 2]| format!("times are not compared: the old ones are of {o}, the new ones of {n}");
    verdict.notes.splice(0..0, apart.into_iter().map(text));
    verdict
}

/// A setting in a sentence.
pub(super) fn name(e: &Entry) -> String {
    let setting = if e.setting.is_empty() { "own setting" } else { &e.setting };
    format!("{} on {}, {setting}", e.graph, e.scene)
}

fn times(before: &Entry, after: &Entry, worse: &mut Vec<String>) {
    for old in &before.phases {
        let Some(new) = after.phases.iter().find(|p| p.phase == old.phase) else { continue };
        if old.repeats < 2 || new.repeats < 2 {
            continue;
        }
        let (o, n) = (old.wall_ms, new.wall_ms);
        if n.min > o.max && n.median > o.median * (1.0 + SLOWER) {
            let phase = old.phase.word();
            let text = format!(
                "{}, {phase}: {:.2} ms ({:.2} to {:.2}) became {:.2} ms ({:.2} to {:.2})",
                name(before),
                o.median,
                o.min,
                o.max,
                n.median,
                n.min,
                n.max
            );
            worse.push(text);
        }
    }
}

fn errors(place: &str, before: &[Score], after: &[Score], share: f64, worse: &mut Vec<String>) {
    for old in before {
        let same = |s: &&Score| s.output == old.output && s.only_when == old.only_when;
        let Some(new) = after.iter().find(same) else {
            worse.push(format!("{place}: `{}` is no longer compared with {}", old.output, old.origin));
            continue;
        };
        let pairs = [
            ("rmse", old.metrics.rmse_percent, new.metrics.rmse_percent),
            ("rmse of 8 × 8 means", old.metrics.block_rmse_percent, new.metrics.block_rmse_percent),
            ("bias", old.metrics.bias_percent.abs(), new.metrics.bias_percent.abs()),
        ];
        for (what, o, n) in pairs {
            if n > o * (1.0 + share) && n - o > LEAST {
                worse.push(format!("{place}: {what} of `{}` grew from {o:.3} % to {n:.3} %", old.output));
            }
        }
    }
}
