//! Steps of a block to an order: what must come before what, and a stable choice among the legal orders.

use super::{Loop, Node, ResourceId, Step, StepId, Until};
use std::collections::{BTreeMap, BTreeSet};

/// The entries of a graph or of a loop's body, in the order of the file, each with its rank.
#[derive(Debug, Default)]
pub struct Block {
    entries: Vec<(Entry, Rank)>,
}

/// Group, member, place in the file: among the entries that may come next the lowest rank does.
pub type Rank = (usize, u32, usize);

#[derive(Debug)]
pub enum Entry {
    Step(StepId),
    Loop { name: String, count: u32, until: Option<Until>, body: Block },
}

impl Block {
    pub fn push(&mut self, entry: Entry, rank: Rank) {
        self.entries.push((entry, rank));
    }

    /// The entries of another block, after those of this one.
    pub fn append(&mut self, other: Block) {
        self.entries.extend(other.entries);
    }
}

/// What an entry touches, and the steps it stands for.
struct Touch {
    reads: BTreeSet<ResourceId>,
    writes: BTreeSet<ResourceId>,
    steps: Vec<StepId>,
}

/// Orders a block; fills in `after` of its steps.
///
/// `choose` picks among the entries that may come next, given their ranks in rising order: 0 for the stable order,
/// anything else for another legal one.
pub fn order(block: Block, steps: &mut [Step], choose: &mut dyn FnMut(&[Rank]) -> usize) -> Vec<Node> {
    let touches: Vec<Touch> = block.entries.iter().map(|(e, _)| touch(e, steps)).collect();
    let before = dependencies(&touches);
    for (i, t) in touches.iter().enumerate() {
        let after: BTreeSet<StepId> = before[i].iter().flat_map(|j| touches[*j].steps.iter().copied()).collect();
        for s in &t.steps {
            steps[s.0].after.extend(after.iter().copied());
        }
    }
    let ranks: Vec<Rank> = block.entries.iter().map(|(_, r)| *r).collect();
    let mut entries: Vec<Option<Entry>> = block.entries.into_iter().map(|(e, _)| Some(e)).collect();
    let mut waiting: Vec<usize> = before.iter().map(BTreeSet::len).collect();
    let mut dependents: Vec<Vec<usize>> = vec![vec![]; before.len()];
    for (j, b) in before.iter().enumerate() {
        b.iter().for_each(|i| dependents[*i].push(j));
    }
    let mut ready: BTreeSet<(Rank, usize)> =
        (0..ranks.len()).filter(|i| waiting[*i] == 0).map(|i| (ranks[i], i)).collect();
    let mut nodes = vec![];
    while !ready.is_empty() {
        let open: Vec<(Rank, usize)> = ready.iter().copied().collect();
        let pick = choose(&open.iter().map(|o| o.0).collect::<Vec<_>>()).min(open.len() - 1);
        let next = open[pick];
        ready.remove(&next);
        if let Some(entry) = entries[next.1].take() {
            nodes.push(match entry {
                Entry::Step(s) => Node::Step(s),
                Entry::Loop { name, count, until, body } => {
                    Node::Loop(Loop { name, count, until, body: order(body, steps, choose) })
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

fn touch(entry: &Entry, steps: &[Step]) -> Touch {
    match entry {
        Entry::Step(s) => {
            let step = &steps[s.0];
            Touch {
                reads: step.reads.iter().copied().collect(),
                writes: step.writes.iter().copied().collect(),
                steps: vec![*s],
            }
        }
        Entry::Loop { until, body, .. } => {
            let mut all = Touch { reads: BTreeSet::new(), writes: BTreeSet::new(), steps: vec![] };
            all.reads.extend(until.iter().map(|u| u.buffer));
            for (e, _) in &body.entries {
                let t = touch(e, steps);
                all.reads.extend(t.reads);
                all.writes.extend(t.writes);
                all.steps.extend(t.steps);
            }
            all
        }
    }
}

/// For each entry those it must come after: reads after writes, writes after reads, writes after writes.
fn dependencies(touches: &[Touch]) -> Vec<BTreeSet<usize>> {
    let mut writer: BTreeMap<ResourceId, usize> = BTreeMap::new();
    let mut readers: BTreeMap<ResourceId, Vec<usize>> = BTreeMap::new();
    let mut before = vec![BTreeSet::new(); touches.len()];
    for (i, t) in touches.iter().enumerate() {
        for r in t.reads.union(&t.writes) {
            before[i].extend(writer.get(r).copied());
        }
        for r in &t.writes {
            before[i].extend(readers.remove(r).unwrap_or_default());
            writer.insert(*r, i);
        }
        for r in &t.reads {
            readers.entry(*r).or_default().push(i);
        }
        before[i].remove(&i);
    }
    before
}
