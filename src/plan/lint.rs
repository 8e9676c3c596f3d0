//! Things declared and never used, and what a plan's reader should know.

use super::{Desc, Plan};
use crate::diag::Diagnostic;
use crate::graph::Graph;
use crate::graph::ast::{PassKind, walk};
use crate::graph::expr::Expr;
use crate::shader::Library;
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;

/// The names that the expressions of a graph mention.
pub(super) fn mentioned(graph: &Graph) -> FxHashSet<&str> {
    let mut used: FxHashSet<&str> = FxHashSet::default();
    let mut note = |e| Expr::names(e, &mut |n, _| used.extend([n]));
    graph.lets.iter().chain(&graph.defines).for_each(|(_, e)| note(e));
    for (_, r) in &graph.resources {
        let (sizes, counts) = r.exprs();
        sizes.into_iter().chain(counts).for_each(&mut note);
    }
    walk(&graph.passes, &mut |p| {
        p.when.iter().chain(&p.each).chain(p.rows.iter().chain(&p.defines).map(|d| &d.1)).for_each(&mut note);
        match &p.kind {
            PassKind::Draw(r) | PassKind::Screen(r) => {
                r.layer.iter().chain(&r.views).chain(&r.tolerance).for_each(&mut note);
            }
            PassKind::Compute { over, .. } => over.exprs().iter().for_each(&mut note),
            PassKind::Reduce { factor, until, .. } => factor.iter().chain([until]).for_each(&mut note),
            PassKind::Loop { count, until, .. } => [count].into_iter().chain(until).for_each(&mut note),
            PassKind::Copy { .. } | PassKind::Clear { .. } | PassKind::Fastest { .. } => {}
        }
    });
    used
}

/// Parameters, lets, resources and definitions that neither the graph nor any of its shaders mentions.
pub fn unused(graph: &Graph, library: &Library) -> Vec<Diagnostic> {
    let mut used = mentioned(graph);
    let mut shaders: BTreeSet<&str> = BTreeSet::new();
    walk(&graph.passes, &mut |p| {
        used.extend(p.bind.iter().chain(&p.masked).map(|(_, name)| name.value.as_str()));
        shaders.extend(p.kind.shader().map(|s| s.value.as_str()));
        match &p.kind {
            PassKind::Draw(r) | PassKind::Screen(r) => {
                used.extend(r.color.iter().chain(&r.depth).chain(&r.frusta).map(|n| n.value.as_str()));
            }
            PassKind::Compute { sight, .. } => used.extend(sight.iter().map(|s| s.frusta.value.as_str())),
            PassKind::Reduce { from, to, .. } | PassKind::Copy { from, to } => {
                used.extend([from.value.as_str(), to.value.as_str()]);
            }
            PassKind::Clear { target, .. } => used.extend([target.value.as_str()]),
            PassKind::Loop { .. } | PassKind::Fastest { .. } => {}
        }
    });
    used.extend(graph.outputs.iter().map(|o| o.1.value.as_str()));
    let index = library.index();
    let files = index.reachable(shaders.iter().copied());
    let defs = index.mentioned(shaders);
    let in_shader = |name: &str| files.iter().any(|f| index.place(f, name).is_some());
    let names = graph.params.iter().map(|(n, _)| (n, "parameter"));
    let names = names.chain(graph.lets.iter().map(|(n, _)| (n, "let")));
    let names = names.chain(graph.resources.iter().map(|(n, _)| (n, "resource")));
    let mut faults = vec![];
    for (name, noun) in names {
        if !used.contains(name.value.as_str()) && !in_shader(&name.value) {
            let d = Diagnostic::error(format!("nothing uses the {noun} `{}`", name.value)).at(&name.span, "");
            faults.push(d.help("remove it, or name it in a pass or a shader"));
        }
    }
    for (name, _) in &graph.defines {
        if !defs.contains(name.value.as_str()) {
            let d = Diagnostic::error(format!("no shader mentions the definition `{}`", name.value));
            faults.push(d.at(&name.span, "").nearest(&name.value, defs.iter().copied()));
        }
    }
    faults
}

/// What is worth saying about a plan that works.
pub fn notices(plan: &Plan) -> Vec<Diagnostic> {
    let large = |d: &Desc| d.bytes() > 1 << 30;
    let big = plan.resources.iter().filter(|r| large(&r.desc));
    big.map(|r| Diagnostic::note(format!("`{}` takes {} MiB", r.name, r.desc.bytes() >> 20))).collect()
}
