//! Faults and how they are shown: a place in a text, a reason, a remedy.
//!
//! Every stage that reads what a user wrote returns [`Checked`]: either its value, or all faults it found.

mod show;

pub use show::render;

use crate::files;
use rustc_hash::FxHashMap;
use std::{fmt, ops::Range, path::Path, sync::Arc};

/// A text that faults can point into.
#[derive(Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Source {
    /// The path as shown to the user.
    pub path: String,
    /// The text as it was read.
    pub text: String,
}

impl Source {
    /// A source from a path to show and its text.
    pub fn new(path: impl Into<String>, text: impl Into<String>) -> Arc<Source> {
        Arc::new(Source { path: path.into(), text: text.into() })
    }

    /// Reads a UTF-8 file.
    ///
    /// # Errors
    /// A fault that names the path, when the file can't be read, is no regular file, is too large or isn't UTF-8.
    pub fn read(path: &Path) -> Checked<Arc<Source>> {
        let shown = path.display().to_string();
        match files::read_text(path, files::TEXT) {
            Ok(text) => Ok(Source::new(shown, text)),
            Err(e) => Err(Diagnostic::error(format!("can't read {shown}: {e}")).into()),
        }
    }

    /// One-based line and column (in characters) of a byte offset.
    pub fn line_column(&self, offset: usize) -> (usize, usize) {
        let head = &self.text[..self.floor(offset)];
        let line = head.matches('\n').count() + 1;
        let column = head.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        (line, column)
    }

    fn floor(&self, offset: usize) -> usize {
        let mut at = offset.min(self.text.len());
        while !self.text.is_char_boundary(at) {
            at -= 1;
        }
        at
    }
}

/// A range of bytes in a source.
#[derive(Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// The text it lies in.
    pub source: Arc<Source>,
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

impl Span {
    /// The bytes `range` of `source`.
    pub fn new(source: &Arc<Source>, range: Range<usize>) -> Span {
        Span { source: source.clone(), start: range.start, end: range.end }
    }

    /// The whole of a source.
    pub fn whole(source: &Arc<Source>) -> Span {
        Span::new(source, 0..source.text.len())
    }

    /// The text it covers.
    pub fn text(&self) -> &str {
        self.source.text.get(self.start..self.end).unwrap_or("")
    }
}

impl fmt::Debug for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (line, column) = self.source.line_column(self.start);
        write!(f, "{}:{line}:{column}", self.source.path)
    }
}

/// How much a diagnostic weighs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The work can't be done.
    Error,
    /// The work is done, but probably not as meant.
    Warning,
    /// Something the user should know.
    Note,
}

/// One fault: what, where, and what to do about it.
///
/// ```
/// use lightgraph::{Checked, Diagnostic};
///
/// fn check(name: &str) -> Checked<()> {
///     let known = ["color", "depth"];
///     if known.contains(&name) {
///         return Ok(());
///     }
///     Err(Diagnostic::error(format!("no output `{name}`")).nearest(name, known).into())
/// }
///
/// let faults = check("colour").unwrap_err();
/// assert_eq!(faults.one_line(), "no output `colour`");
/// assert!(faults.to_string().contains("color"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// How much it weighs.
    pub severity: Severity,
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// Places; the first is the main one. The text may be empty.
    pub labels: Vec<(Span, String)>,
    /// Remedies.
    pub help: Vec<String>,
}

impl Diagnostic {
    /// An error without a place yet.
    pub fn error(message: impl Into<String>) -> Diagnostic {
        Diagnostic { severity: Severity::Error, message: message.into(), labels: vec![], help: vec![] }
    }

    /// A warning without a place yet.
    pub fn warning(message: impl Into<String>) -> Diagnostic {
        Diagnostic { severity: Severity::Warning, ..Diagnostic::error(message) }
    }

    /// A note without a place yet.
    pub fn note(message: impl Into<String>) -> Diagnostic {
        Diagnostic { severity: Severity::Note, ..Diagnostic::error(message) }
    }

    /// Adds a place with a word on it (may be empty).
    pub fn at(mut self, span: &Span, label: impl Into<String>) -> Diagnostic {
        self.labels.push((span.clone(), label.into()));
        self
    }

    /// Adds a remedy.
    pub fn help(mut self, help: impl Into<String>) -> Diagnostic {
        self.help.push(help.into());
        self
    }

    /// Adds "did you mean …" when one of `candidates` is near `name`.
    pub fn nearest<'a>(self, name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Diagnostic {
        match nearest(name, candidates) {
            Some(near) => self.help(format!("did you mean `{near}`?")),
            None => self,
        }
    }
}

/// One or more faults.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Faults(pub Vec<Diagnostic>);

/// A value, or every fault that stands in its way.
pub type Checked<T> = Result<T, Faults>;

impl Faults {
    /// `Ok(value)` when `faults` holds no error. What was found in several ways is told once.
    pub fn check<T>(faults: Vec<Diagnostic>, value: T) -> Checked<T> {
        if faults.iter().all(|d| d.severity != Severity::Error) {
            return Ok(value);
        }
        let mut once: Vec<Diagnostic> = vec![];
        let mut alike: FxHashMap<(String, Option<usize>), Vec<usize>> = FxHashMap::default();
        for d in faults {
            let known = alike.entry((d.message.clone(), d.labels.first().map(|l| l.0.start))).or_default();
            if !known.iter().any(|at| once[*at] == d) {
                known.push(once.len());
                once.push(d);
            }
        }
        Err(Faults(once))
    }

    /// The messages alone, where there is room for a line.
    pub fn one_line(&self) -> String {
        self.0.iter().map(|d| d.message.as_str()).collect::<Vec<_>>().join("; ")
    }
}

impl From<Diagnostic> for Faults {
    fn from(d: Diagnostic) -> Faults {
        Faults(vec![d])
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&render(&self.0))
    }
}

impl std::error::Error for Faults {}

/// The candidate with the smallest edit distance, when it is near enough to be a slip of the hand.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = name.chars().count();
    if length > LONGEST_NAME {
        return None;
    }
    let limit = (length / 3).max(1) + 1;
    // The lengths alone rule most of them out.
    let near = |c: &&str| c.len() <= 4 * (length + limit) && c.chars().count().abs_diff(length) <= limit;
    let measured = candidates.into_iter().filter(near).filter_map(|c| Some((distance(name, c, limit)?, c)));
    measured.min_by_key(|(d, _)| *d).map(|(_, c)| c)
}

/// Longer names are no slips of the hand.
const LONGEST_NAME: usize = 100;

/// Characters inserted, left out, replaced, or swapped with their neighbour (optimal string alignment); `None` beyond
/// the limit.
fn distance(a: &str, b: &str, limit: usize) -> Option<usize> {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut before = vec![0; b.len() + 1];
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for i in 0..a.len() {
        let mut next = vec![i + 1; b.len() + 1];
        for j in 0..b.len() {
            let replaced = row[j] + usize::from(a[i] != b[j]);
            next[j + 1] = replaced.min(next[j] + 1).min(row[j + 1] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                next[j + 1] = next[j + 1].min(before[j - 1] + 1);
            }
        }
        before = std::mem::replace(&mut row, next);
        // Both rows: a swap reaches back over one.
        if row.iter().chain(&before).all(|d| *d > limit) {
            return None;
        }
    }
    row.last().copied().filter(|d| *d <= limit)
}

/// What stands for a character that is not shown.
const REPLACED: char = '\u{fffd}';

/// Whether a character may steer a terminal or turn the direction of a text, rather than be seen.
fn steers(c: char) -> bool {
    let directs = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    (c.is_control() && !matches!(c, '\n' | '\t')) || directs
}

/// At most so many characters of a text, without those that would steer a terminal.
pub fn tame(text: &str, most: usize) -> String {
    let cut = text.char_indices().nth(most).map(|(at, _)| at);
    let kept = text[..cut.unwrap_or(text.len())].chars().map(|c| if steers(c) { REPLACED } else { c });
    kept.chain(cut.map(|_| '…')).collect()
}

/// Makes faults of warnings.
pub fn strict(faults: &mut [Diagnostic]) {
    for d in faults.iter_mut().filter(|d| d.severity == Severity::Warning) {
        d.severity = Severity::Error;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_finds_slips_and_ignores_strangers() {
        assert_eq!(nearest("bouncs", ["grid", "bounces"]), Some("bounces"));
        assert_eq!(nearest("mxa", ["min", "max"]), Some("max"));
        assert_eq!(nearest("xyz", ["grid", "bounces"]), None);
    }
}
