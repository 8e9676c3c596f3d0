//! Finds declarations of a graph that nothing uses. Needs no device.

use crate::diag::Diagnostic;
use crate::graph::Graph;
use crate::graph::ast::{Name, PassKind, Size, set_of, walk};
use crate::graph::expr::Expr;
use crate::shader::Library;
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;

/// The names that the expressions of a graph mention.
pub fn mentioned(graph: &Graph) -> FxHashSet<&str> {
    let mut used: FxHashSet<&str> = FxHashSet::default();
    let mut note = |e| Expr::names(e, &mut |n, _| used.extend([n]));
    graph.lets.iter().chain(&graph.defines).for_each(|(_, e)| note(e));
    graph.warnings.iter().for_each(|(_, w)| note(&w.when));
    for (_, r) in &graph.resources {
        let (sizes, counts) = r.exprs();
        sizes.into_iter().chain(counts).for_each(&mut note);
    }
    walk(&graph.passes, &mut |p| {
        p.when
            .iter()
            .chain(&p.each)
            .chain(p.defines.iter().chain(&p.mips).chain(&p.set).map(|d| &d.1))
            .for_each(&mut note);
        match &p.kind {
            PassKind::Draw(r) | PassKind::Screen(r) => {
                r.layer.iter().chain(&r.views).chain(&r.tolerance).chain(&r.materials).for_each(&mut note);
                r.vertices.iter().flat_map(|v| v.exprs()).for_each(&mut note);
            }
            PassKind::Compute { over, .. } => over.iter().flat_map(Size::exprs).for_each(&mut note),
            PassKind::Reduce { factor, until, .. } => factor.iter().chain([until]).for_each(&mut note),
            PassKind::Loop { count, until, .. } => [count].into_iter().chain(until).for_each(&mut note),
            PassKind::For { count, .. } => note(count),
            PassKind::Scan { .. }
            | PassKind::Copy { .. }
            | PassKind::Clear { .. }
            | PassKind::Mips { .. }
            | PassKind::Fastest { .. } => {}
        }
    });
    used
}

/// What a graph's own file declares and neither the graph nor any of its shaders mentions. What a base declares may be
/// for other variants.
pub fn find(graph: &Graph, library: &Library) -> Vec<Diagnostic> {
    let own = |name: &Name| name.span.source.path == graph.source.path;
    let (idle, known) = idle(graph, library);
    let said = idle.into_iter().filter(|(name, _)| own(name)).map(|(name, noun)| {
        if noun == DEFINITION {
            let d = Diagnostic::warning(format!("no shader mentions the definition `{}`", name.value));
            return d.at(&name.span, "").nearest(&name.value, known.iter().map(String::as_str));
        }
        let d = Diagnostic::warning(format!("nothing uses the {noun} `{}`", name.value)).at(&name.span, "");
        d.help("remove it, or name it in a pass or a shader")
    });
    said.collect()
}

/// Takes out of a variant what its bases declare and nothing mentions any more.
pub fn prune(graph: &mut Graph, library: &Library) {
    loop {
        let idle: Vec<(String, &str)> = idle(graph, library)
            .0
            .into_iter()
            .filter(|(name, _)| name.span.source.path != graph.source.path)
            .map(|(name, noun)| (name.value.clone(), noun))
            .collect();
        if idle.is_empty() {
            return;
        }
        let in_use = |noun: &str, name: &Name| !idle.iter().any(|(n, of)| *n == name.value && *of == noun);
        graph.params.retain(|(name, _)| in_use(PARAMETER, name));
        graph.lets.retain(|(name, _)| in_use(LET, name));
        graph.resources.retain(|(name, _)| in_use(RESOURCE, name));
        graph.defines.retain(|(name, _)| in_use(DEFINITION, name));
    }
}

const PARAMETER: &str = "parameter";
const LET: &str = "let";
const RESOURCE: &str = "resource";
const DEFINITION: &str = "definition";

/// Parameters, lets, resources and definitions that neither the graph nor any of its shaders mentions; the definitions
/// that shaders mention.
fn idle<'g>(graph: &'g Graph, library: &Library) -> (Vec<(&'g Name, &'static str)>, BTreeSet<String>) {
    let mut used = mentioned(graph);
    let mut shaders: BTreeSet<&str> = BTreeSet::new();
    walk(&graph.passes, &mut |p| {
        used.extend(p.bind.iter().map(|(_, name)| name.value.as_str()));
        used.extend(p.only.iter().map(|dirty| dirty.bits.value.as_str()));
        // What another name of a shader stands for.
        let renamed = p.scope.iter().flat_map(|s| &s.names).filter(|(own, whole)| !whole.ends_with(own.as_str()));
        used.extend(renamed.map(|(_, whole)| whole.as_str()));
        used.extend(p.kind.indirect().map(|name| name.value.as_str()));
        shaders.extend(p.kind.shader().map(|s| s.value.as_str()));
        match &p.kind {
            PassKind::Draw(r) | PassKind::Screen(r) => {
                used.extend(r.color.iter().chain(&r.depth).chain(&r.frusta).map(|n| n.value.as_str()));
                used.extend(r.resolve.iter().map(|(_, to)| to.value.as_str()));
            }
            PassKind::Reduce { from, to, .. } | PassKind::Scan { from, to, .. } | PassKind::Copy { from, to } => {
                used.extend([from.value.as_str(), to.value.as_str()]);
            }
            PassKind::Clear { target, .. } => used.extend([target.value.as_str()]),
            PassKind::Mips { of } => used.extend([of.value.as_str()]),
            PassKind::Compute { .. } | PassKind::Loop { .. } | PassKind::For { .. } | PassKind::Fastest { .. } => {}
        }
    });
    used.extend(graph.outputs.iter().map(|o| o.1.value.as_str()));
    used = used.into_iter().map(set_of).collect();
    let index = library.index();
    let files = index.reachable(shaders.iter().copied());
    let defs = index.mentioned(shaders);
    // A shader of a sub-graph writes names without the sub-graph's.
    let in_shader = |name: &str| {
        let plain = name.rsplit('.').next().unwrap_or(name);
        files.iter().any(|f| index.place(f, plain).is_some())
    };
    let names = graph.params.iter().map(|(n, _)| (n, PARAMETER));
    let names = names.chain(graph.lets.iter().map(|(n, _)| (n, LET)));
    let names = names.chain(graph.resources.iter().map(|(n, _)| (n, RESOURCE)));
    let mut idle: Vec<(&Name, &'static str)> =
        names.filter(|(name, _)| !used.contains(name.value.as_str()) && !in_shader(&name.value)).collect();
    let defines = graph.defines.iter().filter(|(name, _)| !defs.contains(name.value.as_str()));
    idle.extend(defines.map(|(name, _)| (name, DEFINITION)));
    (idle, defs.into_iter().map(String::from).collect())
}
