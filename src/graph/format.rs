//! One layout for RON files: graphs, variants, scenes and tests.
//!
//! What a person decides stays: which items share a line, empty lines (one at most), comments. The rest follows: four
//! spaces for each bracket that is open, a space after commas and colons, a comma after the last item of a bracket that
//! ends on a line of its own, and lines of at most [`WIDTH`] columns: longer ones are broken at items and between words
//! of texts and comments, and what `about` says is filled. A layout of a layout is itself.

use super::tree::{SyntaxKind, SyntaxNode, comment, parse};
use crate::diag::{Checked, Source, Span};
use std::sync::Arc;

/// Columns of a line, at most; a word that is longer stays whole.
pub const WIDTH: usize = 100;

const STEP: usize = 4;

/// Fields whose texts are names or paths, in which a space is a character like others.
const WHOLE: [&str; 10] = ["name", "shader", "graph", "base", "file", "scene", "from", "to", "entry", "node"];

/// The text of a RON file in the one layout.
///
/// # Errors
/// The fault of syntax that keeps it from being read.
pub fn format(source: &Arc<Source>) -> Checked<String> {
    let root = parse(source)?;
    let text: &str = &source.text;
    let mut out = Printer { text, out: String::new(), column: 0 };
    let head = head(text);
    out.push(head.trim_end());
    if !head.is_empty() {
        out.line(0);
    }
    let before = Gap::of(&text[head.len()..root.span.start]);
    let lines: Vec<(bool, &str)> = before.tail.map(|c| (false, c)).into_iter().chain(before.lines).collect();
    out.comments(&lines, 0, false);
    if !lines.is_empty() {
        out.line(0);
    }
    out.node(&root, 0, 0, Words::Lines);
    let behind = Gap::of(&text[root.span.end..]);
    if let Some(comment) = behind.tail {
        out.push(" ");
        out.comment(comment, 0);
    }
    out.comments(&behind.lines, 0, true);
    out.out.push('\n');
    Ok(out.out)
}

/// The extensions at the head of a file, as written.
fn head(text: &str) -> &str {
    let mut end = 0;
    while let Some(start) = text[end..].trim_start().strip_prefix("#!") {
        let begun = text.len() - start.len();
        end = begun + start.find(']').map_or(start.len(), |i| i + 1);
    }
    &text[..end]
}

/// What stands between two values: white space, commas, colons and comments.
struct Gap<'t> {
    /// A comment on the line of the value before.
    tail: Option<&'t str>,
    /// Comments on lines of their own, each with whether an empty line stands before it.
    lines: Vec<(bool, &'t str)>,
    /// Whether the value behind begins another line.
    broken: bool,
    /// Whether an empty line stands before the value behind.
    blank: bool,
}

impl<'t> Gap<'t> {
    fn of(text: &'t str) -> Gap<'t> {
        let (mut tail, mut lines) = (None, vec![]);
        let (mut newlines, mut broken, mut rest) = (0, false, text);
        while let Some(c) = rest.chars().next() {
            let length = match c {
                '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
                '/' => comment(rest).unwrap_or(rest.len()),
                _ => {
                    newlines += usize::from(c == '\n');
                    broken |= c == '\n';
                    rest = &rest[c.len_utf8()..];
                    continue;
                }
            };
            let comment = rest[..length].trim_end();
            if broken || tail.is_some() {
                lines.push((newlines > 1, comment));
            } else {
                tail = Some(comment);
            }
            newlines = 0;
            rest = &rest[length..];
        }
        Gap { tail, lines, broken, blank: newlines > 1 }
    }

    fn comments(&self) -> impl Iterator<Item = &'t str> {
        self.tail.into_iter().chain(self.lines.iter().map(|l| l.1))
    }

    fn has_comments(&self) -> bool {
        self.tail.is_some() || !self.lines.is_empty()
    }
}

/// What a comment up to the end of its line begins with; nothing for others.
fn mark(comment: &str) -> &str {
    let marks = comment.len() - comment.trim_start_matches(['/', '!']).len();
    if comment.starts_with("//") { &comment[..marks] } else { "" }
}

/// What may be done with the white space of a text.
#[derive(Clone, Copy, PartialEq)]
enum Words {
    /// Nothing: a name or a path.
    Whole,
    /// Its lines stay, and are broken where they are too long.
    Lines,
    /// Lines are filled.
    Prose,
}

/// A value in a bracket, with its name or key.
struct FieldItem<'n> {
    key: Option<&'n Span>,
    value: &'n SyntaxNode,
}

impl FieldItem<'_> {
    fn start(&self) -> usize {
        self.key.map_or(self.value.span.start, |k| k.start)
    }
}

struct Printer<'t> {
    text: &'t str,
    out: String,
    column: usize,
}

impl<'t> Printer<'t> {
    fn push(&mut self, text: &str) {
        self.out.push_str(text);
        self.column += text.chars().count();
    }

    /// Ends a line, without the spaces at its end, and indents the next.
    fn line(&mut self, indent: usize) {
        self.out.truncate(self.out.trim_end_matches(' ').len());
        if !self.out.is_empty() {
            self.out.push('\n');
        }
        self.out.extend(std::iter::repeat_n(' ', indent));
        self.column = indent;
    }

    /// Comments on lines of their own. A paragraph of them in which a line is too long is filled anew. `inside`:
    /// something stands above, so that an empty line may.
    fn comments(&mut self, lines: &[(bool, &str)], indent: usize, inside: bool) {
        let mut at = 0;
        while at < lines.len() {
            let (blank, first) = lines[at];
            let mark = mark(first);
            let same = |(blank, line): &&(bool, &str)| !blank && self::mark(line) == mark && line.len() > mark.len();
            let count = match mark.is_empty() || first.len() == mark.len() {
                true => 1,
                false => 1 + lines[at + 1..].iter().take_while(same).count(),
            };
            let paragraph = &lines[at..at + count];
            if blank && (inside || at > 0) {
                self.out.push('\n');
            }
            if !mark.is_empty() && paragraph.iter().any(|l| indent + l.1.chars().count() > WIDTH) {
                self.line(indent);
                self.filled(mark, paragraph.iter().map(|l| l.1), indent);
            } else {
                for (_, comment) in paragraph {
                    self.line(indent);
                    self.push(comment);
                }
            }
            at += count;
        }
    }

    /// A comment behind a value, on its line as far as it fits there.
    fn comment(&mut self, comment: &str, indent: usize) {
        let mark = mark(comment);
        if mark.is_empty() || self.column + comment.chars().count() <= WIDTH {
            return self.push(comment);
        }
        self.filled(mark, std::iter::once(comment), indent);
    }

    fn filled<'c>(&mut self, mark: &str, comments: impl Iterator<Item = &'c str>, indent: usize) {
        self.push(mark);
        let mut begun = false;
        for word in comments.flat_map(|c| c[mark.len()..].split_whitespace().collect::<Vec<_>>()) {
            if begun && self.column + 1 + word.chars().count() > WIDTH {
                self.line(indent);
                self.push(mark);
            }
            self.push(" ");
            self.push(word);
            begun = true;
        }
    }

    /// A value that begins where the line stands. `reserve`: the columns that must be left behind it.
    fn node(&mut self, node: &SyntaxNode, indent: usize, reserve: usize, kind: Words) {
        match &node.kind {
            SyntaxKind::Word => self.push(node.span.text()),
            SyntaxKind::Text => self.words(node.span.text(), indent, reserve, kind),
            SyntaxKind::List(items) => self.bracket(node, "[", values(items), indent, reserve),
            SyntaxKind::Map(pairs) => {
                let items = pairs.iter().map(|(key, value)| FieldItem { key: Some(&key.span), value }).collect();
                self.bracket(node, "{", items, indent, reserve);
            }
            SyntaxKind::Tuple(name, items) => self.named(node, name.as_ref(), values(items), indent, reserve),
            SyntaxKind::Struct(name, fields) => {
                let items = fields.iter().map(|f| FieldItem { key: Some(&f.name), value: &f.value }).collect();
                self.named(node, name.as_ref(), items, indent, reserve);
            }
        }
    }

    fn named(&mut self, node: &SyntaxNode, name: Option<&Span>, items: Vec<FieldItem>, indent: usize, reserve: usize) {
        if let Some(name) = name {
            self.push(name.text());
        }
        self.bracket(node, "(", items, indent, reserve);
    }

    /// A text in quotes.
    fn words(&mut self, text: &str, indent: usize, reserve: usize, kind: Words) {
        let long = self.column + text.chars().count() + reserve > WIDTH;
        if kind == Words::Whole || !(long || text.contains('\n')) {
            return self.push(text);
        }
        let joined = match kind {
            Words::Prose => text.split_whitespace().collect::<Vec<_>>().join(" "),
            _ => text.into(),
        };
        let mut lines = joined.split('\n').map(str::trim).peekable();
        let mut first = true;
        while let Some(line) = lines.next() {
            if !first {
                self.line(indent + STEP);
            }
            first = false;
            let behind = if lines.peek().is_none() { reserve } else { 0 };
            let mut words = line.split(' ').filter(|w| !w.is_empty()).peekable();
            let mut begun = false;
            while let Some(word) = words.next() {
                let behind = if words.peek().is_none() { behind } else { 0 };
                if begun && self.column + 1 + word.chars().count() + behind > WIDTH {
                    self.line(indent + STEP);
                } else if begun {
                    self.push(" ");
                }
                self.push(word);
                begun = true;
            }
        }
    }

    fn bracket(&mut self, node: &SyntaxNode, open: &str, items: Vec<FieldItem>, indent: usize, reserve: usize) {
        let close = match open {
            "(" => ")",
            "[" => "]",
            _ => "}",
        };
        self.push(open);
        let inside = self.inside(node, open);
        let end = node.span.end - 1;
        let mut gaps = vec![];
        let mut at = inside;
        for item in &items {
            gaps.push(Gap::of(&self.text[at..item.start()]));
            at = item.value.span.end;
        }
        let last = Gap::of(&self.text[at..end]);
        // A name between brackets of a map is set apart from them as a value is.
        let keyed = |i: usize, item: &FieldItem| match item.key {
            Some(key) => {
                Gap::of(&self.text[key.end..item.value.span.start]).has_comments() || (i > 0 && gaps[i].broken)
            }
            None => i > 0 && gaps[i].broken,
        };
        let together = !gaps.iter().any(|g| g.has_comments() || g.broken)
            && !last.has_comments()
            && !items.iter().enumerate().any(|(i, item)| keyed(i, item));
        if together && self.fits(&items, reserve) {
            self.joined(&items, indent, reserve + 1);
            return self.push(close);
        }
        if items.is_empty() && !last.has_comments() {
            return self.push(close);
        }
        self.broken(&items, &gaps, indent + STEP);
        self.rest(&last, indent + STEP);
        self.line(indent);
        self.push(close);
    }

    /// Where what is in a bracket begins.
    fn inside(&self, node: &SyntaxNode, open: &str) -> usize {
        let start = match &node.kind {
            SyntaxKind::Tuple(Some(name), _) | SyntaxKind::Struct(Some(name), _) => name.end,
            _ => node.span.start,
        };
        start + self.text[start..node.span.end].find(open).map_or(0, |i| i + 1)
    }

    /// Whether items stand on one line, of which the last may go on over others.
    fn fits(&self, items: &[FieldItem], reserve: usize) -> bool {
        let mut column = self.column;
        for (i, item) in items.iter().enumerate() {
            let text = item.value.span.text();
            let key = item.key.map_or(0, |k| k.text().chars().count() + 2);
            column += key + if i > 0 { 2 } else { 0 };
            if let (true, Some(first)) = (i + 1 == items.len(), opening(item.value)) {
                return column + first <= WIDTH;
            }
            if text.contains('\n') || text.contains("/*") {
                return false;
            }
            column += flat(item.value);
        }
        column + 1 + reserve <= WIDTH
    }

    fn joined(&mut self, items: &[FieldItem], indent: usize, reserve: usize) {
        for (i, item) in items.iter().enumerate() {
            if i > 0 {
                self.push(", ");
            }
            self.item(item, indent, if i + 1 == items.len() { reserve } else { 1 });
        }
    }

    fn item(&mut self, item: &FieldItem, indent: usize, reserve: usize) {
        if let Some(key) = item.key {
            self.push(key.text());
            self.push(": ");
        }
        let kind = match item.key.map(|k| k.text()) {
            Some("about") => Words::Prose,
            Some(key) if WHOLE.contains(&key) => Words::Whole,
            _ => Words::Lines,
        };
        self.node(item.value, indent, reserve, kind);
    }

    /// Items on lines below their bracket. Those that shared a line do, as long as they fit.
    fn broken(&mut self, items: &[FieldItem], gaps: &[Gap], indent: usize) {
        let mut over_lines = false;
        for (i, (item, gap)) in items.iter().zip(gaps).enumerate() {
            let inner = item.key.map(|k| Gap::of(&self.text[k.end..item.value.span.start]));
            let inner: Vec<&str> = inner.iter().flat_map(|g| g.comments()).collect();
            let width = item.key.map_or(0, |k| k.text().chars().count() + 2) + flat(item.value);
            let shares = i > 0
                && !(gap.broken || gap.has_comments() || over_lines)
                && inner.is_empty()
                && !item.value.span.text().contains('\n')
                && self.column + 1 + width < WIDTH;
            if shares {
                self.push(" ");
            } else {
                if let (Some(comment), true) = (gap.tail, i > 0) {
                    self.push(" ");
                    self.comment(comment, indent);
                }
                let first = if i == 0 { gap.tail.map(|c| (false, c)) } else { None };
                let own = inner.iter().map(|c| (false, *c));
                let lines: Vec<_> = first.into_iter().chain(gap.lines.iter().copied()).chain(own).collect();
                self.comments(&lines, indent, i > 0);
                if gap.blank && (i > 0 || gap.has_comments()) {
                    self.out.push('\n');
                }
                self.line(indent);
            }
            let begun = self.out.len();
            self.item(item, indent, 1);
            over_lines = self.out[begun..].contains('\n');
            self.push(",");
        }
    }

    /// The comments before the end of a bracket.
    fn rest(&mut self, gap: &Gap, indent: usize) {
        if let Some(comment) = gap.tail {
            self.push(" ");
            self.comment(comment, indent);
        }
        self.comments(&gap.lines, indent, true);
    }
}

fn values(nodes: &[SyntaxNode]) -> Vec<FieldItem<'_>> {
    nodes.iter().map(|value| FieldItem { key: None, value }).collect()
}

/// The columns of a value on one line.
fn flat(node: &SyntaxNode) -> usize {
    let list = |widths: &mut dyn Iterator<Item = usize>| {
        let (sum, count) = widths.fold((0, 0usize), |(sum, n), w| (sum + w, n + 1));
        sum + 2 * count.saturating_sub(1) + 2
    };
    let key = |s: &Span| s.text().chars().count() + 2;
    match &node.kind {
        SyntaxKind::Word | SyntaxKind::Text => node.span.text().chars().count(),
        SyntaxKind::List(items) => list(&mut items.iter().map(flat)),
        SyntaxKind::Map(pairs) => list(&mut pairs.iter().map(|(k, v)| key(&k.span) + flat(v))),
        SyntaxKind::Tuple(name, items) => {
            name.as_ref().map_or(0, |n| n.text().chars().count()) + list(&mut items.iter().map(flat))
        }
        SyntaxKind::Struct(name, fields) => {
            let name = name.as_ref().map_or(0, |n| n.text().chars().count());
            name + list(&mut fields.iter().map(|f| key(&f.name) + flat(&f.value)))
        }
    }
}

/// The columns up to the bracket behind which a value is broken in the text; `None` for one on a single line.
fn opening(node: &SyntaxNode) -> Option<usize> {
    let text = node.span.text();
    let first = text.split('\n').next().unwrap_or(text);
    let brackets = !matches!(node.kind, SyntaxKind::Word | SyntaxKind::Text);
    (brackets && first.len() < text.len() && first.trim_end().ends_with(['(', '[', '{']))
        .then(|| first.trim_end().chars().count())
}

#[cfg(test)]
mod tests;
