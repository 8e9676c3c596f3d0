//! What the page is told, as JSON.

use lightgraph::internals::diag::{Severity, Span, render};
use lightgraph::internals::plan::{Desc, Resource, TextureKind};
use lightgraph::internals::value::{Value as Number, Values};
use lightgraph::{Diagnostic, Graph, Plan};
use serde_json::{Value, json};

/// Faults, warnings and notes, with their places as JavaScript counts in texts: in UTF-16.
pub fn diagnostics(all: &[Diagnostic]) -> Value {
    let place = |(span, text): &(Span, String)| {
        let units = |byte: usize| span.source.text.get(..byte).map_or(0, |head| head.encode_utf16().count());
        json!({ "path": span.source.path, "from": units(span.start), "to": units(span.end), "text": text })
    };
    let one = |d: &Diagnostic| {
        let severity = match d.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "info",
        };
        json!({
            "severity": severity,
            "message": d.message,
            "help": d.help,
            "places": d.labels.iter().map(place).collect::<Vec<_>>(),
            "shown": render(std::slice::from_ref(d)),
        })
    };
    all.iter().map(one).collect()
}

/// The parameters of a graph, each with its value.
pub fn params(graph: &Graph, set: &Values) -> Value {
    let one = |(name, param): &(lightgraph::internals::graph::ast::Name, lightgraph::internals::graph::ast::Param)| {
        json!({
            "name": name.value,
            "type": param.ty.wgsl(),
            "about": param.about,
            "value": number(set.get(&name.value).unwrap_or(&param.default)),
            "default": number(&param.default),
            "min": param.min.as_ref().map(number),
            "max": param.max.as_ref().map(number),
        })
    };
    graph.params.iter().map(one).collect()
}

/// The resources of a plan, for whoever looks into them.
pub fn resources(plan: &Plan) -> Value {
    let one = |resource: &Resource| match &resource.desc {
        Desc::Texture(t) => {
            let kind = match t.kind {
                TextureKind::D2 { .. } => "layer",
                TextureKind::Cube { .. } => "face",
                TextureKind::D3 => "slice",
            };
            let size = [t.width, t.height];
            json!({ "name": resource.name, "size": size, "mips": t.mips, "layers": t.layers, "kind": kind })
        }
        Desc::Buffer { size, .. } => json!({ "name": resource.name, "bytes": size }),
    };
    plan.resources.iter().map(one).collect()
}

fn number(value: &Number) -> Value {
    match value {
        Number::Bool(v) => json!(v),
        Number::Uint(v) => json!(v),
        Number::Int(v) => json!(v),
        Number::Float(v) => json!(v),
        other => json!(other.to_string()),
    }
}
