//! What a file declares at module scope, read from its words: names, resource variables, struct members.

use super::lex::{Token, TokenKind};
use crate::diag::{Diagnostic, Source, Span};
use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Range,
    sync::Arc,
};

/// A declaration at module scope.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Declared {
    /// `fn`, `struct`, `var`, `const` or `alias`.
    pub keyword: String,
    /// Of the name.
    pub range: Range<usize>,
}

/// The declarations of a file; words by their index.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outline {
    pub declared: BTreeMap<String, Declared>,
    /// The `var` of each resource variable.
    pub resources: BTreeSet<usize>,
    /// Words of `@group(…)` and `@binding(…)`, which are left out: bindings come from names.
    pub attributes: BTreeSet<usize>,
    /// Names of struct members where they are declared.
    pub members: BTreeSet<usize>,
}

/// Finds the declarations among the words of `text`, which has no comments or directives.
pub(super) fn outline(source: &Arc<Source>, text: &str, words: &[Token], faults: &mut Vec<Diagnostic>) -> Outline {
    let mut out = Outline::default();
    let word = |at: usize| words.get(at).map_or("", |w| w.text(text));
    let mark = |at: usize, c: char| words.get(at).is_some_and(|w| w.is(c));
    let (mut braces, mut parens, mut at) = (0usize, 0usize, 0);
    let mut in_struct = false;
    while let Some(token) = words.get(at) {
        match token.kind {
            TokenKind::Mark('{') => braces += 1,
            TokenKind::Mark('}') => braces = braces.saturating_sub(1),
            TokenKind::Mark('(') => parens += 1,
            TokenKind::Mark(')') => parens = parens.saturating_sub(1),
            TokenKind::Mark('@') if braces == 0 && parens == 0 && ["group", "binding"].contains(&word(at + 1)) => {
                let end = (at + 2..words.len()).find(|i| mark(*i, ')')).unwrap_or(at + 1);
                out.attributes.extend(at..=end);
                at = end;
            }
            TokenKind::Name if in_struct && braces == 1 && parens == 0 && mark(at + 1, ':') => {
                out.members.insert(at);
            }
            TokenKind::Name if braces == 0 && parens == 0 && !mark(at.wrapping_sub(1), '@') => {
                let keyword = word(at);
                in_struct = keyword == "struct" || (in_struct && !is_keyword(keyword));
                if let Some((message, help)) = refused(keyword) {
                    faults.push(Diagnostic::error(message).at(&Span::new(source, token.range.clone()), "").help(help));
                } else if is_keyword(keyword) {
                    let template = if keyword == "var" { template_length(words, at + 1) } else { 0 };
                    if keyword == "var" && is_resource(word(at + 2), template) {
                        out.resources.insert(at);
                    }
                    let name = at + 1 + template;
                    if let Some(named) = words.get(name).filter(|w| w.kind == TokenKind::Name) {
                        let declared = Declared { keyword: keyword.to_owned(), range: named.range.clone() };
                        out.declared.entry(named.text(text).to_owned()).or_insert(declared);
                        at = name;
                    }
                }
            }
            TokenKind::Mark('"') => {
                let place = Span::new(source, token.range.clone());
                faults
                    .push(Diagnostic::error("a quote that is never closed").at(&place, "").help("WGSL has no strings"));
            }
            TokenKind::Mark('#') => {
                let place = Span::new(source, token.range.clone());
                let help = "write `#{NAME}` for the value of a definition; a directive begins its line";
                faults.push(Diagnostic::error("a stray `#`").at(&place, "").help(help));
            }
            _ => {}
        }
        at += 1;
    }
    out
}

fn is_keyword(word: &str) -> bool {
    ["fn", "struct", "var", "const", "alias"].contains(&word)
}

/// Declarations that composition can't carry, and what to write instead.
fn refused(word: &str) -> Option<(&'static str, &'static str)> {
    match word {
        "override" => Some(("`override` isn't supported", "use `const` with a definition: `const N = #{N};`")),
        "virtual" => Some(("`virtual` functions aren't supported", "choose by a definition with `#ifdef`")),
        "enable" | "requires" | "diagnostic" => {
            Some(("directives on language extensions aren't supported", "remove it: shaders keep to plain WGSL"))
        }
        _ => None,
    }
}

/// How many words `<…>` takes at word `at`.
fn template_length(words: &[Token], at: usize) -> usize {
    if !words.get(at).is_some_and(|w| w.is('<')) {
        return 0;
    }
    words.iter().skip(at).position(|w| w.is('>')).map_or(0, |p| p + 1)
}

/// A variable without an address space is a texture or a sampler.
fn is_resource(space: &str, template: usize) -> bool {
    template == 0 || space == "uniform" || space == "storage"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::lex;

    #[test]
    fn declarations_resources_and_members() {
        let text = "@group(1) @binding(2) var<storage, read_write> cells: array<f32, 4>;\nvar<private> seed: u32;\nvar t: texture_2d<f32>;\n\
            struct S { @location(0) a: f32, b: vec2<f32> }\n@compute @workgroup_size(8, 8) fn main(s: S) { var t2 = s.a; }\nalias A = f32;";
        let source = Source::new("a.wgsl", text);
        let words = lex::tokens(text, 0..text.len());
        let mut faults = vec![];
        let out = outline(&source, text, &words, &mut faults);
        let names: Vec<&str> = out.declared.keys().map(String::as_str).collect();
        assert_eq!(names, ["A", "S", "cells", "main", "seed", "t"]);
        assert_eq!(out.resources.len(), 2);
        assert_eq!(out.attributes.len(), 10);
        let members: Vec<&str> = out.members.iter().map(|i| words[*i].text(text)).collect();
        assert_eq!(members, ["a", "b"]);
        assert_eq!(faults, []);
    }
}
