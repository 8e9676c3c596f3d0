//! Resolves the members of a uniform by name: parameters, frame values, loop indices, values of the pass, properties
//! of the atlases it binds.

use super::wire::{Wired, Wirer};
use super::{Binding, Desc};
use crate::diag::Diagnostic;
use crate::graph::ast::{PassKind, ResourceKind};
use crate::scene::FRAME_VALUES;
use crate::shader::{Layout, Shader};
use crate::value::{Type, Value, Values};
use std::sync::Arc;

impl<'g> Wirer<'g, '_> {
    /// A uniform's members, each a value by name. A renamed plain value asks for its new name.
    pub(super) fn uniform(
        &mut self,
        wired: &Wired<'g>,
        shader: &Shader,
        layout: &Arc<Layout>,
        variable: &str,
        target: &str,
    ) -> Option<Binding> {
        let mut extra = self.atlas_facts(wired, shader);
        extra.extend(self.set_values(wired));
        let indices = wired.pass.indices.iter();
        let index = |name: &str| indices.clone().rev().find(|(n, _)| n == name).map(|(_, i)| Value::Uint(*i));
        let pass = wired.pass;
        let whole = |name: &str| match name {
            name if extra.contains_key(name) || name == "member" => None,
            name if name == variable => Some(target.to_string()),
            name => Some(pass.target(name).0),
        };
        let mut layout = layout.clone();
        for (i, new) in layout.members.iter().map(|m| whole(&m.name)).enumerate().collect::<Vec<_>>() {
            if let Some(new) = new.filter(|new| *new != layout.members[i].name) {
                Arc::make_mut(&mut layout).members[i].name = new;
            }
        }
        let mut good = true;
        for m in &layout.members {
            if m.name == "member" && wired.each.is_some() {
                extra.insert("member".into(), Value::Uint(0));
            }
            if let Some(index) = index(&m.name).filter(|_| !extra.contains_key(&m.name)) {
                extra.insert(m.name.clone(), index);
            }
            let ty = extra.get(&m.name).or_else(|| self.values.get(&m.name)).map(|v| (v.ty(), v.cast(m.ty).is_some()));
            let ty = ty.or_else(|| wired.loops.contains(&m.name).then_some((Type::Uint, castable(Type::Uint, m.ty))));
            let frame = || FRAME_VALUES.iter().find(|f| f.0 == m.name).map(|f| (f.1, castable(f.1, m.ty)));
            match ty.or_else(frame) {
                Some((_, true)) => {}
                Some((ty, false)) => {
                    let d = Diagnostic::error(format!(
                        "`{}` is of type {}, the shader wants {}",
                        m.name,
                        ty.wgsl(),
                        m.ty.wgsl()
                    ));
                    let span = self.locate(wired.pass, shader, &m.name);
                    self.faults.push(d.at(&span, ""));
                    good = false;
                }
                None => {
                    let span = self.locate(wired.pass, shader, &m.name);
                    let d = Diagnostic::error(format!("no parameter or value is called `{}`", m.name)).at(&span, "");
                    let names = self.values.keys().map(String::as_str).chain(FRAME_VALUES.iter().map(|f| f.0));
                    let names: Vec<&str> = names.chain(wired.loops.iter().map(String::as_str)).collect();
                    let d = d.nearest(&m.name, names);
                    if !self.faults.contains(&d) {
                        self.faults.push(d);
                    }
                    good = false;
                }
            }
        }
        extra.retain(|name, _| layout.members.iter().any(|m| m.name == *name));
        good.then_some(Binding::Uniform { layout, extra })
    }

    /// What a pass sets by itself.
    fn set_values(&mut self, wired: &Wired<'g>) -> Values {
        let mut values = Values::new();
        for (name, e) in &wired.pass.set {
            let value = e.eval(&|n| self.value(n)).and_then(|v| {
                let fault = || Diagnostic::error(format!("`{}` doesn't fit 32 bits", name.value)).at(&e.span, "");
                v.to_value().ok_or_else(fault)
            });
            if let Some(value) = self.keep(value) {
                values.insert(name.value.clone(), value);
            }
        }
        values
    }

    /// `v_tile`, `v_columns`, `v_count` of the atlases bound to variables.
    fn atlas_facts(&self, wired: &Wired<'g>, shader: &Shader) -> Values {
        let mut facts = Values::new();
        for v in &shader.interface.variables {
            let target = wired.pass.target(&v.name).0;
            let resource = match &wired.pass.kind {
                PassKind::Reduce { from, .. } if v.name == "source" => &from.value,
                PassKind::Reduce { to, .. } if v.name == "result" => &to.value,
                _ => &target,
            };
            let atlas = self.sizes.declared(resource).is_some_and(|r| matches!(r.kind, ResourceKind::Atlas { .. }));
            if atlas
                && let Some(Ok(sized)) = self.sizes.of(resource)
                && let Desc::Texture(t) = &sized.desc
                && let Some(tiles) = t.tiles
            {
                for (suffix, n) in [("tile", tiles.edge), ("columns", tiles.columns), ("count", tiles.count)] {
                    facts.insert(format!("{}_{suffix}", v.name), Value::Uint(n));
                }
            }
        }
        facts
    }
}

/// Whether a uniform may hold a value of another type, converted.
pub(super) fn castable(from: Type, to: Type) -> bool {
    from == to
        || matches!(
            (from, to),
            (Type::Bool, Type::Uint | Type::Int)
                | (Type::Uint, Type::Int | Type::Float)
                | (Type::Int, Type::Uint | Type::Float)
                | (Type::UVec2, Type::Vec2)
                | (Type::UVec3, Type::Vec3)
        )
}
