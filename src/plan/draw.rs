//! Resolves what draw and screen passes render to (targets, layers, tiles) and which part of the scene a draw takes,
//! at which level of detail.

use super::dispatch::Most;
use super::expand::Expander;
use super::partial::frames;
use super::request::{Request, tolerance, values};
use super::wire::Wired;
use super::{
    ColorTarget, Cull, DepthTarget, Desc, Draw, DrawGeometry, DrawMember, Place, Resource, ResourceId, TextureDesc,
    TextureKind, Values, request,
};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::graph::ast::{Name, PassKind, Raster, Vertices, walk};
use crate::graph::check::material_columns;
use crate::graph::expr::{Expr, Val};
use crate::scene::{Column, Level, Scene, Table, Taken};
use crate::shader::Stage;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Whether some members of a draw can be drawn again while what the others drew stays: each has a tile or a layer of
/// its own in every target, all of which begin at their clear values.
pub(super) fn splits(resources: &[Resource], draw: &Draw) -> bool {
    let clears = |t: &ColorTarget| t.clear.is_some();
    let fresh = |t: &DepthTarget| t.clear.is_some() && t.write;
    let targets = || draw.color.iter().map(|t| t.resource).chain(draw.depth.iter().map(|t| t.resource));
    let room = |id: ResourceId, place: &Place| match (&resources[id.0].desc, place) {
        (Desc::Texture(TextureDesc { tiles, .. }), Place::Rect(_)) => tiles.is_some(),
        (Desc::Texture(TextureDesc { layers, .. }), Place::Layer(layer)) => layer < layers,
        _ => false,
    };
    let places: BTreeSet<Place> = draw.members.iter().map(|m| m.place).collect();
    draw.views == 1
        && draw.color.iter().all(clears)
        && draw.depth.iter().all(fresh)
        && places.len() == draw.members.len()
        && targets().all(|id| places.iter().all(|p| room(id, p)))
}

impl Expander<'_, '_> {
    /// The render pass of a draw or screen pass: targets and the place of each member.
    pub(super) fn draw(&mut self, w: &Wired, r: &Raster, name: &str, member: u32, batched: bool) -> Option<Draw> {
        let index = w.shader?;
        let interface = &self.shaders[index].interface;
        let geometry = match w.pass.kind {
            PassKind::Draw(_) => match &r.vertices {
                Some(vertices) => self.vertices(w, vertices, r.cull, name)?,
                None => DrawGeometry::Scene { cull: r.cull },
            },
            _ => DrawGeometry::Screen,
        };
        let screen = geometry == DrawGeometry::Screen;
        let vertex = if screen { None } else { Some(interface.entry(Stage::Vertex)?.name.clone()) };
        let fragment = interface.entry(Stage::Fragment).map(|e| e.name.clone());
        let clear_of = |name: &str| r.clear.iter().find(|c| c.0.value == name).map(|c| c.1);
        let loads = |name: &str| r.load.iter().any(|n| n.value == name);
        let mut color = vec![];
        let mut extents: Vec<(ResourceId, String)> = vec![];
        let mut mips = vec![];
        let mut samples = 1;
        for (location, name, mip) in &w.color {
            let id = self.id(name, member, &w.pass.span)?;
            let clear = (!loads(name)).then(|| clear_of(name).unwrap_or([0.0; 4]));
            let resolve = match w.resolve.iter().find(|(at, _)| at == location) {
                Some((_, to)) => Some(self.id(to, member, &w.pass.span)?),
                None => None,
            };
            let Desc::Texture(t) = &self.out.resources[id.0].desc else { return None };
            samples = t.samples;
            color.push(ColorTarget {
                resource: id,
                mip: *mip,
                location: *location,
                format: t.format,
                clear,
                blend: r.blend.iter().find(|b| b.0.value == *name).map(|b| b.1),
                resolve,
            });
            extents.push((id, name.clone()));
            mips.push(*mip);
        }
        let mut depth = None;
        if let Some(name) = &r.depth {
            let id = self.id(&name.value, member, &name.span)?;
            let Desc::Texture(t) = &self.out.resources[id.0].desc else { return None };
            samples = t.samples;
            let clear = (!loads(&name.value)).then(|| clear_of(&name.value).map_or(1.0, |c| c[0] as f32));
            depth = Some(DepthTarget {
                resource: id,
                format: t.format,
                clear,
                compare: r.depth_compare,
                write: r.depth_write,
            });
            extents.push((id, name.value.clone()));
            mips.push(0);
        }
        let views = self.views(r, &extents)?;
        let members = self.places(w, r, member, (batched, views), (&extents, &mips))?;
        let asked = part_of(r, self.values);
        let asked = self.keep(asked)?;
        let level = asked.and_then(|asked| self.asked.iter().position(|a| *a == asked));
        let level = level.filter(|i| *i < self.levels.len());
        let indirect = match w.culling {
            Some(_) => Some(self.culled(w, r, name, (&members, level))?),
            None => None,
        };
        let shader = index;
        Some(Draw { shader, vertex, fragment, geometry, color, depth, members, indirect, samples, views, level })
    }

    /// How many vertices and instances a draw without the scene has.
    fn vertices(&mut self, w: &Wired, v: &Vertices, cull: Cull, name: &str) -> Option<DrawGeometry> {
        let count = request::count(&v.count, self.values, "a number of vertices");
        let count = self.keep(count)?;
        let instances = match &v.instances {
            Some(instances) => {
                let instances = request::count(instances, self.values, "a number of instances");
                self.keep(instances)?
            }
            None => 1,
        };
        if count.checked_mul(instances).is_none() {
            let d = Diagnostic::error(format!("{instances} instances of {count} vertices are beyond 32 bits"));
            self.faults.push(d.at(&v.count.span, "").help("draw fewer, or in several passes"));
            return None;
        }
        let indirect = match &w.counts {
            Some(counts) => Some(self.counted(w, counts, name, Most::Vertices { count, instances })?),
            None => None,
        };
        Some(DrawGeometry::Vertices { count, instances, topology: v.topology, cull, indirect })
    }

    /// Layers that each member draws to at once: what the adapter can do, and the targets hold.
    fn views(&mut self, r: &Raster, targets: &[(ResourceId, String)]) -> Option<u32> {
        let Some(expr) = &r.views else { return Some(1) };
        let views = request::count(expr, self.values, "a number of views");
        let views = self.keep(views)?;
        if !(2..=32).contains(&views) {
            let d = Diagnostic::error(format!("a pass has 2 to 32 views, this one {views}")).at(&expr.span, "");
            self.faults.push(d.help("leave `views` out to draw to one layer at a time"));
            return None;
        }
        let able = self.features.contains(wgpu_types::Features::MULTIVIEW);
        let most = if able { self.limits.max_multiview_view_count } else { 1 };
        if views > most {
            let d =
                Diagnostic::error(format!("the adapter draws to at most {most} views at once, the pass to {views}"));
            let d = d.at(&expr.span, "");
            self.faults.push(d.help("draw to one layer at a time: without `views`, and with `each` times as many"));
            return None;
        }
        for (id, name) in targets {
            let layered = matches!(&self.out.resources[id.0].desc, Desc::Texture(t) if t.tiles.is_none()
                && t.kind == (TextureKind::D2 { array: true }) && t.layers >= views);
            if !layered {
                let d = Diagnostic::error(format!("`{name}` does not have the layers that {views} views draw to"));
                let d = d.at(&expr.span, "");
                self.faults.push(d.help(format!("make it a `Texture` with `layers` of {views} for each member")));
                return None;
            }
        }
        Some(views)
    }

    fn places(
        &mut self,
        w: &Wired,
        r: &Raster,
        member: u32,
        (batched, views): (bool, u32),
        (targets, mips): (&[(ResourceId, String)], &[u32]),
    ) -> Option<Vec<DrawMember>> {
        let texture = |i: usize| match &self.out.resources[targets.get(i)?.0.0].desc {
            Desc::Texture(t) => {
                let [width, height, layers] = t.level(mips.get(i).copied().unwrap_or(0));
                Some(TextureDesc { width, height, layers, ..t.clone() })
            }
            Desc::Buffer { .. } => None,
        };
        let first = texture(0)?;
        for (i, (_, name)) in targets.iter().enumerate().skip(1) {
            let t = texture(i)?;
            if (t.width, t.height, t.tiles) != (first.width, first.height, first.tiles) {
                let d = Diagnostic::error(format!("the targets `{}` and `{name}` differ in size", targets[0].1));
                let d =
                    d.at(&w.pass.name.span, format!("{}×{} and {}×{}", first.width, first.height, t.width, t.height));
                self.faults.push(d);
                return None;
            }
        }
        let indices = if batched { 0..w.each.unwrap_or(1) } else { member..member + 1 };
        if let Some(layer) = &r.layer {
            let place = self.layer(w, layer, &first)?;
            return Some(indices.map(|index| DrawMember { index, place }).collect());
        }
        let room = match first.tiles {
            Some(t) => Some(t.count),
            None if first.kind == (TextureKind::D2 { array: false }) => None,
            None => Some(first.layers),
        };
        if let Some(room) = room
            && batched
        {
            let n = w.each.unwrap_or(1).saturating_mul(views);
            let what = if first.tiles.is_some() { "tiles" } else { "layers" };
            if n > room || w.each.is_none() && room > views {
                let d = Diagnostic::error(format!("`{}` has {room} {what}, the pass draws {n}", targets[0].1));
                self.faults
                    .push(d.at(&w.pass.name.span, "").help(format!("give the pass `each` of {room}, or `layer`")));
                return None;
            }
        }
        let place = |index: u32| match (first.tiles, first.kind) {
            (Some(t), _) if batched => {
                Place::Rect([index % t.columns * t.edge, index / t.columns * t.edge, t.edge, t.edge])
            }
            (None, TextureKind::D2 { array: true } | TextureKind::Cube { .. } | TextureKind::D3) => {
                Place::Layer(if batched { index * views } else { 0 })
            }
            _ => Place::Whole,
        };
        Some(indices.map(|index| DrawMember { index, place: place(index) }).collect())
    }

    /// A layer that is fixed, or the innermost loop's index plus a number.
    fn layer(&mut self, w: &Wired, layer: &Expr, target: &TextureDesc) -> Option<Place> {
        let inner = w.loops.last();
        let at = |i: i64| {
            layer.eval(&|n| {
                if Some(n) == inner.map(String::as_str) {
                    Some(Val::Int(i))
                } else {
                    self.values.get(n).map(|v| Val::from(*v))
                }
            })
        };
        let end = i64::from(self.counts.last().copied().unwrap_or(1)) - 1;
        let (a, b, last) = (at(0), at(1), at(end));
        let (a, b, last) = (self.keep(a)?, self.keep(b)?, self.keep(last)?);
        let place = match (&a, &b) {
            (Val::Int(x), Val::Int(y)) if x == y => {
                u32::try_from(*x).ok().filter(|x| *x < target.layers).map(Place::Layer)
            }
            (Val::Int(x), Val::Int(y)) if x.checked_add(1) == Some(*y) && last == Val::Int(x.saturating_add(end)) => {
                let last = x.saturating_add(end);
                if last >= target.layers.into() {
                    let d = Diagnostic::error(format!("the loop's last iteration draws to layer {last}"));
                    let d = d.at(&layer.span, format!("the target has {} layers", target.layers));
                    self.faults.push(d.help("give the target more layers, or the loop fewer iterations"));
                    return None;
                }
                u32::try_from(*x).ok().map(Place::LoopLayer)
            }
            _ => None,
        };
        if place.is_none() {
            let d = Diagnostic::error(
                "a layer is a number below the target's layers, or the innermost loop's index plus a number",
            );
            self.faults.push(d.at(&layer.span, format!("the target has {} layers", target.layers)));
        }
        place
    }
}

/// What a draw asks for, with all put in that is known without the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct PartRequest {
    tolerance: f32,
    materials: Option<Expr>,
    nodes: Vec<Name>,
}

/// What all draws that run ask for, each once, by tolerance; nothing where a plan will find faults.
pub fn asked_parts(request: &Request) -> Vec<PartRequest> {
    let Ok(values) = values(request) else { return vec![] };
    let value = |name: &str| values.get(name).map(|v| Val::from(*v));
    let mut all: Vec<PartRequest> = vec![];
    walk(&request.graph.passes, &mut |pass| {
        let runs = pass.when.as_ref().is_none_or(|when| matches!(frames(when, &value), Ok(Some(_))));
        if let PassKind::Draw(r) = &pass.kind
            && runs
            && let Ok(Some(asked)) = part_of(r, &values)
            && !all.contains(&asked)
        {
            all.push(asked);
        }
    });
    all.sort_by(|a, b| a.tolerance.total_cmp(&b.tolerance));
    all
}

/// What a draw asks for; `None`: the scene as it is.
///
/// # Errors
/// Its tolerance is no number of metres.
pub(super) fn part_of(r: &Raster, values: &Values) -> Result<Option<PartRequest>, Diagnostic> {
    let tolerance = tolerance(r, values)?;
    if tolerance.is_none() && r.materials.is_none() && r.nodes.is_empty() {
        return Ok(None);
    }
    let column = |name: &str| material_columns().any(|c| c == name);
    let known = |name: &str| if column(name) { None } else { values.get(name).map(|v| Val::from(*v)) };
    let mut materials = r.materials.clone();
    materials.iter_mut().for_each(|e| e.substitute(&known));
    Ok(Some(PartRequest { tolerance: tolerance.unwrap_or(0.0), materials, nodes: r.nodes.clone() }))
}

/// The parts of a scene that draws ask for, in that order.
///
/// # Errors
/// Nodes that the scene lacks, conditions that are none of its materials.
pub fn parts(asked: &[PartRequest], scene: &Scene) -> Checked<Vec<Arc<Level>>> {
    let (mut levels, mut faults) = (vec![], vec![]);
    for asked in asked {
        match taken(asked, scene) {
            Ok(taken) => levels.push(scene.part(&taken)),
            Err(d) => faults.push(d),
        }
    }
    Faults::check(faults, levels)
}

fn taken(asked: &PartRequest, scene: &Scene) -> Result<Taken, Diagnostic> {
    let materials = match &asked.materials {
        Some(when) => Some(materials(when, scene)?),
        None => None,
    };
    let nodes = if asked.nodes.is_empty() { None } else { Some(nodes(&asked.nodes, scene)?) };
    Ok(Taken { tolerance: asked.tolerance, materials, nodes })
}

/// By material: whether the condition holds.
fn materials(when: &Expr, scene: &Scene) -> Result<Vec<bool>, Diagnostic> {
    let tables = scene.tables_named(&scene.pose(0.0), |name| name == "materials");
    let Some(table) = tables.iter().find(|t| t.name == "materials") else { return Ok(vec![]) };
    (0..scene.materials.len()).map(|row| when.truth(&|name| cell(table, name, row))).collect()
}

fn cell(table: &Table, column: &str, row: usize) -> Option<Val> {
    let floats = |v: &[f32]| Val::Floats(v.iter().map(|x| f64::from(*x)).collect());
    Some(match table.column(column)? {
        Column::Uint(all) => Val::Int((*all.get(row)?).into()),
        Column::Float(all) => Val::Float((*all.get(row)?).into()),
        Column::Vec2(all) => floats(&all.get(row)?.to_array()),
        Column::Vec3(all) => floats(&all.get(row)?.to_array()),
        Column::Vec4(all) => floats(&all.get(row)?.to_array()),
        _ => return None,
    })
}

/// By node: whether it has one of these names, or lies below one that has.
fn nodes(names: &[Name], scene: &Scene) -> Result<Vec<bool>, Diagnostic> {
    for name in names {
        if scene.nodes.iter().all(|n| n.name != name.value) {
            let d = Diagnostic::error(format!("the scene `{}` has no node `{}`", scene.name, name.value));
            return Err(d.at(&name.span, "").nearest(&name.value, scene.nodes.iter().map(|n| n.name.as_str())));
        }
    }
    let mut taken: Vec<bool> = vec![];
    for node in &scene.nodes {
        let below = node.parent.is_some_and(|parent| taken.get(parent) == Some(&true));
        taken.push(below || names.iter().any(|name| name.value == node.name));
    }
    Ok(taken)
}
