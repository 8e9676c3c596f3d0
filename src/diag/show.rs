//! Diagnostics as text, of bounded length whatever the files hold.

use super::{Diagnostic, Severity, Source, Span, tame};
use codespan_reporting::{diagnostic as cs, files, term};
use std::{collections::BTreeSet, ops::Range, sync::Arc};

/// Diagnostics shown at most; the others are counted.
const MOST_SHOWN: usize = 50;

/// Places of one diagnostic shown at most.
const MOST_LABELS: usize = 8;

/// Remedies of one diagnostic shown at most.
const MOST_HELP: usize = 8;

/// Characters of a line shown at most: those round its first place.
const LINE: usize = 200;

/// How many of them stand before the place.
const BEFORE: usize = 60;

/// Characters of a message, label or remedy shown at most.
const MESSAGE: usize = 1000;

/// The diagnostics as plain text with carets, ready for a terminal or a log. Of many, the first are shown and the
/// others counted; long lines are cut round the caret; characters that steer a terminal are replaced.
pub fn render(diagnostics: &[Diagnostic]) -> String {
    let mut out = String::new();
    let mut lines: Vec<Lines> = vec![];
    for d in diagnostics.iter().take(MOST_SHOWN) {
        show(d, &mut lines, &mut out);
    }
    let more = diagnostics.len().saturating_sub(MOST_SHOWN);
    if more > 0 {
        out.push_str(&format!("note: {more} more are not shown\n\n"));
    }
    out
}

fn show(d: &Diagnostic, lines: &mut Vec<Lines>, out: &mut String) {
    let severity = match d.severity {
        Severity::Error => cs::Severity::Error,
        Severity::Warning => cs::Severity::Warning,
        Severity::Note => cs::Severity::Note,
    };
    let shown = &d.labels[..d.labels.len().min(MOST_LABELS)];
    let mut excerpts = Excerpts(vec![]);
    for (span, _) in shown {
        if !excerpts.0.iter().any(|e| same(&e.source, &span.source)) {
            let known = lines.iter().position(|l| same(&l.source, &span.source)).unwrap_or_else(|| {
                lines.push(Lines::new(&span.source));
                lines.len() - 1
            });
            let spans: Vec<&Span> = shown.iter().map(|l| &l.0).filter(|s| same(&s.source, &span.source)).collect();
            excerpts.0.push(Excerpt::new(&lines[known], &spans));
        }
    }
    let labels = shown.iter().enumerate().filter_map(|(i, (span, text))| {
        let id = excerpts.0.iter().position(|e| same(&e.source, &span.source))?;
        let style = if i == 0 { cs::LabelStyle::Primary } else { cs::LabelStyle::Secondary };
        let start = excerpts.0[id].shown(span.start);
        let range = start..excerpts.0[id].shown(span.end).max(start);
        Some(cs::Label::new(style, id, range).with_message(tame(text, MESSAGE)))
    });
    let help = d.help.iter().take(MOST_HELP).map(|h| format!("help: {}", tame(h, MESSAGE)));
    let diagnostic = cs::Diagnostic::new(severity)
        .with_message(tame(&d.message, MESSAGE))
        .with_labels(labels.collect())
        .with_notes(help.collect());
    if term::emit_to_string(out, &term::Config::default(), &excerpts, &diagnostic).is_err() {
        out.push_str(&tame(&d.message, MESSAGE));
        out.push('\n');
    }
}

/// Texts are read once and shared: comparing them would cost their length for each place.
fn same(a: &Arc<Source>, b: &Arc<Source>) -> bool {
    Arc::ptr_eq(a, b)
}

/// Where the lines of a text start.
struct Lines {
    source: Arc<Source>,
    starts: Vec<usize>,
}

impl Lines {
    fn new(source: &Arc<Source>) -> Lines {
        Lines { source: source.clone(), starts: files::line_starts(&source.text).collect() }
    }

    /// The index of the line that holds a byte.
    fn of(&self, at: usize) -> usize {
        self.starts.partition_point(|start| *start <= at).saturating_sub(1)
    }

    fn range(&self, line: usize) -> Range<usize> {
        let end = self.starts.get(line + 1).copied().unwrap_or(self.source.text.len());
        self.starts.get(line).copied().unwrap_or(end)..end
    }
}

/// The lines of a text that a diagnostic shows.
struct Excerpt {
    source: Arc<Source>,
    /// All shown lines, one after the other, each with its end.
    text: String,
    lines: Vec<Shown>,
}

/// One line of an excerpt.
struct Shown {
    /// Its index in the source.
    index: usize,
    /// Bytes of the excerpt.
    range: Range<usize>,
    /// Bytes of the source.
    of: Range<usize>,
    /// Where each character that is shown stands in the source and in the excerpt, in order.
    places: Vec<(usize, usize)>,
}

impl Excerpt {
    /// The lines with these places, and those near them that may be shown too.
    fn new(lines: &Lines, spans: &[&Span]) -> Excerpt {
        let source = &lines.source;
        let mut wanted = BTreeSet::new();
        for span in spans {
            let (first, last) = (lines.of(span.start), lines.of(span.end.max(span.start)));
            wanted.extend(first.saturating_sub(1)..=first + 4);
            wanted.extend(last.saturating_sub(2)..=last + 1);
        }
        let mut excerpt = Excerpt { source: source.clone(), text: String::new(), lines: vec![] };
        for index in wanted.into_iter().filter(|index| *index < lines.starts.len()) {
            let of = lines.range(index);
            let focus = spans.iter().map(|s| source.floor(s.start)).find(|at| of.contains(at)).unwrap_or(of.start);
            excerpt.add(index, of, focus);
        }
        excerpt
    }

    fn add(&mut self, index: usize, of: Range<usize>, focus: usize) {
        let start = self.text.len();
        let line = self.source.text.get(of.clone()).unwrap_or("").trim_end_matches(['\n', '\r']);
        let before = line.get(..focus - of.start).unwrap_or(line);
        // A line that fits is shown whole.
        let fits = line.char_indices().nth(LINE).is_none();
        let from = if fits { 0 } else { before.char_indices().rev().nth(BEFORE - 1).map_or(0, |(at, _)| at) };
        let to = line[from..].char_indices().nth(LINE).map_or(line.len(), |(at, _)| from + at);
        let mut places = vec![];
        if from > 0 {
            self.text.push('…');
        }
        for (at, c) in line[from..to].char_indices() {
            places.push((of.start + from + at, self.text.len()));
            self.text.push(if super::steers(c) { super::REPLACED } else { c });
        }
        places.push((of.start + to, self.text.len()));
        if to < line.len() {
            self.text.push('…');
        }
        self.text.push('\n');
        self.lines.push(Shown { index, range: start..self.text.len(), of, places });
    }

    /// Where a byte of the source is shown.
    fn shown(&self, at: usize) -> usize {
        let line = self.lines.partition_point(|l| l.of.end <= at).min(self.lines.len().saturating_sub(1));
        let Some(places) = self.lines.get(line).map(|l| &l.places) else { return 0 };
        let at = self.source.floor(at);
        let place = places.partition_point(|(of, _)| *of < at).min(places.len().saturating_sub(1));
        places.get(place).map_or(0, |(_, shown)| *shown)
    }

    fn line(&self, index: usize) -> Option<&Shown> {
        self.lines.binary_search_by_key(&index, |l| l.index).ok().and_then(|at| self.lines.get(at))
    }
}

struct Excerpts(Vec<Excerpt>);

impl Excerpts {
    fn get(&self, id: usize) -> Result<&Excerpt, files::Error> {
        self.0.get(id).ok_or(files::Error::FileMissing)
    }
}

impl<'a> files::Files<'a> for Excerpts {
    type FileId = usize;
    type Name = String;
    type Source = &'a str;

    fn name(&'a self, id: usize) -> Result<String, files::Error> {
        Ok(tame(&self.get(id)?.source.path, MESSAGE))
    }

    fn source(&'a self, id: usize) -> Result<&'a str, files::Error> {
        Ok(&self.get(id)?.text)
    }

    fn line_index(&'a self, id: usize, byte: usize) -> Result<usize, files::Error> {
        let lines = &self.get(id)?.lines;
        let at = lines.partition_point(|l| l.range.end <= byte).min(lines.len().saturating_sub(1));
        Ok(lines.get(at).map_or(0, |l| l.index))
    }

    fn line_range(&'a self, id: usize, index: usize) -> Result<Range<usize>, files::Error> {
        // Between the places of one diagnostic there may be lines that are not shown.
        Ok(self.get(id)?.line(index).map_or(0..0, |l| l.range.clone()))
    }

    fn column_number(&'a self, id: usize, index: usize, byte: usize) -> Result<usize, files::Error> {
        let excerpt = self.get(id)?;
        let column = excerpt.line(index).and_then(|line| {
            let place = line.places.partition_point(|(_, shown)| *shown < byte);
            let (of, _) = line.places.get(place).or(line.places.last())?;
            Some(excerpt.source.text.get(line.of.start..*of)?.chars().count())
        });
        Ok(column.unwrap_or(0) + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(source: &Arc<Source>, range: Range<usize>) -> Diagnostic {
        Diagnostic::error("unknown name").at(&Span::new(source, range), "here")
    }

    #[test]
    fn rendered_faults_name_line_and_column() {
        let s = Source::new("a.ron", "one\ntwo three\n");
        let d = at(&s, 8..13).help("remove it");
        let text = render(&[d]);
        assert!(text.contains("a.ron:2:5"), "{text}");
        assert!(text.contains("2 │ two three\n  │     ^^^^^ here"), "{text}");
        assert!(text.contains("help: remove it"), "{text}");
    }

    #[test]
    fn long_lines_are_cut_round_the_caret() {
        let s = Source::new("a.ron", format!("first\n{} three {}\nlast", "é".repeat(50_000), "x".repeat(50_000)));
        let start = 6 + 100_000 + 1;
        let text = render(&[at(&s, start..start + 5)]);
        assert!(text.contains("a.ron:2:50002"), "{text}");
        assert!(text.contains("é three x") && text.contains("^^^^^ here"), "{text}");
        assert!(text.len() < 2000, "{} bytes", text.len());
        let caret = text.lines().find(|l| l.contains("^^^^^")).unwrap().find('^').unwrap();
        let line = text.lines().find(|l| l.contains(" three ")).unwrap();
        assert_eq!(
            line.chars().position(|c| c == 't'),
            Some(text[..].lines().find(|l| l.contains('^')).unwrap()[..caret].chars().count())
        );
    }

    #[test]
    fn a_place_over_many_lines_shows_its_ends() {
        let s = Source::new("a.ron", (0..1000).map(|i| format!("line {i}\n")).collect::<String>());
        let text = render(&[Diagnostic::error("all of it").at(&Span::whole(&s), "here")]);
        assert!(text.contains("line 0\n") && text.contains("line 999\n") && !text.contains("line 500"), "{text}");
    }

    #[test]
    fn thousands_of_faults_on_one_line_are_a_page() {
        let words: String = (0..50_000).map(|i| format!("name{i} ")).collect();
        let s = Source::new("a.ron", words);
        let all: Vec<Diagnostic> = (0..50_000).map(|i| at(&s, i * 5..i * 5 + 4)).collect();
        let text = render(&all);
        assert!(text.len() < 60_000, "{} bytes", text.len());
        assert!(text.contains("49950 more are not shown"), "{}", &text[text.len() - 80..]);
    }

    #[test]
    fn what_steers_a_terminal_is_replaced() {
        let s = Source::new("\x1b]0;a\x07.ron", "ab\x1b[2Jcd \u{202e}e\n");
        let d = Diagnostic::error("a name\x1b[31m \u{2066}").at(&Span::new(&s, 6..8), "\x07").help("\u{9b}1m");
        let text = render(&[d]);
        assert!(!text.chars().any(super::super::steers), "{text:?}");
        assert!(text.contains("ab\u{fffd}[2Jcd \u{fffd}e"), "{text}");
        assert!(text.contains(":1:7"), "{text}");
    }
}
