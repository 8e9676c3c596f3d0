//! Reads the nodes of a tree as names, expressions, numbers, words, lists and maps. Gathers every fault.

use super::ast::{Name, Spanned, set_of};
use super::expr::Expr;
use super::join::{Joined, TREE};
use super::tree::{Field, SyntaxKind, SyntaxNode};
use crate::diag::{Diagnostic, Span, nearest};
use rustc_hash::FxHashSet;
use std::path::PathBuf;

/// Names by name, and expressions.
pub(super) type Names = Vec<(Name, Name)>;
pub(super) type Exprs = Vec<(Name, Expr)>;

/// Reads parts of a tree and gathers the faults; what can't be read is left out and counted as a fault.
#[derive(Default)]
pub struct Reader {
    pub faults: Vec<Diagnostic>,
    /// Names whose declarations can't be read: that they are missing is no further fault.
    pub(super) broken: Vec<String>,
    /// A whole section can't be read: which names it declares is unknown.
    pub(super) lost: bool,
    /// The sub-graphs of the graph that is read.
    pub(super) joined: Vec<Joined>,
    /// Files of the images so far, and their bytes unpacked.
    pub(super) images: Vec<PathBuf>,
    pub(super) image_bytes: u64,
}

/// The fields of one struct that are still to be read.
pub struct Fields<'t> {
    what: &'static str,
    pub(super) span: &'t Span,
    fields: &'t [Field],
    /// Some more than once.
    asked: Vec<&'static str>,
}

impl<'t> Fields<'t> {
    /// An optional field; `None` stands for one that is not there. A second field of the same name is a fault when the
    /// struct is finished.
    pub fn get(&mut self, name: &'static str) -> Option<&'t SyntaxNode> {
        self.choice(name).filter(|n| n.word() != Some("None"))
    }

    /// As [`Fields::get`], where `None` is one of the words that the field takes.
    pub fn choice(&mut self, name: &'static str) -> Option<&'t SyntaxNode> {
        self.asked.push(name);
        self.field(name).map(|f| &f.value)
    }

    /// What was asked for, each once.
    fn known(&self) -> Vec<&'static str> {
        let mut known = vec![];
        self.asked.iter().for_each(|name| {
            if !known.contains(name) {
                known.push(*name)
            }
        });
        known
    }

    /// A field with its name.
    pub(super) fn field(&self, name: &str) -> Option<&'t Field> {
        self.fields.iter().find(|f| f.name.text() == name)
    }
}

impl Reader {
    /// Notes a fault.
    pub fn fault(&mut self, d: Diagnostic) {
        self.faults.push(d);
    }

    /// A struct `Name(…)`, whose name must be among `names`; `None` and a fault otherwise.
    pub fn named<'t>(&mut self, node: &'t SyntaxNode, names: &[&'static str]) -> Option<(&'static str, Fields<'t>)> {
        let (name, fields) = match &node.kind {
            SyntaxKind::Struct(Some(name), fields) => (name.text(), fields.as_slice()),
            SyntaxKind::Word => (node.span.text(), [].as_slice()),
            _ => {
                self.fault(
                    Diagnostic::error(format!("expected {}", one_of(names)))
                        .at(&node.span, "")
                        .help("write it as `Name(field: value, …)`"),
                );
                return None;
            }
        };
        let Some(known) = names.iter().find(|n| **n == name) else {
            let d = Diagnostic::error(format!("unknown kind `{name}`, expected {}", one_of(names)));
            self.fault(d.at(&node.span, "").nearest(name, names.iter().copied()));
            return None;
        };
        Some((known, Fields { what: known, span: &node.span, fields, asked: Vec::with_capacity(24) }))
    }

    /// Reports the fields nobody asked for and those that stand twice.
    pub fn finish(&mut self, fields: &Fields) {
        let mut seen = FxHashSet::default();
        for f in fields.fields {
            let name = f.name.text();
            let first = seen.insert(name);
            if !fields.asked.contains(&name) && name != TREE {
                let d = Diagnostic::error(format!("`{}` has no field `{name}`", fields.what)).at(&f.name, "unknown");
                let near = nearest(name, fields.asked.iter().copied());
                let d = match near {
                    Some(n) => d.help(format!("did you mean `{n}`?")),
                    None => d.help(format!("it has {}", fields.known().join(", "))),
                };
                self.fault(d);
            } else if !first {
                self.fault(Diagnostic::error(format!("`{name}` stands twice")).at(&f.name, "the second"));
            }
        }
    }

    /// A field that must be there.
    pub fn need<'t>(&mut self, fields: &mut Fields<'t>, name: &'static str) -> Option<&'t SyntaxNode> {
        let node = fields.get(name);
        if node.is_none() {
            self.fault(Diagnostic::error(format!("`{}` needs a field `{name}`", fields.what)).at(fields.span, ""));
        }
        node
    }

    /// A quoted string.
    pub fn text(&mut self, node: &SyntaxNode) -> Option<Name> {
        let text = node.quoted().map(|span| Spanned { value: span.text().to_string(), span });
        if text.is_none() {
            self.fault(Diagnostic::error("expected a string in quotes").at(&node.span, ""));
        }
        text
    }

    /// Text in quotes, which may go on over several lines: what is white there is a space.
    pub fn prose(&mut self, node: &SyntaxNode) -> Option<String> {
        self.text(node).map(|text| text.value.split_whitespace().collect::<Vec<_>>().join(" "))
    }

    /// A name as WGSL and expressions can write it; one of a sub-graph has the sub-graph's before it, and a dot; one of
    /// a set has its number behind it: `chain[level + 1]`.
    pub fn name(&mut self, node: &SyntaxNode) -> Option<Name> {
        let name = self.text(node)?;
        let plain = |name: &str| {
            name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
                && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
                && !name.contains("__")
        };
        let index = name.value.find('[');
        if let Some(at) = index.filter(|_| name.value.ends_with(']')) {
            let Span { source, start, end } = &name.span;
            let span = Span::new(source, start + at + 1..end - 1);
            if let Err(d) = Expr::parse(&span, span.text()) {
                self.fault(d);
                return None;
            }
        }
        let unclosed = index.is_some() && !name.value.ends_with(']');
        if unclosed || !set_of(&name.value).split('.').all(plain) {
            self.fault(unfit(&name));
            return None;
        }
        Some(name)
    }

    /// A name that the graph gives something itself.
    pub(super) fn own_name(&mut self, node: &SyntaxNode) -> Option<Name> {
        let name = self.name(node)?;
        if name.value.contains(['.', '[']) {
            self.fault(unfit(&name));
            return None;
        }
        Some(name)
    }

    /// An expression: a string, a bare number or a boolean.
    pub fn expr(&mut self, node: &SyntaxNode) -> Option<Expr> {
        let place = node.quoted().or_else(|| node.word().map(|_| node.span.clone()));
        let Some(place) = place else {
            self.fault(Diagnostic::error("expected an expression: a string or a number").at(&node.span, ""));
            return None;
        };
        match Expr::parse(&place, place.text()) {
            Ok(e) => Some(e),
            Err(d) => {
                self.fault(d);
                None
            }
        }
    }

    /// `true` or `false`.
    pub fn bool(&mut self, node: Option<&SyntaxNode>, default: bool) -> bool {
        let Some(node) = node else { return default };
        match node.word() {
            Some(w @ ("true" | "false")) => w == "true",
            _ => {
                self.fault(Diagnostic::error("expected `true` or `false`").at(&node.span, ""));
                default
            }
        }
    }

    /// A finite number.
    pub fn number(&mut self, node: &SyntaxNode) -> Option<f64> {
        let number = node.word().and_then(|w| w.parse::<f64>().ok()).filter(|x| x.is_finite());
        if number.is_none() {
            self.fault(Diagnostic::error("expected a finite number").at(&node.span, ""));
        }
        number
    }

    /// The numbers of a tuple; a bare number stands for a tuple of one.
    pub fn numbers(&mut self, node: &SyntaxNode) -> Option<Vec<f64>> {
        match &node.kind {
            SyntaxKind::Tuple(None, items) => items.iter().map(|n| self.number(n)).collect(),
            _ => self.number(node).map(|x| vec![x]),
        }
    }

    /// Four numbers; one number stands for all four.
    pub(super) fn color(&mut self, node: &SyntaxNode) -> Option<[f64; 4]> {
        let v = self.numbers(node)?;
        match v[..] {
            [x] => Some([x; 4]),
            [x, y, z, w] => Some([x, y, z, w]),
            _ => {
                self.fault(Diagnostic::error("expected one number or four: (r, g, b, a)").at(&node.span, ""));
                None
            }
        }
    }

    /// One of some bare words; `default` without one.
    pub fn word<T: Copy>(&mut self, node: Option<&SyntaxNode>, choices: &[(&'static str, T)], default: T) -> T {
        let Some(node) = node else { return default };
        let word = node.word().unwrap_or("");
        if let Some((_, v)) = choices.iter().find(|(n, _)| *n == word) {
            return *v;
        }
        let names: Vec<&str> = choices.iter().map(|c| c.0).collect();
        let d = Diagnostic::error(format!("expected {}", one_of(&names))).at(&node.span, "");
        self.fault(d.nearest(word, names.iter().copied()));
        default
    }

    /// The entries of `{…}`.
    pub fn map<'t>(&mut self, node: Option<&'t SyntaxNode>) -> &'t [(SyntaxNode, SyntaxNode)] {
        match node.map(|n| (&n.kind, n)) {
            None => &[],
            Some((SyntaxKind::Map(pairs), _)) => pairs,
            Some((_, n)) => {
                self.fault(Diagnostic::error("expected a map `{\"name\": value}`").at(&n.span, ""));
                self.lost = true;
                &[]
            }
        }
    }

    /// The items of `[…]`.
    pub fn list<'t>(&mut self, node: Option<&'t SyntaxNode>) -> &'t [SyntaxNode] {
        match node.map(|n| (&n.kind, n)) {
            None => &[],
            Some((SyntaxKind::List(items), _)) => items,
            Some((_, n)) => {
                self.fault(Diagnostic::error("expected a list `[…]`").at(&n.span, ""));
                &[]
            }
        }
    }

    /// A map from names to expressions.
    pub(super) fn exprs(&mut self, node: Option<&SyntaxNode>) -> Vec<(Name, Expr)> {
        self.pairs(node, Reader::expr)
    }

    /// A map from names to names.
    pub fn names(&mut self, node: Option<&SyntaxNode>) -> Vec<(Name, Name)> {
        self.pairs(node, Reader::name)
    }

    /// A map from variables to names, or to names and a level of each: `(of: "chain", mip: "level")`.
    pub(super) fn bindings(&mut self, node: Option<&SyntaxNode>) -> (Names, Exprs) {
        let said = self.pairs(node, |reader, node| {
            let SyntaxKind::Struct(None, fields) = &node.kind else { return Some((reader.name(node)?, None)) };
            let mut f = Fields { what: "a binding", span: &node.span, fields, asked: vec![] };
            let of = reader.need(&mut f, "of").and_then(|n| reader.name(n));
            let mip = reader.need(&mut f, "mip").and_then(|n| reader.expr(n));
            reader.finish(&f);
            Some((of?, Some(mip?)))
        });
        let mips = said.iter().filter_map(|(from, (_, mip))| Some((from.clone(), mip.clone()?))).collect();
        (said.into_iter().map(|(from, (to, _))| (from, to)).collect(), mips)
    }

    /// As [`Reader::pairs`], for names that the graph gives.
    pub(super) fn declared<T>(
        &mut self,
        node: Option<&SyntaxNode>,
        read: impl Fn(&mut Reader, &SyntaxNode) -> Option<T>,
    ) -> Vec<(Name, T)> {
        let pairs = self.pairs(node, read);
        let (good, bad): (Vec<_>, Vec<_>) = pairs.into_iter().partition(|(name, _)| !name.value.contains(['.', '[']));
        self.faults.extend(bad.iter().map(|(name, _)| unfit(name)));
        good
    }

    /// A map from names to what `read` makes of the values; notes the names for which it makes nothing.
    pub(super) fn pairs<T>(
        &mut self,
        node: Option<&SyntaxNode>,
        read: impl Fn(&mut Reader, &SyntaxNode) -> Option<T>,
    ) -> Vec<(Name, T)> {
        let mut pairs = vec![];
        for (key, value) in self.map(node) {
            let (name, value) = (self.name(key), read(self, value));
            match (name, value) {
                (Some(name), Some(value)) => pairs.push((name, value)),
                _ => self.broken.push(key.span.text().trim_matches('"').to_string()),
            }
        }
        pairs
    }
}

fn unfit(name: &Name) -> Diagnostic {
    let d = Diagnostic::error(format!("`{}` can't be a name", name.value)).at(&name.span, "");
    d.help("use letters, digits and single underscores, a letter first")
}

/// "`a`, `b` or `c`"
pub fn one_of(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|n| format!("`{n}`")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        Some((last, _)) => last.clone(),
        None => String::new(),
    }
}
