//! Directives of a file: `#ifdef`, `#if`, `#import`, `#define_import_path`, `#{NAME}`, each fault with its place.
//!
//! Conditions are settled here and not by naga_oil, which takes a false definition for a defined one, reads
//! `#if NAME` as a comparison with its last letter, and reports places that drift behind a `#{NAME}`.

use super::{
    compose::{Def, Defs},
    imports::{Import, parse_imports},
    lex::{self, TokenKind},
    report::HERE,
};
use crate::diag::{Diagnostic, Source, Span};
use std::{collections::BTreeSet, ops::Range, sync::Arc};

/// What the directives of a file say, for one set of definitions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scan {
    /// The text without comments, directives and branches not taken: all blanked, byte for byte in its place.
    pub text: String,
    /// The name given by `#define_import_path`, and where.
    pub module: Option<(String, Range<usize>)>,
    pub imports: Vec<Import>,
    /// Definitions that any branch asks for.
    pub mentioned: BTreeSet<String>,
}

const DIRECTIVES: [&str; 7] = ["ifdef", "ifndef", "if", "else", "endif", "import", "define_import_path"];

/// A condition that is open.
struct Branch {
    /// Its text is kept.
    active: bool,
    /// It, or one before it, was taken; or none may be, as the text around it is left out.
    settled: bool,
    /// `#else` has come.
    last: bool,
    place: Range<usize>,
}

/// Reads the directives. Without definitions every branch is kept: what the file may ask for under any.
pub(super) fn scan(source: &Arc<Source>, defs: Option<&Defs>, faults: &mut Vec<Diagnostic>) -> Scan {
    let clean = lex::blank_comments(source, faults);
    let mut scan =
        Scan { text: String::with_capacity(clean.len()), module: None, imports: vec![], mentioned: BTreeSet::new() };
    let mut open: Vec<Branch> = vec![];
    let mut lines = lines(&clean).into_iter();
    while let Some(line) = lines.next() {
        let text = clean.get(line.clone()).unwrap_or("");
        let active = open.last().is_none_or(|b| b.active);
        // Directives and definitions have the mark; other lines are read once their branch is known to be taken.
        let words = if text.contains('#') { lex::tokens(&clean, line.clone()) } else { vec![] };
        note_definitions(&clean, &words, &mut scan.mentioned);
        if !words.first().is_some_and(|w| w.is('#')) {
            if active {
                scan.text.push_str(text);
            } else {
                lex::blank(&mut scan.text, text.len());
            }
            scan.text.push('\n');
            continue;
        }
        let mut reader = DirectiveReader { source, text: &clean, words: &words, defs, faults };
        let mut whole = line.clone();
        match reader.name(1) {
            "ifdef" | "ifndef" | "if" => {
                let holds = reader.condition(1, active, &mut scan.mentioned);
                open.push(Branch { active: active && holds, settled: !active || holds, last: false, place: line });
            }
            "else" => reader.otherwise(&mut open, &mut scan.mentioned),
            "endif" => {
                if open.pop().is_none() {
                    reader.fault(0..2, "`#endif` without a condition before it", "remove it");
                }
                reader.ends(2);
            }
            "import" => {
                // A list in braces goes on over lines.
                while unclosed(clean.get(whole.clone()).unwrap_or("")) {
                    let Some(next) = lines.next() else { break };
                    whole.end = next.end;
                }
                if active {
                    parse_imports(source, &clean, whole.clone(), &mut scan.imports, faults);
                }
            }
            "define_import_path" if active => {
                let rest = words.get(2).map_or(line.end, |w| w.range.start)..line.end;
                let name = clean.get(rest.clone()).unwrap_or("").trim();
                if name.is_empty() || name.contains(['"', ' ', '\t']) {
                    reader.fault(0..words.len(), "a module needs one name", "write `#define_import_path name`");
                } else if scan.module.is_some() {
                    reader.fault(0..words.len(), "a second `#define_import_path`", "keep one");
                } else {
                    scan.module = Some((name.to_owned(), rest.start..rest.start + name.len()));
                }
            }
            "define_import_path" => {}
            "define" if active => {
                reader.fault(
                    0..2,
                    "definitions don't stand in shaders",
                    "give it in the graph, under `defines`, or use `const`",
                );
            }
            other if active => reader.unknown(other),
            _ => {}
        }
        for c in clean.get(whole).unwrap_or("").chars() {
            if c == '\n' { scan.text.push('\n') } else { lex::blank(&mut scan.text, c.len_utf8()) }
        }
        scan.text.push('\n');
    }
    for branch in &open {
        let place = Span::new(source, branch.place.clone());
        faults.push(
            Diagnostic::error("a condition is never closed").at(&place, "opened here").help("close it with `#endif`"),
        );
    }
    scan
}

/// Byte ranges of the lines, without their ends.
fn lines(text: &str) -> Vec<Range<usize>> {
    let mut start = 0;
    text.split_terminator('\n')
        .map(|line| {
            let range = start..start + line.len();
            start = range.end + 1;
            range
        })
        .collect()
}

fn unclosed(text: &str) -> bool {
    text.matches('{').count() > text.matches('}').count()
}

fn note_definitions(text: &str, words: &[lex::Token], mentioned: &mut BTreeSet<String>) {
    let names = words.iter().filter(|w| w.kind == TokenKind::Definition).map(|w| w.definition(text));
    // A place is no definition that anybody gives.
    mentioned.extend(names.filter(|name| *name != HERE).map(ToOwned::to_owned));
}

/// One line that begins with `#`.
struct DirectiveReader<'a> {
    source: &'a Arc<Source>,
    text: &'a str,
    words: &'a [lex::Token],
    defs: Option<&'a Defs>,
    faults: &'a mut Vec<Diagnostic>,
}

impl<'a> DirectiveReader<'a> {
    fn name(&self, at: usize) -> &'a str {
        self.words.get(at).filter(|w| w.kind == TokenKind::Name).map_or("", |w| w.text(self.text))
    }

    fn place(&self, words: Range<usize>) -> Span {
        let taken = self.words.get(words.start..words.end.min(self.words.len())).unwrap_or(self.words);
        let taken = if taken.is_empty() { self.words } else { taken };
        let start = taken.first().map_or(0, |w| w.range.start);
        Span::new(self.source, start..taken.last().map_or(start, |w| w.range.end))
    }

    fn fault(&mut self, words: Range<usize>, message: impl Into<String>, help: &str) {
        let place = self.place(words);
        self.faults.push(Diagnostic::error(message).at(&place, "").help(help));
    }

    fn unknown(&mut self, directive: &str) {
        let place = self.place(0..2);
        self.faults.push(
            Diagnostic::error(format!("unknown directive `#{directive}`"))
                .at(&place, "")
                .nearest(directive, DIRECTIVES)
                .help("a directive is one of #ifdef #ifndef #if #else #endif #import #define_import_path; a value is `#{NAME}`"),
        );
    }

    /// Nothing may stand from word `at` on.
    fn ends(&mut self, at: usize) {
        if at < self.words.len() {
            self.fault(at..self.words.len(), "unexpected text after a directive", "remove it, or make it a comment");
        }
    }

    fn otherwise(&mut self, open: &mut [Branch], mentioned: &mut BTreeSet<String>) {
        let Some(branch) = open.last_mut() else {
            return self.fault(0..2, "`#else` without a condition before it", "remove it");
        };
        if branch.last {
            self.fault(0..2, "a second `#else` in one condition", "close the first condition with `#endif`");
        }
        let every = self.defs.is_none();
        if self.words.len() > 2 {
            let holds = self.condition(2, !branch.settled || every, mentioned);
            branch.active = (!branch.settled || every) && holds;
        } else {
            branch.active = !branch.settled || every;
            branch.last = true;
        }
        branch.settled |= branch.active;
    }

    /// The condition whose keyword is word `at`. When it doesn't `matter`, only its form is read.
    fn condition(&mut self, at: usize, matters: bool, mentioned: &mut BTreeSet<String>) -> bool {
        let keyword = self.name(at);
        let name = self.name(at + 1);
        if !["ifdef", "ifndef", "if"].contains(&keyword) {
            self.fault(
                at..self.words.len(),
                "expected `ifdef`, `ifndef` or `if` after `#else`",
                "end the line after `#else`",
            );
            return true;
        }
        if name.is_empty() {
            self.fault(0..self.words.len(), format!("`#{keyword}` needs the name of a definition"), "name one");
            return true;
        }
        mentioned.insert(name.to_owned());
        let defined = |defs: &Defs| defs.get(name).is_some_and(|d| *d != Def::Bool(false));
        match keyword {
            "ifdef" => {
                self.ends(at + 2);
                self.defs.is_none_or(defined)
            }
            "ifndef" => {
                self.ends(at + 2);
                self.defs.is_none_or(|defs| !defined(defs))
            }
            _ => self.comparison(at, name, matters),
        }
    }

    /// `#if NAME op VALUE`.
    fn comparison(&mut self, at: usize, name: &str, matters: bool) -> bool {
        let rest = self.words.get(at + 1).map_or(0, |w| w.range.end)..self.words.last().map_or(0, |w| w.range.end);
        let rest = self.text.get(rest).unwrap_or("").trim();
        let split = rest.find(|c| !"=!<>".contains(c)).unwrap_or(rest.len());
        let (operator, value) = (&rest[..split], rest[split..].trim());
        let whole = 0..self.words.len();
        if !["==", "!=", "<", "<=", ">", ">="].contains(&operator) {
            let help = "write `#if NAME == VALUE` (or != < <= > >=), or `#ifdef NAME`";
            self.fault(whole, format!("`#if {name}` needs a comparison"), help);
            return true;
        }
        let wanted = match value {
            "true" => Some((true, 1)),
            "false" => Some((true, 0)),
            _ => value.trim_end_matches(['u', 'i']).parse::<i64>().ok().map(|v| (false, v)),
        };
        let Some((boolean, wanted)) = wanted else {
            self.fault(
                whole,
                format!("`{value}` is neither an integer nor `true` or `false`"),
                "compare with one of them",
            );
            return true;
        };
        let Some(defs) = self.defs.filter(|_| matters) else { return true };
        let (is_boolean, held) = match defs.get(name) {
            Some(Def::Bool(v)) => (true, i64::from(*v)),
            Some(Def::Int(v)) => (false, i64::from(*v)),
            Some(Def::Uint(v)) => (false, i64::from(*v)),
            None => {
                let unknown = unknown_definition(name, &self.place(whole), defs);
                self.faults.push(unknown);
                return true;
            }
        };
        if boolean != is_boolean || (boolean && !["==", "!="].contains(&operator)) {
            let kind = if is_boolean { "a boolean" } else { "an integer" };
            let message = format!("`{name}` is {kind} and can't be compared by `{operator} {value}`");
            self.fault(
                whole,
                message,
                "compare a boolean by == or != with `true` or `false`, an integer with integers",
            );
            return true;
        }
        match operator {
            "==" => held == wanted,
            "!=" => held != wanted,
            "<" => held < wanted,
            "<=" => held <= wanted,
            ">" => held > wanted,
            _ => held >= wanted,
        }
    }
}

/// The fault of a definition that the graph doesn't give.
pub(super) fn unknown_definition(name: &str, place: &Span, defs: &Defs) -> Diagnostic {
    Diagnostic::error(format!("unknown definition `{name}`"))
        .at(place, "")
        .nearest(name, defs.keys().map(String::as_str))
        .help(format!("give `{name}` in the graph, under `defines`"))
}
