//! A variant: what it says over its base, in the grammar of a graph. Both are trees, and the graph is read from the
//! tree that [`overlay`] makes of them.

use super::join::TREE;
use super::read::{Fields, Reader};
use super::tree::{Field, SyntaxKind, SyntaxNode};
use crate::diag::{Diagnostic, Source, Span};
use std::collections::BTreeMap;

/// Sections that map names to declarations, and what each declares.
const SECTIONS: [(&str, &str); 7] = [
    ("inputs", "input"),
    ("params", "parameter"),
    ("lets", "let"),
    ("resources", "resource"),
    ("defines", "definition"),
    ("outputs", "output"),
    ("warnings", "warning"),
];

/// Sections whose names share one space: a name in one of them replaces that of the base in any.
const ONE_SPACE: usize = 4;

/// Changes the tree of a base by what a variant says. Faults go to the reader.
///
/// An entry replaces the base's of its name; one without a kind, `(default: 3)`, changes the fields that it names;
/// `None` removes. New passes go `before` and `after` others, or to the end (`append`).
pub fn overlay(reader: &mut Reader, base: &mut SyntaxNode, over: &mut Fields) {
    if let Some(about) = over.field("about") {
        section(base, about).value = about.value.clone();
    }
    for (name, noun) in SECTIONS {
        let Some(field) = over.field(name) else { continue };
        for (key, value) in unique(reader, &field.value) {
            if let Some((graph, key)) = inside(reader, base, key) {
                entry(reader, graph, field, &key, value, noun);
            }
        }
    }
    let edits = over.field("passes").map(|f| unique(reader, &f.value)).unwrap_or_default();
    let appended = over.field("append").map(|f| reader.list(Some(&f.value))).unwrap_or_default();
    let mut placed = vec![];
    for (word, behind) in [("before", 0), ("after", 1)] {
        let entries = over.field(word).map(|f| unique(reader, &f.value)).unwrap_or_default();
        placed.extend(entries.into_iter().map(|(key, list)| (key, reader.list(Some(list)), behind)));
    }
    let Some(passes) = passes_of(base) else { return };
    let mut instead = BTreeMap::new();
    for (key, value) in edits {
        let renamed = edit(reader, passes, key, value);
        instead.extend(renamed.map(|name| (text(key), name)));
    }
    place(reader, passes, placed, &instead);
    passes.extend(appended.iter().cloned());
}

/// The words of a variant.
pub const FIELDS: [&str; 13] = [
    "base",
    "about",
    "inputs",
    "params",
    "lets",
    "defines",
    "resources",
    "passes",
    "before",
    "after",
    "append",
    "outputs",
    "warnings",
];

fn is_none(node: &SyntaxNode) -> bool {
    node.word() == Some("None")
}

/// A key without its quotes, or without the dot before it.
fn text(key: &SyntaxNode) -> &str {
    key.span.text().trim_matches(['"', '.'])
}

/// The graph that a key such as `"bloom.threshold"` means, and the key there. `None`, and a fault, where there is no
/// such graph.
fn inside<'b>(
    reader: &mut Reader,
    graph: &'b mut SyntaxNode,
    key: &SyntaxNode,
) -> Option<(&'b mut SyntaxNode, SyntaxNode)> {
    let Some(dot) = text(key).find('.') else { return Some((graph, key.clone())) };
    let (sub, start) = (&text(key)[..dot], key.span.start + 1 + dot);
    let key = SyntaxNode { span: Span::new(&key.span.source, start..key.span.end), kind: SyntaxKind::Text };
    let known = sub_graphs(graph);
    if !known.iter().any(|name| name == sub) {
        let d = Diagnostic::error(format!("the base has no sub-graph `{sub}`")).at(&key.span, "");
        reader.fault(d.nearest(sub, known.iter().map(String::as_str)));
        return None;
    }
    let (list, at) = find(passes_of(graph)?, sub)?;
    inside(reader, tree(&mut list[at])?, &key)
}

/// The names of the sub-graphs that a graph uses itself.
fn sub_graphs(graph: &mut SyntaxNode) -> Vec<String> {
    fn add(passes: &mut [SyntaxNode], all: &mut Vec<String>) {
        for pass in passes {
            if tree(pass).is_some() {
                all.extend(name(pass).map(String::from));
            }
            bodies(pass).into_iter().for_each(|body| add(body, all));
        }
    }
    let mut all = vec![];
    if let Some(passes) = passes_of(graph) {
        add(passes, &mut all);
    }
    all
}

/// The graph of a pass that uses one.
fn tree(pass: &mut SyntaxNode) -> Option<&mut SyntaxNode> {
    match &mut pass.kind {
        SyntaxKind::Struct(_, fields) => fields.iter_mut().find(|f| f.name.text() == TREE).map(|f| &mut f.value),
        _ => None,
    }
}

/// The entries of a map, each name once.
fn unique<'t>(reader: &mut Reader, map: &'t SyntaxNode) -> Vec<(&'t SyntaxNode, &'t SyntaxNode)> {
    let mut seen: BTreeMap<&str, &Span> = BTreeMap::new();
    let mut entries = vec![];
    for (key, value) in reader.map(Some(map)) {
        if let Some(first) = seen.insert(text(key), &key.span) {
            let d = Diagnostic::error(format!("`{}` stands twice", text(key)));
            reader.fault(d.at(&key.span, "the second").at(first, "the first"));
        } else {
            entries.push((key, value));
        }
    }
    entries
}

/// A field of the base; an empty one where the base has none.
fn section<'b>(base: &'b mut SyntaxNode, like: &Field) -> &'b mut Field {
    let fields = fields_of(base);
    let at = fields.iter().position(|f| f.name.text() == like.name.text()).unwrap_or_else(|| {
        let value = SyntaxNode { span: like.value.span.clone(), kind: SyntaxKind::Map(vec![]) };
        fields.push(Field { name: like.name.clone(), value });
        fields.len() - 1
    });
    &mut fields[at]
}

fn existing<'b>(base: &'b mut SyntaxNode, name: &str) -> Option<&'b mut Vec<(SyntaxNode, SyntaxNode)>> {
    let field = fields_of(base).iter_mut().find(|f| f.name.text() == name)?;
    match &mut field.value.kind {
        SyntaxKind::Map(pairs) => Some(pairs),
        _ => None,
    }
}

/// The fields of a struct; a bare word is a struct without any.
fn fields_of(node: &mut SyntaxNode) -> &mut Vec<Field> {
    if !matches!(node.kind, SyntaxKind::Struct(..)) {
        node.kind = SyntaxKind::Struct(Some(node.span.clone()), vec![]);
    }
    match &mut node.kind {
        SyntaxKind::Struct(_, fields) => fields,
        _ => unreachable!("it was made one"),
    }
}

fn unknown<'n>(
    reader: &mut Reader,
    key: &SyntaxNode,
    noun: &str,
    names: impl IntoIterator<Item = &'n str>,
    help: &str,
) {
    let d = Diagnostic::error(format!("the base has no {noun} `{}`", text(key))).at(&key.span, "");
    reader.fault(d.nearest(text(key), names).help(help));
}

/// One entry over those of the base.
fn entry(
    reader: &mut Reader,
    base: &mut SyntaxNode,
    section_like: &Field,
    key: &SyntaxNode,
    value: &SyntaxNode,
    noun: &str,
) {
    let one_space = |name: &str| SECTIONS[..ONE_SPACE].iter().any(|s| s.0 == name);
    let name = section_like.name.text();
    if one_space(name) && !is_none(value) && !matches!(value.kind, SyntaxKind::Struct(None, _)) {
        for (other, _) in SECTIONS[..ONE_SPACE].iter().filter(|other| other.0 != name) {
            if let Some(pairs) = existing(base, other) {
                pairs.retain(|(k, _)| text(k) != text(key));
            }
        }
    }
    let SyntaxKind::Map(pairs) = &mut section(base, section_like).value.kind else { return };
    let at = pairs.iter().position(|(k, _)| text(k) == text(key));
    match (at, &value.kind) {
        (Some(at), _) if is_none(value) => drop(pairs.remove(at)),
        (Some(at), SyntaxKind::Struct(None, fields)) => {
            pairs[at].0 = key.clone();
            change(reader, &mut pairs[at].1, fields);
        }
        (Some(at), _) => pairs[at] = (key.clone(), value.clone()),
        (None, SyntaxKind::Struct(None, _)) => {
            let names: Vec<&str> = pairs.iter().map(|(k, _)| text(k)).collect();
            unknown(reader, key, noun, names, "one without a kind, `(…)`, changes what the base has");
        }
        (None, _) if is_none(value) => {
            let names: Vec<&str> = pairs.iter().map(|(k, _)| text(k)).collect();
            unknown(reader, key, noun, names, "`None` removes what the base has");
        }
        (None, _) => pairs.push((key.clone(), value.clone())),
    }
}

/// Changes the fields of a declaration: maps entry by entry, all else as a whole.
fn change(reader: &mut Reader, node: &mut SyntaxNode, changed: &[Field]) {
    for (i, field) in changed.iter().enumerate() {
        let name = field.name.text();
        if changed[..i].iter().any(|f| f.name.text() == name) {
            reader.fault(Diagnostic::error(format!("`{name}` stands twice")).at(&field.name, "the second"));
            continue;
        }
        let fields = fields_of(node);
        if name == "graph" {
            fields.retain(|f| f.name.text() != TREE);
        }
        let Some(there) = fields.iter_mut().find(|f| f.name.text() == name) else {
            fields.push(field.clone());
            continue;
        };
        match (&mut there.value.kind, &field.value.kind) {
            (SyntaxKind::Map(pairs), SyntaxKind::Map(_)) => {
                for (key, value) in unique(reader, &field.value) {
                    match pairs.iter().position(|(k, _)| text(k) == text(key)) {
                        Some(at) if is_none(value) => drop(pairs.remove(at)),
                        Some(at) => pairs[at] = (key.clone(), value.clone()),
                        None => pairs.push((key.clone(), value.clone())),
                    }
                }
            }
            _ => *there = field.clone(),
        }
    }
}

fn passes_of(base: &mut SyntaxNode) -> Option<&mut Vec<SyntaxNode>> {
    match &mut fields_of(base).iter_mut().find(|f| f.name.text() == "passes")?.value.kind {
        SyntaxKind::List(passes) => Some(passes),
        _ => None,
    }
}

/// Changes, replaces or removes the pass of a name; the name of what stands in its place.
fn edit(reader: &mut Reader, passes: &mut Vec<SyntaxNode>, key: &SyntaxNode, value: &SyntaxNode) -> Option<String> {
    let Some((list, at)) = find(passes, text(key)) else {
        let names = names(passes);
        let help = "a new pass goes to `before`, `after` or `append`";
        unknown(reader, key, "pass", names.iter().map(String::as_str), help);
        return None;
    };
    match &value.kind {
        _ if is_none(value) => drop(list.remove(at)),
        SyntaxKind::Struct(None, fields) => change(reader, &mut list[at], fields),
        SyntaxKind::Struct(Some(_), _) => {
            let mut pass = value.clone();
            let fields = fields_of(&mut pass);
            if !fields.iter().any(|f| f.name.text() == "name") {
                let start = text(key).rfind('.').map_or(key.span.start, |dot| key.span.start + 1 + dot);
                let value =
                    SyntaxNode { span: Span::new(&key.span.source, start..key.span.end), kind: SyntaxKind::Text };
                fields.insert(0, Field { name: Span::whole(&Source::new("", "name")), value });
            }
            list[at] = pass;
            return name(&list[at]).map(String::from);
        }
        _ => {
            let d = Diagnostic::error("expected changes `(field: value)`, a pass, or `None`").at(&value.span, "");
            reader.fault(d);
        }
    }
    None
}

/// Puts new passes before and after those that their keys name: new ones too, and those that were replaced.
fn place(
    reader: &mut Reader,
    passes: &mut Vec<SyntaxNode>,
    mut open: Vec<(&SyntaxNode, &[SyntaxNode], usize)>,
    instead: &BTreeMap<&str, String>,
) {
    loop {
        let before = open.len();
        open.retain(|(key, new, behind)| {
            let renamed = instead.get(text(key)).filter(|_| find(passes, text(key)).is_none());
            let wanted = renamed.map_or(text(key), String::as_str);
            let Some((list, at)) = find(passes, wanted) else { return true };
            list.splice(at + behind..at + behind, new.iter().cloned());
            false
        });
        if open.is_empty() || open.len() == before {
            break;
        }
    }
    for (key, _, _) in open {
        let names = names(passes);
        unknown(reader, key, "pass", names.iter().map(String::as_str), "name the pass beside which the new ones go");
    }
}

/// The name that a pass gives itself.
fn name(pass: &SyntaxNode) -> Option<&str> {
    match &pass.kind {
        SyntaxKind::Struct(_, fields) => fields.iter().find(|f| f.name.text() == "name").map(|f| text(&f.value)),
        _ => None,
    }
}

/// The lists of passes that a pass holds.
fn bodies(pass: &mut SyntaxNode) -> Vec<&mut Vec<SyntaxNode>> {
    let SyntaxKind::Struct(_, fields) = &mut pass.kind else { return vec![] };
    let mut lists = vec![];
    for field in fields {
        match (field.name.text(), &mut field.value.kind) {
            ("passes", SyntaxKind::List(passes)) => lists.push(passes),
            ("of", SyntaxKind::List(alternatives)) => {
                lists.extend(alternatives.iter_mut().filter_map(|a| match &mut a.kind {
                    SyntaxKind::List(passes) => Some(passes),
                    _ => None,
                }));
            }
            _ => {}
        }
    }
    lists
}

/// The passes of a graph that use another.
pub fn uses(graph: &mut SyntaxNode) -> Vec<&mut SyntaxNode> {
    fn add<'p>(passes: &'p mut [SyntaxNode], all: &mut Vec<&'p mut SyntaxNode>) {
        for pass in passes {
            if matches!(&pass.kind, SyntaxKind::Struct(Some(word), _) if word.text() == "Use") {
                all.push(pass);
            } else {
                bodies(pass).into_iter().for_each(|body| add(body, all));
            }
        }
    }
    let mut all = vec![];
    if let Some(passes) = passes_of(graph) {
        add(passes, &mut all);
    }
    all
}

/// The list that holds the pass, and its place in it; `sub.pass` is one of a sub-graph's.
fn find<'p>(passes: &'p mut Vec<SyntaxNode>, wanted: &str) -> Option<(&'p mut Vec<SyntaxNode>, usize)> {
    if let Some(at) = passes.iter().position(|p| name(p) == Some(wanted)) {
        return Some((passes, at));
    }
    if let Some((sub, rest)) = wanted.split_once('.') {
        let (list, at) = find(passes, sub)?;
        return find(passes_of(tree(&mut list[at])?)?, rest);
    }
    passes.iter_mut().flat_map(bodies).find_map(|body| find(body, wanted))
}

fn names(passes: &mut [SyntaxNode]) -> Vec<String> {
    let mut all = vec![];
    for pass in passes {
        let own = name(pass).map(String::from);
        if let (Some(own), Some(inner)) = (&own, tree(pass).and_then(passes_of)) {
            all.extend(names(inner).into_iter().map(|name| format!("{own}.{name}")));
        }
        all.extend(own);
        bodies(pass).into_iter().for_each(|body| all.extend(names(body)));
    }
    all
}

#[cfg(test)]
mod tests;
