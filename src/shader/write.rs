//! The text that naga_oil is given for a file, and the way back from its places to the user's.

use super::{
    compose::{Def, Defs},
    lex::TokenKind,
    link::{LinkTarget, LinkUnit},
    report::{HERE, place},
};
use crate::diag::Span;
use naga_oil::compose::Composer;
use std::ops::Range;

/// A file as naga_oil is given it. Lines stay lines.
#[derive(Debug, Clone)]
pub(super) struct Written {
    /// Other modules' items appear as `module::item`.
    pub text: String,
    /// From the text as naga parses it (items decorated) to the source: ranges in both, in order.
    pieces: Vec<(Range<usize>, Range<usize>)>,
}

impl Written {
    /// The bytes of the source that bytes of the parsed text came from.
    pub fn back(&self, range: Range<usize>) -> Range<usize> {
        let start = self.back_one(range.start, false);
        start..self.back_one(range.end.max(range.start + 1) - 1, true).max(start)
    }

    fn back_one(&self, at: usize, end: bool) -> usize {
        let index = self.pieces.partition_point(|(parsed, _)| parsed.end <= at);
        let Some((parsed, source)) = self.pieces.get(index).or(self.pieces.last()) else { return 0 };
        let within = if parsed.len() == source.len() {
            at.saturating_sub(parsed.start).min(source.len()) + usize::from(end)
        } else if end {
            source.len()
        } else {
            0
        };
        source.start + within.min(source.len())
    }
}

/// The name under which naga_oil knows a unit.
pub(super) fn module_name(unit: usize) -> String {
    format!("m{unit}")
}

/// What a member's name gets appended when naga's WGSL writer would change it, which naga_oil refuses:
/// the writer puts `_` behind a last digit and drops a last `_`.
const MEMBER_MARK: &str = "X_member_X";

/// naga_oil's mark between an imported item's name and its module's.
const MODULE_MARK: &str = "X_naga_oil_mod_X";

/// Marks that a source can't hold as they would be mistaken for naga_oil's or ours.
pub(super) const RESERVED_MARKS: [&str; 3] = [MODULE_MARK, "X_naga_oil_vrt_X", MEMBER_MARK];

/// A name, or a text with names, as the user wrote them.
pub(super) fn plain(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(MODULE_MARK) {
        out.push_str(&rest[..at]);
        let tail = &rest[at + MODULE_MARK.len()..];
        // The module's name in base 32 ends with an X of its own, or of the alphabet.
        let end = tail.find(|c: char| !c.is_ascii_uppercase() && !c.is_ascii_digit()).unwrap_or(tail.len());
        rest = &tail[end..];
    }
    out.push_str(rest);
    out.replace(MEMBER_MARK, "")
}

/// Where something of this decorated name is declared.
pub(super) fn declared_at(units: &[LinkUnit], decorated: &str) -> Option<Span> {
    let name = plain(decorated);
    let (root, modules) = units.split_last()?;
    let of_module = |(i, _): &(usize, &LinkUnit)| Composer::decorated_name(Some(&module_name(*i)), &name) == decorated;
    let unit = modules.iter().enumerate().find(of_module).map_or(root, |(_, unit)| unit);
    let declared = unit.outline.declared.get(&name)?;
    Some(Span::new(&unit.source, declared.range.clone()))
}

/// Writes a unit. `bindings` counts the resource variables of all units: each gets a number of its own for as long
/// as naga_oil validates. `file` is the unit's index among the paths of all units in order.
pub(super) fn write(unit: &LinkUnit, defs: &Defs, file: usize, bindings: &mut u32) -> Written {
    let source = &unit.scan.text;
    let mut out = Writer { text: String::new(), parsed: 0, pieces: vec![] };
    let mut at = 0;
    for (index, word) in unit.words.iter().enumerate() {
        out.copy(source, at..word.range.start);
        at = word.range.end;
        if unit.outline.attributes.contains(&index) {
            continue;
        }
        if unit.outline.resources.contains(&index) {
            out.insert(&format!("@group(0) @binding({bindings}) "), word.range.start);
            *bindings += 1;
        }
        let name = word.text(source);
        let before = index.checked_sub(1).and_then(|i| unit.words.get(i));
        let accessed = before.is_some_and(|w| w.is('.'));
        let attribute = before.is_some_and(|w| w.is('@'));
        let member = unit.outline.members.contains(&index);
        let target = unit.paths.get(&index).or_else(|| unit.imports.get(name));
        match (word.kind, target) {
            (TokenKind::Definition, _) => {
                let value = match word.definition(source) {
                    HERE => format!("{}u", place(file, 1 + newlines(source, word.range.start))),
                    name => defs.get(name).map_or(String::new(), Def::wgsl),
                };
                out.replace(&value, &value, word.range.clone());
            }
            (TokenKind::Name, _) if (accessed || member) && name.ends_with(|c: char| c.is_numeric() || c == '_') => {
                let marked = format!("{name}{MEMBER_MARK}");
                out.replace(&marked, &marked, word.range.clone());
            }
            (TokenKind::Name, Some(LinkTarget::Item(module, item))) if !accessed && !member && !attribute => {
                let module = module_name(*module);
                let parsed = Composer::decorated_name(Some(&module), item);
                out.replace(&format!("{module}::{item}"), &parsed, word.range.clone());
            }
            _ => out.copy(source, word.range.clone()),
        }
    }
    out.copy(source, at..source.len());
    Written { text: out.text, pieces: out.pieces }
}

fn newlines(text: &str, end: usize) -> usize {
    text.get(..end).map_or(0, |before| before.matches('\n').count())
}

struct Writer {
    text: String,
    /// The length of the text as naga will see it.
    parsed: usize,
    pieces: Vec<(Range<usize>, Range<usize>)>,
}

impl Writer {
    fn copy(&mut self, source: &str, range: Range<usize>) {
        if let Some(text) = source.get(range.clone()).filter(|t| !t.is_empty()) {
            self.replace(text, text, range);
        }
    }

    fn insert(&mut self, text: &str, at: usize) {
        self.replace(text, text, at..at);
    }

    fn replace(&mut self, given: &str, parsed: &str, source: Range<usize>) {
        self.text.push_str(given);
        if !parsed.is_empty() {
            self.pieces.push((self.parsed..self.parsed + parsed.len(), source));
            self.parsed += parsed.len();
        }
    }
}

impl Def {
    /// The value as WGSL writes it.
    fn wgsl(&self) -> String {
        match self {
            Def::Bool(v) => v.to_string(),
            Def::Int(v) => v.to_string(),
            Def::Uint(v) => v.to_string(),
        }
    }
}
