//! Reductions to stages, with the textures between them.

use super::expand::{Expander, shape};
use super::request;
use super::wire::{How, Wired};
use super::{Desc, ResourceId, TextureDesc, TextureKind, Tiles};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::PassKind;
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
