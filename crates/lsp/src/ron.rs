//! The words of a graph file with what each is for, however broken the file.
//!
//! A walk over the text keeps the brackets that are open, what stands before each and the key in it; from these follows
//! what a word means. It never fails: half-typed text is text up to the cursor.

use crate::words::word;
use lightgraph::internals::graph::tree::comment;
use std::ops::Range;

/// An open bracket.
#[derive(Debug, Clone)]
pub struct Bracket<'t> {
    pub open: u8,
    /// The kind before it: `Draw` of `Draw(…)`.
    pub word: &'t str,
    /// Of its kind, or of the bracket.
    pub start: usize,
    /// The key before the colon.
    pub key: Option<(&'t str, Range<usize>)>,
    /// Keys that were before in it.
    pub keys: Vec<&'t str>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenShape {
    /// In quotes, which its range leaves out.
    Text,
    Word,
    /// A bracket closes: the range of all that it holds, its kind included.
    Close,
}

#[derive(Debug, Clone)]
pub struct RonToken<'t> {
    pub text: &'t str,
    pub range: Range<usize>,
    pub shape: TokenShape,
    /// A colon follows.
    pub key: bool,
    /// A bracket follows: it is a kind.
    pub kind: bool,
}

/// Calls `f` with each word and the brackets around it; at the end gives the brackets that are open there.
pub fn walk<'t>(text: &'t str, f: &mut dyn FnMut(&RonToken<'t>, &[Bracket<'t>])) -> Vec<Bracket<'t>> {
    let bytes = text.as_bytes();
    let mut frames: Vec<Bracket<'t>> = vec![];
    let mut word: Option<Range<usize>> = None;
    let mut at = 0;
    while let Some(byte) = bytes.get(at).copied() {
        match byte {
            b'/' if matches!(bytes.get(at + 1), Some(b'/' | b'*')) => {
                at = behind_comment(text, at);
                continue;
            }
            b'"' => {
                let end = text[at + 1..].find('"').map_or(text.len(), |e| at + 1 + e);
                let token = token(text, at + 1..end, TokenShape::Text, (end + 1).min(text.len()));
                f(&token, &frames);
                note(&mut frames, &token);
                word = None;
                at = end + 1;
                continue;
            }
            b'(' | b'[' | b'{' => {
                let kind = word.take().filter(|_| byte == b'(').unwrap_or(at..at);
                frames.push(Bracket {
                    open: byte,
                    word: &text[kind.clone()],
                    start: kind.start,
                    key: None,
                    keys: vec![],
                });
            }
            b')' | b']' | b'}' => {
                if let Some(frame) = frames.pop() {
                    let range = frame.start..at + 1;
                    let token = RonToken {
                        text: &text[range.clone()],
                        range,
                        shape: TokenShape::Close,
                        key: false,
                        kind: false,
                    };
                    f(&token, &frames);
                }
                word = None;
            }
            b',' => {
                if let Some(frame) = frames.last_mut() {
                    frame.key = None;
                }
                word = None;
            }
            b if is_word(b) => {
                let end = at + bytes[at..].iter().position(|b| !is_word(*b)).unwrap_or(bytes.len() - at);
                let token = token(text, at..end, TokenShape::Word, end);
                f(&token, &frames);
                note(&mut frames, &token);
                word = Some(at..end);
                at = end;
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    frames
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'.' | b'+' | b'-') || !byte.is_ascii()
}

fn token(text: &str, range: Range<usize>, shape: TokenShape, after: usize) -> RonToken<'_> {
    let mut at = after;
    loop {
        match text.as_bytes().get(at) {
            Some(b) if b.is_ascii_whitespace() => at += 1,
            Some(b'/') if matches!(text.as_bytes().get(at + 1), Some(b'/' | b'*')) => at = behind_comment(text, at),
            next => {
                let (key, kind) = (next == Some(&b':'), next == Some(&b'(') && shape == TokenShape::Word);
                return RonToken { text: &text[range.clone()], range, shape, key, kind };
            }
        }
    }
}

fn note<'t>(frames: &mut [Bracket<'t>], token: &RonToken<'t>) {
    if let Some(frame) = frames.last_mut().filter(|_| token.key) {
        frame.key = Some((token.text, token.range.clone()));
        frame.keys.push(token.text);
    }
}

fn behind_comment(text: &str, at: usize) -> usize {
    let rest = &text[at..];
    if rest.starts_with("//") {
        return at + rest.find('\n').unwrap_or(rest.len());
    }
    comment(rest).map_or(text.len(), |length| at + length)
}

/// What the struct around a word is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StructKind {
    Root,
    Parameter,
    Resource,
    /// What a sub-graph takes, before it is known to be a resource or a value.
    Input,
    Pass,
    Dirty,
    Warning,
}

impl StructKind {
    /// The headings of the reference that list its kinds.
    pub fn headings(self) -> &'static [&'static str] {
        match self {
            StructKind::Root => &["Sections"],
            StructKind::Parameter => &["Parameters"],
            StructKind::Resource => &["Resources"],
            StructKind::Input => &["Resources", "Parameters"],
            StructKind::Pass | StructKind::Dirty => &["Passes"],
            StructKind::Warning => &["Warnings"],
        }
    }
}

/// What a word of a graph file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordRole {
    /// The name of a section, or of a field of a thing.
    Field(StructKind),
    /// The kind of a thing, or the value of a field in its place.
    Kind(StructKind),
    /// Declares a parameter, let, resource or input.
    Declares,
    Output,
    /// The name of a resource or value.
    Names,
    Expression,
    /// A pass's own name.
    Pass,
    /// The name of a pass of the base.
    OfPass,
    /// A variable of the pass's shader.
    Variable,
    Definition,
    Shader,
    Entry,
    /// A graph file.
    Graph,
    /// Of the graph that a pass uses: an input, output or parameter.
    Input,
    Taken,
    Parameter,
    /// The value of a field that takes few words.
    Choice,
    Other,
}

const DECLARING: [&str; 4] = ["params", "lets", "resources", "inputs"];

/// The innermost struct around a place and what it is: its place among the brackets.
pub fn thing(frames: &[Bracket]) -> Option<(usize, StructKind)> {
    let root = frames.first()?;
    let section = root.key.as_ref().map_or("", |k| k.0);
    let mut found = (0, StructKind::Root);
    for (i, frame) in frames.iter().enumerate().skip(1).filter(|(_, f)| f.open == b'(') {
        found = match section {
            "params" if i == 2 => (i, StructKind::Parameter),
            "inputs" if i == 2 && word("Parameters", frame.word).is_some() => (i, StructKind::Parameter),
            "resources" | "inputs" if i == 2 => (i, StructKind::Resource),
            "warnings" if i == 2 => (i, StructKind::Warning),
            "passes" | "before" | "after" | "append" => match &frames[i - 1] {
                around if around.open != b'(' => (i, StructKind::Pass),
                around if frame.word == "Dirty" || around.key.as_ref().is_some_and(|k| k.0 == "only") => {
                    (i, StructKind::Dirty)
                }
                _ => found,
            },
            _ => found,
        };
    }
    Some(found)
}

/// What a word is for, by the brackets around it. `key`: a colon follows.
pub fn role(frames: &[Bracket], shape: TokenShape, key: bool) -> WordRole {
    let Some((at, thing)) = thing(frames) else {
        return if shape == TokenShape::Word { WordRole::Kind(StructKind::Root) } else { WordRole::Other };
    };
    let inner = &frames[at + 1..];
    let struct_ = &frames[at];
    if inner.is_empty() && key {
        return WordRole::Field(thing);
    }
    let field = struct_.key.as_ref().map_or("", |k| k.0);
    let in_map = inner.len() == 1 && inner[0].open == b'{';
    let bare = shape == TokenShape::Word;
    match thing {
        StructKind::Root => match field {
            "about" => WordRole::Other,
            "base" => WordRole::Graph,
            _ if key && in_map && DECLARING.contains(&field) => WordRole::Declares,
            "defines" if key && in_map => WordRole::Definition,
            "outputs" if key && in_map => WordRole::Output,
            "outputs" if in_map && !bare => WordRole::Names,
            "lets" | "defines" if in_map && !bare => WordRole::Expression,
            "params" if in_map && bare => WordRole::Kind(StructKind::Parameter),
            "warnings" if in_map && bare => WordRole::Kind(StructKind::Warning),
            "resources" if in_map && bare => WordRole::Kind(StructKind::Resource),
            "inputs" if in_map && bare => WordRole::Kind(StructKind::Input),
            "passes" | "before" | "after" if key && in_map => WordRole::OfPass,
            "passes" | "append" | "before" | "after" if bare => WordRole::Kind(StructKind::Pass),
            _ => WordRole::Other,
        },
        StructKind::Parameter => {
            if bare && inner.is_empty() {
                WordRole::Choice
            } else {
                WordRole::Other
            }
        }
        StructKind::Resource | StructKind::Input => match field {
            "size" | "layers" | "mips" | "count" | "tile" | "members" | "stride" if !bare => WordRole::Expression,
            "file" | "element" => WordRole::Other,
            _ if bare && inner.is_empty() => WordRole::Choice,
            _ => WordRole::Other,
        },
        StructKind::Warning => {
            if field == "when" && !bare {
                WordRole::Expression
            } else {
                WordRole::Other
            }
        }
        StructKind::Dirty => {
            if bare {
                WordRole::Other
            } else {
                WordRole::Names
            }
        }
        StructKind::Pass => match field {
            "name" => WordRole::Pass,
            "shader" => WordRole::Shader,
            "graph" => WordRole::Graph,
            "entry" => WordRole::Entry,
            "color" | "depth" | "frusta" | "indirect" | "from" | "to" | "target" | "load" if !bare => WordRole::Names,
            "clear" | "blend" if key => WordRole::Names,
            "blend" if bare => WordRole::Choice,
            "bind" if key => WordRole::Variable,
            "bind" | "in" if !bare && !key => WordRole::Names,
            "in" if key => WordRole::Input,
            "out" if key => WordRole::Taken,
            "out" if !bare => WordRole::Declares,
            "set" if key && struct_.word == "Use" => WordRole::Parameter,
            "set" if key => WordRole::Variable,
            "defines" | "tune" if key => WordRole::Definition,
            "passes" | "of" if bare => WordRole::Kind(StructKind::Pass),
            "only" if bare => WordRole::Kind(StructKind::Dirty),
            "when" | "each" | "over" | "factor" | "until" | "count" | "layer" | "views" | "tolerance" | "materials"
            | "vertices" | "instances" | "set" | "defines" | "tune"
                if !bare =>
            {
                WordRole::Expression
            }
            _ if bare && inner.is_empty() => WordRole::Choice,
            _ => WordRole::Other,
        },
    }
}

/// The names in an expression, each with its place in the text: `grid.x` is one of two parts, calls are none.
pub fn names(text: &str) -> Vec<(&str, Range<usize>)> {
    let mut found = vec![];
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let begins = c.is_alphabetic() || c == '_';
        let part = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        let length = match begins || c.is_ascii_digit() {
            true => text[at..].find(|c| !part(c)).unwrap_or(text.len() - at),
            false => c.len_utf8(),
        };
        let word = &text[at..at + length];
        let call = text[at + length..].trim_start().starts_with('(');
        if begins && !call && !matches!(word, "true" | "false") {
            found.push((word, at..at + length));
        }
        at += length;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roles(text: &str) -> Vec<(&str, WordRole)> {
        let mut all = vec![];
        walk(text, &mut |t, frames| {
            if t.shape != TokenShape::Close {
                all.push((t.text, role(frames, t.shape, t.key)));
            }
        });
        all
    }

    #[test]
    fn words_have_roles() {
        let text = r#"Graph(about: "a", lets: {"n": "grid.x"},
            resources: {"r": Texture(format: R8Unorm, size: ("n", 2))},
            passes: [Loop(name: "l", count: "n", passes: [Draw(name: "p", shader: "s.wgsl", // "c"
                clear: {"r": (0, 0)}, bind: {"v": "r"}, only: Dirty(bits: "b", of: ["r"]))])], outputs: {"o": "r"})"#;
        let found = roles(text);
        for expected in [
            ("Graph", WordRole::Kind(StructKind::Root)),
            ("lets", WordRole::Field(StructKind::Root)),
            ("n", WordRole::Declares),
            ("grid.x", WordRole::Expression),
            ("r", WordRole::Declares),
            ("Texture", WordRole::Kind(StructKind::Resource)),
            ("format", WordRole::Field(StructKind::Resource)),
            ("R8Unorm", WordRole::Choice),
            ("n", WordRole::Expression),
            ("Loop", WordRole::Kind(StructKind::Pass)),
            ("l", WordRole::Pass),
            ("Draw", WordRole::Kind(StructKind::Pass)),
            ("s.wgsl", WordRole::Shader),
            ("r", WordRole::Names),
            ("v", WordRole::Variable),
            ("bits", WordRole::Field(StructKind::Dirty)),
            ("b", WordRole::Names),
            ("o", WordRole::Output),
        ] {
            assert!(found.contains(&expected), "{expected:?} in {found:?}");
        }
        let variant = roles(
            r#"Variant(base: "b.ron", params: {"p": (default: 3)}, passes: {"x": (when: "p > 0")},
            before: {"x": [Clear(target: "r")]})"#,
        );
        for expected in [
            ("b.ron", WordRole::Graph),
            ("p", WordRole::Declares),
            ("default", WordRole::Field(StructKind::Parameter)),
            ("x", WordRole::OfPass),
            ("when", WordRole::Field(StructKind::Pass)),
            ("p > 0", WordRole::Expression),
            ("Clear", WordRole::Kind(StructKind::Pass)),
            ("r", WordRole::Names),
        ] {
            assert!(variant.contains(&expected), "{expected:?} in {variant:?}");
        }
    }

    #[test]
    fn expressions_hold_names() {
        let found: Vec<&str> =
            names("max(grid.x, 2) * a_1 + chain[level + 1] ? true : 1e3").iter().map(|n| n.0).collect();
        assert_eq!(found, ["grid.x", "a_1", "chain", "level"]);
    }

    #[test]
    fn broken_text_is_walked() {
        for text in ["", "(", "Graph(passes: [Draw(name: \"", ")]}", "\"é", "/* /*", "Graph(a: b: {", "é(é: é"] {
            roles(text);
        }
    }
}
