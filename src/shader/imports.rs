//! The `#import` line: what it names, and under which local name.

use super::lex::{self, Token, TokenKind};
use crate::diag::{Diagnostic, Source, Span};
use std::{ops::Range, sync::Arc};

/// One name that an `#import` brings in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Import {
    /// The name the file uses.
    pub local: String,
    /// A module, or a module, `::` and one of its items.
    pub path: String,
    pub range: Range<usize>,
}

/// Braces deeper than this are a fault: nobody means them, and each costs stack.
const MAX_DEPTH: usize = 32;

/// Reads `#import …` at `range` of `text`, which has no comments: `a::b`, `a as x`, `a::{b, c as d, e::{f}}`,
/// `"path"::{g}`, separated by commas.
pub(super) fn parse_imports(
    source: &Arc<Source>,
    text: &str,
    range: Range<usize>,
    imports: &mut Vec<Import>,
    faults: &mut Vec<Diagnostic>,
) {
    let words = lex::tokens(text, range);
    let mut parser = ImportParser { text, words: &words, at: 2, imports };
    if let Err((place, message)) = parser.list("", 0) {
        let help =
            "write `#import module::{a, b}`, `#import module::a` or `#import module as m`; a path stands in quotes";
        faults.push(Diagnostic::error(message).at(&Span::new(source, place), "").help(help));
    }
}

type ImportFault = (Range<usize>, &'static str);

struct ImportParser<'a> {
    text: &'a str,
    words: &'a [Token],
    at: usize,
    imports: &'a mut Vec<Import>,
}

impl<'a> ImportParser<'a> {
    fn peek(&self) -> Option<&'a Token> {
        self.words.get(self.at)
    }

    fn accept(&mut self, mark: char) -> bool {
        let found = self.peek().is_some_and(|w| w.is(mark));
        self.at += usize::from(found);
        found
    }

    /// The place of the word to come, or the last one's.
    fn here(&self) -> Range<usize> {
        self.peek().or(self.words.last()).map_or(0..0, |w| w.range.clone())
    }

    /// Items up to the closing brace, or up to the end at depth 0. Each is put behind `prefix`.
    fn list(&mut self, prefix: &str, depth: usize) -> Result<(), ImportFault> {
        if depth > MAX_DEPTH {
            return Err((self.here(), "an import nests too deep"));
        }
        let mut any = false;
        loop {
            if depth > 0 && self.accept('}') {
                break;
            }
            if depth == 0 && any && self.peek().is_none() {
                break;
            }
            self.item(prefix, depth)?;
            any = true;
            if self.accept(',') {
                continue;
            }
            if depth > 0 {
                if !self.accept('}') {
                    return Err((self.here(), "expected `,` or `}` in an import"));
                }
            } else {
                self.accept(';');
                if self.peek().is_some() {
                    return Err((self.here(), "unexpected text in an import"));
                }
            }
            break;
        }
        Ok(())
    }

    fn item(&mut self, prefix: &str, depth: usize) -> Result<(), ImportFault> {
        let Some(word) = self.peek().filter(|w| w.kind == TokenKind::Name) else {
            return Err((self.here(), "expected a name in an import"));
        };
        self.at += 1;
        let path = format!("{prefix}{}", word.text(self.text));
        if path.ends_with("::") {
            if !self.accept('{') {
                return Err((self.here(), "expected `{` or a name after `::`"));
            }
            return self.list(&path, depth + 1);
        }
        let mut local = path.rsplit("::").next().unwrap_or("").to_owned();
        if self.peek().is_some_and(|w| w.text(self.text) == "as") {
            self.at += 1;
            let Some(name) = self.peek().filter(|w| w.kind == TokenKind::Name) else {
                return Err((self.here(), "expected a name after `as`"));
            };
            name.text(self.text).clone_into(&mut local);
            self.at += 1;
        }
        self.imports.push(Import { local, path, range: word.range.clone() });
        Ok(())
    }
}
