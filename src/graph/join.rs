//! Sub-graphs: a `Use` becomes the passes of the graph that it names. Their names get the use's before them, inputs and
//! outputs become resources of the graph around.

use super::ast::{
    Graph, Input, Name, NameScope, Param, Pass, ResourceDecl, ResourceKind, Warning, rescope, set_of, walk, walk_mut,
};
use super::check::is_provided;
use super::expr::{Binary, Expr, ExprKind};
use super::read::Reader;
use super::rename;
use super::tree::SyntaxNode;
use crate::diag::Diagnostic;
use crate::image::texture::Shape;
use std::collections::BTreeMap;
use std::mem::discriminant;
use std::sync::Arc;

/// The field of a `Use` that holds the tree of its graph. No file can write it.
pub const TREE: &str = "its graph";

/// The declarations of a sub-graph under their names in the graph around.
pub struct Joined {
    name: String,
    params: Vec<(Name, Param)>,
    lets: Vec<(Name, Expr)>,
    resources: Vec<(Name, ResourceDecl)>,
    warnings: Vec<(Name, Warning)>,
    /// By input: what the graph around gives, and what is wanted.
    given: Vec<(String, Name, Input)>,
    /// Outputs by the names that the graph around may use.
    outputs: BTreeMap<String, String>,
}

impl Reader {
    /// The passes of a sub-graph; its declarations wait for [`Joined::declare`].
    pub(super) fn sub_graph(&mut self, node: &SyntaxNode) -> Vec<Pass> {
        let Some((_, mut f)) = self.named(node, &["Use"]) else { return vec![] };
        let name = self.need(&mut f, "name").and_then(|n| self.own_name(n));
        let file = self.need(&mut f, "graph").and_then(|n| self.text(n));
        let when = f.get("when").and_then(|n| self.expr(n));
        let group = f.get("group").and_then(|n| self.text(n));
        let given = self.names(f.get("in"));
        let taken = self.names(f.get("out"));
        let set = self.exprs(f.get("set"));
        let tree = f.field(TREE).map(|field| &field.value);
        self.finish(&f);
        let (Some(name), Some(file), Some(tree)) = (name, file, tree) else { return vec![] };
        let Some((_, mut fields)) = self.named(tree, &["Graph"]) else { return vec![] };
        let sub = self.graph(&mut fields, &tree.span);
        let used = Used { name, file, when, group, given, taken, set };
        let (joined, passes) = used.join(self, sub);
        self.joined.push(joined);
        passes
    }
}

/// What a `Use` says.
struct Used {
    name: Name,
    file: Name,
    when: Option<Expr>,
    group: Option<Name>,
    given: Vec<(Name, Name)>,
    taken: Vec<(Name, Name)>,
    set: Vec<(Name, Expr)>,
}

impl Used {
    fn join(self, reader: &mut Reader, mut sub: Graph) -> (Joined, Vec<Pass>) {
        let given = self.given(reader, &sub);
        let taken = self.taken(reader, &sub);
        let tied = self.set(reader, &mut sub);
        let prefix = format!("{}.", self.name.value);
        let mut names: BTreeMap<String, String> = BTreeMap::new();
        let mut own = |name: &str| drop(names.insert(name.to_string(), format!("{prefix}{name}")));
        sub.params.iter().map(|(n, _)| n).chain(sub.lets.iter().map(|(n, _)| n)).for_each(|n| own(&n.value));
        sub.resources.iter().map(|(n, _)| n).chain(tied.iter().map(|(n, _)| n)).for_each(|n| own(&n.value));
        walk(&sub.passes, &mut |p| {
            if !p.kind.bodies().is_empty() && !p.kind.is_tuned(&p.name) {
                own(&p.name.value);
            }
        });
        names.extend(given.iter().map(|(input, name, _)| (input.clone(), name.value.clone())));
        names.extend(taken.iter().map(|(resource, name)| (resource.clone(), name.value.clone())));
        let scope = NameScope { prefix: prefix.clone(), names, around: BTreeMap::new() };
        let to = |name: &str| scope.resolve(name);

        sub.lets.iter_mut().for_each(|(_, e)| e.rename(&to));
        sub.resources.iter_mut().for_each(|(_, r)| rename::resource(r, &to));
        sub.defines.iter_mut().for_each(|(_, e)| e.rename(&to));
        sub.warnings.iter_mut().for_each(|(_, w)| w.when.rename(&to));
        let whole = Arc::new(scope.clone());
        let group = self.group.unwrap_or_else(|| self.name.clone());
        let names_of = |names: &BTreeMap<String, String>| {
            names.iter().map(|(own, name)| (own.clone(), rename::renamed(name, &to))).collect()
        };
        rescope(&mut sub.passes, |inner| NameScope {
            prefix: format!("{prefix}{}", inner.prefix),
            names: names_of(&inner.names),
            around: names_of(&inner.around),
        });
        walk_mut(&mut sub.passes, &mut |p| {
            rename::pass(p, &to);
            p.name.value = format!("{prefix}{}", p.name.value);
            p.group.get_or_insert_with(|| group.clone());
            p.scope.get_or_insert_with(|| whole.clone());
            p.defines.splice(0..0, sub.defines.iter().cloned());
        });
        if let Some(when) = &self.when {
            let both = |inner: Expr| Expr {
                span: inner.span.clone(),
                kind: ExprKind::Binary(Binary::And, Box::new(when.clone()), Box::new(inner)),
            };
            for pass in &mut sub.passes {
                pass.when = Some(pass.when.take().map_or_else(|| when.clone(), both));
            }
            for (_, warning) in &mut sub.warnings {
                warning.when = both(warning.when.clone());
            }
        }
        let outputs =
            sub.outputs.iter().map(|(n, r)| (format!("{prefix}{}", n.value), rename::renamed(&r.value, &to))).collect();
        let prefixed = |name: Name| Name { value: to(&name.value), span: name.span };
        let mut lets: Vec<(Name, Expr)> = sub.lets.into_iter().map(|(n, e)| (prefixed(n), e)).collect();
        lets.extend(tied.into_iter().map(|(n, e)| (prefixed(n), e)));
        let within = |name: Name| Name { value: format!("{prefix}{}", name.value), span: name.span };
        let warnings = sub.warnings.into_iter().map(|(n, w)| (within(n), w)).collect();
        let joined = Joined {
            params: sub.params.into_iter().map(|(n, p)| (prefixed(n), p)).collect(),
            lets,
            resources: sub.resources.into_iter().map(|(n, r)| (prefixed(n), r)).collect(),
            warnings,
            given,
            outputs,
            name: self.name.value,
        };
        (joined, sub.passes)
    }

    /// By input: what the graph around gives. Without a word, what it has of the same name.
    fn given(&self, reader: &mut Reader, sub: &Graph) -> Vec<(String, Name, Input)> {
        for (input, _) in self.given.iter().filter(|(n, _)| !sub.inputs.iter().any(|i| i.0.value == n.value)) {
            let d = Diagnostic::error(format!("`{}` has no input `{}`", self.file.value, input.value));
            let names = sub.inputs.iter().map(|i| i.0.value.as_str());
            reader.fault(d.at(&input.span, "").nearest(&input.value, names));
        }
        let given = sub.inputs.iter().map(|(input, declared)| {
            let said = self.given.iter().find(|(n, _)| n.value == input.value);
            let name = match said {
                Some((_, name)) => name.clone(),
                None => Name { value: input.value.clone(), span: self.name.span.clone() },
            };
            (input.value.clone(), name, declared.clone())
        });
        given.collect()
    }

    /// By resource of the sub-graph: the name under which the graph around takes it.
    fn taken(&self, reader: &mut Reader, sub: &Graph) -> Vec<(String, Name)> {
        let mut taken: Vec<(String, Name)> = vec![];
        for (output, name) in &self.taken {
            let Some((_, resource)) = sub.outputs.iter().find(|(n, _)| n.value == output.value) else {
                let d = Diagnostic::error(format!("`{}` has no output `{}`", self.file.value, output.value));
                let names = sub.outputs.iter().map(|o| o.0.value.as_str());
                reader.fault(d.at(&output.span, "").nearest(&output.value, names));
                continue;
            };
            let twice = taken.iter().any(|(r, _)| *r == resource.value);
            if twice || !sub.resources.iter().any(|(n, _)| n.value == resource.value) {
                let d = Diagnostic::error(format!("`{}` can't have another name here", output.value));
                let why = if twice { "it has one already" } else { "it is an input, or a sub-graph's" };
                let by = format!("name it `{}.{}` where it is needed", self.name.value, output.value);
                reader.fault(d.at(&output.span, why).help(by));
                continue;
            }
            taken.push((resource.value.clone(), name.clone()));
        }
        taken
    }

    /// Gives parameters their values: new defaults, or, by expressions that name something, ties to the graph around.
    /// Those are no parameters any more.
    fn set(&self, reader: &mut Reader, sub: &mut Graph) -> Vec<(Name, Expr)> {
        let mut tied = vec![];
        for (name, e) in &self.set {
            let Some(at) = sub.params.iter().position(|(n, _)| n.value == name.value) else {
                let d = Diagnostic::error(format!("`{}` has no parameter `{}`", self.file.value, name.value));
                let names: Vec<&str> = sub.params.iter().map(|p| p.0.value.as_str()).collect();
                reader.fault(d.at(&name.span, "").nearest(&name.value, names));
                continue;
            };
            let mut constant = true;
            e.names(&mut |_, _| constant = false);
            if !constant {
                tied.push((name.clone(), e.clone()));
                sub.params.remove(at);
                continue;
            }
            let param = &mut sub.params[at].1;
            match e.eval(&|_| None).map(|v| v.to_value().and_then(|v| v.cast(param.ty))) {
                Err(d) => reader.fault(d),
                Ok(None) => {
                    let d = Diagnostic::error(format!("expected a value of type {}", param.ty.wgsl()));
                    reader.fault(d.at(&e.span, "").at(&param.span, "declared here"));
                }
                Ok(Some(value)) => match param.accepts(&value) {
                    Ok(()) => param.default = value,
                    Err(why) => {
                        let d = Diagnostic::error(format!("`{}` = {value} is {why}", name.value)).at(&e.span, "");
                        reader.fault(d.at(&param.span, "declared here"));
                    }
                },
            }
        }
        tied
    }
}

impl Joined {
    /// Adds the declarations to the graph around.
    pub(super) fn declare(&mut self, graph: &mut Graph) {
        for (name, resource) in std::mem::take(&mut self.resources) {
            // The graph around may declare what it takes.
            if !graph.resources.iter().any(|(n, _)| n.value == name.value) {
                graph.resources.push((name, resource));
            }
        }
        graph.params.append(&mut self.params);
        graph.lets.append(&mut self.lets);
        graph.warnings.append(&mut self.warnings);
    }

    /// Faults of what the graph around gives. `all` are its sub-graphs, every one declared.
    pub(super) fn check(&self, all: &[Joined], reader: &mut Reader, graph: &Graph) {
        let output = |name: &str| all.iter().find_map(|j| j.outputs.get(name));
        let values = values(graph);
        for (port, name, input) in &self.given {
            let input = match input {
                Input::Resource(resource) => resource,
                Input::Value(_) if is_provided(&name.value) || values.contains(&name.value.as_str()) => continue,
                Input::Value(param) => {
                    let d = Diagnostic::error(format!("`{}` needs a value `{}`", self.name, name.value));
                    let d = d.at(&name.span, "").at(&param.span, "for this input");
                    let d = d.nearest(&name.value, values.iter().copied());
                    reader.fault(d.help(format!("give it one: `in: {{\"{port}\": \"…\"}}`")));
                    reader.broken.extend([port.clone(), name.value.clone()]);
                    continue;
                }
            };
            let whole = output(&name.value).unwrap_or(&name.value);
            let Some(there) = resources(graph).find(|(n, _)| n.value == set_of(whole)).map(|(_, there)| there) else {
                let d = Diagnostic::error(format!("`{}` needs a resource `{}`", self.name, name.value));
                let known = resources(graph).map(|(n, _)| n.value.as_str());
                let outputs = all.iter().flat_map(|j| j.outputs.keys().map(String::as_str));
                let d = d.at(&name.span, "").at(&input.span, "for this input");
                let d = d.nearest(&name.value, known.chain(outputs));
                reader.fault(d.help(format!("give it one: `in: {{\"{port}\": \"…\"}}`")));
                // That the passes in it find none is no further fault.
                reader.broken.extend([port.clone(), name.value.clone()]);
                continue;
            };
            if !fits(&there.kind, &input.kind) {
                let d = Diagnostic::error(format!("`{}` can't be this input of `{}`", name.value, self.name));
                reader.fault(d.at(&name.span, "").at(&there.span, "given").at(&input.span, "wanted"));
            }
        }
    }

    /// Gives outputs that the graph around names their names there. Every sub-graph is declared before.
    pub(super) fn name_outputs(&self, graph: &mut Graph) {
        let outputs = &self.outputs;
        let to = |name: &str| outputs.get(name).cloned().unwrap_or_else(|| name.to_string());
        let prefix = format!("{}.", self.name);
        let around = |name: &str| !name.starts_with(&prefix);
        graph.resources.iter_mut().filter(|(n, _)| around(&n.value)).for_each(|(_, r)| rename::resource(r, &to));
        graph.lets.iter_mut().filter(|(n, _)| around(&n.value)).for_each(|(_, e)| e.rename(&to));
        graph.outputs.iter_mut().for_each(|(_, r)| r.value = rename::renamed(&r.value, &to));
        graph.warnings.iter_mut().filter(|(n, _)| around(&n.value)).for_each(|(_, w)| w.when.rename(&to));
        walk_mut(&mut graph.passes, &mut |p| {
            if around(&p.name.value) {
                rename::pass(p, &to);
            }
        });
        rescope(&mut graph.passes, |scope| {
            let mut scope = scope.clone();
            if around(&scope.prefix) {
                scope.names.values_mut().for_each(|n| *n = rename::renamed(n, &to));
            }
            scope
        });
    }
}

/// Lets the shaders of sub-graphs find what the graph around has and the sub-graphs have not.
pub(super) fn look_around(graph: &mut Graph) {
    let mut known: Vec<String> = values(graph).into_iter().map(String::from).collect();
    known.extend(resources(graph).map(|(n, _)| n.value.clone()));
    known.retain(|name| !name.contains('.'));
    rescope(&mut graph.passes, |scope| {
        let mut scope = scope.clone();
        for name in &known {
            scope.around.entry(name.clone()).or_insert_with(|| name.clone());
        }
        scope
    });
}

/// The resources of a graph, those that it takes among them.
fn resources(graph: &Graph) -> impl Iterator<Item = (&Name, &ResourceDecl)> {
    let inputs = graph.inputs.iter().filter_map(|(name, input)| match input {
        Input::Resource(resource) => Some((name, resource)),
        Input::Value(_) => None,
    });
    graph.resources.iter().map(|(name, resource)| (name, resource)).chain(inputs)
}

/// The names of the values of a graph: parameters, lets, what it takes, and what loops and alternatives count.
fn values(graph: &Graph) -> Vec<&str> {
    let mut all: Vec<&str> =
        graph.params.iter().map(|(n, _)| n).chain(graph.lets.iter().map(|(n, _)| n)).map(text).collect();
    all.extend(graph.inputs.iter().filter(|(_, i)| matches!(i, Input::Value(_))).map(|(n, _)| text(n)));
    walk(&graph.passes, &mut |p| {
        if !p.kind.bodies().is_empty() && !p.kind.is_tuned(&p.name) {
            all.push(&p.name.value);
        }
    });
    all
}

fn text(name: &Name) -> &str {
    &name.value
}

fn fits(given: &ResourceKind, wanted: &ResourceKind) -> bool {
    let like = |kind: &ResourceKind| match kind {
        ResourceKind::Texture { .. } | ResourceKind::Atlas { .. } => Some(Shape::Flat),
        ResourceKind::Texture3d { .. } => Some(Shape::Solid),
        ResourceKind::Cube { .. } => Some(Shape::Cube),
        ResourceKind::Image(image) => Some(image.shape),
        ResourceKind::Buffer { .. } | ResourceKind::Table { .. } | ResourceKind::Sampler(_) => None,
    };
    discriminant(given) == discriminant(wanted) || like(given).is_some() && like(given) == like(wanted)
}
