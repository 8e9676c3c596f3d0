//! Passes and what flows between them. Small plans are seen step by step, large ones pass by pass.

use lightgraph::internals::plan::text::words::{StepWords, intermediate, loop_head, member};
use lightgraph::internals::plan::{Action, Desc, OrderNode, Plan, ResourceId, Step, StepId, steps_of};
use std::collections::{BTreeMap, BTreeSet};

/// Plans with more steps than this are drawn pass by pass.
const MOST_STEPS: usize = 40;

/// The passes of a plan in their order, and who reads what they write.
pub(super) struct Network {
    pub passes: Vec<NetworkPass>,
    pub ports: Vec<Port>,
    pub items: Vec<NetworkItem>,
}

/// A pass (or a step of one), or an output of the graph.
pub(super) struct NetworkPass {
    pub name: String,
    /// "output" for an output.
    pub kind: &'static str,
    /// Empty without one.
    pub shader: String,
    /// What it stands for; none for an output.
    pub steps: Vec<StepId>,
    /// What it writes: indices of [`Network::ports`].
    pub ports: Vec<usize>,
    /// What it reads that an earlier iteration or frame wrote.
    pub carried: Vec<String>,
}

/// A resource as one pass leaves it.
pub(super) struct Port {
    pub pass: usize,
    pub resource: String,
    /// One, or the members of a set that is seen as one.
    pub ids: Vec<ResourceId>,
    /// Later passes that read it, or write into it.
    pub readers: Vec<usize>,
    /// Passes that read it in the next iteration or frame.
    pub carried: Vec<usize>,
}

/// A place in the order.
pub(super) enum NetworkItem {
    Pass(usize),
    Loop { title: String, body: Vec<NetworkItem> },
}

/// Sees a plan as a network, in which each of the `collapsed` sub-graphs is one pass.
pub(super) fn network(plan: &Plan, collapsed: &BTreeSet<String>) -> Network {
    let mut b = Builder {
        plan,
        collapsed,
        fold: plan.steps.len() > MOST_STEPS,
        out: Network { passes: vec![], ports: vec![], items: vec![] },
        by_key: BTreeMap::new(),
        of_step: BTreeMap::new(),
        writer: BTreeMap::new(),
    };
    let items = b.items(&plan.order);
    b.out.items = items;
    b.flow(&plan.order, &mut None);
    for (name, id) in &plan.outputs {
        let pass = b.add(name.clone(), "output", String::new());
        b.out.items.push(NetworkItem::Pass(pass));
        let resource = b.label(*id);
        if let Some(port) = b.writer.get(&resource).copied() {
            b.read(port, pass, false);
        }
    }
    // The next frame finds what this one left.
    b.flow(&plan.order, &mut Some(Again { first: 0, written: BTreeSet::new(), history_only: true }));
    b.hide_private();
    b.out
}

/// A second round, by which what earlier rounds leave is found.
struct Again {
    /// The first pass of the round.
    first: usize,
    /// Written in this round.
    written: BTreeSet<String>,
    /// Only resources with history last from round to round.
    history_only: bool,
}

struct Builder<'p> {
    plan: &'p Plan,
    collapsed: &'p BTreeSet<String>,
    fold: bool,
    out: Network,
    by_key: BTreeMap<String, usize>,
    of_step: BTreeMap<usize, usize>,
    /// The port that last wrote a resource.
    writer: BTreeMap<String, usize>,
}

impl Builder<'_> {
    fn add(&mut self, name: String, kind: &'static str, shader: String) -> usize {
        self.out.passes.push(NetworkPass { name, kind, shader, steps: vec![], ports: vec![], carried: vec![] });
        self.out.passes.len() - 1
    }

    fn items(&mut self, nodes: &[OrderNode]) -> Vec<NetworkItem> {
        let mut items = vec![];
        for node in nodes {
            match node {
                OrderNode::Loop(l) => {
                    items.push(NetworkItem::Loop { title: loop_head(self.plan, l), body: self.items(&l.body) })
                }
                OrderNode::Step(s) => {
                    let step = &self.plan.steps[s.0];
                    let graph = sub_graphs(&step.pass).find(|g| self.collapsed.contains(*g));
                    let key = match graph {
                        Some(graph) => graph.to_owned(),
                        None if self.fold => key(step),
                        None => step.name.clone(),
                    };
                    let pass = match self.by_key.get(&key) {
                        Some(pass) => *pass,
                        None => {
                            let row = StepWords::of(self.plan, *s);
                            let (kind, shader) =
                                if graph.is_some() { (COLLAPSED, String::new()) } else { (row.kind, row.shader) };
                            let pass = self.add(key.clone(), kind, shader);
                            self.by_key.insert(key, pass);
                            items.push(NetworkItem::Pass(pass));
                            pass
                        }
                    };
                    self.out.passes[pass].steps.push(*s);
                    self.of_step.insert(s.0, pass);
                }
            }
        }
        items
    }

    /// Takes away what only the collapsed sub-graph reads that wrote it.
    fn hide_private(&mut self) {
        let Network { passes, ports, .. } = &mut self.out;
        for (i, pass) in passes.iter_mut().enumerate().filter(|(_, p)| p.kind == COLLAPSED) {
            let private = |p: &Port| p.readers.is_empty() && p.carried.iter().all(|reader| *reader == i);
            let hidden: Vec<String> =
                pass.ports.iter().map(|p| &ports[*p]).filter(|p| private(p)).map(|p| p.resource.clone()).collect();
            pass.ports.retain(|p| !private(&ports[*p]));
            pass.carried.retain(|name| !hidden.contains(name));
        }
    }

    fn label(&self, id: ResourceId) -> String {
        let name = &self.plan.resources[id.0].name;
        match member(name) {
            Some((_, text)) if self.fold => name.replacen(text, "", 1),
            _ => name.clone(),
        }
    }

    /// Follows the resources through the order.
    fn flow(&mut self, nodes: &[OrderNode], again: &mut Option<Again>) {
        for node in nodes {
            match node {
                OrderNode::Step(s) => self.step(*s, again),
                OrderNode::Loop(l) => {
                    self.flow(&l.body, again);
                    let steps = steps_of(&l.body);
                    let first = steps.iter().filter_map(|s| self.of_step.get(&s.0)).min().copied().unwrap_or(0);
                    if again.is_none() && l.count > 1 {
                        let round = Again { first, written: BTreeSet::new(), history_only: false };
                        self.flow(&l.body, &mut Some(round));
                    }
                }
            }
        }
    }

    fn step(&mut self, s: StepId, again: &mut Option<Again>) {
        let plan = self.plan;
        let step = &plan.steps[s.0];
        let Some(pass) = self.of_step.get(&s.0).copied() else { return };
        for id in &step.reads {
            let resource = self.label(*id);
            let Some(port) = self.writer.get(&resource).copied() else { continue };
            match again {
                None => self.read(port, pass, false),
                Some(a) => {
                    let lasts = !a.history_only || plan.resources[id.0].history;
                    if lasts && !a.written.contains(&resource) && self.out.ports[port].pass >= a.first {
                        self.read(port, pass, true);
                    }
                }
            }
        }
        for id in &step.writes {
            let resource = self.label(*id);
            // Private to the pass, unless each step is seen.
            if self.fold && intermediate(&resource) {
                continue;
            }
            if let Some(a) = again {
                a.written.insert(resource.clone());
            }
            if again.is_none()
                && let Some(before) = self.writer.get(&resource).copied()
                && !overwrites(plan, step, *id)
            {
                self.read(before, pass, false);
            }
            let known = self.out.passes[pass].ports.iter().find(|p| self.out.ports[**p].resource == resource).copied();
            let port = known.unwrap_or_else(|| {
                let (readers, carried, ids) = (vec![], vec![], vec![]);
                self.out.ports.push(Port { pass, resource: resource.clone(), ids, readers, carried });
                let port = self.out.ports.len() - 1;
                self.out.passes[pass].ports.push(port);
                port
            });
            let ids = &mut self.out.ports[port].ids;
            if !ids.contains(id) {
                ids.push(*id);
            }
            self.writer.insert(resource, port);
        }
    }

    fn read(&mut self, port: usize, pass: usize, carried: bool) {
        let p = &mut self.out.ports[port];
        // A sub-graph in one box stands where its first pass does: what it reads later leads back.
        let carried = carried || (p.pass > pass && !self.collapsed.is_empty());
        if carried {
            if !p.carried.contains(&pass) {
                p.carried.push(pass);
                self.out.passes[pass].carried.push(p.resource.clone());
            }
        } else if p.pass != pass && !p.readers.contains(&pass) {
            p.readers.push(pass);
        }
    }
}

/// The kind of a box that stands for a sub-graph.
pub const COLLAPSED: &str = "sub-graph";

/// The sub-graphs that a pass is in, outermost first: `a` and `a.b` of `a.b.blur`.
pub fn sub_graphs(pass: &str) -> impl Iterator<Item = &str> {
    pass.match_indices('.').map(|(at, _)| &pass[..at])
}

/// What the steps of a pass have in common; clears that begin a frame stand apart from passes.
fn key(step: &Step) -> String {
    match (step.name.strip_suffix(" = initial"), member(&step.name)) {
        (Some(name), Some((_, text))) => format!("{} = initial", name.replacen(text, "", 1)),
        (Some(_), None) => step.name.clone(),
        (None, _) => step.pass.clone(),
    }
}

/// Whether nothing that was there before is left.
fn overwrites(plan: &Plan, step: &Step, id: ResourceId) -> bool {
    match &step.action {
        Action::Copy { .. } | Action::Clear { .. } => true,
        Action::Draw(d) => {
            let layers = match &plan.resources[id.0].desc {
                Desc::Texture(t) if t.tiles.is_none() => t.layers as usize,
                Desc::Texture(_) | Desc::Buffer { .. } => 1,
            };
            let color = d.color.iter().any(|c| c.resource == id && c.clear.is_some());
            let depth = d.depth.as_ref().is_some_and(|t| t.resource == id && t.clear.is_some());
            (color || depth) && d.members.len() * d.views as usize >= layers
        }
        Action::Compute { .. } => false,
    }
}
