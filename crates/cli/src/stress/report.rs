//! What was found: rows, as a table, as JSON and as one page.

use lightgraph::internals::files;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Checked, Diagnostic};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::path::Path;

const STYLE: &str = include_str!("report.css");

/// Everything of a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StressReport {
    pub version: String,
    /// Name and driver.
    pub adapter: String,
    /// The adapter is a CPU.
    pub software: bool,
    pub seed: u64,
    pub seconds: f64,
    pub rows: Vec<CaseRow>,
}

/// One run of a case on a graph.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CaseRow {
    /// `case`, `random`, `fly-through` or `adapter`.
    pub part: String,
    pub case: String,
    /// What is known of the right answer.
    pub about: String,
    pub graph: String,
    /// What was varied.
    pub setting: String,
    pub expected: Option<f64>,
    pub got: Option<f64>,
    /// As the case defines it; mostly relative.
    pub error: Option<f64>,
    pub bound: Option<f64>,
    pub state: RowState,
    pub notice: String,
    pub seconds: f64,
}

/// Rows of a run under way.
pub(super) struct CaseRows<'t> {
    pub all: Vec<CaseRow>,
    /// Hears of each when it is known.
    told: &'t mut dyn FnMut(&CaseRow),
}

impl<'t> CaseRows<'t> {
    pub fn new(told: &'t mut dyn FnMut(&CaseRow)) -> CaseRows<'t> {
        CaseRows { all: vec![], told }
    }

    pub fn tell(&mut self, rows: &[CaseRow]) {
        rows.iter().for_each(&mut *self.told);
    }

    /// Tells them as well.
    pub fn keep(&mut self, rows: Vec<CaseRow>) {
        self.tell(&rows);
        self.all.extend(rows);
    }
}

/// The runs that have their turn: all of them, or those that others had left no time for.
#[derive(Debug, Clone, Copy)]
pub(super) enum RunSelection<'a> {
    All,
    Left(&'a [CaseRow]),
}

impl RunSelection<'_> {
    pub fn has(self, run: &CaseRow) -> bool {
        match self {
            RunSelection::All => true,
            RunSelection::Left(rows) => rows.iter().any(|row| row.state == RowState::Left && row.is_of(run)),
        }
    }
}

/// Puts rows in the places of those that were left out.
pub(super) fn caught_up(rows: &mut [CaseRow], more: Vec<CaseRow>) {
    for new in more {
        if let Some(row) = rows.iter_mut().find(|row| row.state == RowState::Left && row.is_of(&new)) {
            *row = new;
        }
    }
}

/// How a row ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RowState {
    Passed,
    Failed,
    /// What it needs is not on this machine.
    Absent,
    /// Time ran out before it.
    Left,
}

impl RowState {
    /// As tables show it.
    pub fn word(self) -> &'static str {
        match self {
            RowState::Passed => "pass",
            RowState::Failed => "FAIL",
            RowState::Absent => "absent",
            RowState::Left => "left out",
        }
    }
}

impl CaseRow {
    pub(super) fn new(part: &str, case: &str, graph: &str, setting: &str) -> CaseRow {
        CaseRow {
            part: part.into(),
            case: case.into(),
            about: String::new(),
            graph: graph.into(),
            setting: setting.into(),
            expected: None,
            got: None,
            error: None,
            bound: None,
            state: RowState::Passed,
            notice: String::new(),
            seconds: 0.0,
        }
    }

    /// Adds words.
    pub(super) fn note(&mut self, text: &str) {
        if !self.notice.is_empty() {
            self.notice.push_str("; ");
        }
        self.notice.push_str(text);
    }

    /// Left out for lack of time.
    pub(super) fn left(self) -> CaseRow {
        CaseRow { state: RowState::Left, notice: "no time was left".into(), ..self }
    }

    /// Whether it is of the same run.
    pub(super) fn is_of(&self, other: &CaseRow) -> bool {
        fn key(row: &CaseRow) -> [&str; 4] {
            [&row.part, &row.case, &row.graph, &row.setting]
        }
        key(self) == key(other)
    }

    pub(super) fn fail(&mut self, why: &str) {
        self.state = RowState::Failed;
        self.note(why);
    }

    /// Passes when the error is no larger than the bound.
    pub(super) fn judge(&mut self, expected: Option<f64>, got: Option<f64>, error: f64, bound: f64) {
        (self.expected, self.got, self.error, self.bound) = (expected, got, Some(error), Some(bound));
        if error.is_nan() || error > bound {
            self.state = RowState::Failed;
        }
    }

    /// Passes when a text holds these words.
    pub(super) fn judge_text(&mut self, words: &str, text: &str) {
        match text.contains(words) {
            true => self.note(text),
            false => self.fail(&format!("it does not say \"{words}\", but \"{text}\"")),
        }
    }
}

impl StressReport {
    /// Reads the `results.json` of a folder.
    ///
    /// # Errors
    /// A file that can't be read or holds something else.
    pub(super) fn read(folder: &Path) -> Checked<StressReport> {
        let path = folder.join("results.json");
        let fault = |why: String| Diagnostic::error(format!("can't read {}: {why}", path.display()));
        let text = files::read_text(&path, files::TABLE).map_err(|e| fault(e.to_string()))?;
        Ok(serde_json::from_str(&text).map_err(|e| fault(e.to_string()))?)
    }

    /// How many rows are in a state.
    pub fn count(&self, state: RowState) -> usize {
        self.rows.iter().filter(|r| r.state == state).count()
    }

    /// The table: rows that differ in their setting only stand in one line, the worst first to be seen.
    pub fn table(&self) -> String {
        let mut out = String::new();
        let cell = |x: Option<f64>| x.map_or("-".to_string(), short);
        let line = |out: &mut String, w: [&str; 9]| {
            let [case, graph, setting, expected, got, error, bound, state, notice] = w;
            // Writing to a string can't fail.
            let _ = writeln!(
                out,
                "{case:<22} {graph:<18} {setting:<26} {expected:>10} {got:>10} {error:>9} {bound:>9} {state:<8} {notice}"
            );
        };
        line(&mut out, ["case", "graph", "worst setting", "expected", "got", "error", "bound", "", "notice"]);
        for (worst, count) in self.worst() {
            let cells = [worst.expected, worst.got, worst.error, worst.bound].map(cell);
            let setting = if count > 1 { format!("{} (of {count})", worst.setting) } else { worst.setting.clone() };
            let [expected, got, error, bound] = &cells;
            let state = worst.state.word();
            line(&mut out, [&worst.case, &worst.graph, &setting, expected, got, error, bound, state, &worst.notice]);
        }
        let _ = writeln!(
            out,
            "{} passed, {} failed, {} absent, {} left out for lack of time; {:.0} s on {}",
            self.count(RowState::Passed),
            self.count(RowState::Failed),
            self.count(RowState::Absent),
            self.count(RowState::Left),
            self.seconds,
            self.adapter
        );
        out
    }

    /// Of each case and graph the row that is nearest to failing, or has, and how many there are.
    fn worst(&self) -> Vec<(&CaseRow, usize)> {
        let mut groups: Vec<(&CaseRow, usize)> = vec![];
        let rank = |r: &CaseRow| {
            let state = match r.state {
                RowState::Passed => 0,
                RowState::Absent | RowState::Left => 1,
                RowState::Failed => 2,
            };
            let near = r.error.zip(r.bound).map_or(0.0, |(e, b)| if e == 0.0 { 0.0 } else { e / b });
            (state, near)
        };
        for row in &self.rows {
            match groups.iter_mut().find(|(g, _)| (&g.part, &g.case, &g.graph) == (&row.part, &row.case, &row.graph)) {
                Some((worst, count)) => {
                    *count += 1;
                    if rank(row).partial_cmp(&rank(worst)) == Some(std::cmp::Ordering::Greater) {
                        *worst = row;
                    }
                }
                None => groups.push((row, 1)),
            }
        }
        groups
    }

    /// Writes results.json and report.html.
    ///
    /// # Errors
    /// Files that can't be written.
    pub fn write(&self, folder: &Path) -> Checked<()> {
        let json = serde_json::to_string_pretty(self)
            .map_err(|e| Diagnostic::error(format!("can't write the results: {e}")))?;
        write_atomically(&folder.join("results.json"), json.as_bytes())?;
        write_atomically(&folder.join("report.html"), self.html().as_bytes())
    }

    /// One page without outside files.
    fn html(&self) -> String {
        let (failed, passed) = (self.count(RowState::Failed), self.count(RowState::Passed));
        let mut out = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>stress: {failed} failed, {passed} \
             passed</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{failed} failed, {passed} passed, {} absent, {} \
             left out</h1>\n<p>lightgraph {}, {}{}, seed {}, {:.0} s</p>\n",
            self.count(RowState::Absent),
            self.count(RowState::Left),
            escaped(&self.version),
            escaped(&self.adapter),
            if self.software { " (a software driver)" } else { "" },
            self.seed,
            self.seconds
        );
        out.push_str("<h2>The worst of each case and graph</h2>\n");
        table(&mut out, self.worst().into_iter().map(|w| w.0));
        out.push_str("<h2>All</h2>\n");
        table(&mut out, self.rows.iter());
        out.push_str("</body>\n</html>\n");
        out
    }
}

fn table<'r>(out: &mut String, rows: impl Iterator<Item = &'r CaseRow>) {
    let head = ["case", "graph", "setting", "expected", "got", "error", "bound", "verdict", "notice", "seconds"];
    let head: String = head.iter().map(|h| format!("<th>{h}</th>")).collect();
    let _ = writeln!(out, "<table>\n<tr>{head}</tr>");
    for r in rows {
        let number = |x: Option<f64>| format!("<td class=\"number\">{}</td>", x.map_or(String::new(), short));
        let class = match r.state {
            RowState::Passed => "passed",
            RowState::Failed => "failed",
            RowState::Absent | RowState::Left => "absent",
        };
        let _ = writeln!(
            out,
            "<tr class=\"{class}\"><td title=\"{}\">{}</td><td>{}</td><td>{}</td>{}{}{}{}<td>{}</td><td>{}</td><td class=\"number\">{:.2}</td></tr>",
            escaped(&r.about),
            escaped(&r.case),
            escaped(&r.graph),
            escaped(&r.setting),
            number(r.expected),
            number(r.got),
            number(r.error),
            number(r.bound),
            r.state.word(),
            escaped(&r.notice),
            r.seconds
        );
    }
    out.push_str("</table>\n");
}

/// Few digits.
fn short(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 || (1e-2..1e5).contains(&size) { format!("{x:.5}") } else { format!("{x:.2e}") }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_were_left_out_are_caught_up_with_in_their_places() {
        let row = |setting: &str| CaseRow::new("case", "sizes", "a graph", setting);
        let mut rows = vec![row("n=1"), row("n=2").left(), row("n=3").left()];
        let wanted = RunSelection::Left(&rows);
        let runs = ["n=1", "n=2", "n=3"].map(|setting| wanted.has(&row(setting)));
        assert_eq!(runs, [false, true, true]);
        assert!(RunSelection::All.has(&row("n=1")) && !wanted.has(&CaseRow::new("random", "sizes", "a graph", "n=2")));
        let mut again = row("n=3");
        again.fail("too dark");
        caught_up(&mut rows, vec![again, row("n=2").left()]);
        let states: Vec<_> = rows.iter().map(|r| (r.setting.as_str(), r.state)).collect();
        assert_eq!(states, [("n=1", RowState::Passed), ("n=2", RowState::Left), ("n=3", RowState::Failed)]);
    }
}
