//! Plans passes that run for the instances whose dirty bit is set, and passes that run in some frames only (`when:
//! "first_frame"`) together with the history that keeps their results.

use super::keys::Keys;
use super::wire::{Mode, ResourceUse, Wire, Wired, WiredItem, Wirer, uses_of};
use super::{Binding, Desc, Plan, ResourceId};
use crate::diag::Diagnostic;
use crate::graph::Graph;
use crate::graph::ast::{Dirty, Pass, PassKind, ResourceDecl};
use crate::graph::check::FIRST_FRAME;
use crate::graph::expr::{Expr, Val};
use crate::scene;
use crate::value::{Value, Values};
use std::collections::BTreeSet;

/// Tables from which the boxes follow by which draws leave out what their instances don't see.
pub(super) const CULLED_BY: [&str; 2] = ["nodes", "clusters"];

/// Faults of outputs and history that follow from dirty bits: they would depend on what ran in earlier frames.
pub(super) fn lasting(plan: &Plan, graph: &Graph) -> Vec<Diagnostic> {
    if !plan.resources.iter().any(|r| r.bits) {
        return vec![];
    }
    let from_bits = Keys::of(plan, None).from_bits;
    let output = |id: ResourceId| plan.outputs.iter().any(|o| o.1 == id);
    let lasts = |(i, r): &(usize, &super::Resource)| from_bits[*i] && (r.history || output(ResourceId(*i)));
    let fault = |(_, r): (usize, &super::Resource)| {
        let d = Diagnostic::error(format!("`{}` lasts, and follows from dirty bits", r.name));
        let declared = graph.resources.iter().find(|(name, _)| name.value == r.name);
        let help = "dirty bits say which instances changed in a frame: let only passes read them that write dirty bits";
        declared.map_or(d.clone(), |(name, _)| d.at(&name.span, "")).help(help)
    };
    plan.resources.iter().enumerate().filter(lasts).map(fault).collect()
}

impl<'g> Wirer<'g, '_> {
    /// Finds what the dirty bits of passes account for, among what they read. Resources that nothing of this plan
    /// makes are left out: an alternative that does not run would have.
    pub(super) fn dirty_inputs(&mut self, items: &mut [WiredItem<'g>], made: &BTreeSet<String>) {
        for item in items {
            match item {
                WiredItem::Pass(w) => {
                    if let Some(dirty) = &w.pass.only {
                        self.inputs_of(w, dirty, made);
                    }
                }
                WiredItem::Loop { body, .. } => self.dirty_inputs(body, made),
            }
        }
    }

    fn inputs_of(&mut self, w: &mut Wired<'g>, dirty: &'g Dirty, made: &BTreeSet<String>) {
        for name in &dirty.of {
            if scene::table(&name.value).is_some() {
                let bound = |wire: &Wire| match wire {
                    Wire::Fixed(Binding::Table(i)) if self.out.tables[*i].table == name.value => Some(*i),
                    _ => None,
                };
                let tables: BTreeSet<usize> = w.bindings.iter().filter_map(bound).collect();
                let culled = w.culling.is_some() && CULLED_BY.contains(&name.value.as_str());
                if tables.is_empty() && !culled {
                    self.reads_nothing_of(w, &name.value, &name.span);
                }
                w.dirty_tables.extend(tables);
            } else if w.uses.iter().any(|u| u.resource == name.value && u.mode == Mode::Read) {
                w.dirty.push(name);
            } else if made.contains(&name.value) {
                self.reads_nothing_of(w, &name.value, &name.span);
            }
        }
        let Some(instances) = w.each else { return };
        if let Some(Ok(sized)) = self.sizes.of(&dirty.bits.value)
            && let Desc::Buffer { size, .. } = sized.desc
            && size < u64::from(instances).div_ceil(32) * 4
        {
            let what = format!("`{}` has {size} bytes for the bits of {instances} instances", dirty.bits.value);
            let help = format!("declare it as `Buffer(stride: 4, count: \"ceil_div({instances}, 32)\")`, or more");
            self.faults.push(Diagnostic::error(what).at(&dirty.bits.span, "").help(help));
        }
    }

    fn reads_nothing_of(&mut self, w: &Wired, name: &str, span: &crate::diag::Span) {
        let d = Diagnostic::error(format!("`{}` reads nothing of `{name}`", w.pass.name.value)).at(span, "");
        let read = w.uses.iter().filter(|u| u.mode == Mode::Read).map(|u| u.resource.as_str());
        let table = |wire: &Wire| match wire {
            Wire::Fixed(Binding::Table(i)) => Some(self.out.tables[*i].table.as_str()),
            _ => None,
        };
        let tables = w.bindings.iter().filter_map(table);
        let all: BTreeSet<&str> = read.chain(tables).collect();
        let all: Vec<&str> = all.into_iter().collect();
        self.faults.push(d.nearest(name, all.iter().copied()).help(format!("what it reads: {}", all.join(", "))));
    }

    /// Faults of passes that write dirty bits and something else.
    pub(super) fn marks(&mut self, items: &[WiredItem<'g>]) {
        for item in items {
            let WiredItem::Pass(w) = item else { continue };
            let is_bits = |u: &&ResourceUse| self.bits.contains(u.resource.as_str());
            let written = || w.uses.iter().filter(|u| u.mode.writes());
            if let (Some(bits), Some(other)) = (written().find(is_bits), written().find(|u| !is_bits(u))) {
                let what = format!("`{}` writes the dirty bits `{}` and more", w.pass.name.value, bits.resource);
                let d = Diagnostic::error(what).at(&bits.span, "").at(&other.span, "");
                self.faults.push(d.help("write them in a pass of their own, which runs only when they are asked for"));
            }
        }
        let used: Vec<&str> = self.bits.iter().copied().collect();
        for bits in used {
            let reads = |u: &ResourceUse| u.resource == bits && u.mode == Mode::Read;
            let writes = |u: &ResourceUse| u.resource == bits && u.mode.writes();
            if let (Some(read), None) = (uses_of(items).find(|u| reads(u)), uses_of(items).find(|u| writes(u))) {
                let d = Diagnostic::error(format!("nothing writes the dirty bits `{bits}`")).at(&read.span, "");
                let help =
                    "let a pass before it set the bit of each instance that a change can touch, or leave `only` out";
                self.faults.push(d.help(help));
            }
        }
    }
}

/// The frames in which a step runs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Frames {
    #[default]
    All,
    /// Those with which history begins.
    First,
    /// All others.
    Later,
}

impl Frames {
    /// Whether the frame with these values is one of them.
    pub fn include(self, values: &Values) -> bool {
        let first = values.get(FIRST_FRAME) == Some(&Value::Bool(true));
        match self {
            Frames::All => true,
            Frames::First => first,
            Frames::Later => !first,
        }
    }

    /// As plans show them.
    pub fn words(self) -> Option<&'static str> {
        match self {
            Frames::All => None,
            Frames::First => Some("in first frames"),
            Frames::Later => Some("in all frames but first ones"),
        }
    }
}

/// The frames in which a condition holds; `None`: in none.
///
/// # Errors
/// As [`Expr::truth`].
pub(super) fn frames(when: &Expr, value: &dyn Fn(&str) -> Option<Val>) -> Result<Option<Frames>, Diagnostic> {
    let mut asks = false;
    when.names(&mut |name, _| asks |= name == FIRST_FRAME);
    if !asks {
        return Ok(when.truth(value)?.then_some(Frames::All));
    }
    let holds = |first| when.truth(&|name| if name == FIRST_FRAME { Some(Val::Bool(first)) } else { value(name) });
    Ok(match (holds(true)?, holds(false)?) {
        (true, true) => Some(Frames::All),
        (true, false) => Some(Frames::First),
        (false, true) => Some(Frames::Later),
        (false, false) => None,
    })
}

impl<'g> Wirer<'g, '_> {
    /// Whether a pass may go by the frame where it stands: in a loop the loop does, and alternatives are measured.
    pub(super) fn goes_by_frames(&mut self, pass: &'g Pass, frames: Frames, loops: &[String]) -> bool {
        let Some(when) = pass.when.as_ref().filter(|_| frames != Frames::All) else { return true };
        let d = match (&pass.kind, loops.last()) {
            (PassKind::Fastest { .. }, _) => {
                let d = Diagnostic::error(format!("the alternatives of `{}` run in some frames only", pass.name.value));
                d.help("alternatives are measured in any frame: leave `first_frame` out of `when`")
            }
            (_, Some(around)) => {
                let d = Diagnostic::error(format!("`{}` runs in some frames only, in a loop", pass.name.value));
                d.help(format!("give `{around}` the condition, or a loop of its own to the pass"))
            }
            _ if self.alternative => {
                let d = Diagnostic::error(format!("`{}` runs in some frames only, as an alternative", pass.name.value));
                d.help("alternatives are measured in any frame: leave `first_frame` out of `when`")
            }
            _ if pass.only.is_some() => {
                let d = Diagnostic::error(format!("`{}` runs in some frames only, and in part", pass.name.value));
                d.help("leave `only` out, or `first_frame`")
            }
            _ => return true,
        };
        self.faults.push(d.at(&when.span, ""));
        false
    }

    /// What such a pass writes is kept where it does not run: it has to be history.
    pub(super) fn keeps(&mut self, wired: &mut Wired<'g>) {
        for i in 0..wired.uses.len() {
            let u = &mut wired.uses[i];
            if !u.mode.writes() {
                continue;
            }
            if u.mode == Mode::Write {
                u.mode = Mode::Partial;
            }
            let declared = self.sizes.declared(&u.resource);
            if declared.is_some_and(|r: &ResourceDecl| r.history) {
                continue;
            }
            let (name, of) = (&wired.pass.name, &u.resource);
            let d = Diagnostic::error(format!("`{}` runs in some frames only, and nothing keeps `{of}`", name.value));
            let d = d.at(&u.span, "").at(&name.span, "in this pass");
            self.faults.push(d.help(format!("give `{of}` `history: true`, so that other frames find it")));
        }
    }
}
