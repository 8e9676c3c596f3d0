//! Names: every one resolves, none stands twice, none collides with what scenes and frames provide. `names` knows what
//! each may stand for.

mod names;

use super::ast::{Dirty, Graph, Name, Pass, PassKind, Raster, ResourceKind, Size, groups, told_groups, walk};
use super::expr::{Binary, Expr, ExprKind};
use super::is_inside;
use crate::diag::{Diagnostic, Span};
use crate::scene::{FACTS, FRAME_VALUES, TABLES};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

/// Values that are neither parameters nor facts: the image's size, a member's index, a workgroup's size, the instances
/// of a dispatch, the scene's textures.
pub const BUILT_IN: [&str; 5] = ["screen", "member", WORKGROUP, "instances", "scene_textures"];

/// The size of a shader's workgroup, where a pass says how much it does.
pub const WORKGROUP: &str = "workgroup_size";

/// The value of frames that conditions of passes know.
pub const FIRST_FRAME: &str = "first_frame";

/// The names that no graph may declare.
static PROVIDED: LazyLock<FxHashSet<&str>> = LazyLock::new(|| {
    let values = FACTS.iter().chain(FRAME_VALUES).map(|f| f.0);
    values.chain(TABLES.iter().map(|t| t.name)).chain(BUILT_IN).collect()
});

/// The columns of the table of materials, which conditions of materials know.
pub fn material_columns() -> impl Iterator<Item = &'static str> {
    TABLES.iter().filter(|t| t.name == "materials").flat_map(|t| t.columns).map(|column| column.0)
}

/// Whether the scene or the frame provides a name.
pub fn is_provided(name: &str) -> bool {
    PROVIDED.contains(name)
}

/// The faults of names in a graph.
pub fn check(graph: &Graph) -> Vec<Diagnostic> {
    let mut c = Checker::new(graph);
    c.unique();
    c.lets();
    for (_, e) in &graph.defines {
        c.names(e, ExprScope::Values);
    }
    for (name, r) in &graph.resources {
        c.resource(&name.value, r);
    }
    c.passes(&graph.passes, &mut vec![]);
    for (_, resource) in &graph.outputs {
        c.resource_name(resource, "an output");
    }
    for (_, warning) in &graph.warnings {
        // That of a sub-graph has the condition of its use.
        c.indices.push(FIRST_FRAME);
        c.names(&warning.when, ExprScope::Values);
        c.indices.pop();
    }
    if graph.outputs.is_empty() {
        c.faults.push(
            Diagnostic::error("the graph has no outputs, so nothing of it would run")
                .at(&Span::new(&graph.source, 0..0), "")
                .help("add `outputs: {\"color\": \"color\"}`"),
        );
    }
    c.faults
}

#[derive(Clone, Copy, PartialEq)]
enum ExprScope<'a> {
    /// Parameters, lets, facts, which alternative of a group runs, `screen`.
    Values,
    /// Also the names of resources: their extents.
    Sizes,
    /// Also the index of the innermost of the loops around.
    Loops(&'a [String]),
}

struct Checker<'g> {
    graph: &'g Graph,
    values: BTreeSet<&'g str>,
    resources: BTreeMap<&'g str, &'g ResourceKind>,
    /// Resources that are sets.
    sets: BTreeSet<&'g str>,
    /// Of the repetitions around.
    indices: Vec<&'g str>,
    faults: Vec<Diagnostic>,
}

impl<'g> Checker<'g> {
    fn new(graph: &'g Graph) -> Checker<'g> {
        let mut values: BTreeSet<&str> = FACTS.iter().map(|f| f.0).chain(["screen"]).collect();
        values.extend(graph.params.iter().map(|(n, _)| n.value.as_str()));
        values.extend(graph.lets.iter().map(|(n, _)| n.value.as_str()));
        values.extend(told_groups(&graph.passes).iter().map(|n| n.value.as_str()));
        let resources = graph.resources.iter().map(|(n, r)| (n.value.as_str(), &r.kind)).collect();
        let sets = graph.resources.iter().filter(|(_, r)| r.members.is_some()).map(|(n, _)| n.value.as_str()).collect();
        Checker { graph, values, resources, sets, indices: vec![], faults: vec![] }
    }

    /// Names share one space, so that a shader's variable can mean one thing only.
    fn unique(&mut self) {
        let g = self.graph;
        let mut seen: FxHashMap<&str, (&Span, &str)> = FxHashMap::default();
        let params = g.params.iter().map(|(n, _)| (n, "parameter"));
        let lets = g.lets.iter().map(|(n, _)| (n, "let"));
        let resources = g.resources.iter().map(|(n, _)| (n, "resource"));
        let groups = told_groups(&g.passes).into_iter().map(|n| (n, "group of alternatives"));
        let mut repetitions = vec![];
        walk(&g.passes, &mut |p| {
            if matches!(p.kind, PassKind::For { .. }) {
                repetitions.push((&p.name, "repetition"));
            }
        });
        for (name, noun) in params.chain(lets).chain(resources).chain(groups).chain(repetitions) {
            if PROVIDED.contains(name.value.as_str()) {
                let d = Diagnostic::error(format!("`{}` is a name that the scene or the frame provides", name.value));
                self.faults.push(d.at(&name.span, "choose another name"));
            } else if let Some((span, other)) = seen.insert(&name.value, (&name.span, noun)) {
                let d = Diagnostic::error(format!("`{}` stands twice", name.value));
                self.faults.push(d.at(&name.span, format!("this {noun}")).at(span, format!("and this {other}")));
            }
        }
        self.twice(g.defines.iter().map(|(n, _)| n), "definition");
        self.twice(g.outputs.iter().map(|(n, _)| n), "output");
        self.twice(g.warnings.iter().map(|(n, _)| n), "warning");
        let mut passes = vec![];
        walk(&g.passes, &mut |p| passes.extend((!p.kind.is_tuned(&p.name)).then_some(&p.name)));
        self.twice(passes.into_iter(), "pass");
    }

    fn twice(&mut self, names: impl Iterator<Item = &'g Name>, noun: &str) {
        let mut seen: FxHashMap<&str, &Span> = FxHashMap::default();
        for n in names {
            if let Some(there) = seen.insert(&n.value, &n.span) {
                let d = Diagnostic::error(format!("two of the name `{}` ({noun})", n.value));
                self.faults.push(d.at(&n.span, "").at(there, "the other"));
            }
        }
    }

    fn lets(&mut self) {
        let graph = self.graph;
        let by_name: BTreeMap<&str, &Expr> = graph.lets.iter().map(|(n, e)| (n.value.as_str(), e)).collect();
        let mut cycles: Vec<BTreeSet<&str>> = vec![];
        for (name, e) in &graph.lets {
            self.names(e, ExprScope::Values);
            let mut reached: BTreeSet<&str> = BTreeSet::new();
            let mut open: Vec<&Expr> = vec![e];
            while let Some(e) = open.pop() {
                e.names(&mut |n, _| {
                    if let Some(next) = by_name.get(n)
                        && reached.insert(n)
                    {
                        open.push(next);
                    }
                });
            }
            // Every let of a cycle reaches the same ones: one fault a cycle.
            if reached.contains(name.value.as_str()) && !cycles.contains(&reached) {
                let d = Diagnostic::error(format!("`{}` is defined by itself", name.value));
                self.faults.push(d.at(&name.span, "a cycle of lets"));
                cycles.push(reached);
            }
        }
    }

    fn names(&mut self, e: &Expr, scope: ExprScope) {
        let mut unknown = vec![];
        e.names(&mut |name, span| {
            let known = self.values.contains(name)
                || self.indices.contains(&name)
                || match scope {
                    ExprScope::Values => false,
                    ExprScope::Sizes => self.resources.contains_key(name),
                    ExprScope::Loops(loops) => loops.last().is_some_and(|l| l == name),
                };
            if !known {
                unknown.push((name.to_string(), span.clone()));
            }
        });
        for (name, span) in unknown {
            let d = Diagnostic::error(format!("unknown name `{name}`")).at(&span, "");
            let mut near: Vec<&str> = self.values.iter().chain(&self.indices).copied().collect();
            if scope == ExprScope::Sizes {
                near.extend(self.resources.keys());
            }
            let hint = self.resources.contains_key(name.as_str()) && scope != ExprScope::Sizes;
            let outer = matches!(scope, ExprScope::Loops(loops) if loops.contains(&name));
            let d = if outer { d.help("only the innermost loop's index can be used here") } else { d };
            let vector = name.split_once('.').is_some_and(|(head, _)| self.values.contains(head));
            let d = if vector { d.help("components are `x`, `y`, `z` and `w`") } else { d };
            let d = match name.as_str() {
                WORKGROUP => d.help("only `over` of a `Compute` may ask for it"),
                FIRST_FRAME => d.help("`when` of a pass may ask for it, and shaders read it"),
                name if FRAME_VALUES.iter().any(|(known, _)| *known == name) => {
                    d.help("it varies from frame to frame, and is for shaders")
                }
                _ => d,
            };
            let d = if hint { d.help("a resource's name stands for its extent in sizes only") } else { d };
            self.faults.push(d.nearest(&name, near));
        }
    }

    fn resource(&mut self, name: &str, r: &super::ast::ResourceDecl) {
        let (sizes, counts) = r.exprs();
        // The size of a member may go by its number.
        self.indices.extend(r.members.as_ref().map(|_| "member"));
        for e in sizes {
            self.names(e, ExprScope::Sizes);
            let mut itself = false;
            e.names(&mut |n, _| itself |= n == name);
            if itself {
                self.faults.push(Diagnostic::error(format!("`{name}` takes its size from itself")).at(&e.span, ""));
            }
        }
        self.indices.clear();
        for e in counts {
            self.names(e, ExprScope::Values);
        }
    }

    fn passes(&mut self, passes: &'g [Pass], loops: &mut Vec<String>) {
        for p in passes {
            self.indices.push(FIRST_FRAME);
            p.when.iter().for_each(|e| self.names(e, ExprScope::Values));
            self.indices.pop();
            for e in p.each.iter().chain(p.defines.iter().chain(&p.mips).chain(&p.set).map(|d| &d.1)) {
                self.names(e, ExprScope::Values);
            }
            for (_, to) in &p.bind {
                let known = PROVIDED.contains(to.value.as_str())
                    || self.values.contains(to.value.as_str())
                    || self.indices.contains(&to.value.as_str());
                if !known && !loops.contains(&to.value) {
                    self.resource_name(to, "a binding");
                }
            }
            if let Some(dirty) = &p.only {
                self.dirty(p, dirty, loops);
            }
            if let Some(shader) = p.kind.shader()
                && !is_inside(&shader.value)
            {
                let d = Diagnostic::error(format!("the shader `{}` lies outside the shader folder", shader.value));
                self.faults.push(d.at(&shader.span, "").help("give a path inside it, without `..`"));
            }
            self.kind(p, loops);
        }
    }

    fn kind(&mut self, p: &'g Pass, loops: &mut Vec<String>) {
        match &p.kind {
            PassKind::Draw(r) | PassKind::Screen(r) => self.raster(r, loops),
            PassKind::Compute { over, indirect, .. } => {
                self.indices.push(WORKGROUP);
                over.iter().flat_map(Size::exprs).for_each(|e| self.names(e, ExprScope::Sizes));
                self.indices.pop();
                indirect.iter().for_each(|n| self.buffer_name(n, "a list of counts"));
            }
            PassKind::Reduce { from, to, factor, until, .. } => {
                factor.iter().chain([until]).for_each(|e| self.names(e, ExprScope::Values));
                self.texture_name(from, "reduced");
                self.texture_name(to, "reduced");
            }
            PassKind::Scan { from, to, .. } => {
                self.buffer_name(from, "summed up");
                self.buffer_name(to, "summed up");
                if from.value == to.value {
                    let d = Diagnostic::error("sums in place of what they are of").at(&to.span, "");
                    self.faults.push(d.help("sum up to another buffer"));
                }
            }
            PassKind::Copy { from, to } => {
                self.resource_name(from, "copied");
                self.resource_name(to, "copied");
                if from.value == to.value {
                    self.faults.push(Diagnostic::error("a copy onto itself").at(&to.span, ""));
                }
            }
            PassKind::Clear { target, .. } => self.resource_name(target, "cleared"),
            PassKind::Mips { of } => self.levels_of(of),
            PassKind::Loop { count, until, passes } => {
                self.names(count, ExprScope::Values);
                if let Some(until) = until {
                    self.until(until);
                }
                if passes.is_empty() {
                    self.faults.push(Diagnostic::error("a loop without passes").at(&p.name.span, ""));
                }
                loops.push(p.name.value.clone());
                self.passes(passes, loops);
                loops.pop();
            }
            PassKind::For { count, passes } => {
                self.names(count, ExprScope::Values);
                if passes.is_empty() {
                    self.faults.push(Diagnostic::error("a repetition without passes").at(&p.name.span, ""));
                }
                if let Some((group, _)) = groups(passes).first() {
                    let d = Diagnostic::error(format!("alternatives can't be repeated: `{}`", group.value));
                    let d = d.at(&group.span, "").at(&p.name.span, "in this repetition");
                    self.faults.push(d.help("repeat in each of the alternatives"));
                }
                self.indices.push(&p.name.value);
                self.passes(passes, loops);
                self.indices.pop();
            }
            PassKind::Fastest { of, .. } => {
                self.alternatives(p, of);
                of.iter().for_each(|passes| self.passes(passes, loops));
            }
        }
    }

    fn alternatives(&mut self, group: &'g Pass, of: &'g [Vec<Pass>]) {
        if of.len() < 2 {
            let d = Diagnostic::error(format!("`{}` has nothing to choose from", group.name.value));
            self.faults.push(d.at(&group.name.span, "").help("give it two alternatives or more: `of: [[…], […]]`"));
        }
        if of.iter().any(Vec::is_empty) {
            let d = Diagnostic::error(format!("an alternative of `{}` has no passes", group.name.value));
            self.faults.push(d.at(&group.name.span, ""));
        }
        let mut inner = vec![];
        for passes in of {
            walk(passes, &mut |p| inner.extend(matches!(p.kind, PassKind::Fastest { .. }).then_some(&p.name)));
        }
        for name in inner {
            let d = Diagnostic::error(format!("`{}` stands in an alternative of another group", name.value));
            let d = d.at(&name.span, "").at(&group.name.span, "this one");
            self.faults.push(d.help("list its alternatives in the outer group, or put it beside that"));
        }
    }

    fn until(&mut self, until: &Expr) {
        let ExprKind::Binary(op, left, right) = &until.kind else {
            return self.until_shape(until);
        };
        if *op == Binary::And {
            self.names(left, ExprScope::Values);
            return self.until(right);
        }
        let comparison = matches!(op, Binary::Less | Binary::LessEqual | Binary::Greater | Binary::GreaterEqual);
        match &left.kind {
            ExprKind::Name(n) if comparison => match self.resources.get(n.as_str()) {
                Some(ResourceKind::Buffer { .. }) => self.names(right, ExprScope::Values),
                _ => {
                    let buffers = self.resources.iter().filter(|r| matches!(r.1, ResourceKind::Buffer { .. }));
                    let near: Vec<&str> = buffers.map(|r| *r.0).collect();
                    let d = Diagnostic::error(format!("`{n}` is not a buffer")).at(&left.span, "");
                    self.faults.push(d.nearest(n, near));
                }
            },
            _ => self.until_shape(until),
        }
    }

    fn until_shape(&mut self, until: &Expr) {
        let d = Diagnostic::error("`until` compares a buffer's first f32 with a value").at(&until.span, "");
        self.faults.push(d.help("write it as `change < epsilon`"));
    }

    fn raster(&mut self, r: &'g Raster, loops: &[String]) {
        if let Some(depth) = &r.depth
            && let Some(format) = self.texture_name(depth, "a depth target")
            && !format.has_depth_aspect()
        {
            let d = Diagnostic::error(format!("`{}` has no depth format", depth.value));
            self.faults.push(d.at(&depth.span, format!("{format:?}")).help("use Depth32Float"));
        }
        if let Some(color) = &r.color
            && let Some(format) = self.texture_name(color, "a colour target")
            && format.has_depth_aspect()
        {
            let d = Diagnostic::error(format!("`{}` has a depth format", color.value));
            self.faults.push(d.at(&color.span, format!("{format:?}")).help("give it as `depth`"));
        }
        for name in r.load.iter().chain(r.clear.iter().map(|c| &c.0)).chain(r.blend.iter().map(|b| &b.0)) {
            self.texture_name(name, "a target");
        }
        for name in r.resolve.iter().flat_map(|(from, to)| [from, to]) {
            self.texture_name(name, "a target");
        }
        for (name, _) in &r.blend {
            if !r.load.iter().chain(r.clear.iter().map(|c| &c.0)).any(|n| n.value == name.value) {
                let d = Diagnostic::error(format!("nothing says what is blended with in `{}`", name.value));
                let load = format!("keep what is there: `load: [\"{}\"]`", name.value);
                let clear = format!("or begin with a value: `clear: {{\"{}\": 0}}`", name.value);
                self.faults.push(d.at(&name.span, "").help(load).help(clear));
            }
        }
        for name in &r.load {
            if r.clear.iter().any(|c| c.0.value == name.value) {
                let d = Diagnostic::error(format!("`{}` is both kept and cleared", name.value));
                self.faults.push(d.at(&name.span, ""));
            }
        }
        if let Some(layer) = &r.layer {
            self.names(layer, ExprScope::Loops(loops));
        }
        if let Some(tolerance) = &r.tolerance {
            self.names(tolerance, ExprScope::Values);
        }
        if let Some(materials) = &r.materials {
            let before = self.indices.len();
            material_columns().for_each(|column| self.indices.push(column));
            self.names(materials, ExprScope::Values);
            self.indices.truncate(before);
        }
        for expr in r.vertices.iter().flat_map(|v| v.exprs()) {
            self.names(expr, ExprScope::Values);
        }
        for name in r.vertices.iter().flat_map(|v| &v.indirect) {
            self.buffer_name(name, "a list of counts");
        }
        if let Some(frusta) = &r.frusta {
            self.frusta(frusta);
        }
        if let Some(views) = &r.views {
            self.names(views, ExprScope::Values);
            if let Some(layer) = &r.layer {
                let d = Diagnostic::error("a pass with `views` draws each member to as many layers in turn");
                self.faults.push(d.at(&layer.span, "`layer` says another place").at(&views.span, ""));
            }
        }
    }

    fn dirty(&mut self, p: &'g Pass, dirty: &'g Dirty, loops: &[String]) {
        self.buffer_name(&dirty.bits, "dirty bits");
        for name in dirty.of.iter().filter(|name| !TABLES.iter().any(|t| t.name == name.value)) {
            if self.resources.contains_key(name.value.as_str()) {
                self.resource_name(name, "an input that changes in part");
                continue;
            }
            let d = Diagnostic::error(format!("unknown resource or table `{}`", name.value)).at(&name.span, "");
            let tables = TABLES.iter().map(|t| t.name);
            self.faults.push(d.nearest(&name.value, self.resources.keys().copied().chain(tables)));
        }
        if p.each.is_none() {
            let d =
                Diagnostic::error(format!("`only` chooses among the instances of `{}`, which has one", p.name.value));
            self.faults.push(d.at(&dirty.bits.span, "").help("give it `each`, or leave `only` out"));
        }
        if let Some(around) = loops.last() {
            let d = Diagnostic::error(format!("`only` in the loop `{around}`, whose iterations overwrite each other"));
            self.faults.push(d.at(&dirty.bits.span, "").help("move the pass out of the loop, or leave `only` out"));
        }
        if let PassKind::Draw(Raster { frusta: None, .. }) = &p.kind {
            let d = Diagnostic::error(format!("nothing says what the instances of `{}` draw", p.name.value));
            self.faults.push(d.at(&dirty.bits.span, "").help("give the pass `frusta`, or leave `only` out"));
        }
    }
}
