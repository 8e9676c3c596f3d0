//! Faults and how they are shown: a place in a text, a reason, a remedy.
//!
//! Every stage that reads what a user wrote returns [`Checked`]: either its value, or all faults it found.

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
    /// A fault that names the path, when the file can't be read or isn't UTF-8.
    pub fn read(path: &Path) -> Checked<Arc<Source>> {
        let shown = path.display().to_string();
        match std::fs::read_to_string(path) {
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
        for d in faults {
            if !once.contains(&d) {
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
    let limit = (name.chars().count() / 3).max(1) + 1;
    candidates
        .into_iter()
        .map(|c| (distance(name, c), c))
        .filter(|(d, _)| *d <= limit)
        .min_by_key(|(d, _)| *d)
        .map(|(_, c)| c)
}

/// Characters inserted, left out, replaced, or swapped with their neighbour (optimal string alignment).
fn distance(a: &str, b: &str) -> usize {
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
    }
    row[b.len()]
}

/// The diagnostics as plain text with carets, ready for a terminal or a log.
pub fn render(diagnostics: &[Diagnostic]) -> String {
    use codespan_reporting::{diagnostic as cs, files::SimpleFiles, term};
    let mut files = SimpleFiles::new();
    let mut known: Vec<(Arc<Source>, usize)> = vec![];
    let mut out = String::new();
    for d in diagnostics {
        let severity = match d.severity {
            Severity::Error => cs::Severity::Error,
            Severity::Warning => cs::Severity::Warning,
            Severity::Note => cs::Severity::Note,
        };
        let mut labels = vec![];
        for (i, (span, text)) in d.labels.iter().enumerate() {
            let id = match known.iter().find(|(s, _)| *s == span.source) {
                Some((_, id)) => *id,
                None => {
                    let id = files.add(span.source.path.clone(), span.source.text.clone());
                    known.push((span.source.clone(), id));
                    id
                }
            };
            let style = if i == 0 { cs::LabelStyle::Primary } else { cs::LabelStyle::Secondary };
            let start = span.source.floor(span.start);
            let end = span.source.floor(span.end).max(start);
            labels.push(cs::Label::new(style, id, start..end).with_message(text));
        }
        let shown = cs::Diagnostic::new(severity)
            .with_message(&d.message)
            .with_labels(labels)
            .with_notes(d.help.iter().map(|h| format!("help: {h}")).collect());
        if term::emit_to_string(&mut out, &term::Config::default(), &files, &shown).is_err() {
            out.push_str(&d.message);
            out.push('\n');
        }
    }
    out
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

    #[test]
    fn rendered_faults_name_line_and_column() {
        let s = Source::new("a.ron", "one\ntwo three\n");
        let d = Diagnostic::error("unknown name `three`").at(&Span::new(&s, 8..13), "").help("remove it");
        let text = render(&[d]);
        assert!(text.contains("a.ron:2:5"), "{text}");
        assert!(text.contains("^^^^^"), "{text}");
        assert!(text.contains("help: remove it"), "{text}");
    }
}
