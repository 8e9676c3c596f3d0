//! What a compute pass goes over, in workgroups.

use super::Desc;
use super::expand::Expander;
use super::wire::{How, Wired};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::Size;
use crate::graph::check::WORKGROUP;
use crate::graph::expr::{Expr, ExprKind, Val};
use crate::shader::Stage;
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
