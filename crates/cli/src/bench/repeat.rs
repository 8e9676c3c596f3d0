//! What of an earlier run comes out again: error figures, to the last digit, and which of two settings is the faster
//! one.

use super::against::name;
use super::results::{Entry, Phase, Results};
use super::score::Score;
use std::collections::BTreeMap;
use std::fmt;

/// Two settings count as of different speed when one took this many times as long.
pub const APART: f64 = 1.2;
/// Rows that are named when their errors differ.
const NAMED: usize = 12;

/// How much came out again. Other renderers take no part.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Repeated {
    /// Of the settings in both results: the errors of the first frame, those of each phase that has its own, the leak.
    pub rows: usize,
    /// Of those, the ones with another figure, and the greatest change of one; by decreasing share of itself.
    pub other: Vec<(f64, String)>,
    /// By phase: which setting of two is the faster one.
    pub order: BTreeMap<Phase, Order>,
    /// Of the pairs that changed places, the one that did by the greatest factor.
    pub worst: Option<(f64, String)>,
}

/// Pairs of settings of the same scene whose times were [`APART`] in the old results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Order {
    pub pairs: usize,
    /// Those of which the same one is the faster one in the new results.
    pub kept: usize,
    /// Those of which the other one is, by [`APART`] too.
    pub reversed: usize,
}

impl fmt::Display for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Order { pairs, kept, reversed } = *self;
        let percent = (APART - 1.0) * 100.0;
        // Not rounded up: 100 % are all of them.
        let share = |n: usize| match pairs {
            0 => n.to_string(),
            _ => format!("{n} ({:.2} %)", (1e4 * n as f64 / pairs as f64).floor() / 100.0),
        };
        write!(
            f,
            "of {pairs} pairs of settings more than {percent:.0} % apart, {} are in the same order, ",
            share(kept)
        )?;
        write!(f, "{} in the other by as much", share(reversed))
    }
}

impl Repeated {
    /// Of all phases together.
    pub fn order(&self) -> Order {
        self.order.values().fold(Order::default(), |a, b| Order {
            pairs: a.pairs + b.pairs,
            kept: a.kept + b.kept,
            reversed: a.reversed + b.reversed,
        })
    }
}

impl fmt::Display for Repeated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let equal = self.rows - self.other.len();
        writeln!(f, "errors: {equal} of {} rows are equal to the last digit", self.rows)?;
        for (_, what) in self.other.iter().take(NAMED) {
            writeln!(f, "  not equal: {what}")?;
        }
        if let Some(more @ 1..) = self.other.len().checked_sub(NAMED) {
            writeln!(f, "  and {more} more")?;
        }
        writeln!(f, "times: {}", self.order())?;
        if self.order.len() > 1 {
            self.order.iter().try_for_each(|(phase, order)| writeln!(f, "  {}: {order}", phase.word()))?;
        }
        self.worst.iter().try_for_each(|(_, what)| writeln!(f, "  worst: {what}"))
    }
}

/// Compares what is in both results.
pub fn repeated(old: &Results, new: &Results) -> Repeated {
    let mut found = Repeated::default();
    let both: Vec<(&Entry, &Entry)> = old
        .entries
        .iter()
        .filter(|e| e.peer.is_none())
        .filter_map(|before| Some((before, new.entries.iter().find(|e| e.key() == before.key())?)))
        // What was left out or failed in one run says nothing of the other.
        .filter(|(before, after)| before.fault.is_none() && after.fault.is_none())
        .collect();
    let mut timed: BTreeMap<_, Vec<SettingTimes<'_>>> = BTreeMap::new();
    for (before, after) in both {
        let machines = (old.machine_of(before), new.machine_of(after));
        found.row(&name(before), &before.scores, &after.scores);
        if before.leak.is_some() || after.leak.is_some() {
            found.rows += 1;
            let text = || format!("{}: the leak was {}, is {}", name(before), shown(before.leak), shown(after.leak));
            found.other.extend(change(before.leak, after.leak).map(|share| (share, text())));
        }
        for old in &before.phases {
            let Some(new) = after.phases.iter().find(|t| t.phase == old.phase) else { continue };
            found.row(&format!("{}, {}", name(before), old.phase.word()), &old.scores, &new.scores);
            let place = (&before.scene, &before.camera, before.size, old.phase, machines);
            let ms = [old, new].map(|times| times.quick_ms());
            timed.entry(place).or_default().push(SettingTimes { entry: before, phase: old.phase, ms });
        }
    }
    found.other.sort_by(|a, b| b.0.total_cmp(&a.0));
    for all in timed.values() {
        for (i, a) in all.iter().enumerate() {
            all.iter().skip(i + 1).for_each(|b| found.pair(a, b));
        }
    }
    found
}

/// How quick a setting's frames are in a phase.
struct SettingTimes<'a> {
    entry: &'a Entry,
    phase: Phase,
    /// Before and after.
    ms: [f64; 2],
}

impl Repeated {
    fn row(&mut self, place: &str, before: &[Score], after: &[Score]) {
        if before.is_empty() && after.is_empty() {
            return;
        }
        self.rows += 1;
        let mut most: Option<(f64, String)> = None;
        for old in before {
            let Some(new) = after.iter().find(|s| s.output == old.output && s.only_when == old.only_when) else {
                most = Some((f64::INFINITY, format!("{place}: `{}` is no longer compared", old.output)));
                break;
            };
            for ((what, o), (_, n)) in figures(old).into_iter().zip(figures(new)) {
                if let Some(share) = change(o, n).filter(|s| most.as_ref().is_none_or(|m| *s > m.0)) {
                    let text = format!("{place}: {what} of `{}` was {}, is {}", old.output, shown(o), shown(n));
                    most = Some((share, text));
                }
            }
        }
        if before.len() < after.len() && most.is_none() {
            most = Some((f64::INFINITY, format!("{place}: more is compared than before")));
        }
        self.other.extend(most);
    }

    fn pair(&mut self, a: &SettingTimes<'_>, b: &SettingTimes<'_>) {
        let (fast, slow) = if a.ms[0] <= b.ms[0] { (a, b) } else { (b, a) };
        // Of a time of zero nothing is a multiple.
        if slow.ms[0] <= fast.ms[0] * APART || fast.ms.iter().chain(&slow.ms).any(|ms| *ms <= 0.0) {
            return;
        }
        let order = self.order.entry(fast.phase).or_default();
        order.pairs += 1;
        if fast.ms[1] < slow.ms[1] {
            order.kept += 1;
            return;
        }
        order.reversed += usize::from(fast.ms[1] > slow.ms[1] * APART);
        let factor = (slow.ms[0] / fast.ms[0]) * (fast.ms[1] / slow.ms[1]);
        if self.worst.as_ref().is_none_or(|w| factor > w.0) {
            let took = |t: &SettingTimes<'_>| format!("{} took {:.3} and {:.3} ms", name(t.entry), t.ms[0], t.ms[1]);
            self.worst = Some((factor, format!("{}: {}; {}", fast.phase.word(), took(fast), took(slow))));
        }
    }
}

/// All that a comparison says.
fn figures(s: &Score) -> Vec<(&'static str, Option<f64>)> {
    let m = &s.metrics;
    vec![
        ("mean", Some(m.mean_test)),
        ("rmse", Some(m.rmse_percent)),
        ("bias", Some(m.bias_percent)),
        ("relMSE", Some(m.relmse)),
        ("rmse of 8 × 8 means", Some(m.block_rmse_percent)),
        ("95th percentile", Some(m.p95_error)),
        ("greatest error", Some(m.max_error)),
        ("HDR-FLIP", s.flip),
    ]
}

/// How much of itself a figure changed by; `None` for the same.
fn change(old: Option<f64>, new: Option<f64>) -> Option<f64> {
    match (old, new) {
        (Some(o), Some(n)) => (o != n).then(|| (n - o).abs() / o.abs()),
        (None, None) => None,
        _ => Some(f64::INFINITY),
    }
}

fn shown(figure: Option<f64>) -> String {
    figure.map_or("none".into(), |x| x.to_string())
}
