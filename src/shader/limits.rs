//! What a shader may be at most, counted on its words before naga sees it.
//!
//! naga, its writers and the compilers of drivers descend into expressions, types and chains of declarations by
//! recursion, and naga writes constants out in full wherever they are named. A text of some kilobytes could end the
//! program by its depth, or take all memory.

use super::{
    lex::{Token, TokenKind},
    link::{LinkTarget, LinkUnit},
};
use crate::diag::{Diagnostic, Span};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// Bytes of a file at most.
const MAX_BYTES: usize = 1 << 20;

/// Brackets, operators and `else` around a word at most. The deepest of the shaders that ship has 48.
const MAX_DEPTH: usize = 1000;

/// Operators that an `else` counts for: a statement in a statement takes more stack than an operator.
const ELSE: usize = 4;

/// Declarations in a chain at most, each of which names the next: structs in structs, constants of constants, calls of
/// calls.
const MAX_CHAIN: usize = 200;

/// Scalars and structs that an expression may be written out to.
const MAX_PARTS: u64 = 65_536;

/// Bytes of stack for work on a shader within these limits. A level takes up to about 2 KiB without optimisation.
const STACK: usize = 64 << 20;

/// Files that a shader may be made of, and how many may stand between it and one that it imports.
pub(super) const MAX_FILES: usize = 512;
pub(super) const MAX_IMPORTS: usize = 64;

/// Runs `work` where the stack is deep enough for whatever [`check`] lets pass.
///
/// # Errors
/// The system gives no thread.
pub(super) fn on_deep_stack<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, Diagnostic> {
    // A browser has one thread, whose stack is as deep as whoever links the program says.
    if cfg!(target_arch = "wasm32") {
        return Ok(work());
    }
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().name("shader".into()).stack_size(STACK).spawn_scoped(scope, work);
        let thread = thread.map_err(|e| Diagnostic::error(format!("no thread to compose a shader on: {e}")))?;
        thread.join().map_err(|panic| std::panic::resume_unwind(panic))
    })
}

/// The limits that these units break, with their places: of each kind the first in a file.
pub(super) fn check(units: &[LinkUnit]) -> Vec<Diagnostic> {
    let mut faults: Vec<Diagnostic> = units.iter().filter_map(|u| length(u).or_else(|| depth(u))).collect();
    if faults.is_empty() {
        faults.extend(Items::new(units).chain_and_parts().err());
    }
    faults
}

fn length(unit: &LinkUnit) -> Option<Diagnostic> {
    let place = Span::new(&unit.source, 0..0);
    (unit.source.text.len() > MAX_BYTES)
        .then(|| Diagnostic::error("a shader file holds at most a mebibyte").at(&place, "").help("split it"))
}

/// A bracket or template list that is open.
struct Nesting {
    end: char,
    /// Operators since the last comma, semicolon or brace.
    operators: usize,
    /// What the `else` of the chain that goes on here count for.
    chain: usize,
}

impl Nesting {
    fn new(end: char) -> Nesting {
        Nesting { end, operators: 0, chain: 0 }
    }
}

fn depth(unit: &LinkUnit) -> Option<Diagnostic> {
    let (text, words) = (&unit.scan.text, &unit.words);
    let mut levels = vec![Nesting::new('\0')];
    let mut total = 0;
    for (at, word) in words.iter().enumerate() {
        let top = levels.last_mut()?;
        match word.kind {
            TokenKind::Mark('<') if is_template(words, text, at) => levels.push(Nesting::new('>')),
            TokenKind::Mark('>') if top.end == '>' => close(&mut levels, &mut total, '>'),
            TokenKind::Mark(open @ ('(' | '[' | '{')) => {
                let end = match open {
                    '(' => ')',
                    '[' => ']',
                    _ => '}',
                };
                levels.push(Nesting::new(end));
            }
            TokenKind::Mark(end @ (')' | ']' | '}')) => {
                close(&mut levels, &mut total, end);
                let top = levels.last_mut()?;
                if end != '}' {
                    // A call or an index stands round what is before it.
                    top.operators += 1;
                    total += 1;
                    continue;
                }
                total -= std::mem::take(&mut top.operators);
                if words.get(at + 1).is_some_and(|w| w.text(text) == "else") {
                    top.chain += ELSE;
                    total += ELSE;
                } else {
                    total -= std::mem::take(&mut top.chain);
                }
            }
            TokenKind::Mark(',' | ';') => total -= std::mem::take(&mut top.operators),
            TokenKind::Mark(mark) if "+-*/%&|^<>=!~.".contains(mark) => {
                top.operators += 1;
                total += 1;
            }
            _ => {}
        }
        if total + levels.len() > MAX_DEPTH {
            let place = Span::new(&unit.source, word.range.clone());
            let d = Diagnostic::error(format!("more than {MAX_DEPTH} operators, brackets or `else` round one word"));
            return Some(d.at(&place, "here").help("split it into several statements, or use a loop or a `switch`"));
        }
    }
    None
}

/// Closes the innermost bracket of this kind, and template lists in it that were none.
fn close(levels: &mut Vec<Nesting>, total: &mut usize, end: char) {
    let Some(at) = levels.iter().rposition(|l| l.end == end).filter(|at| *at > 0) else { return };
    *total -= levels.drain(at..).map(|l| l.operators + l.chain).sum::<usize>();
}

/// Whether a `<` opens a template list: only names that WGSL itself declares have one.
fn is_template(words: &[Token], text: &str, at: usize) -> bool {
    let Some(before) = at.checked_sub(1).and_then(|i| words.get(i)).filter(|w| w.kind == TokenKind::Name) else {
        return false;
    };
    let name = before.text(text);
    matches!(name, "array" | "ptr" | "atomic" | "bitcast" | "var") || name.starts_with("texture_") || is_vector(name)
}

/// `vec3`, `mat4x4`, and with the letter of their scalar.
fn is_vector(name: &str) -> bool {
    let shape = name.strip_prefix("vec").or_else(|| name.strip_prefix("mat"));
    shape.is_some_and(|s| s.starts_with(['2', '3', '4']) && s.len() <= 4)
}

/// The declarations of all units.
struct Items<'a> {
    units: &'a [LinkUnit],
    all: Vec<DeclaredItem<'a>>,
    /// By unit and word: the item that it names.
    meant: Vec<Vec<Option<usize>>>,
}

struct DeclaredItem<'a> {
    unit: usize,
    keyword: &'a str,
    /// Words from its name to the next declaration's.
    words: Range<usize>,
}

/// What is known of an item once all that it names is known.
#[derive(Clone, Copy)]
struct ItemCost {
    chain: usize,
    parts: u64,
}

/// By word of a unit: the item that it names. `named` are the items by name, of each unit.
fn meanings(u: &LinkUnit, unit: usize, named: &[HashMap<&str, usize>]) -> Vec<Option<usize>> {
    let (mut paths, mut member) = (u.paths.iter().peekable(), false);
    let meaning = |(i, word): (usize, &Token)| {
        let path = paths.next_if(|(at, _)| **at == i).map(|(_, target)| target);
        let after_dot = std::mem::replace(&mut member, word.is('.'));
        if word.kind != TokenKind::Name || after_dot {
            return None;
        }
        let text = word.text(&u.scan.text);
        match path.or_else(|| u.imports.get(text)) {
            Some(LinkTarget::Item(unit, name)) => named.get(*unit)?.get(name.as_str()).copied(),
            Some(LinkTarget::Module(_)) => None,
            None => named.get(unit)?.get(text).copied(),
        }
    };
    u.words.iter().enumerate().map(meaning).collect()
}

impl<'a> Items<'a> {
    fn new(units: &'a [LinkUnit]) -> Items<'a> {
        let (mut items, mut named) = (Items { units, all: vec![], meant: vec![] }, vec![]);
        for (unit, u) in units.iter().enumerate() {
            let place = |d: &super::outline::Declared| u.words.partition_point(|w| w.range.start < d.range.start);
            let mut starts: Vec<_> = u.outline.declared.iter().map(|(name, d)| (place(d), name.as_str(), d)).collect();
            starts.sort_unstable_by_key(|s| s.0);
            let ends: Vec<usize> = starts.iter().skip(1).map(|s| s.0).chain([u.words.len()]).collect();
            let mut own = HashMap::new();
            for ((start, name, declared), end) in starts.into_iter().zip(ends) {
                own.insert(name, items.all.len());
                items.all.push(DeclaredItem { unit, keyword: &declared.keyword, words: start..end });
            }
            named.push(own);
        }
        items.meant = units.iter().enumerate().map(|(i, u)| meanings(u, i, &named)).collect();
        items
    }

    /// The item that a word names.
    fn named_by(&self, unit: usize, word: usize) -> Option<usize> {
        *self.meant.get(unit)?.get(word)?
    }

    fn mentions(&self, item: usize) -> Vec<usize> {
        let Some(DeclaredItem { unit, words, .. }) = self.all.get(item) else { return vec![] };
        words.clone().skip(1).filter_map(|word| self.named_by(*unit, word)).collect()
    }

    /// Goes through all items, each after those that it names; in a circle, which naga reports, some come before.
    fn chain_and_parts(&self) -> Result<(), Diagnostic> {
        let mut known: Vec<Option<ItemCost>> = vec![None; self.all.len()];
        let mut seen = vec![false; self.all.len()];
        for first in 0..self.all.len() {
            let mut open = vec![(first, false)];
            while let Some((item, ready)) = open.pop() {
                if ready {
                    let chain = self.mentions(item).iter().filter_map(|m| Some(known[*m]?.chain)).max().unwrap_or(0);
                    if chain >= MAX_CHAIN {
                        let what =
                            format!("a chain of more than {MAX_CHAIN} declarations, each of which names the next");
                        let d = Diagnostic::error(what).at(&self.place(item), "begins here");
                        return Err(d.help("write some of them out where they are named"));
                    }
                    known[item] = Some(ItemCost { chain: chain + 1, parts: self.parts(item, &known)? });
                } else if !std::mem::replace(&mut seen[item], true) {
                    open.push((item, true));
                    open.extend(self.mentions(item).into_iter().filter(|m| !seen[*m]).map(|m| (m, false)));
                }
            }
        }
        Ok(())
    }

    fn place(&self, item: usize) -> Span {
        let DeclaredItem { unit, words, .. } = &self.all[item];
        let u = &self.units[*unit];
        Span::new(&u.source, u.words.get(words.start).map_or(0..0, |w| w.range.clone()))
    }

    /// How many parts the largest value of an item has when everything that it names is written out.
    fn parts(&self, item: usize, known: &[Option<ItemCost>]) -> Result<u64, Diagnostic> {
        let DeclaredItem { unit, words, .. } = &self.all[item];
        let u = &self.units[*unit];
        let mut locals: BTreeMap<&str, u64> = BTreeMap::new();
        let mut most = 1;
        let ends = |w: &Token| matches!(w.kind, TokenKind::Mark(';' | '{' | '}'));
        let mut start = words.start;
        for end in words.clone().filter(|at| ends(&u.words[*at])).chain([words.end]) {
            let statement = start..end;
            start = end + 1;
            let parts = self.written_out(*unit, statement.clone(), &locals, known);
            if parts > MAX_PARTS {
                let at = |i: usize| u.words.get(i).map_or(0..0, |w| w.range.clone());
                let place = Span::new(&u.source, at(statement.start).start..at(end.max(1) - 1).end);
                let d = Diagnostic::error(format!("written out, this has more than {MAX_PARTS} parts"));
                return Err(d.at(&place, "").help("keep large tables in a buffer or a texture"));
            }
            most = most.max(parts);
            let text = |i: usize| u.words.get(i).map_or("", |w| w.text(&u.scan.text));
            if matches!(text(statement.start), "const" | "let" | "var") {
                let name = statement.clone().skip(1).find(|i| !matches!(text(*i), "<" | ">" | "," | "function"));
                locals.extend(name.map(|i| (text(i), parts)));
            }
        }
        Ok(if self.all[item].keyword == "fn" { 1 } else { most })
    }

    /// How many parts a statement has.
    fn written_out(
        &self,
        unit: usize,
        statement: Range<usize>,
        locals: &BTreeMap<&str, u64>,
        known: &[Option<ItemCost>],
    ) -> u64 {
        let u = &self.units[unit];
        let text = |i: usize| u.words.get(i).map_or("", |w| w.text(&u.scan.text));
        let mut open = vec![Sum { whole: false, before: 0, last: 1 }];
        let mut template = 0;
        // The name before a bracket, or before the template list that stands between.
        let mut callee = None;
        for at in statement {
            let Some(word) = u.words.get(at) else { break };
            let Some(top) = open.last_mut() else { break };
            match word.kind {
                TokenKind::Mark('<') if template > 0 || is_template(&u.words, &u.scan.text, at) => template += 1,
                TokenKind::Mark('>') if template > 0 => template -= 1,
                _ if template > 0 => {}
                TokenKind::Name => {
                    let item = self.named_by(unit, at);
                    let parts = locals.get(text(at)).copied().or_else(|| Some(known[item?]?.parts)).unwrap_or(1);
                    top.last = top.last.max(parts);
                    callee = Some((at, item));
                    continue;
                }
                TokenKind::Number | TokenKind::Definition => top.last = top.last.max(1),
                TokenKind::Mark(mark @ ('(' | '[')) => {
                    let made = callee.is_some_and(|(at, item)| {
                        let keyword = item.and_then(|i| self.all.get(i)).map_or("", |i| i.keyword);
                        text(at) == "array" || matches!(keyword, "struct" | "alias")
                    });
                    // What another function returns is no larger than its own values; brackets alone change nothing.
                    let kept = mark == '(' && (made || callee.is_none());
                    open.push(Sum { whole: kept, before: 0, last: 0 });
                }
                TokenKind::Mark(',') => {
                    top.before = top.before.saturating_add(top.last);
                    top.last = 0;
                }
                TokenKind::Mark(')' | ']') if open.len() > 1 => {
                    let inner = open.pop().map_or(1, |s| if s.whole { s.before.saturating_add(s.last) } else { 1 });
                    if let Some(top) = open.last_mut() {
                        top.last = top.last.max(inner);
                    }
                }
                _ => {}
            }
            if template == 0 && !word.is('>') {
                callee = None;
            }
        }
        open.into_iter().map(|s| s.before.saturating_add(s.last)).max().unwrap_or(1)
    }
}

/// The values in a bracket so far.
struct Sum {
    /// They make one value together.
    whole: bool,
    /// Parts of the values before the last comma.
    before: u64,
    /// Of the value since: of its largest operand.
    last: u64,
}

#[cfg(test)]
mod tests {
    use crate::diag::{Faults, Source, render};
    use crate::shader::{Defs, Library, compose};

    const MAIN: &str = "@compute @workgroup_size(1) fn main() { ";

    fn refused(files: &[(&str, String)]) -> String {
        let mut library = Library::default();
        for (name, text) in files {
            library.files.insert((*name).into(), Source::new(*name, text.as_str()));
        }
        // As small a stack as any thread has that asks for a shader.
        let run = || compose(&library, files[0].0, &Defs::new(), &[]).map(drop);
        match std::thread::scope(|s| s.spawn(run).join().unwrap()) {
            Ok(()) => String::new(),
            Err(Faults(faults)) => {
                assert!(faults.iter().all(|d| !d.labels.is_empty()), "no place: {}", render(&faults));
                faults[0].message.clone()
            }
        }
    }

    fn alone(text: String) -> String {
        refused(&[("a.wgsl", text)])
    }

    fn statement(text: String) -> String {
        alone(format!("var<storage, read_write> data: array<f32>;\n{MAIN}let at = vec2f(1.0);\nlet i = 1u;\n{text} }}"))
    }

    fn sum(terms: usize) -> String {
        statement(format!("data[0] = at.x{};", "+at.x".repeat(terms)))
    }

    #[test]
    fn deep_expressions_are_refused_by_name_and_shallower_ones_composed() {
        let deep = "more than 1000 operators";
        assert!(sum(12_000).contains(deep));
        assert!(sum(490).is_empty(), "{}", sum(490));
        // A comma in a template list separates no terms.
        assert!(statement(format!("data[0] = 1.0{};", "+array<f32, 1>(1.0)[0]".repeat(4000))).contains(deep));
        assert!(statement(format!("if true{} {{}}", "&&true".repeat(20_000))).contains(deep));
        assert!(statement(format!("data[0] = {}1.0;", "-".repeat(20_000))).contains(deep));
        assert!(statement(format!("data[0] = at{};", ".xy".repeat(20_000))).contains(deep));
        assert!(statement(format!("if i == 0u {{}}{}", " else if i == 1u {}".repeat(8_000))).contains(deep));
        let chain = statement(format!("if i == 0u {{}}{}", " else if i == 1u { data[0] = -at.x * 2.0; }".repeat(240)));
        assert!(chain.is_empty(), "{chain}");
        let many = statement("if i < 2u { data[i] += at.x * 2.0; } else { data[0] = -at.y; }\n".repeat(3000));
        assert!(many.is_empty(), "{many}");
    }

    #[test]
    fn several_deep_shaders_at_once_end_nothing() {
        std::thread::scope(|s| {
            let all: Vec<_> = (0..6).map(|_| s.spawn(|| (sum(5_000), sum(490)))).collect();
            for one in all {
                let (deep, shallow) = one.join().unwrap();
                assert!(deep.contains("more than 1000") && shallow.is_empty());
            }
        });
    }

    #[test]
    fn chains_of_declarations_are_refused() {
        let chain = "a chain of more than 200 declarations";
        let structs = |n: usize| (1..n).map(|i| format!("struct S{i} {{ a: S{} }}\n", i - 1)).collect::<String>();
        let nested = |n| alone(format!("struct S0 {{ a: f32 }}\n{}{MAIN} var s: S{}; }}", structs(n), n - 1));
        assert!(nested(20_000).contains(chain));
        assert!(!nested(100).contains(chain));
        let constants: String = (1..5000).rev().map(|i| format!("const C{i} = C{} + 1;\n", i - 1)).collect();
        assert!(alone(format!("const C0 = 1;\n{constants}{MAIN} }}")).contains(chain));
        let calls: String = (1..5000).rev().map(|i| format!("fn f{i}() {{ f{}(); }}\n", i - 1)).collect();
        assert!(alone(format!("fn f0() {{}}\n{calls}{MAIN} f4999(); }}")).contains(chain));
        let alone_again: String = (1..5000).map(|i| format!("const C{i} = {i};\n")).collect();
        let wide = alone(format!("{alone_again}{MAIN} }}"));
        assert!(wide.is_empty(), "{wide}");
    }

    #[test]
    fn imports_of_imports_of_imports_are_refused() {
        let file = |i: usize, n: usize| match i {
            0 => format!("#import m1::f\n{MAIN} f(); }}"),
            _ if i + 1 == n => format!("#define_import_path m{i}\nfn f() {{}}"),
            _ => format!("#define_import_path m{i}\n#import m{}::f as g\nfn f() {{ g(); }}", i + 1),
        };
        let names: Vec<String> = (0..3000).map(|i| format!("f{i}.wgsl")).collect();
        let all = |n: usize| (0..n).map(|i| (names[i].as_str(), file(i, n))).collect::<Vec<_>>();
        assert!(refused(&all(3000)).contains("more than 64 files"), "{}", refused(&all(3000)));
        assert_eq!(refused(&all(30)), "");
    }

    #[test]
    fn constants_that_grow_by_doubling_are_refused() {
        let parts = "more than 65536 parts";
        let doubled = |keyword: &str| {
            let line = |i| format!("{keyword} c{i} = array(c{}, c{});\n", i - 1, i - 1);
            (1..26).map(line).collect::<String>()
        };
        assert!(alone(format!("const c0 = array(1.0, 2.0);\n{}{MAIN} }}", doubled("const"))).contains(parts));
        assert!(statement(format!("const c0 = array(1.0, 2.0);\n{}", doubled("const"))).contains(parts));
        let structs = "struct P { a: array<f32, 300>, b: array<f32, 300> }\n";
        let large = format!("const t = array<f32, 300>({});\n", "1.0, ".repeat(300));
        let all = format!("const u = array({});", "P(t, t), ".repeat(200));
        assert!(alone(format!("{structs}{large}{all}{MAIN} }}")).contains(parts));
        // Scalars and vectors stay as large as they are.
        let squares: String =
            (1..60).map(|i| format!("const q{i} = vec2f(q{0}.x * q{0}.y, q{0}.y);\n", i - 1)).collect();
        let fine = alone(format!("const q0 = vec2f(1.0, 0.5);\n{squares}{MAIN} }}"));
        assert!(fine.is_empty(), "{fine}");
        let table = alone(format!("const t = array<f32, 4096>({});\n{MAIN} let x = t[3]; }}", "1.0, ".repeat(4096)));
        assert!(table.is_empty(), "{table}");
    }
}
