//! What one plan changes of another, in words.

use lightgraph::internals::plan::Plan;
use lightgraph::internals::plan::text::words::{StepWords, bytes, color, shaders};
use lightgraph::internals::plan::text::{Line, groups, lines};
use std::collections::BTreeMap;
use std::fmt::Write;

/// What `b` changes of `a`: parameters, shaders, passes, their order, resources, outputs, memory. Lines begin with
/// `+` for what only `b` has, `-` for what only `a` has. "no difference" when there is none.
pub fn diff(a: &Plan, b: &Plan) -> String {
    let mut out = format!("from {} to {}\n", a.graph, b.graph);
    let head = out.len();
    section(&mut out, "parameters", &parameters(a), &parameters(b));
    section(&mut out, "values", &values(a), &values(b));
    section(&mut out, "shaders", &shaders(a), &shaders(b));
    let (pa, pb) = (passes(a), passes(b));
    section(&mut out, "passes", &pa, &pb);
    order(&mut out, &pa, &pb);
    section(&mut out, "skipped", &a.skipped, &b.skipped);
    section(&mut out, "resources", &resources(a), &resources(b));
    section(&mut out, "outputs", &outputs(a), &outputs(b));
    if out.len() == head {
        return out + "\nno difference\n";
    }
    memory(&mut out, a, b);
    out
}

type NamedTexts = [(String, String)];

/// The entries that differ, by name, in the order of `b`, those of `a` alone at the end.
fn section(out: &mut String, title: &str, a: &NamedTexts, b: &NamedTexts) {
    let entries = |list: &NamedTexts| -> BTreeMap<String, Vec<String>> {
        let mut map: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for (name, text) in list {
            map.entry(name.clone()).or_default().push(text.clone());
        }
        map
    };
    let (old, new) = (entries(a), entries(b));
    let mut names: Vec<&String> = vec![];
    for (name, _) in b.iter().chain(a) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let mut lines = String::new();
    for name in names {
        let none = vec![];
        let (old, new) = (old.get(name).unwrap_or(&none), new.get(name).unwrap_or(&none));
        for text in old.iter().filter(|t| !new.contains(t)) {
            lines += format!("  - {name:<24} {text}").trim_end();
            lines.push('\n');
        }
        for text in new.iter().filter(|t| !old.contains(t)) {
            lines += format!("  + {name:<24} {text}").trim_end();
            lines.push('\n');
        }
    }
    if !lines.is_empty() {
        *out += &format!("\n{title}\n{lines}");
    }
}

fn parameters(plan: &Plan) -> Vec<(String, String)> {
    plan.params.iter().filter_map(|n| Some((n.clone(), plan.value(n)?.to_string()))).collect()
}

fn values(plan: &Plan) -> Vec<(String, String)> {
    let own = plan.values.iter().filter(|(n, _)| !plan.params.contains(n));
    own.map(|(n, v)| (n.clone(), v.to_string())).collect()
}

/// A line for each step, folded; loops by their heads.
fn passes(plan: &Plan) -> Vec<(String, String)> {
    fn gather(lines: &[Line], inside: &str, out: &mut Vec<(String, String)>) {
        let row = |r: &StepWords| {
            let words = [r.kind, &r.shader, &r.detail, &r.flow()].map(str::to_string);
            let words: Vec<String> = words.into_iter().filter(|w| !w.is_empty()).collect();
            (r.name.clone(), format!("{}{inside}", words.join("  ")))
        };
        for line in lines {
            match line {
                Line::Step(r) => out.push(row(r)),
                Line::Members { first, last, rows } => {
                    let counted = |(name, text)| (name, format!("{text}  (i of {first}…{last})"));
                    out.extend(rows.iter().map(row).map(counted));
                }
                Line::Loop { head, body } => {
                    let name = head.split(' ').next().unwrap_or(head);
                    out.push((name.to_string(), format!("loop {head}")));
                    gather(body, &format!("  (in {name})"), out);
                }
            }
        }
    }
    let mut out = vec![];
    gather(&lines(plan, &plan.order), "", &mut out);
    out
}

/// The passes that both have, where they stand in another order.
fn order(out: &mut String, a: &NamedTexts, b: &NamedTexts) {
    let common = |of: &NamedTexts, other: &NamedTexts| -> Vec<String> {
        of.iter().filter(|(n, _)| other.iter().any(|(m, _)| m == n)).map(|(n, _)| n.clone()).collect()
    };
    let (old, new) = (common(a, b), common(b, a));
    if old != new {
        *out += &format!("\norder\n  - {}\n  + {}\n", old.join(", "), new.join(", "));
    }
}

fn resources(plan: &Plan) -> Vec<(String, String)> {
    let mut out = vec![];
    for g in groups(plan) {
        let all: Vec<_> = g.ids.iter().map(|i| &plan.resources[*i]).collect();
        let total: u64 = all.iter().map(|r| r.desc.bytes()).sum();
        let times = if all.len() > 1 { format!("{} × ", all.len()) } else { String::new() };
        let mut text = format!("{times}{}, {}", g.description, bytes(total));
        if let Some(r) = all.first() {
            if r.history {
                text += ", kept from frame to frame";
            }
            if let Some(c) = &r.initial {
                text += &format!(", initially {}", color(c));
            }
        }
        out.push((g.name, text));
    }
    out
}

fn outputs(plan: &Plan) -> Vec<(String, String)> {
    plan.outputs.iter().map(|(n, r)| (n.clone(), plan.resources[r.0].name.clone())).collect()
}

fn memory(out: &mut String, a: &Plan, b: &Plan) {
    let ((shared_a, apart_a), (shared_b, apart_b)) = (a.bytes(), b.bytes());
    *out += "\nmemory\n";
    let change =
        |a: u64, b: u64| if a > 0 { format!("{:+.1} %", 100.0 * (b as f64 / a as f64 - 1.0)) } else { "new".into() };
    for (what, a, b) in [("allocated", shared_a, shared_b), ("unshared", apart_a, apart_b)] {
        // Writing to a string can't fail.
        let _ = writeln!(out, "  {what:<11} {} → {} ({})", bytes(a), bytes(b), change(a, b));
    }
    let _ = writeln!(out, "  steps       {} → {}", a.steps.len(), b.steps.len());
}
