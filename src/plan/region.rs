//! Draws over many views, member by member: what each sees, so that each has a version of its own and only those whose
//! version is new are drawn again. No device.

use super::{
    Action, Binding, ColorTarget, DepthTarget, Desc, Draw, Frusta, Place, Plan, ResourceId, Step, TextureDesc,
};
use crate::scene::{Bounds, Column, Table};
use crate::value::Value;
use glam::{Mat4, Vec3, Vec4};
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

/// Whether some members of a draw can be drawn again while what the others drew stays: each has a tile or a layer of its own in
/// every target, all of which begin at their clear values.
pub fn splits(plan: &Plan, draw: &Draw) -> bool {
    let clears = |t: &ColorTarget| t.clear.is_some();
    let fresh = |t: &DepthTarget| t.clear.is_some() && t.write;
    let targets = || draw.color.iter().map(|t| t.resource).chain(draw.depth.iter().map(|t| t.resource));
    let room = |id: ResourceId, place: &Place| match (&plan.resources[id.0].desc, place) {
        (Desc::Texture(TextureDesc { tiles, .. }), Place::Rect(_)) => tiles.is_some(),
        (Desc::Texture(TextureDesc { layers, .. }), Place::Layer(layer)) => layer < layers,
        _ => false,
    };
    let places: BTreeSet<Place> = draw.members.iter().map(|m| m.place).collect();
    draw.indirect.is_some()
        && draw.views == 1
        && draw.color.iter().all(clears)
        && draw.depth.iter().all(fresh)
        && places.len() == draw.members.len()
        && targets().all(|id| places.iter().all(|p| room(id, p)))
}

/// What a step that can run member by member reads of the scene's places.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts {
    /// Where each member's frustum is.
    pub frusta: Frusta,
    /// The draws that the device makes up from the frusta.
    pub draws: ResourceId,
    /// Its tables of nodes and of frusta, by index of [`Plan::tables`]: of them each member reads what its frustum meets.
    pub tables: Vec<usize>,
}

/// `None` for a draw that runs as a whole.
pub fn parts(plan: &Plan, step: &Step, draw: &Draw) -> Option<Parts> {
    // What its checks say is said of all members together.
    let checked = step.bindings.iter().any(|b| matches!(b, Binding::Report));
    let indirect = draw.indirect.filter(|_| splits(plan, draw) && !checked)?;
    let tables = |wanted: &str| {
        let bound = step.bindings.iter().filter_map(|b| if let Binding::Table(i) = b { Some(*i) } else { None });
        bound.filter(|i| plan.tables.get(*i).is_some_and(|t| t.table == wanted)).collect::<Vec<_>>()
    };
    let mut told = tables("nodes");
    // Where things are is known by the nodes; a shader that doesn't ask for them places things in its own way.
    if told.is_empty() {
        return None;
    }
    if let Frusta::Table(i) = indirect.frusta {
        told.extend(tables(&plan.tables.get(i)?.table));
    }
    Some(Parts { frusta: indirect.frusta, draws: indirect.buffer, tables: told })
}

/// By step that can run member by member, a version of what each of its members sees. `known` gives the frusta in a buffer;
/// steps whose frusta it doesn't know are left out.
pub fn seen(
    plan: &Plan,
    tables: &[Table],
    known: impl Fn(ResourceId) -> Option<Arc<Vec<Mat4>>>,
) -> BTreeMap<usize, Vec<u64>> {
    let mut all = BTreeMap::new();
    let Some(world) = World::new(tables) else { return all };
    for (index, step) in plan.steps.iter().enumerate() {
        let Action::Draw(draw) = &step.action else { continue };
        let Some(parts) = parts(plan, step, draw) else { continue };
        let rows: Vec<usize> = draw.members.iter().map(|m| m.index as usize).collect();
        // What is not a number sees everything.
        let of = |all: &[Mat4]| rows.iter().map(|i| all.get(*i).copied().unwrap_or(Mat4::NAN)).collect::<Vec<_>>();
        match parts.frusta {
            Frusta::Buffer(id) => {
                if let Some(frusta) = known(id) {
                    all.insert(index, world.seen(&of(&frusta), &[]));
                }
            }
            Frusta::Table(i) => {
                let name = plan.tables.get(i).map_or("", |t| t.table.as_str());
                let Some(table) = tables.iter().find(|t| t.name == name) else { continue };
                let column = table.columns.iter().find(|(name, _)| *name == super::cull::FRUSTUM);
                let frusta = if let Some((_, Column::Mat4(all))) = column { of(all) } else { of(&[]) };
                let contents: Vec<u64> = rows.iter().map(|row| row_hash(table, *row)).collect();
                all.insert(index, world.seen(&frusta, &contents));
            }
        }
    }
    all
}

/// The buffers of frusta that a plan's draws go by.
pub fn buffers(plan: &Plan) -> BTreeSet<ResourceId> {
    let of = |step: &Step| match &step.action {
        Action::Draw(draw) => match parts(plan, step, draw)?.frusta {
            Frusta::Buffer(id) => Some(id),
            Frusta::Table(_) => None,
        },
        _ => None,
    };
    plan.steps.iter().filter_map(of).collect()
}

/// The nodes of a scene at a pose, as draws see them.
#[derive(Debug, Clone, Default)]
pub struct World {
    /// By row of the `nodes` table: its content, and the box round its triangles.
    nodes: Vec<(u64, Bounds)>,
}

impl World {
    /// From the tables `nodes` and `clusters`; `None` without them.
    pub fn new(tables: &[Table]) -> Option<World> {
        let find = |name: &str| tables.iter().find(|t| t.name == name);
        let (nodes, clusters) = (find("nodes")?, find("clusters")?);
        let column = |name: &str| clusters.columns.iter().find(|(n, _)| *n == name).map(|(_, c)| c);
        let (Some(Column::Vec3(lower)), Some(Column::Vec3(upper)), Some(Column::Uint(node))) =
            (column("lower"), column("upper"), column("node"))
        else {
            return None;
        };
        let mut boxes = vec![Bounds::EMPTY; nodes.rows];
        for ((min, max), node) in lower.iter().zip(upper).zip(node) {
            if let Some(bounds) = boxes.get_mut(*node as usize) {
                *bounds = bounds.union(Bounds { min: *min, max: *max });
            }
        }
        Some(World { nodes: (0..nodes.rows).map(|row| row_hash(nodes, row)).zip(boxes).collect() })
    }

    /// For each frustum (world to clip space) a version of what lies in it; `rows` are further contents that the
    /// members read, one each.
    pub fn seen(&self, frusta: &[Mat4], rows: &[u64]) -> Vec<u64> {
        let one = |(i, frustum): (usize, &Mat4)| {
            let mut h = DefaultHasher::new();
            (frustum.to_cols_array().map(f32::to_bits), rows.get(i)).hash(&mut h);
            for (row, (content, bounds)) in self.nodes.iter().enumerate() {
                if meets(frustum, bounds) {
                    (row, content).hash(&mut h);
                }
            }
            h.finish()
        };
        frusta.iter().enumerate().map(one).collect()
    }
}

/// The content of a row.
pub fn row_hash(table: &Table, row: usize) -> u64 {
    let mut h = DefaultHasher::new();
    for (_, column) in table.columns.iter() {
        column.get(row).as_ref().map(Value::bytes).hash(&mut h);
    }
    h.finish()
}

/// Whether a box meets what a view-projection matrix keeps. The twin of `meets` in `cull.wgsl`.
pub fn meets(view_projection: &Mat4, bounds: &Bounds) -> bool {
    if bounds.min.cmpgt(bounds.max).any() {
        return false;
    }
    let rows = view_projection.transpose();
    let (x, y, z, w) = (rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis);
    let (middle, half) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min));
    ![w + x, w - x, w + y, w - y, z, w - z].into_iter().any(|plane| outside(plane, middle, half))
}

fn outside(plane: Vec4, middle: Vec3, half: Vec3) -> bool {
    let normal = plane.truncate();
    let reach = normal.abs().dot(half);
    let size = normal.abs().dot(middle.abs()) + plane.w.abs();
    normal.dot(middle) + plane.w + reach < -1e-5 * (size + reach)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxed(center: Vec3, half: f32) -> Bounds {
        Bounds { min: center - half, max: center + half }
    }

    #[test]
    fn a_frustum_meets_what_lies_in_it_and_no_more_than_reaches_over_its_planes() {
        let view = Mat4::perspective_rh(std::f32::consts::FRAC_PI_2, 1.0, 0.1, 10.0)
            * Mat4::look_to_rh(Vec3::new(1.0, 2.0, 3.0), Vec3::X, Vec3::Y);
        let at = |x: f32, y: f32, z: f32| Vec3::new(1.0 + x, 2.0 + y, 3.0 + z);
        for (center, half, expected) in [
            (at(5.0, 0.0, 0.0), 0.1, true),
            (at(-5.0, 0.0, 0.0), 0.1, false),
            (at(5.0, 4.8, 0.0), 0.1, true),
            (at(5.0, 5.3, 0.0), 0.1, false),
            (at(5.0, 5.3, 0.0), 0.2, true),
            (at(11.0, 0.0, 0.0), 0.5, false),
            (at(0.0, 0.0, 0.0), 0.05, false),
            (at(0.0, 0.0, 0.0), 20.0, true),
        ] {
            assert_eq!(meets(&view, &boxed(center, half)), expected, "{center} ± {half}");
        }
        assert!(!meets(&view, &Bounds::EMPTY));
        assert!(meets(&Mat4::NAN, &boxed(Vec3::ZERO, 1.0)), "what is not a number leaves nothing out");
    }

    #[test]
    fn only_the_views_that_an_object_leaves_or_enters_have_a_new_version() {
        let look = |direction: Vec3| {
            let up = if direction.y.abs() > 0.5 { Vec3::Z } else { Vec3::Y };
            Mat4::perspective_rh(1.0, 1.0, 0.1, 10.0) * Mat4::look_to_rh(Vec3::ZERO, direction, up)
        };
        let frusta = [Vec3::X, Vec3::NEG_X, Vec3::Y].map(look);
        let world =
            |content: u64, at: Vec3| World { nodes: vec![(1, boxed(Vec3::Z * 5.0, 0.5)), (content, boxed(at, 0.5))] };
        let rows = [0; 3];
        let before = world(7, Vec3::X * 5.0).seen(&frusta, &rows);
        let differ = |after: Vec<u64>| [0, 1, 2].map(|i| before[i] != after[i]);
        assert_eq!(differ(world(7, Vec3::X * 5.0).seen(&frusta, &rows)), [false, false, false]);
        assert_eq!(differ(world(8, Vec3::X * 5.0).seen(&frusta, &rows)), [true, false, false], "it turned in place");
        assert_eq!(differ(world(8, Vec3::Y * 5.0).seen(&frusta, &rows)), [true, false, true]);
        assert_eq!(differ(world(7, Vec3::X * 5.0).seen(&frusta, &[0, 1, 0])), [false, true, false]);
    }
}
