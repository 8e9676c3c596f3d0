//! Counts the workgroups of a compute pass, or takes the count from a buffer. In the latter case, a step before the
//! pass clamps the count to what the pass allows.

use super::expand::Expander;
use super::shaders::BuiltIn;
use super::wire::{How, Mode, Wired, Wirer, by_name};
use super::{Binding, Desc, ResourceId};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Name, PassKind, Size};
use crate::graph::check::WORKGROUP;
use crate::graph::expr::{Expr, ExprKind, Val};
use crate::shader::{BindingKind, Stage};
use crate::value::{Value, Values};
use std::collections::BTreeSet;

impl Expander<'_, '_> {
    /// What a pass says that it goes over, with the size of its shader's workgroup put in.
    pub(super) fn said(&mut self, shader: usize, over: &Size) -> Option<Size> {
        let size = self.shaders[shader].interface.entry(Stage::Compute)?.workgroup_size.map(i64::from);
        let mut over = over.clone();
        let value = |name: &str| (name == WORKGROUP).then(|| Val::Ints(size.to_vec()));
        over.exprs_mut().iter_mut().for_each(|e| e.substitute(&value));
        Some(over)
    }

    /// The one resource that a pass writes, which it goes over where it says nothing else.
    pub(super) fn written(&mut self, w: &Wired, of_instances: bool) -> Option<Size> {
        let written: BTreeSet<&str> =
            w.uses.iter().filter(|u| u.how == How::Storage && u.mode.writes()).map(|u| u.resource.as_str()).collect();
        let span = &w.pass.name.span;
        match (Vec::from_iter(written).as_slice(), of_instances) {
            ([one], false) => Some(Size::One(Expr { span: span.clone(), kind: ExprKind::Name((*one).to_string()) })),
            (all, _) => {
                let name = &w.pass.name.value;
                let d = Diagnostic::error(format!("nothing says what `{name}` goes over")).at(span, "");
                let d = match all {
                    _ if of_instances => d.help("say what one instance takes: `over: (\"x\", \"y\")`"),
                    [] => d.help("it writes nothing; say how many invocations it has: `over: (\"x\", \"y\", \"z\")`"),
                    all => {
                        let names: Vec<String> = all.iter().map(|n| format!("`{n}`")).collect();
                        d.help(format!("it writes {}; say which: `over: \"{}\"`", names.join(" and "), all[0]))
                    }
                };
                self.faults.push(d.help("or that it is one workgroup: `over: \"workgroup_size\"`"));
                None
            }
        }
    }

    /// Workgroups over an extent.
    pub(super) fn groups(&mut self, shader: usize, over: &Size, span: &Span) -> Option<[u32; 3]> {
        let threads = match over {
            Size::One(Expr { kind: ExprKind::Name(name), span }) if self.sizes.declared(name).is_some() => {
                let Some(sized) = self.sizes.of(name) else {
                    self.faults.push(Diagnostic::error(format!("`{name}` has no extent")).at(span, ""));
                    return None;
                };
                let sized = self.keep(sized)?;
                match sized.desc {
                    Desc::Texture(t) => [t.width, t.height, t.layers],
                    Desc::Buffer { .. } => [sized.elements, 1, 1],
                }
            }
            Size::One(e) => {
                let value = e.eval(&|n| self.sizes.name(n));
                let axes = match self.keep(value)? {
                    Val::Ints(v) => v.len(),
                    _ => 1,
                };
                self.threads(over, axes)?
            }
            Size::Axes(axes, _) => self.threads(over, axes.len())?,
        };
        self.in_groups(shader, threads, span)
    }

    /// Workgroups of each instance of a dispatch.
    pub(super) fn groups_of_instances(
        &mut self,
        shader: usize,
        over: &Size,
        instances: u32,
        span: &Span,
    ) -> Option<[u32; 3]> {
        let [x, y, layers] = self.groups(shader, over, span)?;
        let [.., deep] = self.shaders[shader].interface.entry(Stage::Compute)?.workgroup_size;
        let most = self.limits.max_compute_workgroups_per_dimension;
        if layers > 1 || deep > 1 {
            let d = Diagnostic::error("an instance of a dispatch has one layer of workgroups").at(span, "");
            self.faults.push(d.help("give `over` and the workgroup two axes"));
            return None;
        }
        // Instances beyond the limit of one axis go on along another.
        if u64::from(instances.div_ceil(most)) * u64::from(x) > u64::from(most) {
            let what = format!("{instances} instances of {x} workgroups exceed the adapter's limit of {most} an axis");
            self.faults.push(Diagnostic::error(what).at(span, "").help("let each instance do more"));
            return None;
        }
        Some([x, y, 1])
    }

    fn threads(&mut self, over: &Size, axes: usize) -> Option<[u32; 3]> {
        let e = self.sizes.extent(over, axes);
        let e = self.keep(e)?;
        Some([e.first().copied()?, e.get(1).copied().unwrap_or(1), e.get(2).copied().unwrap_or(1)])
    }

    pub(super) fn in_groups(&mut self, shader: usize, threads: [u32; 3], span: &Span) -> Option<[u32; 3]> {
        let size = self.shaders[shader].interface.entry(Stage::Compute)?.workgroup_size;
        let groups = [0, 1, 2].map(|i| threads[i].div_ceil(size[i].max(1)));
        let most = self.limits.max_compute_workgroups_per_dimension;
        if groups.iter().any(|g| *g > most) {
            let d = Diagnostic::error(format!("{groups:?} workgroups exceed the adapter's limit of {most} an axis"));
            self.faults.push(d.at(span, "").help("choose a larger workgroup or a smaller size"));
            return None;
        }
        let (x, l) = (size, self.limits);
        let ours = x[0].saturating_mul(x[1]).saturating_mul(x[2]);
        if ours > l.max_compute_invocations_per_workgroup
            || x[0] > l.max_compute_workgroup_size_x
            || x[1] > l.max_compute_workgroup_size_y
            || x[2] > l.max_compute_workgroup_size_z
        {
            let most = l.max_compute_invocations_per_workgroup;
            let d =
                Diagnostic::error(format!("a workgroup of {size:?} exceeds the adapter's limit of {most} invocations"));
            self.faults.push(d.at(span, ""));
            return None;
        }
        Some(groups)
    }
}

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
