//! Whether a loop can end on the device: its steps are then handed over for iterations that never come, and do nothing.
//!
//! Draws and dispatches can be told on the device to do nothing; copies and clears can't. One is harmless after the end
//! when nothing needs what it writes any more, or when it writes what is there already.

use super::{Action, Ending, Geometry, Loop, Node, Plan, ResourceId, StepId};
use std::collections::BTreeSet;

/// Decides where each loop with a test is ended. After memory is allocated: what shares memory matters.
pub fn decide(plan: &mut Plan, features: wgpu_types::Features) {
    let mut order = std::mem::take(&mut plan.order);
    let mut rest = vec![];
    walk(plan, &mut order, features, &mut rest);
    plan.order = order;
}

/// `after`: what is read after these nodes, in later iterations of loops around them too.
fn walk(plan: &Plan, nodes: &mut [Node], features: wgpu_types::Features, after: &mut Vec<ResourceId>) {
    for node in nodes.iter_mut().rev() {
        if let Node::Loop(l) = node {
            let mut around = after.clone();
            reads(plan, &l.body, &mut around);
            walk(plan, &mut l.body, features, &mut around);
            let ending = match obstacle(plan, l, features, after) {
                None => Ending::Device,
                Some(why) => Ending::Host { why },
            };
            if let Some(until) = &mut l.until {
                until.ending = ending;
            }
        }
        reads(plan, std::slice::from_ref(node), after);
    }
}

fn reads(plan: &Plan, nodes: &[Node], out: &mut Vec<ResourceId>) {
    for node in nodes {
        match node {
            Node::Step(s) => out.extend(&plan.steps[s.0].reads),
            Node::Loop(l) => reads(plan, &l.body, out),
        }
    }
}

/// What keeps the host in charge of a loop's end, in words.
fn obstacle(plan: &Plan, l: &Loop, features: wgpu_types::Features, after: &[ResourceId]) -> Option<String> {
    let mut body: Vec<StepId> = vec![];
    for node in &l.body {
        match node {
            Node::Step(s) => body.push(*s),
            Node::Loop(inner) => return Some(format!("the loop `{}` lies in it", inner.name)),
        }
    }
    for (place, s) in body.iter().enumerate() {
        let step = &plan.steps[s.0];
        let harmless = match &step.action {
            Action::Compute { indirect: Some(_), .. } => {
                return Some(format!("`{}` already runs as often as the device says", step.name));
            }
            Action::Compute { .. } => true,
            Action::Draw(draw) => {
                let numbered = draw.members.iter().any(|m| m.index > 0);
                if numbered && !features.contains(wgpu_types::Features::INDIRECT_FIRST_INSTANCE) {
                    return Some(format!(
                        "this adapter can't begin an indirect draw of `{}` at a member's number",
                        step.name
                    ));
                }
                if draw.views > 1 {
                    return Some(format!("`{}` draws to several layers at once", step.name));
                }
                if draw.indirect.is_some() || matches!(draw.geometry, Geometry::Vertices { indirect: Some(_), .. }) {
                    return Some(format!("`{}` already draws what the device says", step.name));
                }
                true
            }
            Action::Clear { target, .. } => unneeded(plan, *target, after) || repeats(plan, &body, place, &[*target]),
            Action::Copy { from, to } => unneeded(plan, *to, after) || repeats(plan, &body, place, &[*from, *to]),
        };
        if !harmless {
            return Some(format!("`{}` would go on after the end", step.name));
        }
    }
    None
}

/// Whether nothing after the loop, in this frame or the next, reads a resource.
fn unneeded(plan: &Plan, id: ResourceId, after: &[ResourceId]) -> bool {
    !after.contains(&id) && !plan.resources[id.0].history && plan.outputs.iter().all(|o| o.1 != id)
}

/// Whether a copy or clear at this place of a body, done once more after an iteration, changes nothing: nothing writes
/// to the memory it touches between, and no other copy or clear does at all.
fn repeats(plan: &Plan, body: &[StepId], place: usize, touched: &[ResourceId]) -> bool {
    let slots: BTreeSet<usize> = touched.iter().map(|r| plan.resources[r.0].slot).collect();
    body.iter().enumerate().filter(|(i, _)| *i != place).all(|(i, s)| {
        let step = &plan.steps[s.0];
        let stays = i < place && matches!(step.action, Action::Draw(_) | Action::Compute { .. });
        stays || step.writes.iter().all(|w| !slots.contains(&plan.resources[w.0].slot))
    })
}
