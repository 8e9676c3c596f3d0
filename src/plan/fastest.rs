//! Handles groups of alternatives: several passes with the same results, of which a plan holds one. The caller names
//! the choice, because a plan cannot know how fast a device is; by default the first alternative runs.

use super::wire::{WiredItem, Wirer, Wiring};
use crate::diag::Diagnostic;
use crate::graph::Graph;
use crate::graph::ast::{self, Pass, PassKind, walk};
use crate::unused::mentioned;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{self, Display, Formatter};

/// Which alternative runs, by the name of the group. The first, where a group isn't named.
pub type Choices = BTreeMap<String, Choice>;

/// Of every group the first.
pub static FIRST: Choices = Choices::new();

/// One alternative of a group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Choice {
    /// Its place in the file, from 0. Where its conditions leave it out, the first that is there runs.
    pub index: usize,
    /// Why this one, as users are told.
    pub why: String,
}

/// A group of a plan of which more than one alternative could run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Alternatives {
    pub name: String,
    /// What is fastest in one scene and at one size is taken to be in all.
    pub once: bool,
    /// In the order of the file, without those that their conditions leave out.
    pub ways: Vec<Way>,
    /// The one that runs: an index into `ways`.
    pub chosen: usize,
    /// Why that one.
    pub why: String,
}

/// One way to the results of a group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Way {
    /// Its place in the file, from 0.
    pub index: usize,
    /// Names of its passes, without those in loops.
    pub passes: Vec<String>,
}

impl Display for Alternatives {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Some(way) = self.ways.get(self.chosen) else { return Ok(()) };
        let passes: Vec<String> = way.passes.iter().map(|p| format!("`{p}`")).collect();
        write!(f, "`{}` takes {}: {}", self.name, passes.join(" and "), self.why)
    }
}

/// A group as it was wired.
pub struct Group<'g> {
    pass: &'g Pass,
    found: Alternatives,
    /// By way.
    touched: Vec<Touched>,
}

/// The resources that passes read and write.
#[derive(Default)]
struct Touched {
    reads: BTreeSet<String>,
    writes: BTreeSet<String>,
}

impl Touched {
    /// Adds what these passes touch, apart from those of some names.
    fn add(&mut self, items: &[WiredItem], without: &BTreeSet<&str>) {
        for item in items {
            let skip = without.contains(item.pass().name.value.as_str());
            match item {
                WiredItem::Pass(_) if skip => {}
                WiredItem::Pass(w) => {
                    let of = |test: &dyn Fn(super::wire::Mode) -> bool| {
                        w.uses.iter().filter(|u| test(u.mode)).map(|u| u.resource.clone()).collect::<Vec<_>>()
                    };
                    self.reads.extend(of(&|m| m.reads()));
                    self.writes.extend(of(&|m| m.writes()));
                }
                WiredItem::Loop { until, body, .. } => {
                    self.reads.extend(until.iter().filter(|_| !skip).map(|u| u.0.clone()));
                    self.add(body, without);
                }
            }
        }
    }
}

impl<'g> Wirer<'g, '_> {
    /// The passes of the alternative that is chosen. The others are wired too: their faults are faults of the graph.
    pub(super) fn fastest(&mut self, group: &'g Pass, of: &'g [Vec<Pass>], loops: &[String]) -> Vec<WiredItem<'g>> {
        let name = &group.name.value;
        let asked = self.request.choices.get(name);
        let first = asked.map_or(0, |c| c.index);
        let (mut chosen, mut others) = (None, vec![]);
        let mut found = vec![];
        self.alternative = true;
        for index in std::iter::once(first).chain((0..of.len()).filter(|i| *i != first)) {
            let (shaders, tables) = (self.out.shaders.len(), self.out.tables.len());
            let items = of.get(index).map_or(vec![], |passes| self.passes(passes, loops));
            if items.is_empty() {
                continue;
            }
            let passes: Vec<&'g Pass> = items.iter().map(WiredItem::pass).collect();
            let mut touched = Touched::default();
            touched.add(&items, &BTreeSet::new());
            let way = Way { index, passes: passes.iter().map(|p| p.name.value.clone()).collect() };
            found.push((way, touched));
            if chosen.is_none() {
                chosen = Some((index, items));
            } else {
                others.extend(passes);
                // No step asks for them.
                self.out.shaders.truncate(shaders);
                self.out.tables.truncate(tables);
            }
        }
        self.alternative = false;
        let Some((index, items)) = chosen else {
            self.out.off.push((group, "none of its alternatives runs".into()));
            return vec![];
        };
        if found.len() > 1 {
            found.sort_by_key(|(way, _)| way.index);
            let (ways, touched): (Vec<Way>, Vec<Touched>) = found.into_iter().unzip();
            let why = asked.filter(|c| c.index == index).map_or("the first, not measured".into(), |c| c.why.clone());
            let chosen = ways.iter().position(|w| w.index == index).unwrap_or(0);
            let once = matches!(group.kind, PassKind::Fastest { once: true, .. });
            let found = Alternatives { name: name.clone(), once, ways, chosen, why };
            self.out.off.extend(others.into_iter().map(|p| (p, found.to_string())));
            self.out.groups.push(Group { pass: group, found, touched });
        }
        items
    }
}

/// Faults of alternatives that leave different results: what is read outside of a group, each of its ways writes.
pub fn agree(wiring: &Wiring, graph: &Graph) -> Vec<Diagnostic> {
    let mut faults = vec![];
    let asked = mentioned(graph);
    for group in &wiring.groups {
        let mut own = BTreeSet::new();
        walk(std::slice::from_ref(group.pass), &mut |p| {
            own.insert(p.name.value.as_str());
        });
        let mut others = Touched::default();
        others.add(&wiring.items, &own);
        others.reads.extend(graph.outputs.iter().map(|o| o.1.value.clone()));
        for other in wiring.groups.iter().filter(|o| o.found.name != group.found.name) {
            others.reads.extend(other.touched.iter().flat_map(|t| t.reads.iter().cloned()));
        }
        // Where the graph goes by which one runs, the others may leave what it would read then.
        let named = asked.contains(group.found.name.as_str());
        for resource in &others.reads {
            let writes = |want: bool| {
                let mut ways = group.touched.iter().enumerate();
                let found = ways
                    .find(|(i, t)| t.writes.contains(resource) == want && (want || !named || *i == group.found.chosen));
                found.and_then(|(i, _)| group.found.ways.get(i)?.passes.first())
            };
            if let (Some(one), Some(other)) = (writes(true), writes(false)) {
                let d = Diagnostic::error(format!(
                    "alternatives of `{}` leave different results: that of `{one}` writes `{resource}`, that of `{other}` does not",
                    group.found.name
                ));
                faults.push(
                    d.at(&group.pass.name.span, "")
                        .help(format!("write `{resource}` in each alternative, or in none and read it nowhere else")),
                );
            }
        }
    }
    faults
}

/// Faults of choices of what the graph does not have.
pub fn unknown(graph: &Graph, choices: &Choices) -> Vec<Diagnostic> {
    let groups = groups(graph);
    let mut faults = vec![];
    for (name, choice) in choices {
        match groups.iter().find(|g| g.0 == name) {
            None => {
                let d = Diagnostic::error(format!("the graph has no group of alternatives `{name}`"));
                faults.push(d.nearest(name, groups.iter().map(|g| g.0)));
            }
            Some((_, of)) if choice.index >= of.len() => faults.push(Diagnostic::error(format!(
                "`{name}` has {} alternatives, none of number {}",
                of.len(),
                choice.index
            ))),
            Some(_) => {}
        }
    }
    faults
}

/// The groups of a graph by name, each with its alternatives.
pub fn groups(graph: &Graph) -> Vec<(&str, &[Vec<Pass>])> {
    ast::groups(&graph.passes).into_iter().map(|(name, of)| (name.value.as_str(), of)).collect()
}

/// Whether a group of a graph is measured once on an adapter.
pub fn once(graph: &Graph, group: &str) -> bool {
    let mut found = false;
    walk(&graph.passes, &mut |p| {
        found |= p.name.value == group && matches!(p.kind, PassKind::Fastest { once: true, .. })
    });
    found
}

/// Of some choices those that a graph still offers.
pub fn still(graph: &Graph, choices: &Choices) -> Choices {
    let offered = |name: &str, index| groups(graph).iter().any(|(n, of)| *n == name && index < of.len());
    choices.iter().filter(|(name, c)| offered(name, c.index)).map(|(n, c)| (n.clone(), c.clone())).collect()
}

/// Choices under which every alternative runs: those given, then each of the others by itself.
pub fn each(graph: &Graph, choices: &Choices) -> Vec<Choices> {
    let mut all = vec![choices.clone()];
    for (name, of) in groups(graph) {
        let given = choices.get(name).map_or(0, |c| c.index);
        for index in (0..of.len()).filter(|i| *i != given) {
            let mut other = choices.clone();
            other.insert(name.to_string(), Choice { index, why: "for a check".into() });
            all.push(other);
        }
    }
    all
}

/// Of the groups those whose results are needed; `live` are the passes that are.
pub fn needed(groups: &[Group], live: &BTreeSet<&str>) -> Vec<Alternatives> {
    let runs =
        |a: &&Alternatives| a.ways.get(a.chosen).is_some_and(|w| w.passes.iter().any(|p| live.contains(p.as_str())));
    groups.iter().map(|g| &g.found).filter(runs).cloned().collect()
}
