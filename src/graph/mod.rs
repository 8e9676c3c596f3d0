//! The graph file: text to a checked [`Graph`]. No device.
//!
//! `tree` keeps places, `read` reads single values, `parse` knows the fields, `variant` applies edits, `check`
//! resolves names.

pub mod ast;
pub mod check;
pub mod expr;
mod param;
pub mod parse;
pub mod read;
pub mod tree;
pub mod variant;

pub use ast::Graph;

use crate::builtin;
use crate::diag::{Checked, Diagnostic, Faults, Source};
use read::Reader;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// How graph files are read: from disk, or from anywhere else.
pub type ReadFile<'a> = &'a dyn Fn(&Path) -> Checked<Arc<Source>>;

/// Variants of variants of variants are enough; more is a slip.
const CHAIN: usize = 16;

/// Reads a graph or variant, applies edits, checks names.
///
/// # Errors
/// All faults of the file, with places; those of a base are found first.
pub fn load(path: &Path, read: ReadFile) -> Checked<Graph> {
    let mut graph = load_unchecked(path, read, &mut vec![])?;
    ast::inherit_groups(&mut graph.passes, None);
    Faults::check(check::check(&graph), graph)
}

fn load_unchecked(path: &Path, read: ReadFile, chain: &mut Vec<PathBuf>) -> Checked<Graph> {
    let source = builtin::read(path).unwrap_or_else(|| read(path))?;
    let node = tree::parse(&source)?;
    let mut reader = Reader::default();
    chain.push(path.to_path_buf());
    let Some((word, mut fields)) = reader.named(&node, &["Graph", "Variant"]) else {
        return Err(Faults(reader.faults));
    };
    if word == "Graph" {
        let mut graph = reader.graph(&mut fields, &node.span);
        graph.files = vec![path.to_path_buf()];
        if !reader.faults.is_empty() && !reader.lost {
            // The names of what could be read are checked all the same; faults that follow from the others are not.
            let follows = |d: &Diagnostic| {
                d.labels.first().is_none_or(|(span, _)| {
                    let word = span.text();
                    word.is_empty() || reader.broken.iter().any(|name| name == word)
                })
            };
            let more: Vec<Diagnostic> = check::check(&graph).into_iter().filter(|d| !follows(d)).collect();
            reader.faults.extend(more);
        }
        return Faults::check(reader.faults, graph);
    }
    let base = reader.need(&mut fields, "base").and_then(|n| reader.text(n));
    let about = fields.get("about").and_then(|n| reader.text(n));
    let edits = reader.need(&mut fields, "edits");
    let edits = reader.list(edits);
    reader.finish(&fields);
    let Some(base) = base else { return Err(Faults(reader.faults)) };
    let base_path = builtin::join(path.parent().unwrap_or(Path::new("")), &base.value);
    if !builtin::is_builtin(&base_path) && !is_inside(&base.value) {
        let d = Diagnostic::error("a base must lie in the folder of its variant or below it").at(&base.span, "");
        return Err(d.help(format!("one that comes with lightgraph is named `{}graphs/…`", builtin::PREFIX)).into());
    }
    if chain.contains(&base_path) || chain.len() >= CHAIN {
        let d = Diagnostic::error("a variant can't be based on itself").at(&base.span, "leads back here");
        return Err(d.into());
    }
    let mut graph = load_unchecked(&base_path, read, chain).map_err(|mut faults| {
        if faults.0.iter().all(|d| d.labels.is_empty()) {
            faults.0 = faults.0.into_iter().map(|d| d.at(&base.span, "the base")).collect();
        }
        faults
    })?;
    if let Some(about) = about {
        graph.about = about.value;
    }
    for edit in edits {
        variant::apply(&mut reader, &mut graph, edit);
    }
    graph.source = source;
    graph.files.insert(0, path.to_path_buf());
    Faults::check(reader.faults, graph)
}

/// Whether a relative path stays below the folder it starts from.
pub fn is_inside(path: &str) -> bool {
    Path::new(path).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir))
}

/// Whether a pass names a resource in the graph file: as target, source or binding.
pub fn ast_mentions(pass: &ast::Pass, resource: &str) -> bool {
    use ast::PassKind;
    let named = match &pass.kind {
        PassKind::Draw(r) | PassKind::Screen(r) => {
            r.color.iter().chain(&r.depth).chain(&r.frusta).any(|n| n.value == resource)
        }
        PassKind::Reduce { from, to, .. } | PassKind::Copy { from, to } => {
            from.value == resource || to.value == resource
        }
        PassKind::Clear { target, .. } => target.value == resource,
        PassKind::Loop { .. } | PassKind::Fastest { .. } => {
            pass.kind.bodies().iter().flatten().any(|p| ast_mentions(p, resource))
        }
        PassKind::Compute { sight, .. } => {
            sight.iter().any(|s| std::iter::once(&s.frusta).chain(&s.seen).chain(&s.depth).any(|n| n.value == resource))
        }
    };
    named || pass.bind.iter().chain(&pass.masked).any(|(_, to)| to.value == resource)
}
