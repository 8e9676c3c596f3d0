//! What draw and screen passes say: what they draw, to which targets, and how.

use super::ast::{Raster, Vertices};
use super::read::{Fields, Reader};
use crate::diag::Diagnostic;

/// Which sides of triangles a draw leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cull {
    None,
    Front,
    Back,
    /// As each material says: back faces are culled unless it is double sided.
    Material,
}

impl Reader {
    /// `vertices`, `instances`, `topology` and `indirect` of a draw without the scene.
    fn vertices(&mut self, f: &mut Fields) -> Option<Vertices> {
        let (count, instances, topology) = (f.get("vertices"), f.get("instances"), f.get("topology"));
        let indirect = f.get("indirect");
        let Some(count) = count else {
            for (name, node) in [("instances", instances), ("topology", topology), ("indirect", indirect)] {
                if let Some(node) = node {
                    let d = Diagnostic::error(format!("`{name}` without `vertices`")).at(&node.span, "");
                    self.fault(d.help("say how many vertices an instance has; a draw without them is of the scene"));
                }
            }
            return None;
        };
        for name in ["each", "only", "frusta", "occluders", "materials", "nodes", "tolerance"] {
            if let Some(node) = f.get(name) {
                let d = Diagnostic::error(format!("`{name}` in a draw that has `vertices` of its own"));
                let help = match name {
                    "each" => "its `instances` say how often it draws them",
                    _ => "leave one of them out: it is for draws of the scene",
                };
                self.fault(d.at(&node.span, "").at(&count.span, "").help(help));
            }
        }
        if let Some(node) = f.choice("cull").filter(|n| n.word() == Some("Material")) {
            let d = Diagnostic::error("vertices of a draw's own have no material").at(&node.span, "");
            self.fault(d.help("cull None, Front or Back"));
        }
        let instances = instances.map(|n| self.expr(n));
        use wgpu_types::PrimitiveTopology as T;
        let topologies = [
            ("Triangles", T::TriangleList),
            ("TriangleStrip", T::TriangleStrip),
            ("Lines", T::LineList),
            ("LineStrip", T::LineStrip),
            ("Points", T::PointList),
        ];
        let topology = self.word(topology, &topologies, T::TriangleList);
        let indirect = indirect.and_then(|n| self.name(n));
        Some(Vertices { count: self.expr(count)?, instances: instances.flatten(), topology, indirect })
    }

    pub(super) fn raster(&mut self, f: &mut Fields, geometry: bool) -> Option<Raster> {
        let shader = self.need(f, "shader").and_then(|n| self.text(n));
        let color = f.get("color").and_then(|n| self.name(n));
        let depth = f.get("depth").and_then(|n| self.name(n));
        let depth_compare = self.compare(f.get("depth_compare"), wgpu_types::CompareFunction::Less);
        let depth_write = self.bool(f.get("depth_write"), true);
        let culls = [("None", Cull::None), ("Front", Cull::Front), ("Back", Cull::Back), ("Material", Cull::Material)];
        let vertices = if geometry { self.vertices(f) } else { None };
        let usual = if geometry && vertices.is_none() { Cull::Material } else { Cull::None };
        let cull = if geometry { self.word(f.choice("cull"), &culls, usual) } else { usual };
        let frusta = if geometry { f.get("frusta").and_then(|n| self.name(n)) } else { None };
        let occluders = if geometry { f.get("occluders") } else { None };
        if let (None, Some(wanted)) = (&frusta, occluders) {
            let d = Diagnostic::error("nothing says what the members see").at(&wanted.span, "");
            self.fault(d.help("give the pass `frusta`"));
        }
        let occluders = self.bool(occluders, false);
        let materials = if geometry { f.get("materials").and_then(|n| self.expr(n)) } else { None };
        let nodes = if geometry { f.get("nodes") } else { None };
        let nodes = self.list(nodes).iter().filter_map(|n| self.text(n)).collect();
        let tolerance = if geometry { f.get("tolerance").and_then(|n| self.expr(n)) } else { None };
        let load = self.list(f.get("load")).iter().filter_map(|n| self.name(n)).collect();
        let clear = self.pairs(f.get("clear"), Reader::color);
        let component = |operation| wgpu_types::BlendComponent {
            src_factor: wgpu_types::BlendFactor::One,
            dst_factor: wgpu_types::BlendFactor::One,
            operation,
        };
        let same = |operation| wgpu_types::BlendState { color: component(operation), alpha: component(operation) };
        let blends = [
            ("Add", same(wgpu_types::BlendOperation::Add)),
            ("Max", same(wgpu_types::BlendOperation::Max)),
            ("Min", same(wgpu_types::BlendOperation::Min)),
            ("Alpha", wgpu_types::BlendState::ALPHA_BLENDING),
        ];
        let blend = self
            .pairs(f.get("blend"), |reader, n| Some(reader.word(Some(n), &blends, wgpu_types::BlendState::REPLACE)));
        let resolve = self.names(f.get("resolve"));
        let layer = f.get("layer").and_then(|n| self.expr(n));
        let views = f.get("views").and_then(|n| self.expr(n));
        Some(Raster {
            shader: shader?,
            color,
            depth,
            depth_compare,
            depth_write,
            vertices,
            frusta,
            occluders,
            cull,
            materials,
            nodes,
            tolerance,
            load,
            clear,
            resolve,
            blend,
            layer,
            views,
        })
    }
}
