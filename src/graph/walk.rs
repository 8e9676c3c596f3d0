//! Ways through the passes of a graph, those in others among them.

use super::ast::{Name, NameScope, Pass, PassKind};
use std::sync::Arc;

/// Calls `f` with every pass, those that hold others before them.
pub fn walk<'a>(passes: &'a [Pass], f: &mut impl FnMut(&'a Pass)) {
    for pass in passes {
        f(pass);
        for body in pass.kind.bodies() {
            walk(body, f);
        }
    }
}

/// The groups of alternatives among passes, each with its alternatives.
pub fn groups(passes: &[Pass]) -> Vec<(&Name, &[Vec<Pass>])> {
    let mut found = vec![];
    walk(passes, &mut |p| {
        if let PassKind::Fastest { of, .. } = &p.kind {
            found.push((&p.name, of.as_slice()));
        }
    });
    found
}

/// The groups of alternatives whose name is a value: the number of the one that runs.
pub fn told_groups(passes: &[Pass]) -> Vec<&Name> {
    let mut found = vec![];
    walk(passes, &mut |p| {
        if matches!(p.kind, PassKind::Fastest { .. }) && !p.kind.is_tuned(&p.name) {
            found.push(&p.name);
        }
    });
    found
}

/// As [`walk`], for edits.
pub fn walk_mut(passes: &mut [Pass], f: &mut impl FnMut(&mut Pass)) {
    for pass in passes {
        f(pass);
        for body in pass.kind.bodies_mut() {
            walk_mut(body, f);
        }
    }
}

/// Gives passes without a group that of the pass around them.
pub fn inherit_groups(passes: &mut [Pass], around: Option<&Name>) {
    for pass in passes {
        pass.group = pass.group.take().or_else(|| around.cloned());
        for body in pass.kind.bodies_mut() {
            inherit_groups(body, pass.group.as_ref());
        }
    }
}

/// Changes what the names of sub-graphs mean. Passes that share a scope go on sharing one.
pub fn rescope(passes: &mut [Pass], mut change: impl FnMut(&NameScope) -> NameScope) {
    let mut changed: Vec<(Arc<NameScope>, Arc<NameScope>)> = vec![];
    walk_mut(passes, &mut |p| {
        let Some(scope) = &mut p.scope else { return };
        *scope = match changed.iter().rev().find(|(before, _)| Arc::ptr_eq(before, scope)) {
            Some((_, after)) => after.clone(),
            None => {
                let after = Arc::new(change(scope));
                changed.push((scope.clone(), after.clone()));
                after
            }
        };
    });
}
