//! Builds a plan from a request: one call per stage, in order.

use super::expand::{Expanded, expand};
use super::live::{live, retain, starts_unwritten, unwritten};
use super::order::{OrderBlock, OrderEntry};
use super::partial::frames;
use super::request::{Request, values};
use super::sizes::Sizes;
use super::wire::{WiredItem, uses_of, wire};
use super::{Action, Desc, Frames, LevelUse, Plan, Step, StepId, clear_usage, draw, fastest, memory, order, partial};
use crate::diag::{Checked, Diagnostic, Faults, Severity};
use crate::graph::Graph;
use crate::graph::ast::{ResourceDecl, ResourceKind, set_of};
use crate::graph::expr::Val;
use crate::graph::unroll::unroll;
use crate::unused;
use crate::value::{Value, Values};
use rustc_hash::FxHashMap;
use std::collections::BTreeSet;

/// A plan and what the user should know about it.
#[derive(Debug, Clone)]
pub struct Planned {
    pub plan: Plan,
    pub notices: Vec<Diagnostic>,
    /// What the graph says that it can't do with these values.
    pub warnings: Vec<Diagnostic>,
    /// Milliseconds that composing the shaders took.
    pub compose_ms: f64,
}

/// How freely the plan may be made; both ways must give the same images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Memory is shared between resources that are never alive together.
    pub share: bool,
    /// 0: the order of the file. Otherwise the seed of some other legal order.
    pub order_seed: u64,
    /// Every resource can be read back, not outputs only, and bound by checks.
    pub readable: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options { share: true, order_seed: 0, readable: false }
    }
}

/// Plans a graph.
///
/// # Errors
/// Every fault of parameters, conditions, sizes, shaders, bindings and data flow, at once.
pub fn plan(request: &Request) -> Checked<Planned> {
    plan_with(request, Options::default())
}

/// The faults and warnings of a graph, whichever alternatives run; none of them twice.
pub fn faults(request: &Request) -> Vec<Diagnostic> {
    let mut all = vec![];
    for choices in fastest::each(request.graph, request.choices) {
        let found = match plan(&Request { choices: &choices, ..*request }) {
            Err(Faults(faults)) => faults,
            Ok(planned) => planned.notices.into_iter().filter(|d| d.severity == Severity::Warning).collect(),
        };
        let new: Vec<Diagnostic> = found.into_iter().filter(|d| !all.contains(d)).collect();
        all.extend(new);
    }
    all
}

/// As [`plan`], with another legal order or private memory.
///
/// # Errors
/// As [`plan`].
pub fn plan_with(request: &Request, options: Options) -> Checked<Planned> {
    let values = values(request)?;
    let declared = request.graph;
    let graph = &*unroll(declared, &|name| values.get(name).map(|v| Val::from(*v)))?;
    let declared_request = *request;
    let request = &Request { graph, ..*request };
    let sizes = Sizes::new(request, &values);
    let mut faults = vec![];
    let wiring = wire(request, &values, &sizes, &mut faults);
    let whole = faults.is_empty();
    let unused = unused::find(declared, request.texts);
    faults.extend(unused.iter().cloned());
    let outputs = outputs(graph, request.outputs, &mut faults);
    let warnings = warnings(graph, &values, &mut faults);
    faults.extend(fastest::unknown(graph, request.choices));
    // What a broken pass would have written seems unwritten: such faults would only repeat the first.
    Faults::check(if whole { vec![] } else { std::mem::take(&mut faults) }, ())?;
    faults.extend(unwritten(&wiring.items, &sizes, &wiring.off));
    for (name, resource) in &outputs {
        let written = uses_of(&wiring.items).any(|u| u.resource == *resource && u.mode.writes());
        if let Some(Ok(sized)) = sizes.of(resource)
            && !sized.desc.is_readable()
        {
            let d = Diagnostic::error(format!("the output `{name}` (`{resource}`) has several samples a texel"));
            let place = graph.outputs.iter().find(|o| o.0.value == *name);
            let d = place.map_or(d.clone(), |o| d.at(&o.1.span, ""));
            faults.push(d.help(format!("resolve it: `resolve: {{\"{resource}\": \"…\"}}`, and put that out")));
        }
        let given = |r: &ResourceDecl| r.initial.is_some() || matches!(r.kind, ResourceKind::Image(_));
        if !written && sizes.declared(resource).is_some_and(|r| !given(r)) {
            let d = Diagnostic::error(format!("nothing writes the output `{name}` (`{resource}`)"));
            let place = graph.outputs.iter().find(|o| o.0.value == *name);
            faults.push(place.map_or(d.clone(), |o| d.at(&o.1.span, "")));
        }
    }
    // What depends on broken parts would only repeat their faults.
    Faults::check(std::mem::take(&mut faults), ())?;

    let wanted: Vec<String> = outputs.iter().map(|o| o.1.clone()).collect();
    let needed = live(&wiring.items, &wanted);
    let mut skipped: Vec<(String, String)> =
        wiring.off.iter().map(|(p, why)| (p.name.value.clone(), why.clone())).collect();
    note_unneeded(&wiring.items, &needed, &mut skipped);
    let alternatives = fastest::needed(&wiring.groups, &needed);
    let items = retain(wiring.items, &needed);

    let levels = level_uses(request, &values);
    let asked = draw::asked_parts(&declared_request);
    let device = (request.limits, request.features, (levels.as_slice(), asked.as_slice()));
    let expanded = expand(&items, &sizes, &values, &wiring.shaders, device, &mut faults);
    let Expanded { mut resources, mut steps, mut block, mut ids } = expanded;
    let inputs = inputs(graph, &mut resources, &steps);
    let cleared = initial_clears(graph, &items, &wanted, &mut ids, &mut resources, &sizes, &mut steps);
    block = prepend(cleared, block);
    memory::find_numbers(graph, &mut resources, &steps, &wiring.shaders, &mut faults);
    let mut outs = vec![];
    for (name, resource) in &outputs {
        if let Some(id) = ids.get(resource) {
            outs.push((name.clone(), *id));
            readable(&mut resources[id.0].desc);
        }
    }
    Faults::check(faults, ())?;
    let mut seed = options.order_seed;
    let order = order::order(block, &mut steps, &mut |ready| if seed == 0 { 0 } else { next(&mut seed) % ready });
    let mut plan = Plan {
        graph: graph.source.path.clone(),
        params: graph.params.iter().map(|(n, _)| n.value.clone()).collect(),
        values: values.clone(),
        resources,
        slots: vec![],
        shaders: wiring.shaders,
        tables: wiring.tables,
        levels,
        steps,
        order,
        skipped,
        alternatives,
        inputs,
        outputs: outs,
    };
    if options.readable {
        for r in &mut plan.resources {
            open(&mut r.desc);
        }
    }
    until_usage(&mut plan);
    history_usage(&mut plan);
    memory::allocate(&mut plan, options.share);
    order::decide_ends(&mut plan, request.features);
    Faults::check(partial::lasting(&plan, graph), ())?;
    let notices = unused.into_iter().chain(notices(&plan)).collect();
    Ok(Planned { plan, notices, warnings, compose_ms: wiring.compose_ms })
}

/// What the plan knows of the levels: their clusters stand in the table behind those of the scene itself.
fn level_uses(request: &Request, values: &Values) -> Vec<LevelUse> {
    let mut first_cluster = match values.get("clusters") {
        Some(Value::Uint(n)) => *n,
        _ => 0,
    };
    let mut levels = vec![];
    for level in request.levels {
        let clusters = level.clusters.len() as u32;
        levels.push(LevelUse {
            tolerance: level.taken.tolerance,
            key: level.taken.key(),
            error: level.error,
            triangles: (level.indices.len() / 3) as u32,
            first_cluster,
            clusters,
            one_sided_clusters: level.one_sided_clusters() as u32,
        });
        first_cluster += clusters;
    }
    levels
}

fn readable(desc: &mut Desc) {
    match desc {
        Desc::Texture(t) if t.samples > 1 => {}
        Desc::Texture(t) => t.usage |= wgpu_types::TextureUsages::COPY_SRC,
        Desc::Buffer { usage, .. } => *usage |= wgpu_types::BufferUsages::COPY_SRC,
    }
}

/// Readable by the host and by shaders that no graph names.
fn open(desc: &mut Desc) {
    readable(desc);
    match desc {
        Desc::Texture(t) if t.samples > 1 => {}
        Desc::Texture(t) => t.usage |= wgpu_types::TextureUsages::TEXTURE_BINDING,
        Desc::Buffer { usage, .. } => *usage |= wgpu_types::BufferUsages::STORAGE,
    }
}

/// A linear congruential step; good enough to pick orders.
fn next(seed: &mut u64) -> usize {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 33) as usize
}

/// The graph's own warnings that hold.
fn warnings(graph: &Graph, values: &Values, faults: &mut Vec<Diagnostic>) -> Vec<Diagnostic> {
    let mut found = vec![];
    for (name, warning) in &graph.warnings {
        match frames(&warning.when, &|n| values.get(n).map(|v| Val::from(*v))).map(|holds| holds.is_some()) {
            Ok(true) => found.push(Diagnostic::warning(&warning.about).at(&name.span, "")),
            Ok(false) => {}
            Err(fault) => faults.push(fault),
        }
    }
    found
}

fn outputs(graph: &Graph, wanted: Option<&[String]>, faults: &mut Vec<Diagnostic>) -> Vec<(String, String)> {
    let all = graph.outputs.iter().map(|(n, r)| (n.value.clone(), r.value.clone()));
    let Some(wanted) = wanted else { return all.collect() };
    for name in wanted {
        if !graph.outputs.iter().any(|o| o.0.value == *name) {
            let d = Diagnostic::error(format!("the graph has no output `{name}`"));
            let names: Vec<&str> = graph.outputs.iter().map(|o| o.0.value.as_str()).collect();
            faults.push(d.nearest(name, names.iter().copied()).help(format!("outputs: {}", names.join(", "))));
        }
    }
    all.filter(|(n, _)| wanted.contains(n)).collect()
}

fn note_unneeded(items: &[WiredItem], needed: &BTreeSet<&str>, skipped: &mut Vec<(String, String)>) {
    for item in items {
        let (pass, body) = match item {
            WiredItem::Pass(w) => (w.pass, None),
            WiredItem::Loop { pass, body, .. } => (*pass, Some(body)),
        };
        if !needed.contains(pass.name.value.as_str()) {
            skipped.push((pass.name.value.clone(), "no requested output needs it".into()));
        } else if let Some(body) = body {
            note_unneeded(body, needed, skipped);
        }
    }
}

/// What the graph takes from outside and leaves as it is: whoever runs it may lend memory for that, which it keeps.
fn inputs(graph: &Graph, resources: &mut [super::Resource], steps: &[Step]) -> Vec<super::ResourceId> {
    let mut inputs = vec![];
    for (id, r) in resources.iter_mut().enumerate().map(|(i, r)| (super::ResourceId(i), r)) {
        let declared = graph.inputs.iter().any(|(name, _)| name.value == set_of(&r.name));
        if declared && !steps.iter().any(|s| s.writes.contains(&id)) {
            r.history = true;
            inputs.push(id);
        }
    }
    inputs
}

/// Steps that give resources their initial content each frame, where the frame begins with it.
/// Those with history get it once, on allocation.
fn initial_clears(
    graph: &Graph,
    items: &[WiredItem],
    wanted: &[String],
    ids: &mut FxHashMap<String, super::ResourceId>,
    resources: &mut Vec<super::Resource>,
    sizes: &Sizes,
    steps: &mut Vec<Step>,
) -> Vec<StepId> {
    let mut cleared = vec![];
    for (name, declared) in &graph.resources {
        if matches!(declared.kind, ResourceKind::Image(_))
            && wanted.contains(&name.value)
            && !ids.contains_key(&name.value)
            && let Some(Ok(sized)) = sizes.of(&name.value)
        {
            // An output that no pass reads either.
            ids.insert(name.value.clone(), super::ResourceId(resources.len()));
            resources.push(super::Resource::declared(name.value.clone(), sized.desc, declared));
        }
        let Some(value) = declared.initial else { continue };
        let has_history = || ids.get(&name.value).is_some_and(|id| resources[id.0].history);
        if declared.history || has_history() {
            continue;
        }
        let starts = starts_unwritten(items, &name.value);
        if starts.is_none() && wanted.contains(&name.value) && !ids.contains_key(&name.value) {
            // An output that nothing writes is its initial content.
            let Some(Ok(sized)) = sizes.of(&name.value) else { continue };
            ids.insert(name.value.clone(), super::ResourceId(resources.len()));
            resources.push(super::Resource::declared(name.value.clone(), sized.desc, declared));
        } else if starts != Some(true) {
            continue;
        }
        let Some(first) = ids.get(&name.value).copied() else { continue };
        let members = match sizes.of(&name.value) {
            Some(Ok(s)) => s.members.unwrap_or(1),
            _ => 1,
        };
        for m in 0..members as usize {
            let id = super::ResourceId(first.0 + m);
            match &mut resources[id.0].desc {
                Desc::Texture(t) => t.usage |= clear_usage(t),
                Desc::Buffer { usage, .. } => *usage |= wgpu_types::BufferUsages::COPY_DST,
            }
            cleared.push(StepId(steps.len()));
            steps.push(Step {
                name: format!("{} = initial", resources[id.0].name),
                pass: name.value.clone(),
                group: None,
                frames: Frames::All,
                action: Action::Clear { target: id, value },
                bindings: vec![],
                reads: vec![],
                writes: vec![id],
                only: None,
                after: vec![],
            });
        }
    }
    cleared
}

/// The clears first, then the block.
fn prepend(cleared: Vec<StepId>, block: OrderBlock) -> OrderBlock {
    let mut all = OrderBlock::default();
    for step in cleared {
        all.push(OrderEntry::Step(step), (0, 0, 0));
    }
    all.append(block);
    all
}

/// The host or a kernel reads a loop's test.
fn until_usage(plan: &mut Plan) {
    fn buffers(nodes: &[super::OrderNode], out: &mut Vec<usize>) {
        for n in nodes {
            if let super::OrderNode::Loop(l) = n {
                out.extend(l.until.iter().map(|u| u.buffer.0));
                buffers(&l.body, out);
            }
        }
    }
    let mut ids = vec![];
    buffers(&plan.order, &mut ids);
    for id in ids {
        if let Desc::Buffer { usage, .. } = &mut plan.resources[id].desc {
            *usage |= wgpu_types::BufferUsages::COPY_SRC | wgpu_types::BufferUsages::STORAGE;
        }
    }
}

/// History is cleared on allocation.
fn history_usage(plan: &mut Plan) {
    for r in plan.resources.iter_mut().filter(|r| r.history) {
        match &mut r.desc {
            Desc::Texture(t) => t.usage |= clear_usage(t),
            Desc::Buffer { usage, .. } => *usage |= wgpu_types::BufferUsages::COPY_DST,
        }
    }
}

/// What is worth saying about a plan that works.
fn notices(plan: &Plan) -> Vec<Diagnostic> {
    let large = |d: &Desc| d.bytes() > 1 << 30;
    let big = plan.resources.iter().filter(|r| large(&r.desc));
    big.map(|r| Diagnostic::note(format!("`{}` takes {} MiB", r.name, r.desc.bytes() >> 20))).collect()
}
