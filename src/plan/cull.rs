//! Culls draws over many views: adds a step before each that lists what every member sees.

use super::expand::Expander;
use super::shaders::BuiltIn;
use super::wire::{How, Mode, ResourceUse, Wire, Wired, Wirer};
use super::{Binding, Cull, Desc, DrawMember, Frusta, Indirect, ResourceId};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Name, Raster};
use crate::scene::{self, TableKind};
use crate::shader::BindingKind;
use crate::value::{Value, Values};

/// Bytes of a `mat4x4f`.
const FRUSTUM_BYTES: u64 = 64;

/// Draws of one member and part at most. More find gaps between clusters better, and cost time where they are empty.
const MOST_DRAWS_EACH: u32 = 64;

/// Triangles of the scene to a draw at least: to begin a draw takes a driver as long as so many triangles out of sight.
const LEAST_TRIANGLES_A_DRAW: u32 = 128;

/// Draws that a workgroup of the shader finds.
const DRAWS_A_WORKGROUP: u32 = 8;

/// Bytes of the arguments of an indexed indirect draw.
pub const DRAW_BYTES: u64 = 20;

/// The step before a draw, wired.
pub struct Culling {
    shader: usize,
    bindings: Vec<Wire>,
    /// Which of the bindings are the frusta.
    frusta: usize,
}

/// The triangles of the draws in a buffer of them.
pub fn triangles(draws: &[u8]) -> u64 {
    let word = |draw: &[u8], i: usize| {
        draw.get(4 * i..4 * i + 4).and_then(|b| b.try_into().ok()).map_or(0, |b| u64::from(u32::from_le_bytes(b)))
    };
    draws.chunks_exact(DRAW_BYTES as usize).map(|d| word(d, 0) / 3 * word(d, 1)).sum()
}

/// Whether a resource is a buffer of frusta for so many members.
///
/// # Errors
/// It is none, or too small.
pub(super) fn holds_frusta(name: &Name, desc: &Desc, members: u32) -> Result<(), Diagnostic> {
    let size = if let Desc::Buffer { size, .. } = desc { *size } else { 0 };
    if size >= FRUSTUM_BYTES * u64::from(members) {
        return Ok(());
    }
    let d = Diagnostic::error(format!("`{}` has {size} bytes for the frusta of {members} members", name.value));
    let help = format!("declare it as `Buffer(stride: {FRUSTUM_BYTES}, count: …)` with one `mat4x4f` a member");
    Err(d.at(&name.span, format!("each takes {FRUSTUM_BYTES}")).help(help))
}

impl<'g> Wirer<'g, '_> {
    /// Wires the step that finds what each member sees. `None` after a fault, and for adapters that can't begin an
    /// indirect draw at a member's number: there everything is drawn, which gives the same image.
    pub(super) fn culling(&mut self, wired: &mut Wired<'g>, frusta: &Name) -> Option<Culling> {
        if !self.request.features.contains(wgpu_types::Features::INDIRECT_FIRST_INSTANCE) {
            return None;
        }
        let (index, shader) = self.built_in(BuiltIn::Cull)?;
        let mut bindings = vec![];
        for v in &shader.interface.variables {
            bindings.push(match (&v.kind, v.name.as_str()) {
                (BindingKind::Uniform(layout), _) => {
                    Wire::Fixed(Binding::Uniform { layout: layout.clone(), extra: Values::new() })
                }
                (_, "draws") => Wire::Result,
                (_, "frusta") if !scene::frustum_tables().any(|t| t == frusta.value) => self.frusta(wired, frusta)?,
                (_, name) => {
                    let name = if name == "frusta" { frusta.value.as_str() } else { name };
                    let TableKind { name: table, columns, .. } = scene::table(name)?;
                    self.table(&shader, wired.pass, v, table, columns, &frusta.span)?
                }
            });
        }
        let place = |name: &str| shader.interface.variables.iter().position(|v| v.name == name);
        let frusta = place("frusta")?;
        Some(Culling { shader: index, bindings, frusta })
    }

    fn frusta(&mut self, wired: &mut Wired<'g>, name: &Name) -> Option<Wire> {
        let sized = self.sizes.of(&name.value)?;
        let sized = self.keep(sized)?;
        if let Err(d) = holds_frusta(name, &sized.desc, wired.each.unwrap_or(1)) {
            self.faults.push(d);
            return None;
        }
        wired.uses.push(ResourceUse {
            mip: None,
            resource: name.value.clone(),
            mode: Mode::Read,
            how: How::Storage,
            span: name.span.clone(),
        });
        Some(Wire::Resource(name.value.clone()))
    }
}

impl Expander<'_, '_> {
    /// Adds the step that fills the draws of these members, and says where they are.
    pub(super) fn culled(
        &mut self,
        w: &Wired,
        r: &Raster,
        name: &str,
        (members, level): (&[DrawMember], Option<usize>),
    ) -> Option<Indirect> {
        let culling = w.culling.as_ref()?;
        let number = |name: &str| match self.values.get(name) {
            Some(Value::Uint(n)) => *n,
            _ => 0,
        };
        let (first_cluster, all, one_sided, triangles) = match level.and_then(|i| self.levels.get(i)) {
            Some(l) => (l.first_cluster, l.clusters, l.one_sided_clusters, l.triangles),
            None => (0, number("clusters"), number("one_sided_clusters"), number("triangles")),
        };
        // Only there do both sides differ in what draws them.
        let first = if r.cull == Cull::Material { one_sided.min(all) } else { all };
        let worthwhile = triangles.div_ceil(LEAST_TRIANGLES_A_DRAW).clamp(1, MOST_DRAWS_EACH);
        let parts = [first, all - first].map(|n| (n, n.min(worthwhile)));
        let rows = members.len() as u32;
        let draws = (parts[0].1 + parts[1].1).max(1);
        let buffer = self.draws(name, u64::from(rows) * u64::from(draws) * DRAW_BYTES, &w.pass.span)?;
        let values = [
            ("members", rows),
            ("first_cluster", first_cluster),
            ("first_member", members.first().map_or(0, |m| m.index)),
            ("first_clusters", parts[0].0),
            ("first_draws", draws - parts[1].1),
            ("second_clusters", parts[1].0),
            ("second_draws", parts[1].1),
            ("occluders", r.occluders.into()),
        ];
        let extra: Values = values.into_iter().map(|(name, n)| (name.to_owned(), Value::Uint(n))).collect();
        let mut bindings = vec![];
        let mut reads = vec![];
        for wire in &culling.bindings {
            bindings.push(match wire {
                Wire::Resource(frusta) => {
                    let id = self.id(frusta, 0, &w.pass.span)?;
                    reads.push(id);
                    Binding::Resource(id)
                }
                Wire::Fixed(Binding::Uniform { layout, .. }) => {
                    Binding::Uniform { layout: layout.clone(), extra: extra.clone() }
                }
                Wire::Fixed(other) => other.clone(),
                Wire::Level(..) => return None,
                Wire::Source | Wire::Result => Binding::Resource(buffer),
            });
        }
        let frusta = match bindings.get(culling.frusta)? {
            Binding::Table(i) => Frusta::Table(*i),
            Binding::Resource(id) => Frusta::Buffer(*id),
            Binding::Level(..)
            | Binding::Uniform { .. }
            | Binding::SceneTextures
            | Binding::Sampler(_)
            | Binding::Report
            | Binding::Instances => return None,
        };
        let groups = (rows.checked_mul(draws)?).div_ceil(DRAWS_A_WORKGROUP);
        let across = groups.clamp(1, self.limits.max_compute_workgroups_per_dimension);
        let groups = [across, groups.div_ceil(across), 1];
        self.dispatch(w, format!("{name}.cull"), (culling.shader, groups), (bindings, reads, vec![buffer]))?;
        let [first, second] = [draws - parts[1].1, parts[1].1];
        let clusters = [first_cluster, parts[0].0, parts[1].0];
        Some(Indirect { buffer, first, second, frusta, occluders: r.occluders, clusters })
    }

    fn draws(&mut self, name: &str, size: u64, span: &Span) -> Option<ResourceId> {
        use wgpu_types::BufferUsages as U;
        // It can be read back: how much was drawn is part of a frame's statistics.
        let usage = U::STORAGE | U::INDIRECT | U::COPY_SRC;
        self.made((format!("{name}.draws"), Desc::Buffer { size, usage }), span)
    }
}
