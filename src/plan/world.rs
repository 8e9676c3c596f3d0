//! The nodes of a scene at a pose, as views see them, and a version of what each view sees. No device.

use super::sight::{eye, meets_planes, planes};
use crate::scene::{Bounds, Column, Table, reach};
use crate::value::Value;
use glam::{Mat4, Vec3, Vec4};
use std::hash::{DefaultHasher, Hash, Hasher};

/// What a member is told of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct View {
    /// World to clip space.
    pub frustum: Mat4,
    /// The content of its row in a table of frusta; 0 for a buffer of them. Of a dispatch how far the scene reaches: the
    /// boxes of all triangles are as much wider as rays may be off.
    pub row: u64,
}

/// What a member makes where nothing lies in its frustum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Looks {
    /// What follows from its frustum alone.
    Rays,
    /// What it clears its targets to, wherever the frustum is.
    Drawn,
    /// The same, of draws that leave out what can hide nothing from the eye.
    Occluders,
}

/// The version of a member that draws nothing.
const NOTHING: u64 = 0;

/// The tables that a [`World`] is made of.
pub(super) const WORLD: [&str; 2] = ["nodes", "clusters"];

/// The nodes of a scene at a pose, as draws see them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct World {
    /// By row of the `nodes` table.
    nodes: Vec<Node>,
    /// Between the clusters that lie in a side of the box round everything: from within they hide nothing.
    inside: Bounds,
}

/// A node as draws see it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    /// A hash of its row, and of which of its clusters lie in which sides of the box round everything.
    content: u64,
    /// Round its triangles.
    bounds: Bounds,
    /// Round those that lie in no side.
    inner: Bounds,
}

impl World {
    /// From the tables `nodes` and `clusters`; `None` without them. Of an earlier world, given with its own, those nodes are taken of
    /// which no row is another.
    pub(super) fn after(tables: &[Table], earlier: Option<(&World, &[Table])>) -> Option<World> {
        let find = |name: &str| tables.iter().find(|t| t.name == name);
        let (rows, clusters) = (find("nodes")?, find("clusters")?);
        let column = |name: &str| clusters.column(name);
        let (Some(Column::Vec3(lower)), Some(Column::Vec3(upper)), Some(Column::Uint(node)), Some(Column::Uint(sides))) =
            (column("lower"), column("upper"), column("node"), column("sides"))
        else {
            return None;
        };
        let differs = |now: &Table, before: &[Table]| now.differs(before.iter().find(|t| t.name == now.name)?);
        let changes =
            earlier.and_then(|(world, before)| Some((world, differs(rows, before)?, differs(clusters, before)?)));
        let mut still = vec![changes.is_some(); rows.rows];
        for row in changes.iter().flat_map(|(_, nodes, _)| nodes.iter().cloned().flatten()) {
            still[row] = false;
        }
        for row in changes.iter().flat_map(|(_, _, clusters)| clusters.iter().cloned().flatten()) {
            if let Some(still) = node.get(row).and_then(|node| still.get_mut(*node as usize)) {
                *still = false;
            }
        }
        let nothing = Node { content: 0, bounds: Bounds::EMPTY, inner: Bounds::EMPTY };
        let mut nodes = vec![(DefaultHasher::new(), 0usize, nothing); rows.rows];
        let mut inside = Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
        for (((min, max), sides), node) in lower.iter().zip(upper.iter()).zip(sides.iter()).zip(node.iter()) {
            for axis in (0..3).filter(|_| *sides != 0) {
                if sides >> axis & 1 == 1 {
                    inside.min[axis] = inside.min[axis].max(max[axis]);
                }
                if sides >> (axis + 3) & 1 == 1 {
                    inside.max[axis] = inside.max[axis].min(min[axis]);
                }
            }
            if still.get(*node as usize) != Some(&false) {
                continue;
            }
            let (content, clusters, node) = &mut nodes[*node as usize];
            let bounds = Bounds { min: *min, max: *max };
            node.bounds = node.bounds.union(bounds);
            if *sides == 0 {
                node.inner = node.inner.union(bounds);
            } else {
                (*clusters, sides).hash(content);
            }
            *clusters += 1;
        }
        let known =
            |row: usize| changes.as_ref().filter(|_| still[row]).and_then(|(world, ..)| world.nodes.get(row).copied());
        let finished = |(row, (mut h, clusters, node)): (usize, (DefaultHasher, usize, Node))| {
            known(row).unwrap_or_else(|| {
                (clusters, row_hash(rows, row)).hash(&mut h);
                Node { content: h.finish(), ..node }
            })
        };
        Some(World { nodes: nodes.into_iter().enumerate().map(finished).collect(), inside })
    }

    /// How far it reaches, as [`reach`] says.
    pub(super) fn reach(&self) -> u64 {
        let all = self.nodes.iter().fold(Bounds::EMPTY, |all, node| all.union(node.bounds));
        u64::from(reach(all).to_bits())
    }

    /// For each view a version of what lies in its frustum: a sum over the nodes in it, so that only those need a look that have
    /// moved since `before`, an earlier world with its views and their versions. Where some of these were given back later, it goes on
    /// from there: the same world reached in another way may then have another version, for which a member runs once more than it need.
    pub(super) fn versions(&self, views: &[View], looks: Looks, before: Option<(&World, &[View], &[u64])>) -> Vec<u64> {
        let hashed = |what: &dyn Fn(&mut DefaultHasher)| {
            let mut h = DefaultHasher::new();
            what(&mut h);
            h.finish()
        };
        let part = |row: usize, node: &Node, planes: &[Vec4; 6]| match meets_planes(planes, &node.bounds) {
            true => hashed(&|h| (row, node.content).hash(h)),
            false => 0,
        };
        let anew = |view: &View| {
            let planes = planes(&view.frustum);
            let within = looks == Looks::Occluders && self.holds(&view.frustum);
            let shown = |node: &Node| meets_planes(&planes, if within { &node.inner } else { &node.bounds });
            if looks != Looks::Rays && !self.nodes.iter().any(shown) {
                return NOTHING;
            }
            let start = hashed(&|h| (view.frustum.to_cols_array().map(f32::to_bits), view.row).hash(h));
            let nodes = self.nodes.iter().enumerate();
            nodes.fold(start, |sum, (row, node)| sum.wrapping_add(part(row, node, &planes)))
        };
        let same = |(world, saw, _): &(&World, &[View], _)| world.nodes.len() == self.nodes.len() && *saw == views;
        let Some((before, _, earlier)) = before.filter(same) else { return views.iter().map(anew).collect() };
        let pairs = before.nodes.iter().zip(&self.nodes).enumerate();
        let moved: Vec<_> = pairs.filter(|(_, (then, now))| then != now).collect();
        let one = |(view, version): (&View, &u64)| {
            // It says nothing of where the frustum is, so nothing can be added to it.
            if *version == NOTHING {
                return anew(view);
            }
            let planes = planes(&view.frustum);
            moved.iter().fold(*version, |sum, (row, (then, now))| {
                sum.wrapping_sub(part(*row, then, &planes)).wrapping_add(part(*row, now, &planes))
            })
        };
        views.iter().zip(earlier).map(one).collect()
    }

    /// Whether the eye of a view lies well within all sides of the box round everything.
    fn holds(&self, frustum: &Mat4) -> bool {
        let eye = eye(frustum);
        let at = eye.truncate() / eye.w;
        let size = |v: Vec3| v.to_array().into_iter().filter(|x| x.is_finite()).map(f32::abs).fold(0.0, f32::max);
        let slack = 1e-4 * size(at).max(size(self.inside.min)).max(size(self.inside.max));
        eye.w > 0.0 && at.cmpgt(self.inside.min + slack).all() && at.cmplt(self.inside.max - slack).all()
    }

    /// Boxes round what differs from an earlier world: where it was and where it is. `None`: they have other nodes.
    pub(super) fn moved(&self, before: &World) -> Option<Vec<(Bounds, Bounds)>> {
        let pairs = before.nodes.iter().zip(&self.nodes);
        let moved = pairs.filter(|(then, now)| then != now).map(|(then, now)| (then.bounds, now.bounds));
        (before.nodes.len() == self.nodes.len()).then(|| moved.collect())
    }
}

/// The content of a row.
pub(super) fn row_hash(table: &Table, row: usize) -> u64 {
    let mut h = DefaultHasher::new();
    for (_, column) in table.columns.iter() {
        column.get(row).as_ref().map(Value::bytes).hash(&mut h);
    }
    h.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Tables;

    fn boxed(center: Vec3, half: f32) -> Bounds {
        Bounds { min: center - half, max: center + half }
    }

    const EVERYWHERE: Bounds = Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };

    fn node(content: u64, at: Vec3) -> Node {
        Node { content, bounds: boxed(at, 0.5), inner: boxed(at, 0.5) }
    }

    /// Views from a point along some directions.
    fn look<const N: usize>(from: Vec3, directions: [Vec3; N]) -> [View; N] {
        directions.map(|direction| {
            let up = if direction.y.abs() > 0.5 { Vec3::Z } else { Vec3::Y };
            let frustum = Mat4::perspective_rh(1.0, 1.0, 0.1, 10.0) * Mat4::look_to_rh(from, direction, up);
            View { frustum, row: 0 }
        })
    }

    #[test]
    fn only_the_views_that_an_object_leaves_or_enters_have_a_new_version() {
        let views = look(Vec3::ZERO, [Vec3::X, Vec3::NEG_X, Vec3::Y]);
        let world = |content: u64, at: Vec3| World {
            nodes: vec![node(1, Vec3::Z * 5.0), node(content, at)],
            inside: EVERYWHERE,
        };
        for looks in [Looks::Rays, Looks::Drawn] {
            let versions = |world: &World| world.versions(&views, looks, None);
            let before = versions(&world(7, Vec3::X * 5.0));
            let differ = |after: Vec<u64>| [0, 1, 2].map(|i| before[i] != after[i]);
            assert_eq!(differ(versions(&world(7, Vec3::X * 5.0))), [false, false, false]);
            assert_eq!(differ(versions(&world(8, Vec3::X * 5.0))), [true, false, false], "it turned in place");
            assert_eq!(differ(versions(&world(8, Vec3::Y * 5.0))), [true, false, true]);
            let [a, b, c] = views;
            let other = [View { row: 1, ..a }, View { row: 1, ..b }, c];
            let turned = differ(world(7, Vec3::X * 5.0).versions(&other, looks, None));
            assert_eq!(turned, [true, looks == Looks::Rays, false], "what draws nothing has nothing of its own");
        }
        // From a world to the next, with what was seen before: the same, where rays see it.
        let versions = |world: &World, before: Option<(&World, &[u64])>| {
            world.versions(&views, Looks::Rays, before.map(|(world, versions)| (world, views.as_slice(), versions)))
        };
        let places = [(7, Vec3::X), (8, Vec3::X), (8, Vec3::Y), (9, Vec3::Z), (7, Vec3::X)];
        let worlds = places.map(|(content, at)| world(content, at * 5.0));
        for pair in worlds.windows(2) {
            let before = versions(&pair[0], None);
            assert_eq!(versions(&pair[1], Some((&pair[0], &before))), versions(&pair[1], None));
        }
    }

    #[test]
    fn a_world_after_another_is_the_one_that_is_made_anew() {
        let scene = crate::scene::load(std::path::Path::new("scenes/hall.ron")).unwrap_or_else(|f| panic!("{f}")).scene;
        let tables =
            |pose, earlier: Option<&Tables>| scene.tables_after(pose, |name| WORLD.contains(&name), vec![], earlier);
        let mut before = tables(scene.pose(0.0), None);
        let mut world = World::after(&before.list, None).expect("both tables");
        for node in 0..scene.nodes.len() {
            for by in [Vec3::X * 0.02, Vec3::new(0.0, 9.0, 0.0), Vec3::new(0.0, -8.99, 0.0)] {
                let mut pose = before.pose.clone();
                pose.nodes[node] = Mat4::from_translation(by) * pose.nodes[node];
                let now = tables(pose, Some(&before));
                let found = World::after(&now.list, Some((&world, &before.list))).expect("both tables");
                assert!(found == World::after(&now.list, None).expect("both tables"), "node {node} by {by}");
                assert!(found != world || scene.geometry.clusters.iter().all(|c| c.node != node as u32));
                (before, world) = (now, found);
            }
        }
    }

    #[test]
    fn what_enters_an_empty_view_is_told_with_where_the_view_is() {
        let world = |at: Vec3| World { nodes: vec![node(7, at)], inside: EVERYWHERE };
        let entered = |from: Vec3| {
            let views = look(from, [Vec3::X]);
            let empty = world(Vec3::NEG_X * 5.0);
            let versions = empty.versions(&views, Looks::Drawn, None);
            assert_eq!(versions, [NOTHING]);
            world(Vec3::X * 5.0).versions(&views, Looks::Drawn, Some((&empty, &views, &versions)))
        };
        assert_ne!(entered(Vec3::ZERO), entered(Vec3::Y * 0.5), "the same thing, seen from elsewhere");
    }

    #[test]
    fn from_within_the_sides_of_everything_only_what_lies_between_them_is_drawn() {
        // A wall and a thing before it, both of one node; the wall is the upper side along x.
        let thing = boxed(Vec3::X * 3.0, 0.5);
        let wall = Bounds { min: Vec3::new(5.0, -5.0, -5.0), max: Vec3::new(5.0, 5.0, 5.0) };
        let room = Node { content: 1, bounds: thing.union(wall), inner: thing };
        let world = World {
            nodes: vec![room],
            inside: Bounds { max: Vec3::new(5.0, f32::INFINITY, f32::INFINITY), ..EVERYWHERE },
        };
        let drawn = |from: Vec3, looks| {
            let views = look(from, [Vec3::X, Vec3::new(1.0, 1.0, 0.0).normalize(), Vec3::NEG_X]);
            world.versions(&views, looks, None).iter().map(|v| *v != NOTHING).collect::<Vec<_>>()
        };
        assert_eq!(drawn(Vec3::ZERO, Looks::Drawn), [true, true, false]);
        assert_eq!(drawn(Vec3::ZERO, Looks::Occluders), [true, false, false]);
        assert_eq!(drawn(Vec3::X * 4.0, Looks::Occluders), [false, false, true]);
        assert_eq!(drawn(Vec3::X * 5.0, Looks::Occluders), [false, true, true], "on the wall: it may hide");
        assert_eq!(drawn(Vec3::ZERO, Looks::Rays), [true, true, true]);
    }
}
