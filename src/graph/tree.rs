//! RON text to a tree in which every value keeps its place.
//!
//! The text is read once, from its first byte to its last. Where it can't be read, the `ron` crate says what is wrong
//! with it. Bare words are taken as they stand: whoever reads a word says whether it is a number, a name or neither.

use crate::diag::{Checked, Diagnostic, Source, Span};
use ron::value::RawValue;
use std::sync::Arc;

/// A value and where it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct SyntaxNode {
    pub span: Span,
    pub kind: SyntaxKind,
}

/// The shapes a value can have.
#[derive(Debug, Clone, PartialEq)]
pub enum SyntaxKind {
    /// A quoted string without escapes; the span includes the quotes.
    Text,
    /// A number, `true`, `false` or a bare name, as written.
    Word,
    /// `[a, b]`
    List(Vec<SyntaxNode>),
    /// `{k: v}`
    Map(Vec<(SyntaxNode, SyntaxNode)>),
    /// `(a, b)` or `Name(a, b)`
    Tuple(Option<Span>, Vec<SyntaxNode>),
    /// `(a: 1)` or `Name(a: 1)`
    Struct(Option<Span>, Vec<Field>),
}

/// A named field of a struct.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub name: Span,
    pub value: SyntaxNode,
}

impl SyntaxNode {
    /// The bare word, if it is one.
    pub fn word(&self) -> Option<&str> {
        matches!(self.kind, SyntaxKind::Word).then(|| self.span.text())
    }

    /// The place of a string's content, without its quotes, if it is one.
    pub fn quoted(&self) -> Option<Span> {
        let Span { source, start, end } = &self.span;
        matches!(self.kind, SyntaxKind::Text).then(|| Span::new(source, start + 1..end - 1))
    }
}

/// Values in values in values are enough; more is a slip, and a few more than these one for `ron` too.
const DEEPEST: usize = 60;

/// Parses a whole RON file.
///
/// # Errors
/// The first fault of syntax (the rest of the file can't be trusted after it), or strings with escapes.
pub fn parse(source: &Arc<Source>) -> Checked<SyntaxNode> {
    let tree = TextCursor { source, text: &source.text, at: 0, depth: 0 };
    tree.file().map_err(|fault| {
        let said: Result<&RawValue, _> = ron::from_str(&source.text);
        said.err().map_or(fault, |e| syntax_fault(source, &e)).into()
    })
}

fn syntax_fault(source: &Arc<Source>, e: &ron::error::SpannedError) -> Diagnostic {
    let start = offset(&source.text, e.span.start.line, e.span.start.col);
    let end = offset(&source.text, e.span.end.line, e.span.end.col);
    Diagnostic::error(format!("RON syntax: {}", e.code)).at(&Span::new(source, start..end.max(start)), "here")
}

fn offset(text: &str, line: usize, column: usize) -> usize {
    let mut at = 0;
    for (i, l) in text.split_inclusive('\n').enumerate() {
        if i + 1 == line {
            return at + l.char_indices().nth(column.saturating_sub(1)).map_or(l.len(), |(b, _)| b);
        }
        at += l.len();
    }
    text.len()
}

/// A place in a text.
struct TextCursor<'s> {
    source: &'s Arc<Source>,
    text: &'s str,
    at: usize,
    /// Brackets around it.
    depth: usize,
}

impl<'s> TextCursor<'s> {
    /// The one value of a file, with what may stand around it.
    fn file(mut self) -> Result<SyntaxNode, Diagnostic> {
        if self.next() == Some(b'#') {
            // Extensions that the file asks for: `ron` knows them, and none is of use here.
            let said: Result<&RawValue, _> = ron::from_str(self.text);
            said.map_err(|e| syntax_fault(self.source, &e))?;
            while self.next() == Some(b'#') {
                self.at += self.rest().find(']').map_or(self.rest().len(), |end| end + 1);
            }
        }
        let node = self.node()?;
        match self.next() {
            None if self.at == self.text.len() => Ok(node),
            _ => Err(self.fault(self.at, "RON syntax: nothing may stand behind the value")),
        }
    }

    fn rest(&self) -> &'s str {
        self.text.get(self.at..).unwrap_or("")
    }

    /// Goes over white space and comments; the byte that follows, none at the end or in a comment that has none.
    fn next(&mut self) -> Option<u8> {
        let bytes = self.text.as_bytes();
        loop {
            match *bytes.get(self.at)? {
                b' ' | b'\t'..=b'\r' => self.at += 1,
                b'/' => match bytes.get(self.at + 1) {
                    Some(b'/') => self.at += self.rest().find('\n').unwrap_or(self.rest().len()),
                    Some(b'*') => self.at += comment(self.rest())?,
                    _ => return Some(b'/'),
                },
                other if other.is_ascii() => return Some(other),
                other => match self.rest().chars().next() {
                    Some(c) if MARKS_OF_SPACE.contains(&c) => self.at += c.len_utf8(),
                    _ => return Some(other),
                },
            }
        }
    }

    fn accept(&mut self, mark: u8) -> bool {
        let found = self.next() == Some(mark);
        self.at += usize::from(found);
        found
    }

    fn span(&self, start: usize) -> Span {
        Span::new(self.source, start..self.at)
    }

    fn fault(&self, start: usize, message: &str) -> Diagnostic {
        Diagnostic::error(message).at(&self.span(start), "")
    }

    fn node(&mut self) -> Result<SyntaxNode, Diagnostic> {
        let next = self.next();
        let start = self.at;
        let kind = match next {
            Some(b'"') => self.string().map(|()| SyntaxKind::Text)?,
            Some(b'[') => SyntaxKind::List(self.items(b']', TextCursor::node)?),
            Some(b'{') => SyntaxKind::Map(self.items(b'}', |t| {
                let key = t.node()?;
                if !t.accept(b':') {
                    return Err(t.fault(t.at, "RON syntax: expected `:`"));
                }
                Ok((key, t.node()?))
            })?),
            Some(b'(') => self.group(None)?,
            _ => {
                let word = self.word()?;
                let end = self.at;
                if self.next() == Some(b'(') && is_name(word.text()) {
                    self.group(Some(word))?
                } else {
                    self.at = end;
                    SyntaxKind::Word
                }
            }
        };
        Ok(SyntaxNode { span: self.span(start), kind })
    }

    /// What stands between a bracket and the `end` that closes it, apart by commas.
    fn items<T>(
        &mut self,
        end: u8,
        mut item: impl FnMut(&mut TextCursor<'s>) -> Result<T, Diagnostic>,
    ) -> Result<Vec<T>, Diagnostic> {
        if self.depth == DEEPEST {
            return Err(self.fault(self.at, "RON syntax: too many brackets in each other"));
        }
        self.depth += 1;
        self.at += 1;
        let mut items = vec![];
        while !self.accept(end) {
            items.push(item(self)?);
            if !self.accept(b',') && self.next() != Some(end) {
                return Err(self.fault(self.at, "RON syntax: expected a comma"));
            }
        }
        self.depth -= 1;
        Ok(items)
    }

    /// `(…)`: a struct when its items are `name: value`, otherwise a tuple.
    fn group(&mut self, name: Option<Span>) -> Result<SyntaxKind, Diagnostic> {
        let start = self.at;
        let (mut fields, mut values) = (vec![], vec![]);
        self.items(b')', |t| {
            let value = t.node()?;
            if t.next() == Some(b':') && value.word().is_some_and(is_name) {
                t.at += 1;
                fields.push(Field { name: value.span, value: t.node()? });
            } else {
                values.push(value);
            }
            Ok(())
        })?;
        match (fields.is_empty(), values.is_empty()) {
            (_, true) => Ok(SyntaxKind::Struct(name, fields)),
            (true, false) => Ok(SyntaxKind::Tuple(name, values)),
            (false, false) => Err(self.fault(start, "RON syntax: either all of these values have names, or none has")),
        }
    }

    /// Goes over a string in quotes.
    fn string(&mut self) -> Result<(), Diagnostic> {
        let start = self.at;
        let mut escaped = false;
        let end = self.rest().bytes().skip(1).position(|b| {
            let ends = b == b'"' && !escaped;
            escaped = b == b'\\' && !escaped;
            ends
        });
        self.at = end.map_or(self.text.len(), |i| start + i + 2);
        if end.is_none() {
            return Err(self.fault(start, "RON syntax: a string without its second quote"));
        }
        if self.text.as_bytes()[start..self.at].contains(&b'\\') { Err(self.escapes(start)) } else { Ok(()) }
    }

    fn escapes(&self, start: usize) -> Diagnostic {
        self.fault(start, "strings can't hold escapes here").help("write the characters as they are")
    }

    /// Up to a mark or a space; a character in quotes.
    fn word(&mut self) -> Result<Span, Diagnostic> {
        let (start, rest) = (self.at, self.rest());
        let plain = |b: &u8| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'.' | b'+' | b'-') || !b.is_ascii();
        let length = match rest.strip_prefix('\'') {
            Some(quoted) => quoted.char_indices().skip(1).find(|c| c.1 == '\'').map_or(rest.len(), |c| c.0 + 2),
            None => rest.bytes().position(|b| !plain(&b)).unwrap_or(rest.len()),
        };
        self.at += length;
        if length > 0 && self.rest().starts_with(['"', '#']) {
            // A string with a letter before it.
            self.at += self.rest().find('"').unwrap_or(0);
            self.string()?;
            return Err(self.escapes(start));
        }
        if length == 0 { Err(self.fault(start, "RON syntax: expected a value")) } else { Ok(self.span(start)) }
    }
}

/// Beyond ASCII, what RON takes for white space.
const MARKS_OF_SPACE: [char; 5] = ['\u{85}', '\u{200e}', '\u{200f}', '\u{2028}', '\u{2029}'];

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_') && word.chars().all(|c| c.is_alphanumeric() || c == '_')
}

/// The length of a block comment, those in it included; `None` when it has no end.
pub fn comment(text: &str) -> Option<usize> {
    let (mut depth, mut at) = (0usize, 0);
    let bytes = text.as_bytes();
    while let Some(pair) = bytes.get(at..at + 2) {
        match pair {
            b"/*" => depth += 1,
            b"*/" => depth -= 1,
            _ => {
                at += 1;
                continue;
            }
        }
        at += 2;
        if depth == 0 {
            return Some(at);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_keeps_its_place() {
        let text = "// head\nGraph(\n  // note\n  about: \"x\", // tail\n  size: (1, 2),\n  m: {\"a\": Uint(default: 4), /* c */ \"b\": true},\n  l: [A(x: 1), B],\n)";
        let source = Source::new("t.ron", text);
        let node = parse(&source).unwrap();
        let SyntaxKind::Struct(Some(name), fields) = node.kind else { panic!("{node:?}") };
        assert_eq!(name.text(), "Graph");
        let spans: Vec<&str> = fields.iter().map(|f| f.value.span.text()).collect();
        assert_eq!(spans, ["\"x\"", "(1, 2)", "{\"a\": Uint(default: 4), /* c */ \"b\": true}", "[A(x: 1), B]"]);
        let SyntaxKind::Map(pairs) = &fields[2].value.kind else { panic!() };
        assert_eq!(pairs[1].1.span.text(), "true");
        assert!(matches!(&fields[1].value.kind, SyntaxKind::Tuple(None, items) if items.len() == 2));
    }

    #[test]
    fn a_fault_of_syntax_names_its_line() {
        let source = Source::new("t.ron", "Graph(\n  about: \"x\"\n  size: 3,\n)");
        let faults = parse(&source).unwrap_err();
        assert!(faults.to_string().contains("t.ron:3:3"), "{faults}");
    }

    fn words<'t>(node: &'t SyntaxNode, out: &mut Vec<&'t str>) {
        out.extend(node.word());
        match &node.kind {
            SyntaxKind::Text | SyntaxKind::Word => {}
            SyntaxKind::List(items) | SyntaxKind::Tuple(_, items) => items.iter().for_each(|n| words(n, out)),
            SyntaxKind::Map(pairs) => pairs.iter().flat_map(|(k, v)| [k, v]).for_each(|n| words(n, out)),
            SyntaxKind::Struct(_, fields) => fields.iter().for_each(|f| words(&f.value, out)),
        }
    }

    /// A raw value may not end in a comment that its line doesn't end; a file may.
    fn is_ron(text: &str) -> bool {
        ron::from_str::<&RawValue>(&format!("{text}\n")).is_ok()
    }

    /// What is a tree here is RON but for its words; what is RON is a tree here but for escapes in strings and the
    /// deepest.
    fn agrees(text: &str) {
        match parse(&Source::new("t.ron", text)) {
            Ok(node) if !is_ron(text) => {
                let mut all = vec![];
                words(&node, &mut all);
                assert!(all.iter().any(|w| !is_ron(w)), "no RON, but a tree: {text}");
            }
            Err(faults) if is_ron(text) => {
                let said = faults.to_string();
                assert!(said.contains("escapes") || said.contains("too many brackets"), "{said}: {text}");
            }
            _ => {}
        }
    }

    #[test]
    fn what_a_tree_is_ron_says_too() {
        for text in [
            "",
            " ",
            "a",
            "()",
            "(,)",
            "(a:)",
            "(a:1,2)",
            "(1,a:2)",
            "[1 2]",
            "[1,,2]",
            "{1:2,3:4,}",
            "{1,2}",
            "A (b: 1)",
            "A\n(b)",
            "/* a /* b */ c */ 1",
            "/* 1",
            "1 /*",
            "1 // c",
            "#![enable(implicit_some)] (a: 1)",
            "#![enable(other)] 1",
            "#1",
            "'a'",
            "'(",
            "r\"a\"",
            "r#\"a\"#",
            "\"a\\n\"",
            "\"",
            "1 2",
            "a: 1",
            "(a: b: 1)",
            "-1.5e-3",
            "\u{a0}1",
            "\u{2028}1",
            "(é: 1)",
            ")",
        ] {
            agrees(text);
        }
        for depth in [10, 59, 60, 61, 127, 128, 129] {
            agrees(&format!("{}1{}", "(".repeat(depth), ")".repeat(depth)));
        }
        agrees(&"[".repeat(100_000));
        let graphs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs/gi");
        let mut seed = 1u64;
        let mut draw = move |n: usize| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as usize % n.max(1)
        };
        let paths = std::fs::read_dir(graphs).unwrap().map(|entry| entry.unwrap().path());
        for path in paths.filter(|path| path.is_file()) {
            let text = std::fs::read_to_string(path).unwrap();
            agrees(&text);
            let all: Vec<char> = text.chars().take(2000).collect();
            for _ in 0..20 {
                let mut edited = all.clone();
                for _ in 0..=draw(3) {
                    let (at, marks) = (
                        draw(edited.len()),
                        ['(', ')', '[', ']', '{', '}', ':', ',', '"', '/', '*', '\\', '#', 'a', '1', '\''],
                    );
                    match draw(3) {
                        0 => drop(edited.remove(at)),
                        1 => edited.insert(at, marks[draw(marks.len())]),
                        _ => edited[at] = marks[draw(marks.len())],
                    }
                }
                // A whole value again, whatever was cut off.
                edited.extend(["", ")", "])", "],)", "})"][draw(5)].chars());
                agrees(&edited.into_iter().collect::<String>());
            }
        }
    }
}
