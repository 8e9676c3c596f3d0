//! Orders the steps of a block: finds their dependencies and picks one legal order, the same every time.
//!
//! Also decides whether a loop can end on the device. The host then records all iterations in advance, and those after
//! the end must have no effect. Draws and dispatches get indirect sizes of zero. Copies and clears cannot be skipped;
//! a loop may contain one only if nothing reads its result after the end, or if it writes the same content again.

use super::{Action, DrawGeometry, Ending, Loop, OrderNode, Plan, ResourceId, Step, StepId, Until, steps_of};
use std::collections::BTreeSet;

/// The entries of a graph or of a loop's body, in the order of the file, each with its rank.
#[derive(Debug, Default)]
pub struct OrderBlock {
    entries: Vec<(OrderEntry, Rank)>,
}

/// Group, member, place in the file: among the entries that may come next the lowest rank does.
pub type Rank = (usize, u32, usize);

#[derive(Debug)]
pub enum OrderEntry {
    Step(StepId),
    Loop { name: String, count: u32, until: Option<Until>, body: OrderBlock },
}

impl OrderBlock {
    pub fn push(&mut self, entry: OrderEntry, rank: Rank) {
        self.entries.push((entry, rank));
    }

    /// The entries of another block, after those of this one.
    pub fn append(&mut self, other: OrderBlock) {
        self.entries.extend(other.entries);
    }
}

/// What an entry accesses, and the steps it stands for.
struct EntryAccess {
    /// In rising order, none twice; as are the others.
    reads: Vec<ResourceId>,
    writes: Vec<ResourceId>,
    steps: Vec<StepId>,
}

/// Orders a block; fills in `after` of its steps.
///
/// `choose` picks one of so many entries that may come next, in the order of their ranks: 0 for the stable order,
/// anything else for another legal one.
pub fn order(block: OrderBlock, steps: &mut [Step], choose: &mut dyn FnMut(usize) -> usize) -> Vec<OrderNode> {
    let accesses: Vec<EntryAccess> = block.entries.iter().map(|(e, _)| access_of(e, steps)).collect();
    let before = dependencies(&accesses);
    for (i, t) in accesses.iter().enumerate() {
        let after = sorted(before[i].iter().flat_map(|j| &accesses[*j].steps).copied().collect());
        for s in &t.steps {
            steps[s.0].after.extend(&after);
        }
    }
    let ranks: Vec<Rank> = block.entries.iter().map(|(_, r)| *r).collect();
    let mut entries: Vec<Option<OrderEntry>> = block.entries.into_iter().map(|(e, _)| Some(e)).collect();
    let mut waiting: Vec<usize> = before.iter().map(Vec::len).collect();
    let mut dependents: Vec<Vec<usize>> = vec![vec![]; before.len()];
    for (j, b) in before.iter().enumerate() {
        b.iter().for_each(|i| dependents[*i].push(j));
    }
    let mut ready: BTreeSet<(Rank, usize)> =
        (0..ranks.len()).filter(|i| waiting[*i] == 0).map(|i| (ranks[i], i)).collect();
    let mut nodes = vec![];
    while let Some(last) = ready.len().checked_sub(1) {
        let pick = choose(ready.len()).min(last);
        let Some(next) = ready.iter().nth(pick).copied() else { break };
        ready.remove(&next);
        if let Some(entry) = entries[next.1].take() {
            nodes.push(match entry {
                OrderEntry::Step(s) => OrderNode::Step(s),
                OrderEntry::Loop { name, count, until, body } => {
                    OrderNode::Loop(Loop { name, count, until, body: order(body, steps, choose) })
                }
            });
        }
        for &j in &dependents[next.1] {
            waiting[j] -= 1;
            if waiting[j] == 0 {
                ready.insert((ranks[j], j));
            }
        }
    }
    nodes
}

fn access_of(entry: &OrderEntry, steps: &[Step]) -> EntryAccess {
    fn gather(entry: &OrderEntry, steps: &[Step], all: &mut EntryAccess) {
        match entry {
            OrderEntry::Step(s) => {
                all.reads.extend(&steps[s.0].reads);
                all.writes.extend(&steps[s.0].writes);
                all.steps.push(*s);
            }
            OrderEntry::Loop { until, body, .. } => {
                all.reads.extend(until.iter().map(|u| u.buffer));
                body.entries.iter().for_each(|(e, _)| gather(e, steps, all));
            }
        }
    }
    let mut all = EntryAccess { reads: vec![], writes: vec![], steps: vec![] };
    gather(entry, steps, &mut all);
    EntryAccess { reads: sorted(all.reads), writes: sorted(all.writes), steps: sorted(all.steps) }
}

/// In rising order, none twice.
fn sorted<T: Ord>(mut all: Vec<T>) -> Vec<T> {
    all.sort_unstable();
    all.dedup();
    all
}

/// For each entry those it must come after: reads after writes, writes after reads, writes after writes.
fn dependencies(accesses: &[EntryAccess]) -> Vec<Vec<usize>> {
    let resources = accesses.iter().flat_map(|t| t.reads.iter().chain(&t.writes)).map(|r| r.0 + 1).max().unwrap_or(0);
    let mut writer: Vec<Option<usize>> = vec![None; resources];
    let mut readers: Vec<Vec<usize>> = vec![vec![]; resources];
    let mut before = Vec::with_capacity(accesses.len());
    for (i, t) in accesses.iter().enumerate() {
        let mut earlier: Vec<usize> = t.reads.iter().chain(&t.writes).filter_map(|r| writer[r.0]).collect();
        for r in &t.writes {
            earlier.append(&mut readers[r.0]);
            writer[r.0] = Some(i);
        }
        for r in &t.reads {
            readers[r.0].push(i);
        }
        before.push(sorted(earlier));
    }
    before
}

/// Decides where each loop with a test is ended. After memory is allocated: what shares memory matters.
pub fn decide_ends(plan: &mut Plan, features: wgpu_types::Features) {
    let mut order = std::mem::take(&mut plan.order);
    let mut rest = vec![];
    walk(plan, &mut order, features, &mut rest);
    plan.order = order;
}

/// `after`: what is read after these nodes, in later iterations of loops around them too.
fn walk(plan: &Plan, nodes: &mut [OrderNode], features: wgpu_types::Features, after: &mut Vec<ResourceId>) {
    for node in nodes.iter_mut().rev() {
        if let OrderNode::Loop(l) = node {
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

fn reads(plan: &Plan, nodes: &[OrderNode], out: &mut Vec<ResourceId>) {
    out.extend(steps_of(nodes).iter().flat_map(|s| &plan.steps[s.0].reads));
}

/// What keeps the host in charge of a loop's end, in words.
fn obstacle(plan: &Plan, l: &Loop, features: wgpu_types::Features, after: &[ResourceId]) -> Option<String> {
    let mut body: Vec<StepId> = vec![];
    for node in &l.body {
        match node {
            OrderNode::Step(s) => body.push(*s),
            OrderNode::Loop(inner) => return Some(format!("the loop `{}` lies in it", inner.name)),
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
                if draw.indirect.is_some() || matches!(draw.geometry, DrawGeometry::Vertices { indirect: Some(_), .. })
                {
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
