//! Repetitions to the passes that they stand for, and sets to their members, where a graph names these one by one.

use super::ast::{Graph, Name, NameScope, Pass, PassKind, Raster, ResourceDecl, ResourceKind, Size, set_of, walk};
use super::expr::{Expr, ExprKind, Val, item};
use super::rename;
use crate::diag::{Checked, Diagnostic, Faults, Span};
use crate::shader::library::HALVE;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// More passes, or members of a set, than this are a slip.
const MOST: usize = 4096;

/// Members of all sets that are named by number: each becomes a resource of its own.
const MOST_MEMBERS: usize = 4 * MOST;

/// A value by name.
pub type Lookup<'v> = &'v dyn Fn(&str) -> Option<Val>;

/// The graph without repetitions, and without the sets of which members are named. As it is, where it has neither.
///
/// # Errors
/// Counts that can't be computed or are too large, numbers of members that a set does not have.
pub fn unroll<'g>(graph: &'g Graph, value: Lookup) -> Checked<Cow<'g, Graph>> {
    let mut repeats = false;
    let mut apart: BTreeSet<String> = BTreeSet::new();
    walk(&graph.passes, &mut |p| {
        repeats |= matches!(p.kind, PassKind::For { .. } | PassKind::Mips { .. });
        let mut p = p.clone();
        mentioned(&mut p, &mut |name| {
            if name.contains('[') {
                apart.insert(set_of(name).to_string());
            }
        });
    });
    let outputs = graph.outputs.iter().filter(|(_, r)| r.value.contains('['));
    apart.extend(outputs.map(|(_, r)| set_of(&r.value).to_string()));
    apart.extend(graph.resources.iter().filter(|(_, r)| by_number(r)).map(|(n, _)| n.value.clone()));
    if !repeats && apart.is_empty() {
        return Ok(Cow::Borrowed(graph));
    }
    let mut out = graph.clone();
    let mut u = Unroll { value, members: BTreeMap::new(), textures: BTreeMap::new(), passes: 0, faults: vec![] };
    out.resources = std::mem::take(&mut out.resources)
        .into_iter()
        .flat_map(|(name, r)| if apart.contains(&name.value) { u.set(&name, &r) } else { vec![(name, r)] })
        .collect();
    u.textures = out.resources.iter().map(|(name, r)| (name.value.clone(), r.kind.clone())).collect();
    let passes = std::mem::take(&mut out.passes);
    out.passes = u.passes(passes, &[]);
    for (_, resource) in &mut out.outputs {
        u.reference(resource, &[]);
    }
    Faults::check(u.faults, Cow::Owned(out))
}

/// What stands between the brackets of a name.
///
/// # Errors
/// It is no expression.
pub fn index_of(name: &Name) -> Result<Expr, Diagnostic> {
    let text = name.value.split_once('[').and_then(|(_, rest)| rest.strip_suffix(']')).unwrap_or("0");
    // Of a renamed one the text is another than the file's: its faults are at the name.
    let span = &name.span;
    let inner = span.text().find('[').map(|at| Span::new(&span.source, span.start + at + 1..span.end - 1));
    match inner.filter(|inner| inner.text() == text) {
        Some(inner) => Expr::parse(&inner, text),
        None => Expr::parse(&Span::new(&span.source, span.start..span.start), text),
    }
}

/// Whether the size of a set's members goes by their number.
fn by_number(r: &ResourceDecl) -> bool {
    let mut found = false;
    for e in r.exprs().0 {
        e.names(&mut |n, _| found |= n == "member");
    }
    found && r.members.is_some()
}

/// Calls `f` with every name of a resource that a pass mentions, by itself or in an expression.
fn mentioned(p: &mut Pass, f: &mut dyn FnMut(&str)) {
    let found = std::cell::RefCell::new(f);
    let note = |name: &str| {
        (found.borrow_mut())(name);
        name.to_string()
    };
    for name in rename::references(p) {
        note(&name.value);
    }
    for e in rename::exprs(p) {
        items(e, &mut |name| drop(note(name)));
    }
    if let Some(scope) = &p.scope {
        scope.names.values().for_each(|n| drop(note(n)));
    }
}

/// The members of sets that an expression names, as `set[…]`.
fn items(e: &Expr, f: &mut dyn FnMut(&str)) {
    match &e.kind {
        ExprKind::Item(set, _) => f(&format!("{set}[]")),
        ExprKind::Number(_) | ExprKind::Name(_) => {}
        ExprKind::Parts(a, _) | ExprKind::Unary(_, a) => items(a, f),
        ExprKind::Binary(_, a, b) => [a, b].into_iter().for_each(|e| items(e, f)),
        ExprKind::Choose(a, b, c) => [a, b, c].into_iter().for_each(|e| items(e, f)),
        ExprKind::Call(_, args) => args.iter().for_each(|e| items(e, f)),
    }
}

struct Unroll<'v> {
    value: Lookup<'v>,
    /// By set that was taken apart: how many members it has.
    members: BTreeMap<String, u32>,
    /// What the resources are, members of sets each.
    textures: BTreeMap<String, ResourceKind>,
    passes: usize,
    faults: Vec<Diagnostic>,
}

/// The indices of the repetitions around, by name.
type LoopIndices<'i> = &'i [(String, u32)];

impl Unroll<'_> {
    fn lookup(&self, indices: LoopIndices, name: &str) -> Option<Val> {
        let index = indices.iter().rev().find(|(n, _)| n == name);
        index.map(|(_, i)| Val::Int((*i).into())).or_else(|| (self.value)(name))
    }

    /// Counts a pass that a repetition makes.
    fn made(&mut self, name: &Name) {
        self.passes += 1;
        if self.passes == MOST + 1 {
            let d = Diagnostic::error(format!("repetitions make more than {MOST} passes"));
            self.faults.push(d.at(&name.span, ""));
        }
    }

    fn count(&mut self, e: &Expr, indices: LoopIndices, what: &str) -> u32 {
        let fault = match e.eval(&|n| self.lookup(indices, n)) {
            Ok(Val::Int(n)) if (0..=MOST as i64).contains(&n) => return n as u32,
            Ok(Val::Bool(b)) => return b.into(),
            Ok(Val::Int(n)) => {
                let d = Diagnostic::error(format!("{what} is {n}")).at(&e.span, "");
                d.help(format!("it must lie between 0 and {MOST}"))
            }
            Ok(_) => Diagnostic::error(format!("{what} must be an integer")).at(&e.span, ""),
            Err(d) => d,
        };
        self.faults.push(fault);
        0
    }

    /// The members of a set, each a resource.
    fn set(&mut self, name: &Name, r: &ResourceDecl) -> Vec<(Name, ResourceDecl)> {
        let Some(members) = &r.members else { return vec![(name.clone(), r.clone())] };
        let n = self.count(members, &[], "a number of members");
        let apart: usize = self.members.values().map(|n| *n as usize).sum();
        if apart + n as usize > MOST_MEMBERS {
            let d = Diagnostic::error(format!("sets that are named by number have more than {MOST_MEMBERS} members"));
            self.faults.push(d.at(&name.span, "with this one"));
            return vec![];
        }
        self.members.insert(name.value.clone(), n);
        let member = |i: u32| {
            let mut one = ResourceDecl { members: None, ..r.clone() };
            let value = |name: &str| (name == "member").then_some(Val::Int(i.into()));
            match &mut one.kind {
                ResourceKind::Texture { size, .. }
                | ResourceKind::Texture3d { size, .. }
                | ResourceKind::Cube { size, .. } => match size {
                    Size::One(e) => e.substitute(&value),
                    Size::Axes(axes, _) => axes.iter_mut().for_each(|e| e.substitute(&value)),
                },
                ResourceKind::Buffer { count, .. } => count.substitute(&value),
                ResourceKind::Atlas { .. }
                | ResourceKind::Image(_)
                | ResourceKind::Table { .. }
                | ResourceKind::Sampler(_) => {}
            }
            (Name { value: item(&name.value, i.into()), span: name.span.clone() }, one)
        };
        (0..n).map(member).collect()
    }

    /// A member that a name has a number for.
    fn reference(&mut self, name: &mut Name, indices: LoopIndices) {
        let set = set_of(&name.value).to_string();
        let Some(members) = self.members.get(&set).copied() else { return };
        if set == name.value {
            let d = Diagnostic::error(format!("`{set}` is a set, of which this names no member")).at(&name.span, "");
            self.faults.push(d.help(format!("its members are named one by one in this graph: `{set}[…]`")));
            return;
        }
        let index = index_of(name).and_then(|e| e.eval(&|n| self.lookup(indices, n)));
        match index {
            Ok(Val::Int(i)) if (0..i64::from(members)).contains(&i) => name.value = item(&set, i),
            Ok(Val::Int(i)) => {
                let d = Diagnostic::error(format!("`{set}` has {members} members, none of number {i}"));
                self.faults.push(d.at(&name.span, ""));
            }
            Ok(_) => self.faults.push(Diagnostic::error("a number of a member must be an integer").at(&name.span, "")),
            Err(d) => self.faults.push(d),
        }
    }

    fn passes(&mut self, passes: Vec<Pass>, indices: LoopIndices) -> Vec<Pass> {
        let mut out = vec![];
        for pass in passes {
            if let PassKind::Mips { of } = &pass.kind {
                out.extend(self.levels(&pass, of.clone(), indices));
                continue;
            }
            let PassKind::For { count, passes } = &pass.kind else {
                self.made(&pass.name);
                if self.passes <= MOST {
                    out.push(self.pass(pass, indices));
                }
                continue;
            };
            let n = self.count(count, indices, "a number of repetitions");
            if let Some(when) = &pass.when {
                match when.truth(&|n| self.lookup(indices, n)) {
                    Ok(true) => {}
                    Ok(false) => continue,
                    Err(d) => {
                        self.faults.push(d);
                        continue;
                    }
                }
            }
            for i in 0..n {
                if self.passes > MOST {
                    break;
                }
                let mut inner = indices.to_vec();
                inner.push((pass.name.value.clone(), i));
                let made = self.passes(passes.clone(), &inner);
                if made.is_empty() {
                    // Those that make nothing take time too.
                    self.made(&pass.name);
                }
                out.extend(made);
            }
        }
        out
    }

    /// The passes that draw each level of a texture, layer by layer, from the one above.
    fn levels(&mut self, pass: &Pass, mut of: Name, indices: LoopIndices) -> Vec<Pass> {
        self.reference(&mut of, indices);
        let (mips, layers, faces) = match self.textures.get(&of.value).cloned() {
            Some(ResourceKind::Texture { mips: Some(mips), layers, .. }) => (mips, layers, None),
            Some(ResourceKind::Cube { mips: Some(mips), count, .. }) => (mips, count, Some(6)),
            // A fault of the check.
            _ => return vec![],
        };
        let levels = self.count(&mips, &[], "a number of mips");
        let layers = layers.map(|e| self.count(&e, &[], "a number of layers"));
        let layers = match (layers, faces) {
            (None, faces) => faces,
            (Some(n), faces) => Some(n.saturating_mul(faces.unwrap_or(1))),
        };
        let mut out = vec![];
        for level in 1..levels {
            for layer in 0..layers.unwrap_or(1) {
                self.made(&pass.name);
                if self.passes > MOST {
                    return out;
                }
                let mut inner = indices.to_vec();
                inner.push((pass.name.value.clone(), level));
                inner.extend(layers.map(|_| (format!("{}.layer", pass.name.value), layer)));
                let halve = halve(pass, &of, level, layers.map(|_| layer));
                out.push(self.pass(halve, &inner));
            }
        }
        out
    }

    fn pass(&mut self, mut pass: Pass, indices: LoopIndices) -> Pass {
        let bodies: Vec<Vec<Pass>> = pass.kind.bodies_mut().iter_mut().map(std::mem::take).collect();
        let number = |name: &str| {
            let index = indices.iter().rev().find(|(n, _)| n == name);
            index.map(|(_, i)| Val::Int((*i).into()))
        };
        rename::exprs(&mut pass).into_iter().for_each(|e| e.substitute(&number));
        for name in rename::references(&mut pass) {
            self.reference(name, indices);
        }
        if pass.scope.as_ref().is_some_and(|s| s.names.values().any(|n| n.contains('['))) {
            let mut scope = NameScope::clone(pass.scope.as_ref().map_or(&Arc::default(), |s| s));
            for whole in scope.names.values_mut().filter(|n| n.contains('[')) {
                let mut name = Name { value: whole.clone(), span: pass.name.span.clone() };
                self.reference(&mut name, indices);
                *whole = name.value;
            }
            pass.scope = Some(Arc::new(scope));
        }
        let ending: String = indices.iter().map(|(_, i)| format!("[{i}]")).collect();
        let before = pass.name.value.clone();
        pass.name.value += &ending;
        pass.indices = indices.to_vec();
        let mut inside: Vec<Vec<Pass>> = bodies.into_iter().map(|body| self.passes(body, indices)).collect();
        if !ending.is_empty() && matches!(pass.kind, PassKind::Loop { .. }) {
            inside.iter_mut().flatten().for_each(|p| rename_loop(p, &before, &pass.name.value));
        }
        for (body, inside) in pass.kind.bodies_mut().iter_mut().zip(inside) {
            *body = inside;
        }
        pass
    }
}

/// A pass that draws one level of a texture from the one above.
fn halve(pass: &Pass, of: &Name, level: u32, layer: Option<u32>) -> Pass {
    let name = |value: &str| Name { value: value.into(), span: of.span.clone() };
    let number = |n: u32| Expr { span: of.span.clone(), kind: ExprKind::Number(Val::Int(n.into())) };
    let layered = Expr { span: of.span.clone(), kind: ExprKind::Number(Val::Bool(true)) };
    let raster = Raster { layer: layer.map(number), ..Raster::over(name(HALVE)) };
    Pass {
        defines: layer.map(|_| (name("LAYERED"), layered)).into_iter().collect(),
        bind: ["above", "below"].map(|variable| (name(variable), of.clone())).into(),
        mips: vec![(name("above"), number(level - 1)), (name("below"), number(level))],
        set: layer.map(|layer| (name("layer"), number(layer))).into_iter().collect(),
        scope: None,
        kind: PassKind::Screen(raster),
        ..pass.clone()
    }
}

/// Makes a pass in a repeated loop count by the loop's new name.
fn rename_loop(p: &mut Pass, before: &str, after: &str) {
    let to = |name: &str| if name == before { after.to_string() } else { name.to_string() };
    rename::exprs(p).into_iter().for_each(|e| e.rename(&to));
    let mut scope = p.scope.as_deref().cloned().unwrap_or_default();
    match scope.names.values_mut().find(|n| **n == before) {
        Some(n) => *n = after.to_string(),
        None => drop(scope.names.insert(before.to_string(), after.to_string())),
    }
    p.scope = Some(Arc::new(scope));
    p.kind.bodies_mut().iter_mut().flatten().for_each(|p| rename_loop(p, before, after));
}
