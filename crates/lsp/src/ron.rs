//! The words of a graph file with what each is for, however broken the file.
//!
//! A walk over the text keeps the brackets that are open, what stands before each and the key in it; from these follows
//! what a word means. It never fails: half-typed text is text up to the cursor.

use crate::words::word;
use lightgraph::internals::graph::tree::comment;
use std::ops::Range;

/// An open bracket.
#[derive(Debug, Clone)]
pub struct Frame<'t> {
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
pub enum Shape {
    /// In quotes, which its range leaves out.
    Text,
    Word,
    /// A bracket closes: the range of all that it holds, its kind included.
    Close,
}

#[derive(Debug, Clone)]
pub struct Token<'t> {
    pub text: &'t str,
    pub range: Range<usize>,
    pub shape: Shape,
    /// A colon follows.
    pub key: bool,
    /// A bracket follows: it is a kind.
    pub kind: bool,
}

/// Calls `f` with each word and the brackets around it; at the end gives the brackets that are open there.
pub fn walk<'t>(text: &'t str, f: &mut dyn FnMut(&Token<'t>, &[Frame<'t>])) -> Vec<Frame<'t>> {
    let bytes = text.as_bytes();
    let mut frames: Vec<Frame<'t>> = vec![];
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
                let token = token(text, at + 1..end, Shape::Text, (end + 1).min(text.len()));
                f(&token, &frames);
                note(&mut frames, &token);
                word = None;
                at = end + 1;
                continue;
            }
            b'(' | b'[' | b'{' => {
                let kind = word.take().filter(|_| byte == b'(').unwrap_or(at..at);
                frames.push(Frame {
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
                    let token =
                        Token { text: &text[range.clone()], range, shape: Shape::Close, key: false, kind: false };
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
                let token = token(text, at..end, Shape::Word, end);
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

fn token(text: &str, range: Range<usize>, shape: Shape, after: usize) -> Token<'_> {
    let mut at = after;
    loop {
        match text.as_bytes().get(at) {
            Some(b) if b.is_ascii_whitespace() => at += 1,
            Some(b'/') if matches!(text.as_bytes().get(at + 1), Some(b'/' | b'*')) => at = behind_comment(text, at),
            next => {
                let (key, kind) = (next == Some(&b':'), next == Some(&b'(') && shape == Shape::Word);
                return Token { text: &text[range.clone()], range, shape, key, kind };
            }
        }
    }
}

fn note<'t>(frames: &mut [Frame<'t>], token: &Token<'t>) {
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
pub enum Thing {
    Root,
    Parameter,
    Resource,
    /// What a sub-graph takes, before it is known to be a resource or a value.
    Input,
    Pass,
    Dirty,
    Warning,
}

impl Thing {
    /// The headings of the reference that list its kinds.
    pub fn headings(self) -> &'static [&'static str] {
        match self {
            Thing::Root => &["Sections"],
            Thing::Parameter => &["Parameters"],
            Thing::Resource => &["Resources"],
            Thing::Input => &["Resources", "Parameters"],
            Thing::Pass | Thing::Dirty => &["Passes"],
            Thing::Warning => &["Warnings"],
        }
    }
}

/// What a word of a graph file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The name of a section, or of a field of a thing.
    Field(Thing),
    /// The kind of a thing, or the value of a field in its place.
    Kind(Thing),
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
pub fn thing(frames: &[Frame]) -> Option<(usize, Thing)> {
    let root = frames.first()?;
    let section = root.key.as_ref().map_or("", |k| k.0);
    let mut found = (0, Thing::Root);
    for (i, frame) in frames.iter().enumerate().skip(1).filter(|(_, f)| f.open == b'(') {
        found = match section {
            "params" if i == 2 => (i, Thing::Parameter),
            "inputs" if i == 2 && word("Parameters", frame.word).is_some() => (i, Thing::Parameter),
            "resources" | "inputs" if i == 2 => (i, Thing::Resource),
            "warnings" if i == 2 => (i, Thing::Warning),
            "passes" | "before" | "after" | "append" => match &frames[i - 1] {
                around if around.open != b'(' => (i, Thing::Pass),
                around if frame.word == "Dirty" || around.key.as_ref().is_some_and(|k| k.0 == "only") => {
                    (i, Thing::Dirty)
                }
                _ => found,
            },
            _ => found,
        };
    }
    Some(found)
}

/// What a word is for, by the brackets around it. `key`: a colon follows.
pub fn role(frames: &[Frame], shape: Shape, key: bool) -> Role {
    let Some((at, thing)) = thing(frames) else {
        return if shape == Shape::Word { Role::Kind(Thing::Root) } else { Role::Other };
    };
    let inner = &frames[at + 1..];
    let struct_ = &frames[at];
    if inner.is_empty() && key {
        return Role::Field(thing);
    }
    let field = struct_.key.as_ref().map_or("", |k| k.0);
    let in_map = inner.len() == 1 && inner[0].open == b'{';
    let bare = shape == Shape::Word;
    match thing {
        Thing::Root => match field {
            "about" => Role::Other,
            "base" => Role::Graph,
            _ if key && in_map && DECLARING.contains(&field) => Role::Declares,
            "defines" if key && in_map => Role::Definition,
            "outputs" if key && in_map => Role::Output,
            "outputs" if in_map && !bare => Role::Names,
            "lets" | "defines" if in_map && !bare => Role::Expression,
            "params" if in_map && bare => Role::Kind(Thing::Parameter),
            "warnings" if in_map && bare => Role::Kind(Thing::Warning),
            "resources" if in_map && bare => Role::Kind(Thing::Resource),
            "inputs" if in_map && bare => Role::Kind(Thing::Input),
            "passes" | "before" | "after" if key && in_map => Role::OfPass,
            "passes" | "append" | "before" | "after" if bare => Role::Kind(Thing::Pass),
            _ => Role::Other,
        },
        Thing::Parameter => {
            if bare && inner.is_empty() {
                Role::Choice
            } else {
                Role::Other
            }
        }
        Thing::Resource | Thing::Input => match field {
            "size" | "layers" | "mips" | "count" | "tile" | "members" | "stride" if !bare => Role::Expression,
            "file" | "element" => Role::Other,
            _ if bare && inner.is_empty() => Role::Choice,
            _ => Role::Other,
        },
        Thing::Warning => {
            if field == "when" && !bare {
                Role::Expression
            } else {
                Role::Other
            }
        }
        Thing::Dirty => {
            if bare {
                Role::Other
            } else {
                Role::Names
            }
        }
        Thing::Pass => match field {
            "name" => Role::Pass,
            "shader" => Role::Shader,
            "graph" => Role::Graph,
            "entry" => Role::Entry,
            "color" | "depth" | "frusta" | "indirect" | "from" | "to" | "target" | "load" if !bare => Role::Names,
            "clear" | "blend" if key => Role::Names,
            "blend" if bare => Role::Choice,
            "bind" if key => Role::Variable,
            "bind" | "in" if !bare && !key => Role::Names,
            "in" if key => Role::Input,
            "out" if key => Role::Taken,
            "out" if !bare => Role::Declares,
            "set" if key && struct_.word == "Use" => Role::Parameter,
            "set" if key => Role::Variable,
            "defines" | "tune" if key => Role::Definition,
            "passes" | "of" if bare => Role::Kind(Thing::Pass),
            "only" if bare => Role::Kind(Thing::Dirty),
            "when" | "each" | "over" | "factor" | "until" | "count" | "layer" | "views" | "tolerance" | "materials"
            | "vertices" | "instances" | "set" | "defines" | "tune"
                if !bare =>
            {
                Role::Expression
            }
            _ if bare && inner.is_empty() => Role::Choice,
            _ => Role::Other,
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

    fn roles(text: &str) -> Vec<(&str, Role)> {
        let mut all = vec![];
        walk(text, &mut |t, frames| {
            if t.shape != Shape::Close {
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
            ("Graph", Role::Kind(Thing::Root)),
            ("lets", Role::Field(Thing::Root)),
            ("n", Role::Declares),
            ("grid.x", Role::Expression),
            ("r", Role::Declares),
            ("Texture", Role::Kind(Thing::Resource)),
            ("format", Role::Field(Thing::Resource)),
            ("R8Unorm", Role::Choice),
            ("n", Role::Expression),
            ("Loop", Role::Kind(Thing::Pass)),
            ("l", Role::Pass),
            ("Draw", Role::Kind(Thing::Pass)),
            ("s.wgsl", Role::Shader),
            ("r", Role::Names),
            ("v", Role::Variable),
            ("bits", Role::Field(Thing::Dirty)),
            ("b", Role::Names),
            ("o", Role::Output),
        ] {
            assert!(found.contains(&expected), "{expected:?} in {found:?}");
        }
        let variant = roles(
            r#"Variant(base: "b.ron", params: {"p": (default: 3)}, passes: {"x": (when: "p > 0")},
            before: {"x": [Clear(target: "r")]})"#,
        );
        for expected in [
            ("b.ron", Role::Graph),
            ("p", Role::Declares),
            ("default", Role::Field(Thing::Parameter)),
            ("x", Role::OfPass),
            ("when", Role::Field(Thing::Pass)),
            ("p > 0", Role::Expression),
            ("Clear", Role::Kind(Thing::Pass)),
            ("r", Role::Names),
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
