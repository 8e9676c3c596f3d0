//! A plan for other programs. The keys are stable: they are those of the structs here, not of the plan.

use lightgraph::internals::plan::fastest::Alternatives;
use lightgraph::internals::plan::keys::Keys;
use lightgraph::internals::plan::text::words::{StepWords, comparison, description};
use lightgraph::internals::plan::{Action, Desc, Ending, OrderNode, Plan, Slot};
use lightgraph::internals::shader::Def;
use lightgraph::internals::value::Value;
use serde::Serialize;
use serde_json::{Map, Value as Json, json};

#[derive(Serialize)]
struct PlanJson<'p> {
    graph: &'p str,
    /// In the graph's order.
    parameters: Vec<NamedJson<'p>>,
    /// Derived values and facts, by name.
    values: Map<String, Json>,
    shaders: Vec<ShaderJson<'p>>,
    tables: Vec<TableJson<'p>>,
    steps: Vec<StepJson<'p>>,
    order: Vec<NodeJson<'p>>,
    skipped: Vec<SkippedJson<'p>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    alternatives: Vec<AlternativesJson<'p>>,
    resources: Vec<ResourceJson<'p>>,
    slots: Vec<SlotJson>,
    outputs: Vec<OutputJson<'p>>,
    memory: MemoryJson,
}

#[derive(Serialize)]
struct NamedJson<'p> {
    name: &'p str,
    value: Json,
}

#[derive(Serialize)]
struct ShaderJson<'p> {
    path: &'p str,
    defines: Map<String, Json>,
    sources: &'p [String],
}

#[derive(Serialize)]
struct TableJson<'p> {
    table: &'p str,
    columns: Vec<&'p str>,
    stride: u32,
}

/// `shader`, `reads`, `writes` and `after` are indices.
#[derive(Serialize)]
struct StepJson<'p> {
    name: &'p str,
    pass: &'p str,
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    shader: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    workgroups: Option<[u32; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    draws: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<[f64; 4]>,
    reads: Vec<usize>,
    writes: Vec<usize>,
    after: Vec<usize>,
    /// What it runs again for, besides changes of what it reads; in a loop that of all its steps.
    depends: Vec<String>,
}

/// A place in the order: an index into the steps, or a loop.
#[derive(Serialize)]
#[serde(untagged)]
enum NodeJson<'p> {
    Step(usize),
    Loop {
        #[serde(rename = "loop")]
        name: &'p str,
        count: u32,
        #[serde(skip_serializing_if = "Option::is_none")]
        until: Option<UntilJson<'p>>,
        body: Vec<NodeJson<'p>>,
    },
}

/// `buffer` is an index into the resources.
#[derive(Serialize)]
struct UntilJson<'p> {
    buffer: usize,
    comparison: &'static str,
    value: f32,
    /// Why the host ends it; without, the device does.
    #[serde(skip_serializing_if = "Option::is_none")]
    by_host: Option<&'p str>,
}

#[derive(Serialize)]
struct SkippedJson<'p> {
    pass: &'p str,
    reason: &'p str,
}

/// A group, the passes of each of its alternatives, and the one that runs: its place among them.
#[derive(Serialize)]
struct AlternativesJson<'p> {
    name: &'p str,
    of: Vec<&'p [String]>,
    runs: usize,
    why: &'p str,
}

fn alternatives(found: &Alternatives) -> AlternativesJson<'_> {
    let of = found.ways.iter().map(|way| way.passes.as_slice()).collect();
    AlternativesJson { name: &found.name, of, runs: found.chosen, why: &found.why }
}

/// `slot` is an index; `lifetime` counts places in the order, the end of a loop as one.
#[derive(Serialize)]
struct ResourceJson<'p> {
    name: &'p str,
    #[serde(flatten)]
    desc: DescJson,
    bytes: u64,
    slot: usize,
    lifetime: (usize, usize),
    history: bool,
    initial: Option<[f64; 4]>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum DescJson {
    Texture {
        description: String,
        format: String,
        width: u32,
        height: u32,
        layers: u32,
        mips: u32,
        #[serde(skip_serializing_if = "Option::is_none")]
        tile: Option<u32>,
    },
    Buffer {
        description: String,
    },
}

#[derive(Serialize)]
struct SlotJson {
    #[serde(flatten)]
    desc: DescJson,
    bytes: u64,
}

/// `resource` is an index.
#[derive(Serialize)]
struct OutputJson<'p> {
    name: &'p str,
    resource: usize,
}

#[derive(Serialize)]
struct MemoryJson {
    bytes: u64,
    bytes_unshared: u64,
}

/// The plan with nothing folded: every step, resource and slot, which refer to each other by index.
pub fn to_json(plan: &Plan) -> Json {
    let (bytes, bytes_unshared) = plan.bytes();
    let ids = |ids: &[lightgraph::internals::plan::ResourceId]| ids.iter().map(|r| r.0).collect();
    let mut depends: Vec<Vec<String>> = vec![vec![]; plan.steps.len()];
    for unit in Keys::of(plan, None).units {
        unit.steps.iter().for_each(|s| depends[s.0] = unit.depends());
    }
    let steps = plan.steps.iter().zip(depends).enumerate().map(|(i, (s, depends))| {
        let (shader, workgroups, draws, value) = match &s.action {
            Action::Draw(d) => (Some(d.shader), None, Some(d.members.len()), None),
            Action::Compute { shader, groups, .. } => (Some(*shader), Some(*groups), None, None),
            Action::Copy { .. } => (None, None, None, None),
            Action::Clear { value, .. } => (None, None, None, Some(*value)),
        };
        StepJson {
            name: &s.name,
            pass: &s.pass,
            kind: StepWords::of(plan, lightgraph::internals::plan::StepId(i)).kind,
            shader,
            workgroups,
            draws,
            value,
            reads: ids(&s.reads),
            writes: ids(&s.writes),
            after: s.after.iter().map(|a| a.0).collect(),
            depends,
        }
    });
    let resources = plan.resources.iter().map(|r| ResourceJson {
        name: &r.name,
        desc: desc(&r.desc),
        bytes: r.desc.bytes(),
        slot: r.slot,
        lifetime: r.lifetime,
        history: r.history,
        initial: r.initial,
    });
    let shaders = plan.shaders.iter().map(|s| ShaderJson {
        path: &s.path,
        defines: s.defs.iter().map(|(n, d)| (n.clone(), definition(*d))).collect(),
        sources: &s.sources,
    });
    let tables = plan.tables.iter().map(|t| TableJson {
        table: &t.table,
        columns: t.row.members.iter().map(|m| m.name.as_str()).collect(),
        stride: t.stride,
    });
    let own = plan.values.iter().filter(|(n, _)| !plan.params.contains(n));
    let shown = PlanJson {
        graph: &plan.graph,
        parameters: plan
            .params
            .iter()
            .filter_map(|name| Some(NamedJson { name, value: value(&plan.value(name)?) }))
            .collect(),
        values: own.map(|(n, v)| (n.clone(), value(v))).collect(),
        shaders: shaders.collect(),
        tables: tables.collect(),
        steps: steps.collect(),
        order: nodes(&plan.order),
        skipped: plan.skipped.iter().map(|(pass, reason)| SkippedJson { pass, reason }).collect(),
        alternatives: plan.alternatives.iter().map(alternatives).collect(),
        resources: resources.collect(),
        slots: plan.slots.iter().map(|Slot { desc: d, bytes }| SlotJson { desc: desc(d), bytes: *bytes }).collect(),
        outputs: plan.outputs.iter().map(|(name, r)| OutputJson { name, resource: r.0 }).collect(),
        memory: MemoryJson { bytes, bytes_unshared },
    };
    json!(shown)
}

fn nodes(order: &[OrderNode]) -> Vec<NodeJson<'_>> {
    let node = |n| match n {
        &OrderNode::Step(s) => NodeJson::Step(s.0),
        OrderNode::Loop(l) => NodeJson::Loop {
            name: &l.name,
            count: l.count,
            until: l.until.as_ref().map(|u| UntilJson {
                buffer: u.buffer.0,
                comparison: comparison(u.comparison),
                value: u.value,
                by_host: match &u.ending {
                    Ending::Device => None,
                    Ending::Host { why } => Some(why),
                },
            }),
            body: nodes(&l.body),
        },
    };
    order.iter().map(node).collect()
}

fn desc(d: &Desc) -> DescJson {
    match d {
        Desc::Buffer { .. } => DescJson::Buffer { description: description(d) },
        Desc::Texture(t) => DescJson::Texture {
            description: description(d),
            format: format!("{:?}", t.format),
            width: t.width,
            height: t.height,
            layers: t.layers,
            mips: t.mips,
            tile: t.tiles.map(|t| t.edge),
        },
    }
}

fn definition(d: Def) -> Json {
    match d {
        Def::Bool(v) => json!(v),
        Def::Int(v) => json!(v),
        Def::Uint(v) => json!(v),
    }
}

fn value(v: &Value) -> Json {
    match v {
        Value::Bool(v) => json!(v),
        Value::Uint(v) => json!(v),
        Value::Int(v) => json!(v),
        Value::Float(v) => json!(v),
        Value::UVec2(v) => json!(v.to_array()),
        Value::UVec3(v) => json!(v.to_array()),
        Value::UVec4(v) => json!(v.to_array()),
        Value::Vec2(v) => json!(v.to_array()),
        Value::Vec3(v) => json!(v.to_array()),
        Value::Vec4(v) => json!(v.to_array()),
        Value::Mat4(v) => json!(v.to_cols_array()),
    }
}
