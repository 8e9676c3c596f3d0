//! Wires passes: evaluates conditions, composes shaders and gathers everything that a pass touches.
//!
//! `bind` resolves the variables of a shader, `targets` its outputs; [`super::fastest`] picks among alternatives.

use super::cull::Culling;
use super::dispatch::Counts;
use super::fastest::{self, Group};
use super::partial::frames;
use super::request::{self, Request};
use super::sizes::Sizes;
use super::{Binding, Comparison, Desc, Frames, TableUse};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Graph, Name, Pass, PassKind, ResourceKind, walk};
use crate::graph::expr::{Binary, ExprKind, Val};
use crate::shader::{Index, Shader, Stage};
use crate::value::Values;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use web_time::Instant;

/// A pass that runs, or a loop over such.
pub enum WiredItem<'g> {
    Pass(Box<Wired<'g>>),
    Loop { pass: &'g Pass, count: u32, until: Option<(String, Comparison, f32)>, body: Vec<WiredItem<'g>> },
}

impl<'g> WiredItem<'g> {
    /// Of the graph.
    pub fn pass(&self) -> &'g Pass {
        match self {
            WiredItem::Pass(w) => w.pass,
            WiredItem::Loop { pass, .. } => pass,
        }
    }
}

/// A pass with everything it touches.
pub struct Wired<'g> {
    pub pass: &'g Pass,
    /// Index into the plan's shaders.
    pub shader: Option<usize>,
    pub each: Option<u32>,
    /// Those in which it runs.
    pub frames: Frames,
    pub uses: Vec<ResourceUse>,
    /// Colour targets: location, resource, level.
    pub color: Vec<(u32, String, u32)>,
    /// By location: what the target resolves to.
    pub resolve: Vec<(u32, String)>,
    /// What takes targets of one sample, which have nothing to resolve.
    pub copies: Vec<(&'g Name, &'g Name)>,
    /// Bindings that do not depend on the member, or the name of the resource.
    pub bindings: Vec<Wire>,
    /// Names of the loops around it, outermost first.
    pub loops: Vec<String>,
    /// Of a draw that leaves out what its members don't see.
    pub culling: Option<Culling>,
    /// Of a pass that does as much as a buffer says.
    pub counts: Option<Counts<'g>>,
    /// Of prefix sums: the plan's shaders of their stages.
    pub scan: Vec<usize>,
    /// Tables whose changes its dirty bits account for, by index of the plan's.
    pub dirty_tables: Vec<usize>,
    /// The same of resources.
    pub dirty: Vec<&'g Name>,
}

/// What a shader's variable is bound to, before resources have ids.
pub enum Wire {
    Resource(String),
    /// One level of a texture.
    Level(String, u32),
    /// A variable that a reduction binds itself.
    Source,
    Result,
    Fixed(Binding),
}

/// One use of a resource by a pass.
#[derive(Debug, Clone)]
pub struct ResourceUse {
    pub resource: String,
    /// One level of a texture; `None`: all of them.
    pub mip: Option<u32>,
    pub mode: Mode,
    pub how: How,
    pub span: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Only its size is asked for.
    Size,
    Read,
    /// All of it is overwritten.
    Write,
    /// Some of it may be overwritten; nothing is read.
    Partial,
    ReadWrite,
}

impl Mode {
    pub fn reads(self) -> bool {
        matches!(self, Mode::Read | Mode::ReadWrite)
    }
    pub fn writes(self) -> bool {
        matches!(self, Mode::Write | Mode::Partial | Mode::ReadWrite)
    }
}

/// By what way a resource is used; decides the usages it is allocated with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    Sampled,
    Uniform,
    Storage,
    Target,
    CopySource,
    CopyTarget,
    Cleared,
}

/// The result: items in the order of the file, and what was left out.
pub struct Wiring<'g> {
    pub items: Vec<WiredItem<'g>>,
    pub shaders: Vec<Arc<Shader>>,
    pub tables: Vec<TableUse>,
    /// Passes left out by their condition or for another alternative, and why.
    pub off: Vec<(&'g Pass, String)>,
    /// Groups of alternatives of which more than one could run.
    pub groups: Vec<Group<'g>>,
    /// Milliseconds that the shaders took.
    pub compose_ms: f64,
}

/// Wires all passes whose conditions hold.
pub fn wire<'g>(
    request: &'g Request<'g>,
    values: &'g Values,
    sizes: &'g Sizes<'g>,
    faults: &mut Vec<Diagnostic>,
) -> Wiring<'g> {
    let mut w = Wirer {
        request,
        values,
        sizes,
        faults,
        out: Wiring { items: vec![], shaders: vec![], tables: vec![], off: vec![], groups: vec![], compose_ms: 0.0 },
        index: request.texts.index(),
        mentioned: BTreeMap::new(),
        bits: BTreeSet::new(),
        frames: Frames::All,
        alternative: false,
    };
    walk(&request.graph.passes, &mut |p| w.bits.extend(p.only.iter().map(|dirty| dirty.bits.value.as_str())));
    let start = Instant::now();
    w.compose_ahead();
    w.out.compose_ms = start.elapsed().as_secs_f64() * 1e3;
    w.strides();
    let mut items = w.passes(&request.graph.passes, &[]);
    // The shaders of a sub-graph may read an input for the definitions of a graph around alone.
    let input = |name: &str| request.graph.inputs.iter().any(|(n, _)| n.value == name);
    let given = request.graph.resources.iter().filter(|(name, r)| r.is_given() && !input(&name.value));
    let mut made: BTreeSet<String> = given.map(|(name, _)| name.value.clone()).collect();
    made.extend(uses_of(&items).filter(|u| u.mode.writes()).map(|u| u.resource.clone()));
    w.dirty_inputs(&mut items, &made);
    if w.faults.is_empty() {
        w.marks(&items);
    }
    w.out.items = items;
    if w.faults.is_empty() {
        w.faults.extend(fastest::agree(&w.out, request.graph));
    }
    w.out
}

/// What the wiring works with.
pub(super) struct Wirer<'g, 'f> {
    pub(super) request: &'g Request<'g>,
    pub(super) values: &'g Values,
    pub(super) sizes: &'g Sizes<'g>,
    pub(super) faults: &'f mut Vec<Diagnostic>,
    pub(super) out: Wiring<'g>,
    pub(super) index: Arc<Index>,
    /// By shader: the definitions that it asks for.
    pub(super) mentioned: BTreeMap<&'g str, Arc<BTreeSet<String>>>,
    /// Buffers of dirty bits.
    pub(super) bits: BTreeSet<&'g str>,
    /// Those in which the passes run that are being wired.
    pub(super) frames: Frames,
    /// They are an alternative.
    pub(super) alternative: bool,
}

impl<'g> Wirer<'g, '_> {
    pub(super) fn value(&self, name: &str) -> Option<Val> {
        self.values.get(name).map(|v| Val::from(*v))
    }

    pub(super) fn keep<T>(&mut self, result: Result<T, Diagnostic>) -> Option<T> {
        result.map_err(|d| self.faults.push(d)).ok()
    }

    pub(super) fn graph(&self) -> &'g Graph {
        self.request.graph
    }

    pub(super) fn passes(&mut self, passes: &'g [Pass], loops: &[String]) -> Vec<WiredItem<'g>> {
        let mut items = vec![];
        let around = self.frames;
        for pass in passes {
            self.frames = around;
            if let Some(when) = &pass.when {
                let on = frames(when, &|n| self.value(n));
                match self.keep(on) {
                    Some(Some(frames)) if !self.goes_by_frames(pass, frames, loops) => continue,
                    Some(Some(Frames::All)) => {}
                    Some(Some(frames)) => self.frames = frames,
                    Some(None) => {
                        self.out.off.push((pass, format!("`{}` is false", when.span.text())));
                        continue;
                    }
                    None => continue,
                }
            }
            match &pass.kind {
                PassKind::Loop { count, until, passes } => {
                    let n = request::count(count, self.values, "a loop's count");
                    let Some(n) = self.keep(n) else { continue };
                    if n == 0 {
                        self.out.off.push((pass, format!("`{}` is 0", count.span.text())));
                        continue;
                    }
                    if n > LONGEST_LOOP {
                        let d = Diagnostic::error(format!("a loop of {n} iterations")).at(&count.span, "");
                        self.faults.push(d.help(format!("the most is {LONGEST_LOOP}")));
                        continue;
                    }
                    let until = until.as_ref().and_then(|e| self.until(e));
                    let mut inner = loops.to_vec();
                    inner.push(pass.name.value.clone());
                    let body = self.passes(passes, &inner);
                    if let Some((buffer, ..)) = &until
                        && !uses_of(&body).any(|u| u.resource == *buffer && u.mode.writes())
                    {
                        let d = Diagnostic::error(format!(
                            "nothing in the loop writes `{buffer}`, so it would never end early"
                        ));
                        let span = match &pass.kind {
                            PassKind::Loop { until: Some(e), .. } => &e.span,
                            _ => &pass.span,
                        };
                        self.faults.push(d.at(span, "").help("write it in the loop, or leave out `until`"));
                    }
                    items.push(WiredItem::Loop { pass, count: n, until, body });
                }
                PassKind::Fastest { of, .. } => items.extend(self.fastest(pass, of, loops)),
                _ => {
                    if let Some(mut wired) = self.pass(pass, loops) {
                        self.writes_no_image(&wired);
                        self.samples_fit(&wired);
                        if self.frames != Frames::All {
                            self.keeps(&mut wired);
                        }
                        items.push(WiredItem::Pass(Box::new(wired)));
                    }
                }
            }
        }
        self.frames = around;
        items
    }

    /// The test that may end a loop early; `None` where a value before it says that it never does.
    fn until(&mut self, e: &crate::graph::expr::Expr) -> Option<(String, Comparison, f32)> {
        let ExprKind::Binary(op, left, right) = &e.kind else { return None };
        if *op == Binary::And {
            let tested = left.truth(&|n| self.value(n));
            return self.keep(tested)?.then(|| self.until(right))?;
        }
        let ExprKind::Name(buffer) = &left.kind else { return None };
        let comparison = match op {
            Binary::Less => Comparison::Less,
            Binary::LessEqual => Comparison::LessEqual,
            Binary::Greater => Comparison::Greater,
            _ => Comparison::GreaterEqual,
        };
        let value = right.eval(&|n| self.value(n));
        let value = match self.keep(value)? {
            Val::Int(i) => i as f32,
            Val::Float(f) => f as f32,
            _ => {
                self.faults.push(Diagnostic::error("expected a number").at(&right.span, ""));
                return None;
            }
        };
        Some((buffer.clone(), comparison, value))
    }

    fn pass(&mut self, pass: &'g Pass, loops: &[String]) -> Option<Wired<'g>> {
        let each = match &pass.each {
            Some(e) => {
                let n = request::count(e, self.values, "a number of members");
                let n = self.keep(n)?;
                if n == 0 {
                    self.out.off.push((pass, format!("`{}` is 0", e.span.text())));
                    return None;
                }
                if n > super::sizes::MOST_DRAWS {
                    let d = Diagnostic::error(format!("a pass over {n} members")).at(&e.span, "");
                    self.faults.push(d.help(format!("the most is {}", super::sizes::MOST_DRAWS)));
                    return None;
                }
                Some(n)
            }
            None => None,
        };
        let mut wired = Wired {
            pass,
            shader: None,
            each,
            frames: self.frames,
            uses: vec![],
            color: vec![],
            resolve: vec![],
            copies: vec![],
            bindings: vec![],
            loops: loops.to_vec(),
            culling: None,
            counts: None,
            scan: vec![],
            dirty_tables: vec![],
            dirty: vec![],
        };
        match &pass.kind {
            PassKind::Copy { from, to } => {
                wired.uses.push(by_name(from, Mode::Read, How::CopySource));
                wired.uses.push(by_name(to, Mode::Write, How::CopyTarget));
                return Some(wired);
            }
            PassKind::Clear { target, .. } => {
                wired.uses.push(by_name(target, Mode::Write, How::Cleared));
                return Some(wired);
            }
            PassKind::Scan { from, to, .. } => {
                wired.uses.push(by_name(from, Mode::Read, How::Storage));
                wired.uses.push(by_name(to, Mode::Write, How::Storage));
                wired.scan = self.scan(from, to)?;
                return Some(wired);
            }
            PassKind::Mips { .. } | PassKind::Loop { .. } | PassKind::For { .. } | PassKind::Fastest { .. } => {
                return None;
            }
            PassKind::Draw(_) | PassKind::Screen(_) | PassKind::Compute { .. } | PassKind::Reduce { .. } => {}
        }
        let name = pass.kind.shader()?;
        let (index, shader) = self.shader(pass, name)?;
        wired.shader = Some(index);
        let stages: &[Stage] = match &pass.kind {
            PassKind::Draw(_) => &[Stage::Vertex, Stage::Fragment],
            PassKind::Screen(_) => &[Stage::Fragment],
            _ => &[Stage::Compute],
        };
        let need = match &pass.kind {
            PassKind::Draw(_) => Stage::Vertex,
            PassKind::Screen(_) => Stage::Fragment,
            _ => Stage::Compute,
        };
        if shader.interface.entry(need).is_none() {
            let word = format!("{need:?}").to_lowercase();
            let d = Diagnostic::error(format!("`{}` has no @{word} entry point", name.value)).at(&name.span, "");
            let also = if pass.entry.is_empty() { "" } else { ": name it in `entry` too" };
            self.faults.push(d.help(format!("a {} needs one{also}", pass.kind.word())));
            return None;
        }
        let has =
            |entry: &Name, stage| shader.interface.entries.iter().any(|e| e.name == entry.value && stage == e.stage);
        for entry in pass.entry.iter().filter(|entry| !stages.iter().any(|stage| has(entry, *stage))) {
            let words: Vec<String> = stages.iter().map(|s| format!("@{s:?}").to_lowercase()).collect();
            let d = Diagnostic::error(format!(
                "`{}` has no {} entry point `{}`",
                name.value,
                words.join(" or "),
                entry.value
            ));
            let there = shader.interface.entries.iter().filter(|e| stages.contains(&e.stage)).map(|e| e.name.as_str());
            self.faults.push(d.at(&entry.span, "").nearest(&entry.value, there));
        }
        for stage in stages {
            let mut entries = shader.interface.entries.iter().filter(|e| e.stage == *stage).skip(1);
            if let Some(second) = entries.next() {
                let word = format!("{stage:?}").to_lowercase();
                let d = Diagnostic::error(format!("`{}` has more than one @{word} entry point", name.value));
                let d = d.at(&name.span, "").at(&self.locate(pass, &shader, &second.name), "the second");
                self.faults.push(d.help(format!("say which by `entry: \"{}\"`", second.name)));
            }
        }
        self.variables(&mut wired, &shader, stages);
        match &pass.kind {
            PassKind::Draw(r) => {
                self.vertex_inputs(pass, &shader);
                self.targets(&mut wired, r, &shader);
                wired.culling = r.frusta.as_ref().and_then(|name| self.culling(&mut wired, name));
            }
            PassKind::Screen(r) => self.targets(&mut wired, r, &shader),
            PassKind::Reduce { from, to, .. } => {
                wired.uses.push(by_name(from, Mode::Read, How::Sampled));
                wired.uses.push(by_name(to, Mode::Write, How::Storage));
            }
            _ => {}
        }
        if let Some(name) = pass.kind.indirect() {
            wired.counts = Some(self.counts(&mut wired, name)?);
        }
        self.feedback(&wired);
        if let Some(dirty) = &pass.only {
            wired.uses.push(by_name(&dirty.bits, Mode::Read, How::Storage));
        }
        Some(wired)
    }

    /// The level of a texture that a variable or output goes to; `None` within where nobody says, `None` after a fault.
    pub(super) fn mip(&mut self, pass: &Pass, variable: &str, resource: &str, desc: &Desc) -> Option<Option<u32>> {
        let Some(e) = pass.mip(variable) else { return Some(None) };
        let levels = match desc {
            Desc::Texture(t) => t.mips,
            Desc::Buffer { .. } => 0,
        };
        let level = e.eval(&|n| self.value(n));
        match self.keep(level)? {
            Val::Int(level) if (0..i64::from(levels)).contains(&level) => Some(u32::try_from(level).ok()),
            level => {
                let text = match level {
                    Val::Int(level) => format!("`{resource}` has {levels} levels, none of number {level}"),
                    _ => "a level must be an integer".to_string(),
                };
                self.faults
                    .push(Diagnostic::error(text).at(&e.span, "").help("`mips` of the texture says how many it has"));
                None
            }
        }
    }

    /// What files hold stays as it is.
    fn writes_no_image(&mut self, wired: &Wired) {
        for u in wired.uses.iter().filter(|u| u.mode.writes()) {
            let Some(declared) = self.sizes.declared(&u.resource) else { continue };
            if matches!(declared.kind, ResourceKind::Image(_)) {
                let d = Diagnostic::error(format!("`{}` writes the image `{}`", wired.pass.name.value, u.resource));
                let d = d.at(&u.span, "").at(&declared.span, "read from a file");
                self.faults.push(d.help("write a `Texture` of its own; `size` takes the image's name"));
            }
        }
    }

    /// A texture, or a buffer in a uniform, that is read and written in one pass.
    fn feedback(&mut self, wired: &Wired) {
        for (i, a) in wired.uses.iter().enumerate() {
            for b in &wired.uses[i + 1..] {
                let clash = a.mode.writes() && b.mode != Mode::Size || b.mode.writes() && a.mode != Mode::Size;
                let texture = |r: &str| matches!(self.sizes.of(r), Some(Ok(s)) if matches!(s.desc, Desc::Texture(_)));
                let apart = || [a.how, b.how].contains(&How::Uniform) || texture(&a.resource);
                let meet = a.mip.is_none() || b.mip.is_none() || a.mip == b.mip;
                if a.resource == b.resource && meet && clash && apart() {
                    let d = Diagnostic::error(format!(
                        "`{}` reads and writes `{}` at once",
                        wired.pass.name.value, a.resource
                    ));
                    let d = d.at(&b.span, "").at(&a.span, "").at(&wired.pass.name.span, "in this pass");
                    self.faults
                        .push(d.help("write to another resource and copy, or keep last frame's with `history: true`"));
                }
            }
        }
    }
}

/// More iterations than this are taken for a slip.
pub const LONGEST_LOOP: u32 = 65_536;

pub(super) fn by_name(name: &Name, mode: Mode, how: How) -> ResourceUse {
    ResourceUse { resource: name.value.clone(), mip: None, mode, how, span: name.span.clone() }
}

/// Uses of resources by all passes.
pub fn uses_of<'a>(items: &'a [WiredItem]) -> impl Iterator<Item = &'a ResourceUse> {
    passes_of(items).into_iter().flat_map(|w| &w.uses)
}

/// All passes in their order, those in loops among them.
pub fn passes_of<'a, 'g>(items: &'a [WiredItem<'g>]) -> Vec<&'a Wired<'g>> {
    let of = |item: &'a WiredItem<'g>| match item {
        WiredItem::Pass(w) => vec![&**w],
        WiredItem::Loop { body, .. } => passes_of(body),
    };
    items.iter().flat_map(of).collect()
}
