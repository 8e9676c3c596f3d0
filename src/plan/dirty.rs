//! Passes that run for some of their instances: what their dirty bits account for, and who writes them.

use super::keys::Keys;
use super::wire::{Mode, ResourceUse, Wire, Wired, WiredItem, Wirer, any_use};
use super::{Binding, Desc, Plan, ResourceId};
use crate::diag::Diagnostic;
use crate::graph::Graph;
use crate::graph::ast::Dirty;
use crate::scene;
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
            if any_use(items, &mut |u| reads(u)) && !any_use(items, &mut |u| writes(u)) {
                let mut at = None;
                any_use(items, &mut |u| {
                    at = at.take().or_else(|| reads(u).then(|| u.span.clone()));
                    false
                });
                let d = Diagnostic::error(format!("nothing writes the dirty bits `{bits}`"));
                let help =
                    "let a pass before it set the bit of each instance that a change can touch, or leave `only` out";
                self.faults.push(at.map_or(d.clone(), |span| d.at(&span, "")).help(help));
            }
        }
    }
}
