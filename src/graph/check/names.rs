//! What a name in a pass may stand for: textures, buffers, levels, frusta.

use super::{Checker, ExprScope};
use crate::diag::Diagnostic;
use crate::graph::ast::{Name, ResourceKind, set_of};
use crate::graph::unroll::index_of;
use crate::scene::frustum_tables;

impl<'g> Checker<'g> {
    /// A buffer, or a table that has frusta.
    pub(super) fn frusta(&mut self, name: &Name) {
        let tables: Vec<&str> = frustum_tables().collect();
        let buffer = |(_, kind): &(&&'g str, &&'g ResourceKind)| matches!(kind, ResourceKind::Buffer { .. });
        if tables.contains(&name.value.as_str())
            || matches!(self.resources.get(name.value.as_str()), Some(ResourceKind::Buffer { .. }))
        {
            return;
        }
        let near: Vec<&str> = self.resources.iter().filter(buffer).map(|(n, _)| *n).chain(tables.clone()).collect();
        let d = Diagnostic::error(format!("`{}` holds no frusta", name.value))
            .at(&name.span, "")
            .nearest(&name.value, near);
        self.faults.push(d.help(format!("name a buffer of one `mat4x4f` a member, or a table: {}", tables.join(", "))));
    }

    /// What a name stands for; of a set, where it names a member, which one is checked too.
    pub(super) fn kind_of(&mut self, name: &Name) -> Option<&'g ResourceKind> {
        let set = set_of(&name.value);
        let kind = self.resources.get(set).copied();
        if set != name.value {
            if kind.is_some() && !self.sets.contains(set) {
                let d = Diagnostic::error(format!("`{set}` is no set, so it has no members")).at(&name.span, "");
                self.faults.push(d.help("declare it with `members`, or leave the number out"));
            }
            // Its place and text hold what the file says.
            if let Ok(index) = index_of(name) {
                self.names(&index, ExprScope::Values);
            }
        }
        kind
    }

    pub(super) fn resource_name(&mut self, name: &Name, noun: &str) {
        match self.kind_of(name) {
            None => {
                let d = Diagnostic::error(format!("unknown resource `{}`", name.value)).at(&name.span, "");
                self.faults.push(d.nearest(&name.value, self.resources.keys().copied()));
            }
            Some(kind @ (ResourceKind::Sampler(_) | ResourceKind::Table { .. })) if noun != "a binding" => {
                let is = if matches!(kind, ResourceKind::Sampler(_)) { "a sampler" } else { "a table of the scene" };
                let d = Diagnostic::error(format!("`{}` is {is}, it can't be {noun}", name.value));
                self.faults.push(d.at(&name.span, ""));
            }
            Some(_) => {}
        }
    }

    /// A texture with levels that can be drawn one from the other.
    pub(super) fn levels_of(&mut self, name: &Name) {
        if self.texture_name(name, "halved").is_none() {
            return;
        }
        let fault = match self.kind_of(name) {
            Some(ResourceKind::Texture { mips: Some(_), .. } | ResourceKind::Cube { mips: Some(_), .. }) => return,
            Some(ResourceKind::Texture { .. } | ResourceKind::Cube { .. }) => {
                let d = Diagnostic::error(format!("`{}` has one level only", name.value)).at(&name.span, "");
                d.help("declare it with `mips`: how many it has")
            }
            _ => {
                let d = Diagnostic::error(format!("`{}` is neither a `Texture` nor a `Cube`", name.value));
                d.at(&name.span, "").help("write its levels one by one: `bind: {\"…\": (of: \"…\", mip: \"level\")}`")
            }
        };
        self.faults.push(fault);
    }

    pub(super) fn buffer_name(&mut self, name: &Name, noun: &str) {
        match self.kind_of(name) {
            None | Some(ResourceKind::Sampler(_) | ResourceKind::Table { .. }) => self.resource_name(name, noun),
            Some(ResourceKind::Buffer { .. }) => {}
            Some(_) => {
                let d = Diagnostic::error(format!("`{}` is a texture, it can't be {noun}", name.value));
                self.faults.push(d.at(&name.span, "").help("declare it as `Buffer`"));
            }
        }
    }

    /// The format of a texture resource; a fault when it is none.
    pub(super) fn texture_name(&mut self, name: &Name, noun: &str) -> Option<wgpu_types::TextureFormat> {
        match self.kind_of(name) {
            Some(ResourceKind::Buffer { .. }) => {
                let d = Diagnostic::error(format!("`{}` is a buffer, it can't be {noun}", name.value));
                self.faults.push(d.at(&name.span, ""));
                None
            }
            Some(
                ResourceKind::Texture { format, .. }
                | ResourceKind::Texture3d { format, .. }
                | ResourceKind::Cube { format, .. }
                | ResourceKind::Atlas { format, .. },
            ) => Some(*format),
            Some(ResourceKind::Image(image)) => Some(image.format),
            _ => {
                self.resource_name(name, noun);
                None
            }
        }
    }
}
