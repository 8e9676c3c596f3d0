//! Writes a plan as compact text. Equal plans give equal texts, so two of them can be compared line by line.
//!
//! Equal steps and resources, such as the members of a set, fold into one line. `words` names the parts.

pub mod words;

use self::words::{StepWords, bytes, color, description, loop_head, member, ranges, shaders, template};
use crate::plan::{OrderNode, Plan, StepId};
use std::collections::BTreeSet;
use std::fmt::{self, Display, Formatter};

impl Display for Plan {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "plan of {}", self.graph)?;
        values(self, f)?;
        writeln!(f, "\nshaders")?;
        for (name, defs) in shaders(self) {
            line(f, 1, &[(&name, 26), (&defs, 0)])?;
        }
        writeln!(f, "\nsteps")?;
        steps(f, 1, &lines(self, &self.order))?;
        if !self.skipped.is_empty() {
            writeln!(f, "\nskipped")?;
            for (pass, why) in &self.skipped {
                line(f, 1, &[(pass, 26), (why, 0)])?;
            }
        }
        resources(self, f)?;
        memory(self, f)?;
        writeln!(f, "\noutputs")?;
        for (name, id) in &self.outputs {
            line(f, 1, &[(name, 26), (&self.resources[id.0].name, 0)])?;
        }
        Ok(())
    }
}

/// Words in columns of least widths; nothing hangs over at the end.
fn line(f: &mut Formatter<'_>, depth: usize, columns: &[(&str, usize)]) -> fmt::Result {
    let mut text = "  ".repeat(depth);
    for (word, width) in columns {
        text.push_str(&format!("{word:<width$} "));
        if word.chars().count() >= *width && *width > 0 {
            text.push(' ');
        }
    }
    writeln!(f, "{}", text.trim_end())
}

fn values(plan: &Plan, f: &mut Formatter<'_>) -> fmt::Result {
    writeln!(f, "\nparameters")?;
    for name in &plan.params {
        if let Some(value) = plan.value(name) {
            line(f, 1, &[(name, 26), (&value.to_string(), 0)])?;
        }
    }
    writeln!(f, "\nvalues")?;
    for (name, value) in plan.values.iter().filter(|(n, _)| !plan.params.contains(n)) {
        line(f, 1, &[(name, 26), (&value.to_string(), 0)])?;
    }
    Ok(())
}

fn steps(f: &mut Formatter<'_>, depth: usize, lines: &[Line]) -> fmt::Result {
    let row = |f: &mut Formatter<'_>, depth: usize, r: &StepWords| {
        let name = 26usize.saturating_sub(2 * (depth - 1));
        line(f, depth, &[(&r.name, name), (r.kind, 8), (&r.shader, 24), (&r.detail, 18), (&r.flow(), 0)])
    };
    for l in lines {
        match l {
            Line::Step(r) => row(f, depth, r)?,
            Line::Members { first, last, rows } => match &rows[..] {
                [only] => row(f, depth, &only.renamed("[i]", &span(*first, *last)))?,
                rows => {
                    writeln!(f, "{}for each i of {first}…{last}", "  ".repeat(depth))?;
                    for r in rows {
                        row(f, depth + 1, r)?;
                    }
                }
            },
            Line::Loop { head, body } => {
                writeln!(f, "{}loop {head}", "  ".repeat(depth))?;
                steps(f, depth + 1, body)?;
            }
        }
    }
    Ok(())
}

fn resources(plan: &Plan, f: &mut Formatter<'_>) -> fmt::Result {
    let mut places = vec![];
    place_names(plan, &plan.order, &mut places);
    writeln!(f, "\nresources")?;
    for g in groups(plan) {
        let each = g.ids.first().map_or(0, |i| plan.resources[*i].desc.bytes());
        let size = if g.ids.len() > 1 { format!("{} × {}", g.ids.len(), bytes(each)) } else { bytes(each) };
        let slots = slots(plan, &g);
        let slot = format!("{} {}", if slots.len() == 1 { "slot" } else { "slots" }, ranges(slots));
        let shown = g.shown(plan);
        let life = life(plan, &g, &places);
        line(f, 1, &[(&shown, 26), (&g.description, 34), (&size, 14), (&slot, 8), (&life, 0)])?;
    }
    Ok(())
}

/// From when to when a resource holds something needed, and what it begins with.
fn life(plan: &Plan, group: &ResourceGroup, places: &[String]) -> String {
    let all = || group.ids.iter().map(|i| &plan.resources[*i]);
    let Some(first) = all().next() else { return String::new() };
    let initial = first.initial.map(|c| format!(", initially {}", color(&c))).unwrap_or_default();
    if first.image.is_some() {
        return "from a file".into();
    }
    if first.history {
        return format!("kept from frame to frame{initial}");
    }
    let place = |at: usize| places.get(at).map_or("end", String::as_str);
    let from = place(all().map(|r| r.lifetime.0).min().unwrap_or(0));
    let to = place(all().map(|r| r.lifetime.1).max().unwrap_or(0));
    if from == to { format!("{from}{initial}") } else { format!("{from} … {to}{initial}") }
}

/// The name of each place in the order, as [`crate::plan::Resource::lifetime`] counts them: the passes, and the end of
/// each loop.
fn place_names(plan: &Plan, nodes: &[OrderNode], names: &mut Vec<String>) {
    for node in nodes {
        match node {
            OrderNode::Step(s) => {
                let step = &plan.steps[s.0];
                names.push(if step.name == step.pass { step.name.clone() } else { pass_word(&step.name, &step.pass) });
            }
            OrderNode::Loop(l) => {
                place_names(plan, &l.body, names);
                names.push(format!("end of {}", l.name));
            }
        }
    }
}

/// A pass's name, or "start" for the clear with which a resource begins the frame.
fn pass_word(step: &str, pass: &str) -> String {
    if step.contains(" = ") { "start".into() } else { pass.to_string() }
}

fn memory(plan: &Plan, f: &mut Formatter<'_>) -> fmt::Result {
    let (shared, apart) = plan.bytes();
    writeln!(f, "\nmemory")?;
    let saved = if apart > 0 { 100.0 * (1.0 - shared as f64 / apart as f64) } else { 0.0 };
    let (s, r) = (plan.slots.len(), plan.resources.len());
    writeln!(f, "  {} in {s} slots; {} for {r} resources unshared: {saved:.1} % saved", bytes(shared), bytes(apart))?;
    let groups = groups(plan);
    for (i, slot) in plan.slots.iter().enumerate() {
        let tenants = |g: &ResourceGroup| ResourceGroup {
            ids: g.ids.iter().copied().filter(|r| plan.resources[*r].slot == i).collect(),
            ..g.clone()
        };
        let tenants: Vec<ResourceGroup> = groups.iter().map(tenants).filter(|g| !g.ids.is_empty()).collect();
        if tenants.iter().map(|g| g.ids.len()).sum::<usize>() > 1 {
            let (name, size) = (format!("slot {i}"), bytes(slot.bytes));
            let names: Vec<String> = tenants.iter().map(|g| g.shown(plan)).collect();
            line(f, 1, &[(&name, 8), (&size, 10), (&names.join(", "), 0)])?;
        }
    }
    Ok(())
}

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
