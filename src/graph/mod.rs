//! The graph file: text to a checked [`Graph`]. No device.
//!
//! `tree` keeps places, `variant` lays a variant over its base, `read` reads single values, `parse` knows the fields,
//! `tune` makes alternatives of one pass, `image` reads the files of images, `join` puts sub-graphs in with other names
//! (`rename`), `walk` goes through passes, `limits` counts, `check` resolves names, and `unroll`, when values are
//! known, repeats passes. `format` lays a file out.

pub mod ast;
pub mod check;
pub mod expr;
pub mod format;
mod image;
mod join;
mod limits;
mod param;
pub mod parse;
mod raster;
pub mod read;
mod rename;
mod table;
pub mod tree;
mod tune;
pub mod unroll;
pub mod variant;
mod walk;

pub use ast::Graph;

use crate::builtin;
use crate::diag::{Checked, Diagnostic, Faults, Source, Span};
use crate::files::{self, ReadFile};
use ast::{Input, Name};
use read::Reader;
use std::path::{Component, Path, PathBuf};
use tree::{Field, SyntaxKind, SyntaxNode};

/// Variants of variants, or graphs in graphs, are enough; more is a slip.
const CHAIN: usize = 16;

/// More sub-graphs than this, those in others counted, are a slip.
const SUB_GRAPHS: usize = 256;

/// Reads a graph or variant and checks names.
///
/// # Errors
/// All faults of the file, its bases and sub-graphs, with places.
pub fn load(path: &Path, read: ReadFile) -> Checked<Graph> {
    let mut loading = Loading { read, files: vec![], open: vec![], subs: 0, reader: Reader::default() };
    let tree = loading.tree(path)?;
    let Loading { files, mut reader, .. } = loading;
    let overlaid = reader.faults.is_empty();
    let Some((_, mut fields)) = reader.named(&tree, &["Graph"]) else { return Err(Faults(reader.faults)) };
    let mut graph = reader.graph(&mut fields, &tree.span);
    graph.files = files;
    graph.images = std::mem::take(&mut reader.images);
    for (name, input) in &graph.inputs {
        match input.clone() {
            Input::Resource(resource) => graph.resources.push((name.clone(), resource)),
            Input::Value(param) => graph.params.push((name.clone(), param)),
        }
    }
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

/// Files on their way to one tree.
struct Loading<'r> {
    read: ReadFile<'r>,
    /// Those that were read, each once.
    files: Vec<PathBuf>,
    /// Those that are being read, each by the one before.
    open: Vec<PathBuf>,
    subs: usize,
    reader: Reader,
}

impl Loading<'_> {
    /// The tree of a graph; of a variant that of its base, with what the variant says over it. Its span is the file's.
    fn tree(&mut self, path: &Path) -> Checked<SyntaxNode> {
        let source = builtin::read(path).unwrap_or_else(|| (self.read)(path))?;
        let node = tree::parse(&source)?;
        if !self.files.iter().any(|f| f == path) {
            self.files.push(path.to_path_buf());
        }
        self.open.push(path.to_path_buf());
        let Some((word, mut fields)) = self.reader.named(&node, &["Graph", "Variant"]) else {
            return Err(self.faults());
        };
        let mut tree = match word {
            "Graph" => node,
            _ => {
                for name in variant::FIELDS {
                    let _ = fields.get(name);
                }
                let base = self.reader.need(&mut fields, "base").and_then(|n| self.reader.text(n));
                self.reader.finish(&fields);
                let Some(base) = base else { return Err(self.faults()) };
                let mut tree =
                    self.other(&base, "a base", "its variant", &|_| "a variant can't be based on itself".to_string())?;
                variant::overlay(&mut self.reader, &mut tree, &mut fields);
                tree.span = node.span.clone();
                tree
            }
        };
        self.sub_graphs(&mut tree)?;
        self.open.pop();
        Ok(tree)
    }

    fn faults(&mut self) -> Faults {
        Faults(std::mem::take(&mut self.reader.faults))
    }

    /// The tree of a file that another names.
    fn other(&mut self, name: &Name, what: &str, whose: &str, circle: &dyn Fn(&str) -> String) -> Checked<SyntaxNode> {
        let folder = Path::new(&name.span.source.path).parent().unwrap_or(Path::new(""));
        let path = builtin::join(folder, &name.value);
        if !builtin::is_builtin(&path)
            && let Err(why) = files::inside(folder, &name.value)
        {
            let d = Diagnostic::error(format!("{what} must lie in the folder of {whose} or below it"));
            let help = format!("one that comes with lightgraph is named `{}graphs/…`", builtin::PREFIX);
            return Err(d.at(&name.span, format!("this {why}")).help(help).into());
        }
        if let Some(first) = self.open.iter().position(|f| *f == path) {
            let file = |p: &PathBuf| p.file_name().unwrap_or(p.as_os_str()).to_string_lossy().into_owned();
            let chain: Vec<String> = self.open[first..].iter().chain([&path]).map(file).collect();
            return Err(Diagnostic::error(circle(&chain.join(" → "))).at(&name.span, "leads back here").into());
        }
        if self.open.len() >= CHAIN {
            let d = Diagnostic::error(format!("more than {CHAIN} variants or sub-graphs, each of the next"));
            return Err(d.at(&name.span, "").help("put what several of them say into one").into());
        }
        self.tree(&path).map_err(|mut faults| {
            if faults.0.iter().all(|d| d.labels.is_empty()) {
                faults.0 = faults.0.into_iter().map(|d| d.at(&name.span, what)).collect();
            }
            faults
        })
    }

    /// Gives each pass that uses a graph the tree of it.
    fn sub_graphs(&mut self, tree: &mut SyntaxNode) -> Checked<()> {
        for pass in variant::uses(tree) {
            let SyntaxKind::Struct(_, fields) = &mut pass.kind else { continue };
            let file = fields.iter().find(|f| f.name.text() == "graph").and_then(|f| f.value.quoted());
            // A file that isn't said, or not as a string, is a fault of the pass.
            let Some(span) = file.filter(|_| !fields.iter().any(|f| f.name.text() == join::TREE)) else { continue };
            self.subs += 1;
            if self.subs > SUB_GRAPHS {
                let d = Diagnostic::error(format!("more than {SUB_GRAPHS} sub-graphs")).at(&span, "");
                return Err(d.into());
            }
            let name = Name { value: span.text().to_string(), span };
            let circle = |chain: &str| format!("a graph can't use itself: {chain}");
            let value = self.other(&name, "a sub-graph", "the graph that uses it", &circle)?;
            let name = Span::whole(&Source::new("", join::TREE));
            fields.push(Field { name, value });
        }
        Ok(())
    }
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
            let resolved = r.resolve.iter().map(|(_, to)| to);
            r.color.iter().chain(&r.depth).chain(&r.frusta).chain(resolved).any(|n| n.value == resource)
        }
        PassKind::Reduce { from, to, .. } | PassKind::Scan { from, to, .. } | PassKind::Copy { from, to } => {
            from.value == resource || to.value == resource
        }
        PassKind::Clear { target, .. } => target.value == resource,
        PassKind::Mips { of } => of.value == resource,
        PassKind::Loop { .. } | PassKind::For { .. } | PassKind::Fastest { .. } => {
            pass.kind.bodies().iter().flatten().any(|p| ast_mentions(p, resource))
        }
        PassKind::Compute { .. } => false,
    };
    let bits = pass.only.iter().any(|dirty| dirty.bits.value == resource);
    let counts = pass.kind.indirect().is_some_and(|n| n.value == resource);
    named || bits || counts || pass.bind.iter().any(|(_, to)| to.value == resource)
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
