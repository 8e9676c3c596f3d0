//! A machine that runs plans on words.

use super::super::{Action, Binding, OrderNode, Place, Plan, ResourceId, Step};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// What each slot holds: whose content, and which.
struct Machine<'p> {
    plan: &'p Plan,
    slots: Vec<Option<(ResourceId, u64)>>,
    loops: Vec<(&'p str, u32)>,
}

/// The words of the outputs after some frames.
///
/// # Panics
/// A step reads a resource whose memory another one holds.
pub fn run(plan: &Plan, frames: u32) -> BTreeMap<String, u64> {
    let mut machine = Machine { plan, slots: vec![None; plan.slots.len()], loops: vec![] };
    for (i, r) in plan.resources.iter().enumerate().filter(|(_, r)| r.history) {
        machine.slots[r.slot] = Some((ResourceId(i), 1));
    }
    for _ in 0..frames {
        machine.nodes(&plan.order);
    }
    plan.outputs.iter().map(|(name, id)| (name.clone(), machine.read(*id, "an output"))).collect()
}

impl<'p> Machine<'p> {
    fn nodes(&mut self, nodes: &'p [OrderNode]) {
        for node in nodes {
            match node {
                OrderNode::Step(s) => self.step(&self.plan.steps[s.0]),
                OrderNode::Loop(l) => {
                    for i in 0..l.count {
                        self.loops.push((&l.name, i));
                        self.nodes(&l.body);
                        if let Some(until) = &l.until {
                            self.read(until.buffer, "the test of a loop");
                        }
                        self.loops.pop();
                    }
                }
            }
        }
    }

    fn read(&self, id: ResourceId, who: &str) -> u64 {
        let r = &self.plan.resources[id.0];
        match self.slots[r.slot] {
            Some((holder, word)) if holder == id => word,
            other => {
                let holds = other.map(|(h, _)| self.plan.resources[h.0].name.as_str());
                panic!("{who} reads {}, whose memory holds {holds:?} in\n{}", r.name, self.plan)
            }
        }
    }

    fn step(&mut self, step: &Step) {
        let reads: Vec<u64> = step.reads.iter().map(|r| self.read(*r, &step.name)).collect();
        for id in &step.writes {
            let slot = self.plan.resources[id.0].slot;
            let before = match self.slots[slot] {
                Some((holder, word)) if holder == *id && self.adds(step) => word,
                _ => 0,
            };
            let mut hash = DefaultHasher::new();
            (&step.name, &self.loops, &reads, id, before).hash(&mut hash);
            self.slots[slot] = Some((*id, hash.finish()));
        }
    }

    /// Whether a step leaves what earlier iterations wrote. In the first there is nothing to leave: what an earlier
    /// frame wrote is no one's.
    fn adds(&self, step: &Step) -> bool {
        let later = || self.loops.iter().filter(|l| l.1 > 0);
        let indexed = |b: &Binding| match b {
            Binding::Uniform { layout, .. } => layout.members.iter().any(|m| later().any(|l| l.0 == m.name)),
            _ => false,
        };
        let layer = |place| matches!(place, Place::LoopLayer(_)) && later().next().is_some();
        matches!(&step.action, Action::Draw(d) if d.members.iter().any(|m| layer(m.place)))
            || step.bindings.iter().any(indexed)
    }
}
