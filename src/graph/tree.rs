//! RON text to a tree in which every value keeps its place.
//!
//! The `ron` crate parses; this reads it in layers (each value as raw text that points into the source), so that
//! every fault of a file can be reported, not the first one only.

use crate::diag::{Checked, Diagnostic, Source, Span};
use ron::value::RawValue;
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use std::{fmt, sync::Arc};

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
    Tree { source }.node(raw.get_ron())
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

struct Tree<'s> {
    source: &'s Arc<Source>,
}

impl Tree<'_> {
    /// Where a part of the source's text lies in it.
    fn start(&self, text: &str) -> usize {
        (text.as_ptr() as usize).wrapping_sub(self.source.text.as_ptr() as usize).min(self.source.text.len())
    }

    fn node(&self, text: &str) -> Checked<Node> {
        let text = trim(text);
        let start = self.start(text);
        let span = Span::new(self.source, start..start + text.len());
        let fail = |e: ron::error::SpannedError| syntax_fault(self.source, start, &e);
        let kind = match text.chars().next() {
            Some('"' | 'r') if text.ends_with(['"', '#']) => {
                if text.contains('\\') || text.starts_with('r') {
                    return Err(Diagnostic::error("strings can't hold escapes here")
                        .at(&span, "")
                        .help("write the characters as they are")
                        .into());
                }
                Kind::Text(text[1..text.len() - 1].to_string())
            }
            Some('[') => {
                let items: Vec<&RawValue> = ron::from_str(text).map_err(fail)?;
                Kind::List(items.into_iter().map(|r| self.node(r.get_ron())).collect::<Checked<_>>()?)
            }
            Some('{') => {
                let Pairs(pairs) = ron::from_str(text).map_err(fail)?;
                let pairs = pairs.into_iter().map(|(k, v)| Ok((self.node(k.get_ron())?, self.node(v.get_ron())?)));
                Kind::Map(pairs.collect::<Checked<_>>()?)
            }
            Some('(') => self.group(None, text)?,
            _ => {
                let name = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
                let rest = trim(&text[name..]);
                if name > 0 && rest.starts_with('(') {
                    self.group(Some(text[..name].to_string()), rest)?
                } else {
                    Kind::Word(text.to_string())
                }
            }
        };
        Ok(Node { span, kind })
    }

    /// `(…)`: a struct when its first item is `name:`, otherwise a tuple.
    fn group(&self, name: Option<String>, text: &str) -> Checked<Kind> {
        if let Ok(Fields(fields)) = ron::from_str(text) {
            let fields = fields.into_iter().map(|(key, v)| {
                let start = self.start(key);
                let span = Span::new(self.source, start..start + key.len());
                Ok(Field { name: key.to_string(), span, value: self.node(v.get_ron())? })
            });
            return Ok(Kind::Struct(name, fields.collect::<Checked<_>>()?));
        }
        let Items(items) = ron::from_str(text).map_err(|e| syntax_fault(self.source, self.start(text), &e))?;
        Ok(Kind::Tuple(name, items.into_iter().map(|r| self.node(r.get_ron())).collect::<Checked<_>>()?))
    }
}

/// Without white space and comments around it.
fn trim(mut text: &str) -> &str {
    loop {
        text = text.trim();
        if let Some(rest) = text.strip_prefix("//") {
            text = rest.split_once('\n').map_or("", |(_, after)| after);
        } else if let Some(rest) = text.strip_prefix("/*") {
            text = rest.split_once("*/").map_or("", |(_, after)| after);
        } else {
            break;
        }
    }
    // A raw value ends where the value ends, but may be followed by a comment.
    match ron::from_str::<&RawValue>(text) {
        Ok(raw) => raw.trim().get_ron(),
        Err(_) => text,
    }
}

struct Pairs<'a>(Vec<(&'a RawValue, &'a RawValue)>);
struct Fields<'a>(Vec<(&'a str, &'a RawValue)>);
struct Items<'a>(Vec<&'a RawValue>);

macro_rules! layered {
    ($name:ident, $visitor:ident, $ask:expr, $expecting:literal, $visit:item) => {
        impl<'de: 'a, 'a> Deserialize<'de> for $name<'a> {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let ask: fn(D, $visitor) -> Result<$name<'de>, D::Error> = $ask;
                ask(deserializer, $visitor)
            }
        }
        struct $visitor;
        impl<'de> Visitor<'de> for $visitor {
            type Value = $name<'de>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str($expecting)
            }
            $visit
        }
    };
}

layered!(
    Pairs,
    PairsVisitor,
    |d, v| d.deserialize_map(v),
    "a map",
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Pairs<'de>, A::Error> {
        let mut pairs = vec![];
        while let Some(pair) = map.next_entry()? {
            pairs.push(pair);
        }
        Ok(Pairs(pairs))
    }
);
layered!(
    Fields,
    FieldsVisitor,
    |d, v| d.deserialize_struct("", &[], v),
    "named fields",
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Fields<'de>, A::Error> {
        let mut fields = vec![];
        while let Some(field) = map.next_entry()? {
            fields.push(field);
        }
        Ok(Fields(fields))
    }
);
layered!(
    Items,
    ItemsVisitor,
    |d, v| d.deserialize_tuple(0, v),
    "a tuple",
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Items<'de>, A::Error> {
        let mut items = vec![];
        while let Some(item) = seq.next_element()? {
            items.push(item);
        }
        Ok(Items(items))
    }
);

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
