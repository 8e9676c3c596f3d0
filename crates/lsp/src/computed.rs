//! What a graph comes to for the current scene: values, sizes, who writes and reads what.

use crate::graphs::{self, CheckSettings};
use crate::texts::Texts;
use lightgraph::internals::diag::{Source, Span};
use lightgraph::internals::graph::expr::{Expr, Val};
use lightgraph::internals::graph::unroll::unroll;
use lightgraph::internals::plan::build::plan;
use lightgraph::internals::plan::fastest::FIRST;
use lightgraph::internals::plan::request::{Request, sample_device, sample_facts, values};
use lightgraph::internals::plan::sizes::Sizes;
use lightgraph::internals::plan::{Desc, TextureKind};
use lightgraph::internals::shader::Library;
use lightgraph::internals::value::Values;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Width and height that `screen` has here, as in checks.
const SCREEN: [u32; 2] = [640, 480];

/// What a graph comes to; what can't be computed is left out.
#[derive(Debug, Default)]
pub struct Computed {
    pub values: Values,
    /// By resource: its extent, and the memory it takes.
    pub sizes: BTreeMap<String, String>,
    pub writes: BTreeMap<String, BTreeSet<String>>,
    pub reads: BTreeMap<String, BTreeSet<String>>,
    /// By pass: why it does not run.
    pub skipped: BTreeMap<String, String>,
}

impl Computed {
    pub fn new(path: &Path, settings: &CheckSettings, texts: &Texts, earlier: &Library) -> Computed {
        let mut out = Computed::default();
        let Ok(project) = graphs::open(path, settings, texts, earlier).project else { return out };
        let facts = settings.facts.clone().unwrap_or_else(|| sample_facts(true));
        let (limits, features) = sample_device();
        let params = Values::new();
        let request = Request {
            graph: &project.graph,
            texts: &project.texts,
            params: &params,
            facts: &facts,
            screen: SCREEN,
            outputs: None,
            choices: &FIRST,
            levels: &[],
            limits: &limits,
            features,
        };
        out.values = values(&request).unwrap_or_default();
        let unrolled = unroll(&project.graph, &|name| out.values.get(name).map(|v| Val::from(*v)));
        if let Ok(graph) = unrolled {
            let request = Request { graph: &graph, ..request };
            let sizes = Sizes::new(&request, &out.values);
            for (name, _) in &graph.resources {
                if let Some(Ok(sized)) = sizes.of(&name.value) {
                    let members = sized.members.map_or(String::new(), |n| format!("{n} × "));
                    let elements = Some(sized.elements).filter(|_| sized.stride > 0);
                    out.sizes.insert(name.value.clone(), format!("{members}{}", extent(&sized.desc, elements)));
                }
            }
        }
        if let Ok(planned) = plan(&request) {
            let plan = planned.plan;
            let set = |name: &str| name.split('[').next().unwrap_or(name).to_string();
            for step in &plan.steps {
                for (ids, of) in [(&step.reads, &mut out.reads), (&step.writes, &mut out.writes)] {
                    for resource in ids.iter().filter_map(|id| plan.resources.get(id.0)) {
                        of.entry(set(&resource.name)).or_default().insert(step.pass.clone());
                    }
                }
            }
            for resource in &plan.resources {
                out.sizes.entry(resource.name.clone()).or_insert_with(|| extent(&resource.desc, None));
            }
            out.skipped = plan.skipped.into_iter().collect();
        }
        out
    }

    /// What an expression of the graph gives, where it is more than what it says.
    pub fn value_of(&self, text: &str) -> Option<String> {
        let source = Source::new("", text);
        let expr = Expr::parse(&Span::whole(&source), text).ok()?;
        let mut any = false;
        expr.names(&mut |_, _| any = true);
        let value = expr.eval(&|name| self.values.get(name).map(|v| Val::from(*v))).ok().filter(|_| any)?;
        value.to_value().map(|v| v.to_string())
    }
}

fn extent(desc: &Desc, elements: Option<u32>) -> String {
    let text = match desc {
        Desc::Buffer { size, .. } => elements.map_or(format!("{size} bytes"), |n| format!("{n} elements")),
        Desc::Texture(t) => {
            let layers = match t.kind {
                TextureKind::D3 => format!(" × {}", t.layers),
                TextureKind::D2 { array: true } | TextureKind::Cube { array: true } => format!(", {} layers", t.layers),
                TextureKind::D2 { array: false } | TextureKind::Cube { array: false } => String::new(),
            };
            let mips = if t.mips > 1 { format!(", {} mips", t.mips) } else { String::new() };
            format!("{} × {}{layers}{mips}", t.width, t.height)
        }
    };
    format!("{text}, {}", bytes(desc.bytes()))
}

fn bytes(count: u64) -> String {
    match count {
        0..1024 => format!("{count} B"),
        1024..1_048_576 => format!("{} KiB", count.div_ceil(1024)),
        _ => format!("{:.1} MiB", count as f64 / 1_048_576.0),
    }
}
