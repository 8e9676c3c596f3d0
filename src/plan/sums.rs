//! Splits reductions into stages with intermediate textures, and prefix sums into three steps: sums of blocks, sums
//! over blocks, sums within blocks. Short prefix sums take one step.

use super::expand::{Expander, shape};
use super::shaders::{BuiltIn, ScanStage};
use super::wire::{How, Wired, Wirer};
use super::{Binding, Desc, ResourceId, TextureDesc, TextureKind, Tiles, request};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Name, PassKind, ResourceKind, Stride};
use crate::shader::BindingKind;
use crate::value::{Value, Values};
use std::collections::BTreeMap;

impl Expander<'_, '_> {
    /// Adds the steps of a reduction: one for each stage, its intermediates made on the way.
    pub(super) fn reduce(&mut self, w: &Wired, member: u32, name: &str) -> Option<()> {
        let PassKind::Reduce { from, to, factor, until, shader } = &w.pass.kind else { return None };
        let written = factor;
        let factors: Vec<Result<u32, Diagnostic>> =
            written.iter().map(|e| request::count(e, self.values, "a factor")).collect();
        let mut factor = [1; 3];
        for (i, f) in factors.into_iter().enumerate() {
            factor[i] = self.keep(f)?;
            if factor[i] == 0 {
                let d = Diagnostic::error("a reduction divides by 0").at(&written[i].span, "must be at least 1");
                self.faults.push(d);
                return None;
            }
        }
        if let [_] = written[..] {
            factor = [factor[0]; 3];
        }
        let until = request::count(until, self.values, "the size at which to stop");
        let until = self.keep(until)?.max(1);
        let source = self.id(&from.value, member, &from.span)?;
        let target = self.id(&to.value, member, &to.span)?;
        let (Desc::Texture(first), Desc::Texture(last)) =
            (self.out.resources[source.0].desc.clone(), self.out.resources[target.0].desc.clone())
        else {
            return None;
        };
        let stages = self.stages(first, factor, until, last.format, &w.pass.span)?;
        let end = stages.last()?;
        if (end.width, end.height, end.layers, end.tiles, end.kind)
            != (last.width, last.height, last.layers, last.tiles, last.kind)
        {
            let made = shape(&Desc::Texture(end.clone()));
            let d = Diagnostic::error(format!(
                "the reduction ends with {made}, `{}` is {}",
                to.value,
                shape(&Desc::Texture(last))
            ));
            self.faults.push(d.at(&to.span, "").help(format!("declare `{}` with that size", to.value)));
            return None;
        }
        let mut from_id = source;
        for (i, desc) in stages.iter().enumerate() {
            let made = || (format!("{name}.{i}"), Desc::Texture(desc.clone()));
            let to_id = if i + 1 == stages.len() { target } else { self.made(made(), &w.pass.span)? };
            self.usage(from_id, How::Sampled);
            self.usage(to_id, How::Storage);
            let stage = BTreeMap::from([("source", from_id), ("result", to_id)]);
            let bindings = self.bindings(w, member, name, &stage)?;
            let (mut reads, mut writes) = (vec![from_id], vec![to_id]);
            for u in w.uses.iter().filter(|u| u.resource != from.value && u.resource != to.value) {
                let id = self.id(&u.resource, member, &u.span)?;
                self.usage(id, u.how);
                if u.mode.reads() {
                    reads.push(id);
                }
                if u.mode.writes() {
                    writes.push(id);
                }
            }
            let index = w.shader?;
            let groups = self.in_groups(index, [desc.width, desc.height, desc.layers], &shader.span)?;
            let name = if stages.len() > 1 { format!("{name}.{i}") } else { name.to_string() };
            self.dispatch(w, name, (index, groups), (bindings, reads, writes))?;
            from_id = to_id;
        }
        Some(())
    }

    /// The extents after each stage of a reduction.
    fn stages(
        &mut self,
        first: TextureDesc,
        factor: [u32; 3],
        until: u32,
        format: wgpu_types::TextureFormat,
        span: &Span,
    ) -> Option<Vec<TextureDesc>> {
        let mut at = TextureDesc { format, usage: wgpu_types::TextureUsages::empty(), mips: 1, ..first };
        let mut stages = vec![];
        loop {
            let next = match at.tiles {
                Some(t) => {
                    let edge = t.edge.div_ceil(factor[0].max(1));
                    let rows = t.count.div_ceil(t.columns);
                    let tiles = Tiles { edge, ..t };
                    TextureDesc { width: t.columns * edge, height: rows * edge, tiles: Some(tiles), ..at.clone() }
                }
                None => {
                    let depth = if at.kind == TextureKind::D3 { factor[2] } else { 1 };
                    TextureDesc {
                        width: at.width.div_ceil(factor[0].max(1)),
                        height: at.height.div_ceil(factor[1].max(1)),
                        layers: at.layers.div_ceil(depth.max(1)),
                        ..at.clone()
                    }
                }
            };
            let done = match next.tiles {
                Some(t) => t.edge <= until,
                None => {
                    next.width <= until
                        && next.height <= until
                        && (next.kind != TextureKind::D3 || next.layers <= until)
                }
            };
            if next == at && !done {
                let d = Diagnostic::error("the reduction never reaches its end: a factor is 1").at(span, "");
                self.faults.push(d);
                return None;
            }
            stages.push(next.clone());
            at = next;
            if done {
                return Some(stages);
            }
        }
    }

    /// The tiling of a reduction's present source and target.
    pub(super) fn stage_facts(&self, stage: &BTreeMap<&str, ResourceId>, extra: &mut Values) {
        for (variable, id) in stage {
            if let Desc::Texture(TextureDesc { tiles: Some(t), .. }) = &self.out.resources[id.0].desc {
                for (suffix, n) in [("tile", t.edge), ("columns", t.columns), ("count", t.count)] {
                    if let Some(v) = extra.get_mut(&format!("{variable}_{suffix}")) {
                        *v = Value::Uint(n);
                    }
                }
            }
        }
    }
}

/// Elements that a workgroup sums up, as `scan.wgsl` has it.
const BLOCK: u32 = 2048;

/// The stages over so many elements.
fn stages(count: u32) -> &'static [ScanStage] {
    if count > BLOCK { &[ScanStage::AddUp, ScanStage::Before, ScanStage::Place] } else { &[ScanStage::Alone] }
}

impl Wirer<'_, '_> {
    /// The plan's shaders of the stages. `None` after a fault.
    pub(super) fn scan(&mut self, from: &Name, to: &Name) -> Option<Vec<usize>> {
        let mut floats = vec![];
        let mut sized = vec![];
        for name in [from, to] {
            let size = self.sizes.of(&name.value)?;
            sized.push(self.keep(size)?);
            let declared = self.sizes.declared(&name.value)?;
            let ResourceKind::Buffer { stride, .. } = &declared.kind else { return None };
            let element = if let Stride::Of(element) = stride { element.value.as_str() } else { "" };
            if !["u32", "i32", "f32"].contains(&element) {
                let d =
                    Diagnostic::error(format!("sums are of `u32`, `i32` or `f32`, not of what `{}` has", name.value));
                let d = d.at(&name.span, "").at(&declared.span, "declared here");
                self.faults.push(d.help("declare it as `Buffer(element: \"u32\", …)`"));
                return None;
            }
            floats.push(element == "f32");
        }
        if floats[0] != floats[1] {
            let kind = |floats: bool| if floats { "floats" } else { "integers" };
            let d = Diagnostic::error(format!("sums of {} in a buffer of {}", kind(floats[0]), kind(floats[1])));
            self.faults.push(d.at(&to.span, "").at(&from.span, "").help("give both buffers the same `element`"));
            return None;
        }
        if sized[1].elements < sized[0].elements {
            let (n, has) = (sized[0].elements, sized[1].elements);
            let d = Diagnostic::error(format!("`{}` has {has} elements for {n} sums", to.value)).at(&to.span, "");
            self.faults.push(d.at(&from.span, "").help(format!("declare it with `count: \"{}\"`", from.value)));
            return None;
        }
        stages(sized[0].elements).iter().map(|stage| Some(self.built_in(BuiltIn::Scan(*stage, floats[0]))?.0)).collect()
    }
}

impl Expander<'_, '_> {
    /// Adds the steps of prefix sums.
    pub(super) fn scan(&mut self, w: &Wired, member: u32, name: &str) -> Option<()> {
        let PassKind::Scan { from, to, inclusive } = &w.pass.kind else { return None };
        let count = self.sizes.of(&from.value)?;
        let count = self.keep(count)?.elements;
        let blocks = count.div_ceil(BLOCK);
        let (source, result) = (self.id(&from.value, member, &from.span)?, self.id(&to.value, member, &to.span)?);
        self.usage(source, How::Storage);
        self.usage(result, How::Storage);
        let sums = match blocks {
            1 => None,
            _ => {
                let usage = wgpu_types::BufferUsages::STORAGE;
                let sums = Desc::Buffer { size: 4 * u64::from(blocks), usage };
                Some(self.made((format!("{name}.sums"), sums), &w.pass.span)?)
            }
        };
        let values = [("count", count), ("inclusive", u32::from(*inclusive)), ("blocks", blocks)];
        let extra: Values = values.into_iter().map(|(name, n)| (name.to_owned(), Value::Uint(n))).collect();
        let across = blocks.min(self.limits.max_compute_workgroups_per_dimension);
        let shaders = self.shaders;
        for (i, (shader, stage)) in w.scan.iter().copied().zip(stages(count)).enumerate() {
            let mut bindings = vec![];
            for v in &shaders[shader].interface.variables {
                bindings.push(match (&v.kind, v.name.as_str()) {
                    (BindingKind::Uniform(layout), _) => {
                        Binding::Uniform { layout: layout.clone(), extra: extra.clone() }
                    }
                    (_, "source") => Binding::Resource(source),
                    (_, "result") => Binding::Resource(result),
                    _ => Binding::Resource(sums?),
                });
            }
            let of_blocks = || sums.into_iter().collect();
            let (reads, writes) = match stage {
                ScanStage::AddUp => (vec![source], of_blocks()),
                ScanStage::Before => (of_blocks(), of_blocks()),
                ScanStage::Place | ScanStage::Alone => (std::iter::once(source).chain(sums).collect(), vec![result]),
            };
            let groups = if *stage == ScanStage::Before { [1; 3] } else { [across, blocks.div_ceil(across), 1] };
            let name = if blocks > 1 { format!("{name}.{i}") } else { name.to_string() };
            self.dispatch(w, name, (shader, groups), (bindings, reads, writes))?;
        }
        Some(())
    }
}
