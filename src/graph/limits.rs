//! How much a graph may hold. What is planned for grows faster than the text that asks for it.

use super::ast::{Graph, Name, PassKind, walk};
use crate::diag::Diagnostic;

const PASSES: usize = 2000;
const RESOURCES: usize = 2000;
const PARAMS: usize = 1000;
const LETS: usize = 1000;
const DEFINES: usize = 200;
const OUTPUTS: usize = 200;
const WARNINGS: usize = 200;

/// Alternatives of all groups together: each is planned for.
const ALTERNATIVES: usize = 100;

/// What a graph holds too many of.
pub fn check(graph: &Graph) -> Vec<Diagnostic> {
    let (mut passes, mut alternatives) = (vec![], vec![]);
    walk(&graph.passes, &mut |p| {
        passes.push(&p.name);
        if let PassKind::Fastest { of, .. } = &p.kind {
            alternatives.extend(std::iter::repeat_n(&p.name, of.len()));
        }
    });
    fn names<T>(pairs: &[(Name, T)]) -> Vec<&Name> {
        pairs.iter().map(|(name, _)| name).collect()
    }
    let all = [
        ("alternatives", ALTERNATIVES, alternatives),
        ("passes", PASSES, passes),
        ("resources", RESOURCES, names(&graph.resources)),
        ("parameters", PARAMS, names(&graph.params)),
        ("lets", LETS, names(&graph.lets)),
        ("definitions", DEFINES, names(&graph.defines)),
        ("outputs", OUTPUTS, names(&graph.outputs)),
        ("warnings", WARNINGS, names(&graph.warnings)),
    ];
    let beyond = |(noun, most, names): (&str, usize, Vec<&Name>)| {
        let first = names.get(most)?;
        let d = Diagnostic::error(format!("a graph has at most {most} {noun}, and this one has {}", names.len()));
        Some(d.at(&first.span, "the first beyond"))
    };
    all.into_iter().filter_map(beyond).collect()
}
