//! A plan in the DOT language of Graphviz.

use super::network::{Network, NetworkItem, NetworkPass, network};
use lightgraph::internals::plan::Plan;
use std::collections::BTreeSet;
use std::fmt::Write;

/// Passes as nodes, resources as edges, loops and sub-graphs as clusters; what comes from an earlier iteration or frame
/// is dashed, skipped passes are grey.
pub fn to_dot(plan: &Plan) -> String {
    let net = network(plan, &BTreeSet::new());
    let mut out = String::from("digraph plan {\n");
    let title = quoted(&plan.graph);
    out += &format!("  label={title}; labelloc=t; fontname=\"sans-serif\"; rankdir=TB;\n");
    out +=
        "  node [shape=box, style=\"rounded,filled\", fillcolor=\"#eef2f7\", fontname=\"sans-serif\", fontsize=11];\n";
    out += "  edge [fontname=\"sans-serif\", fontsize=9, color=\"#55606e\"];\n";
    items(&net, &net.items, 1, &mut 0, &mut out);
    for port in &net.ports {
        let label = quoted(&port.resource);
        for reader in &port.readers {
            out += &format!("  n{} -> n{reader} [label={label}];\n", port.pass);
        }
        for reader in &port.carried {
            out += &format!("  n{} -> n{reader} [label={label}, style=dashed, constraint=false];\n", port.pass);
        }
    }
    for (i, (pass, why)) in plan.skipped.iter().enumerate() {
        let label = quoted(&format!("{pass}\n{why}"));
        out += &format!("  s{i} [label={label}, fillcolor=\"#f4f4f4\", color=\"#bbbbbb\", fontcolor=\"#999999\"];\n");
    }
    out + "}\n"
}

fn items(net: &Network, list: &[NetworkItem], depth: usize, clusters: &mut usize, out: &mut String) {
    let indent = "  ".repeat(depth);
    for item in list {
        match item {
            NetworkItem::Pass(i) => {
                let pass = &net.passes[*i];
                let shape = if pass.kind == "output" { ", shape=ellipse, fillcolor=\"#ffffff\"" } else { "" };
                // Writing to a string can't fail.
                let _ = write!(out, "{indent}");
                let subs: Vec<usize> = pass.name.match_indices('.').map(|(at, _)| at).collect();
                for at in &subs {
                    let sub = quoted(&format!("cluster {}", &pass.name[..*at]));
                    let title = quoted(&pass.name[..*at]);
                    let _ = write!(out, "subgraph {sub} {{ label={title}; style=rounded; ");
                }
                let _ = writeln!(out, "n{i} [label={}{shape}];{}", quoted(&label(pass)), " }".repeat(subs.len()));
            }
            NetworkItem::Loop { title, body } => {
                let _ = writeln!(out, "{indent}subgraph cluster_{clusters} {{");
                let _ = writeln!(out, "{indent}  label={}; style=\"rounded,dashed\";", quoted(title));
                *clusters += 1;
                items(net, body, depth + 1, clusters, out);
                let _ = writeln!(out, "{indent}}}");
            }
        }
    }
}

fn label(pass: &NetworkPass) -> String {
    let times = if pass.steps.len() > 1 { format!(" × {}", pass.steps.len()) } else { String::new() };
    let shader = if pass.shader.is_empty() { String::new() } else { format!(" {}", pass.shader) };
    format!("{}\n{}{shader}{times}", pass.name, pass.kind)
}

/// A quoted string, whose line breaks Graphviz keeps.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n"))
}
