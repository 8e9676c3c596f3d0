//! Passes that do as much as a buffer says: a step before them bounds the counts by what the pass allows.

use super::built_in::BuiltIn;
use super::expand::Expander;
use super::wire::{How, Mode, Wired, Wirer, by_name};
use super::{Binding, Desc, ResourceId};
use crate::diag::Diagnostic;
use crate::graph::ast::{Name, PassKind};
use crate::shader::BindingKind;
use crate::value::{Value, Values};

/// The step before a pass, wired.
pub struct Counts<'g> {
    shader: usize,
    /// The buffer.
    name: &'g Name,
}

/// The most that a pass does.
pub(super) enum Most {
    Groups([u32; 3]),
    Vertices { count: u32, instances: u32 },
}

impl<'g> Wirer<'g, '_> {
    /// Wires the step that bounds the counts. `None` after a fault.
    pub(super) fn counts(&mut self, wired: &mut Wired<'g>, name: &'g Name) -> Option<Counts<'g>> {
        let sized = self.sizes.of(&name.value)?;
        let sized = self.keep(sized)?;
        let Desc::Buffer { size, .. } = sized.desc else { return None };
        let (words, of, what) = match wired.pass.kind {
            PassKind::Compute { .. } => (3, "workgroups along x, y and z", "dispatch"),
            _ => (4, "vertices, instances, the first vertex, the first instance", "draw"),
        };
        if size < 4 * words {
            let d = Diagnostic::error(format!(
                "`{}` has {size} bytes, the counts of a {what} take {}",
                name.value,
                4 * words
            ));
            let help = format!("declare it as `Buffer(element: \"u32\", count: {words})`: {of}");
            self.faults.push(d.at(&name.span, "").help(help));
            return None;
        }
        wired.uses.push(by_name(name, Mode::Read, How::Storage));
        let (shader, _) = self.built_in(BuiltIn::Bound)?;
        Some(Counts { shader, name })
    }
}

impl Expander<'_, '_> {
    /// Adds the step that bounds the counts, and says where they are then.
    pub(super) fn counted(&mut self, w: &Wired, counts: &Counts<'_>, name: &str, most: Most) -> Option<ResourceId> {
        let from = self.id(&counts.name.value, 0, &counts.name.span)?;
        let usage = wgpu_types::BufferUsages::STORAGE | wgpu_types::BufferUsages::INDIRECT;
        let (draw, [x, y, z]) = match most {
            Most::Groups(groups) => (false, groups),
            Most::Vertices { count, instances } => (true, [count, instances, 0]),
        };
        let size = if draw { 16 } else { 12 };
        let to = self.made((format!("{name}.counts"), Desc::Buffer { size, usage }), &w.pass.span)?;
        let offsets = self.features.contains(wgpu_types::Features::INDIRECT_FIRST_INSTANCE);
        let values = [("draw", draw.into()), ("most_x", x), ("most_y", y), ("most_z", z), ("offsets", offsets.into())];
        let extra: Values = values.into_iter().map(|(name, n)| (name.to_owned(), Value::Uint(n))).collect();
        let bindings =
            self.shaders[counts.shader].interface.variables.iter().map(|v| match (&v.kind, v.name.as_str()) {
                (BindingKind::Uniform(layout), _) => Binding::Uniform { layout: layout.clone(), extra: extra.clone() },
                (_, "counts") => Binding::Resource(from),
                _ => Binding::Resource(to),
            });
        let bindings = bindings.collect();
        self.dispatch(w, format!("{name}.bound"), (counts.shader, [1; 3]), (bindings, vec![from], vec![to]))?;
        Some(to)
    }
}
