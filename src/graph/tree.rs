//! RON text to a tree in which every value keeps its place.
//!
//! The `ron` crate says whether the text is RON. What it accepts is then read once, from its first byte to its last.

use crate::diag::{Checked, Diagnostic, Source, Span};
use ron::value::RawValue;
use std::sync::Arc;

/// A value and where it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    pub span: Span,
    pub kind: Kind,
}

/// The shapes a value can have.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// A quoted string without escapes; the span includes the quotes.
    Text(String),
    /// A number, `true`, `false` or a bare name, as written.
    Word(String),
    /// `[a, b]`
    List(Vec<Node>),
    /// `{k: v}`
    Map(Vec<(Node, Node)>),
    /// `(a, b)` or `Name(a, b)`
    Tuple(Option<String>, Vec<Node>),
    /// `(a: 1)` or `Name(a: 1)`
    Struct(Option<String>, Vec<Field>),
}

/// A named field of a struct.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub name: String,
    pub span: Span,
    pub value: Node,
}

/// Parses a whole RON file.
///
/// # Errors
/// The first fault of syntax (the rest of the file can't be trusted after it), or strings with escapes.
pub fn parse(source: &Arc<Source>) -> Checked<Node> {
    let raw: &RawValue = ron::from_str(&source.text).map_err(|e| syntax_fault(source, 0, &e))?;
    let start = (raw.get_ron().as_ptr() as usize).wrapping_sub(source.text.as_ptr() as usize);
    Tree { source, at: start.min(source.text.len()) }.node().map_err(Into::into)
}

fn syntax_fault(source: &Arc<Source>, base: usize, e: &ron::error::SpannedError) -> Diagnostic {
    let text = &source.text[base..];
    let start = base + offset(text, e.span.start.line, e.span.start.col);
    let end = base + offset(text, e.span.end.line, e.span.end.col);
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

/// A place in a text that is RON.
struct Tree<'s> {
    source: &'s Arc<Source>,
    at: usize,
}

impl<'s> Tree<'s> {
    fn rest(&self) -> &'s str {
        self.source.text.get(self.at..).unwrap_or("")
    }

    /// Goes over white space and comments; the byte that follows.
    fn next(&mut self) -> Option<u8> {
        loop {
            let rest = self.rest();
            let text = rest.trim_start();
            self.at += rest.len() - text.len();
            if text.starts_with("//") {
                self.at += text.find('\n').unwrap_or(text.len());
            } else if text.starts_with("/*") {
                self.at += comment(text);
            } else {
                return text.bytes().next();
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

    fn node(&mut self) -> Result<Node, Diagnostic> {
        let next = self.next();
        let start = self.at;
        let kind = match next {
            Some(b'"') => Kind::Text(self.string()?),
            Some(b'[') => Kind::List(self.items(b']', Tree::node)?),
            Some(b'{') => Kind::Map(self.items(b'}', |t| {
                let key = t.node()?;
                t.accept(b':');
                Ok((key, t.node()?))
            })?),
            Some(b'(') => self.group(None)?,
            _ => {
                let word = self.word()?;
                let end = self.at;
                if is_name(&word) && self.next() == Some(b'(') {
                    self.group(Some(word))?
                } else {
                    self.at = end;
                    Kind::Word(word)
                }
            }
        };
        Ok(Node { span: self.span(start), kind })
    }

    /// What stands between a bracket and the `end` that closes it, apart by commas.
    fn items<T>(
        &mut self,
        end: u8,
        mut item: impl FnMut(&mut Tree<'s>) -> Result<T, Diagnostic>,
    ) -> Result<Vec<T>, Diagnostic> {
        self.at += 1;
        let mut items = vec![];
        while !self.accept(end) {
            let before = self.at;
            items.push(item(self)?);
            self.accept(b',');
            if self.at == before {
                return Err(self.fault(before, "RON syntax: expected a value"));
            }
        }
        Ok(items)
    }

    /// `(…)`: a struct when its items are `name: value`, otherwise a tuple.
    fn group(&mut self, name: Option<String>) -> Result<Kind, Diagnostic> {
        let start = self.at;
        let items = self.items(b')', |t| {
            let value = t.node()?;
            match &value.kind {
                Kind::Word(name) if is_name(name) && t.accept(b':') => {
                    Ok(Ok(Field { name: name.clone(), span: value.span.clone(), value: t.node()? }))
                }
                _ => Ok(Err(value)),
            }
        })?;
        if items.iter().all(Result::is_ok) {
            return Ok(Kind::Struct(name, items.into_iter().flatten().collect()));
        }
        if items.iter().any(Result::is_ok) {
            return Err(self.fault(start, "RON syntax: either all of these values have names, or none has"));
        }
        Ok(Kind::Tuple(name, items.into_iter().filter_map(Result::err).collect()))
    }

    /// A string in quotes.
    fn string(&mut self) -> Result<String, Diagnostic> {
        let start = self.at;
        let mut escaped = false;
        let end = self.rest().bytes().skip(1).position(|b| {
            let ends = b == b'"' && !escaped;
            escaped = b == b'\\' && !escaped;
            ends
        });
        self.at = end.map_or(self.source.text.len(), |i| start + i + 2);
        let text = self.source.text.get(start + 1..(self.at - 1).max(start + 1)).unwrap_or("");
        if text.contains('\\') { Err(self.escapes(start)) } else { Ok(text.to_string()) }
    }

    fn escapes(&self, start: usize) -> Diagnostic {
        self.fault(start, "strings can't hold escapes here").help("write the characters as they are")
    }

    /// Up to a mark or a space; a character in quotes.
    fn word(&mut self) -> Result<String, Diagnostic> {
        let (start, rest) = (self.at, self.rest());
        let ends = |c: char| c.is_whitespace() || ",:()[]{}\"/#".contains(c);
        let length = match rest.strip_prefix('\'') {
            Some(quoted) => quoted.char_indices().skip(1).find(|c| c.1 == '\'').map_or(rest.len(), |c| c.0 + 2),
            None => rest.find(ends).unwrap_or(rest.len()),
        };
        self.at += length;
        if self.rest().starts_with(['"', '#']) {
            // A string with a letter before it.
            self.at += self.rest().find('"').unwrap_or(0);
            self.string()?;
            return Err(self.escapes(start));
        }
        Ok(rest.get(..length).unwrap_or("").to_string())
    }
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_') && word.chars().all(|c| c.is_alphanumeric() || c == '_')
}

/// The length of a block comment, those in it included.
fn comment(text: &str) -> usize {
    let mut depth = 0usize;
    let bytes = text.as_bytes();
    for (i, pair) in bytes.windows(2).enumerate() {
        match pair {
            b"/*" => depth += 1,
            b"*/" if depth == 1 => return i + 2,
            b"*/" => depth -= 1,
            _ => {}
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_keeps_its_place() {
        let text = "// head\nGraph(\n  // note\n  about: \"x\", // tail\n  size: (1, 2),\n  m: {\"a\": Uint(default: 4), /* c */ \"b\": true},\n  l: [A(x: 1), B],\n)";
        let source = Source::new("t.ron", text);
        let node = parse(&source).unwrap();
        let Kind::Struct(Some(name), fields) = node.kind else { panic!("{node:?}") };
        assert_eq!(name, "Graph");
        let spans: Vec<&str> = fields.iter().map(|f| f.value.span.text()).collect();
        assert_eq!(spans, ["\"x\"", "(1, 2)", "{\"a\": Uint(default: 4), /* c */ \"b\": true}", "[A(x: 1), B]"]);
        let Kind::Map(pairs) = &fields[2].value.kind else { panic!() };
        assert_eq!(pairs[1].1.span.text(), "true");
        assert!(matches!(&fields[1].value.kind, Kind::Tuple(None, items) if items.len() == 2));
    }

    #[test]
    fn a_fault_of_syntax_names_its_line() {
        let source = Source::new("t.ron", "Graph(\n  about: \"x\"\n  size: 3,\n)");
        let faults = parse(&source).unwrap_err();
        assert!(faults.to_string().contains("t.ron:3:3"), "{faults}");
    }
}
