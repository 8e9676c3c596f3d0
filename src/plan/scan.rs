//! Prefix sums to stages: the sums of blocks, sums over these, sums within blocks. Three steps for any count, one for
//! few.

use super::built_in::{BuiltIn, ScanStage};
use super::expand::Expander;
use super::wire::{How, Wired, Wirer};
use super::{Binding, Desc};
use crate::diag::Diagnostic;
use crate::graph::ast::{Name, PassKind, ResourceKind, Stride};
use crate::shader::BindingKind;
use crate::value::{Value, Values};

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
