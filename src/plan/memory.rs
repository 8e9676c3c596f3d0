//! Lifetimes, and which resources share memory.

use super::{Desc, Node, Plan, ResourceId, Slot};

/// One use of a resource at a place of the order.
#[derive(Clone, Copy)]
struct Touch {
    at: usize,
    read: bool,
}

/// Fills in `alive` and `slot` of every resource, and the plan's slots.
///
/// A resource holds something needed from its first write to its last read. Inside a loop that is true of one
/// iteration only when each iteration writes it before reading it and nothing outside uses it; otherwise it is alive
/// for the whole loop. Outputs live to the end, history for ever (in memory of their own).
/// With `share: false` every resource has memory of its own.
pub fn allocate(plan: &mut Plan, share: bool) {
    let mut touches: Vec<Vec<Touch>> = vec![vec![]; plan.resources.len()];
    let mut loops: Vec<(usize, usize)> = vec![];
    let mut at = 0;
    walk(plan, &plan.order, &mut at, &mut touches, &mut loops);
    let end = at;
    for (i, touches) in touches.iter().enumerate() {
        let mut alive = match (touches.first(), touches.last()) {
            (Some(a), Some(b)) => (a.at, b.at),
            _ => (0, 0),
        };
        // Inner loops stand before the loops around them.
        for (start, stop) in &loops {
            let inside = |t: &&Touch| t.at >= *start && t.at <= *stop;
            let Some(first) = touches.iter().find(inside) else { continue };
            let outside = touches.iter().any(|t| t.at < *start || t.at > *stop);
            if outside || first.read {
                alive = (alive.0.min(*start), alive.1.max(*stop));
            }
        }
        let r = &plan.resources[i];
        if plan.outputs.iter().any(|o| o.1.0 == i) {
            alive.1 = end;
        }
        if r.history {
            alive = (0, end);
        }
        plan.resources[i].alive = alive;
    }
    let mut order: Vec<usize> = (0..plan.resources.len()).collect();
    order.sort_by_key(|i| (plan.resources[*i].alive.0, *i));
    // For each slot the place after which it is free; `None` when it never is.
    let mut free: Vec<Option<usize>> = vec![];
    for i in order {
        let r = &plan.resources[i];
        let until = (!r.history).then_some(r.alive.1);
        let found = (0..plan.slots.len()).find(|s| {
            share
                && until.is_some()
                && free[*s].is_some_and(|f| f < r.alive.0)
                && plan.slots[*s].desc.shape() == r.desc.shape()
        });
        let slot = match found {
            Some(s) => {
                unite(&mut plan.slots[s].desc, &r.desc);
                free[s] = until;
                s
            }
            None => {
                plan.slots.push(Slot { desc: r.desc.clone(), bytes: r.desc.bytes() });
                free.push(until);
                plan.slots.len() - 1
            }
        };
        plan.resources[i].slot = slot;
    }
}

fn unite(a: &mut Desc, b: &Desc) {
    match (a, b) {
        (Desc::Texture(a), Desc::Texture(b)) => a.usage |= b.usage,
        (Desc::Buffer { usage: a, .. }, Desc::Buffer { usage: b, .. }) => *a |= *b,
        _ => {}
    }
}

fn walk(plan: &Plan, nodes: &[Node], at: &mut usize, touches: &mut [Vec<Touch>], loops: &mut Vec<(usize, usize)>) {
    for node in nodes {
        match node {
            Node::Step(s) => {
                let step = &plan.steps[s.0];
                let mut note = |id: ResourceId, read| touches[id.0].push(Touch { at: *at, read });
                step.reads.iter().for_each(|r| note(*r, true));
                step.writes.iter().for_each(|r| note(*r, false));
                // Bound for its size only: it must exist while the step runs.
                for b in &step.bindings {
                    if let super::Binding::Resource(id) = b
                        && !step.reads.contains(id)
                        && !step.writes.contains(id)
                    {
                        note(*id, false);
                    }
                }
                *at += 1;
            }
            Node::Loop(l) => {
                let start = *at;
                walk(plan, &l.body, at, touches, loops);
                if let Some(until) = &l.until {
                    touches[until.buffer.0].push(Touch { at: *at, read: true });
                }
                *at += 1;
                loops.push((start, *at - 1));
            }
        }
    }
}
