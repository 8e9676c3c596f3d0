//! The graph file: text to a checked [`Graph`]. No device.
//!
//! `tree` keeps places, `read` reads single values, `parse` knows the fields, `variant` lays a variant over its base, `limits`
//! counts, `check` resolves names.

pub mod ast;
pub mod check;
pub mod expr;
mod limits;
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
use tree::Node;

/// How graph files are read: from disk, or from anywhere else.
pub type ReadFile<'a> = &'a dyn Fn(&Path) -> Checked<Arc<Source>>;

/// Variants of variants of variants are enough; more is a slip.
const CHAIN: usize = 16;

/// Reads a graph or variant and checks names.
///
/// # Errors
/// All faults of the file and its bases, with places.
pub fn load(path: &Path, read: ReadFile) -> Checked<Graph> {
    let mut reader = Reader::default();
    let mut files = vec![];
    let tree = tree_of(path, read, &mut files, &mut reader)?;
    let overlaid = reader.faults.is_empty();
    let Some((_, mut fields)) = reader.named(&tree, &["Graph"]) else { return Err(Faults(reader.faults)) };
    let mut graph = reader.graph(&mut fields, &tree.span);
    graph.files = files;
    ast::inherit_groups(&mut graph.passes, None);
    Faults::check(limits::check(&graph), ())?;
    if reader.faults.is_empty() {
        return Faults::check(check::check(&graph), graph);
    }
    if overlaid && !reader.lost {
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
    Faults::check(reader.faults, graph)
}

/// The tree of a graph; of a variant that of its base, with what the variant says over it. Its span is the file's.
fn tree_of(path: &Path, read: ReadFile, files: &mut Vec<PathBuf>, reader: &mut Reader) -> Checked<Node> {
    let source = builtin::read(path).unwrap_or_else(|| read(path))?;
    let node = tree::parse(&source)?;
    files.push(path.to_path_buf());
    let Some((word, mut fields)) = reader.named(&node, &["Graph", "Variant"]) else {
        return Err(Faults(std::mem::take(&mut reader.faults)));
    };
    if word == "Graph" {
        return Ok(node);
    }
    for name in variant::FIELDS {
        let _ = fields.get(name);
    }
    let base = reader.need(&mut fields, "base").and_then(|n| reader.text(n));
    reader.finish(&fields);
    let Some(base) = base else { return Err(Faults(std::mem::take(&mut reader.faults))) };
    let base_path = builtin::join(path.parent().unwrap_or(Path::new("")), &base.value);
    if !builtin::is_builtin(&base_path) && !is_inside(&base.value) {
        let d = Diagnostic::error("a base must lie in the folder of its variant or below it").at(&base.span, "");
        return Err(d.help(format!("one that comes with lightgraph is named `{}graphs/…`", builtin::PREFIX)).into());
    }
    if files.contains(&base_path) {
        let d = Diagnostic::error("a variant can't be based on itself").at(&base.span, "leads back here");
        return Err(d.into());
    }
    if files.len() >= CHAIN {
        let d = Diagnostic::error(format!("more than {CHAIN} variants, each based on the next")).at(&base.span, "");
        return Err(d.help("put what several of them say into one").into());
    }
    let mut tree = tree_of(&base_path, read, files, reader).map_err(|mut faults| {
        if faults.0.iter().all(|d| d.labels.is_empty()) {
            faults.0 = faults.0.into_iter().map(|d| d.at(&base.span, "the base")).collect();
        }
        faults
    })?;
    variant::overlay(reader, &mut tree, &mut fields);
    tree.span = node.span.clone();
    Ok(tree)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn message(read: ReadFile) -> String {
        load(Path::new("v0.ron"), read).map(drop).unwrap_err().0[0].message.clone()
    }

    #[test]
    fn a_long_chain_of_variants_is_no_circle() {
        let base = |of: &dyn Fn(usize) -> usize, path: &Path| {
            let number: usize = path.file_stem().unwrap().to_string_lossy()[1..].parse().unwrap();
            let text = format!("Variant(base: \"v{}.ron\", about: \"a\")", of(number));
            Ok(Source::new(path.display().to_string(), text))
        };
        assert!(message(&|path| base(&|n| n + 1, path)).contains("more than 16 variants"));
        assert!(message(&|path| base(&|n| (n + 1) % 3, path)).contains("based on itself"));
    }

    #[test]
    fn a_graph_that_holds_too_much_is_refused() {
        let lets: String = (0..8000).map(|i| format!("\"l{}\": \"l{i} + 1\",", i + 1)).collect();
        let passes: String =
            (0..10_000).map(|i| format!("Clear(name: \"p{i}\", target: \"a\", value: (0, 0, 0, 0)),")).collect();
        let group = format!(
            "Fastest(name: \"f\", of: [{}])",
            "[Clear(name: \"c\", target: \"a\", value: (0, 0, 0, 0))],".repeat(2000)
        );
        for (lets, passes, noun) in
            [(&*lets, "", "1000 lets"), ("", &*passes, "2000 passes"), ("", &*group, "100 alternatives")]
        {
            let text = format!(
                "Graph(about: \"a\", lets: {{{lets}}}, resources: {{\"a\": Texture(format: R32Float, size: \"screen\")}}, \
                 passes: [{passes}], outputs: {{\"color\": \"a\"}})"
            );
            let source = Source::new("v0.ron", text);
            let said = message(&|_| Ok(source.clone()));
            assert!(said.contains(&format!("at most {noun}")), "{said}");
        }
    }
}
