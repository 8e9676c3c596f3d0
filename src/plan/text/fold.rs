//! Folds equal steps and resources, such as the members of a set, into one line.

use super::words::{StepWords, description, loop_head, member, ranges, template};
use crate::plan::{OrderNode, Plan, StepId};
use std::collections::BTreeSet;

/// A line of the order, or several.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Line {
    Step(StepWords),
    /// The same rows for each member from `first` to `last`, which stands as `[i]` in the names.
    Members {
        first: u32,
        last: u32,
        rows: Vec<StepWords>,
    },
    Loop {
        head: String,
        body: Vec<Line>,
    },
}

/// The order, folded where neighbours differ only by member.
pub fn lines(plan: &Plan, nodes: &[OrderNode]) -> Vec<Line> {
    let mut lines = vec![];
    let mut rest = nodes;
    while let [first, tail @ ..] = rest {
        rest = match first {
            OrderNode::Loop(l) => {
                lines.push(Line::Loop { head: loop_head(plan, l), body: self::lines(plan, &l.body) });
                tail
            }
            OrderNode::Step(s) => match members(plan, rest) {
                Some((line, length)) => {
                    lines.push(line);
                    &rest[length..]
                }
                None => {
                    lines.push(Line::Step(StepWords::of(plan, *s)));
                    tail
                }
            },
        };
    }
    lines
}

/// The repetition that the nodes begin with, and how many of them it takes.
fn members(plan: &Plan, nodes: &[OrderNode]) -> Option<(Line, usize)> {
    let step = |node: &OrderNode| match node {
        OrderNode::Step(s) => Some(*s),
        OrderNode::Loop(_) => None,
    };
    let number = |s: StepId| member(&plan.steps[s.0].name).map(|m| m.0);
    let steps: Vec<StepId> = nodes.iter().map_while(step).collect();
    let first = number(*steps.first()?)?;
    let period = steps.iter().take_while(|s| number(**s) == Some(first)).count();
    let rows = |part: &[StepId], m: u32| -> Vec<StepWords> {
        part.iter().map(|s| StepWords::of(plan, *s).renamed(&format!("[{m}]"), "[i]")).collect()
    };
    let pattern = rows(&steps[..period], first);
    let mut last = first;
    for part in steps.chunks_exact(period).skip(1) {
        let m = last + 1;
        if part.iter().any(|s| number(*s) != Some(m)) || rows(part, m) != pattern {
            break;
        }
        last = m;
    }
    let repeats = (last - first + 1) as usize;
    (repeats > 1).then_some((Line::Members { first, last, rows: pattern }, repeats * period))
}

/// Resources that differ only by member, as one.
#[derive(Debug, Clone)]
pub struct ResourceGroup {
    /// With `[i]` for the member.
    pub name: String,
    pub description: String,
    /// Indices of [`Plan::resources`], rising.
    pub ids: Vec<usize>,
}

impl ResourceGroup {
    /// The name as shown: `product[0…8]`, `product[1, 3]`.
    pub fn shown(&self, plan: &Plan) -> String {
        let members: BTreeSet<usize> =
            self.ids.iter().filter_map(|i| member(&plan.resources[*i].name).map(|m| m.0 as usize)).collect();
        if members.is_empty() {
            self.name.clone()
        } else {
            self.name.replacen("[i]", &format!("[{}]", ranges(members)), 1)
        }
    }
}

/// `[0…8]`, or `[3]` for a single member.
pub fn span(first: u32, last: u32) -> String {
    if first == last { format!("[{first}]") } else { format!("[{first}…{last}]") }
}

/// The resources of a plan in the order in which they are first used.
pub fn groups(plan: &Plan) -> Vec<ResourceGroup> {
    let mut groups: Vec<ResourceGroup> = vec![];
    for (i, r) in plan.resources.iter().enumerate() {
        let (name, description) = (template(&r.name), description(&r.desc));
        match groups.iter_mut().find(|g| g.name == name && g.description == description) {
            Some(g) => g.ids.push(i),
            None => groups.push(ResourceGroup { name, description, ids: vec![i] }),
        }
    }
    groups
}

/// The slots of some resources.
pub fn slots(plan: &Plan, group: &ResourceGroup) -> BTreeSet<usize> {
    group.ids.iter().map(|i| plan.resources[*i].slot).collect()
}
