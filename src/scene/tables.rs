//! The tables shaders read, in world space at a pose.

use super::{
    Column, Follows, Level, MOVED, Since, TABLES, Table,
    bvh::{Tree, reach},
    clusters,
    corners::{Corners, TriangleOrder, VertexAttribute, VertexRun, around},
    environment::Environment,
    geometry::Geometry,
    hierarchy::Hierarchy,
    light_views::{Surfaces, light_view_table, light_views},
    model::{Bounds, Scene},
    motion::{Pose, nodes},
    pieces::Pieces,
    table,
    transforms::NodeMatrix,
};
use glam::Vec3;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// The tables that boxes round clusters are needed for.
const BOXED: [&str; 5] = ["light_views", "triangles", "bvh", "clusters", MOVED];

/// Rows of the table `moved`.
const MOVED_ROWS: usize = 8;

/// Metres; farther than anything in a scene.
const FAR_AWAY: f32 = 1e30;

/// Tables of a scene at a pose.
#[derive(Debug)]
pub struct Tables {
    pub pose: Pose,
    /// Whose clusters follow those of the scene itself.
    pub levels: Vec<Arc<Level>>,
    pub list: Vec<Table>,
    boxes: Boxes,
    /// Where rays are traced.
    traced: Option<Arc<Hierarchy>>,
}

/// Boxes round clusters at a pose; none where no table is made of them.
#[derive(Debug)]
struct Boxes {
    /// Exactly round the corners of each, those of the levels after the scene's own.
    each: Pieces<Bounds>,
    /// Round the scene's own.
    own: Bounds,
    /// Round those of the levels too.
    all: Bounds,
    /// Which may be others than those of the tables before; `None`: all.
    other: Option<Vec<usize>>,
}

impl Tables {
    /// Whether a step later without motion the tables would be others.
    pub fn settles(&self) -> bool {
        let moved = self.list.iter().find(|t| t.name == MOVED).and_then(|t| t.column("lower"));
        matches!(moved, Some(Column::Vec3(lower)) if lower.iter().any(|l| l.x < FAR_AWAY)) || !stood_still(&self.list)
    }
}

impl Scene {
    /// The tables of [`TABLES`], in their order, at a pose of this scene.
    pub fn tables(&self, pose: &Pose) -> Vec<Table> {
        self.tables_named(pose, |_| true)
    }

    /// The tables whose names pass, in the order of [`TABLES`]; the others cost nothing.
    pub fn tables_named(&self, pose: &Pose, wanted: impl Fn(&str) -> bool) -> Vec<Table> {
        self.tables_after(pose.clone(), wanted, vec![], None).list
    }

    /// As [`Scene::tables_named`], with the clusters of levels of this scene. Of earlier tables of this scene those are
    /// taken that are the same still; of the others what has not moved.
    pub fn tables_after(
        &self,
        pose: Pose,
        wanted: impl Fn(&str) -> bool,
        levels: Vec<Arc<Level>>,
        earlier: Option<&Tables>,
    ) -> Tables {
        let kept = |name: &str| {
            let Tables { pose: before, levels: beside, list, .. } = earlier?;
            let changed = [
                (Follows::NODES, before.nodes != pose.nodes || name == "nodes" && !stood_still(list)),
                (Follows::LIGHTS, before.lights != pose.lights),
                (Follows::LEVELS, !same_levels(beside, &levels)),
                (Follows::MOTION, true),
            ];
            let changed = changed.iter().filter(|(_, other)| *other).fold(Follows::NOTHING, |all, (f, _)| all.and(*f));
            list.iter().find(|t| t.name == name && !table(name).is_none_or(|t| t.follows.meets(changed))).cloned()
        };
        let names = || TABLES.iter().map(|t| t.name).filter(|name| wanted(name));
        let world = World { scene: self, pose: &pose };
        let boxes = match names().any(|name| BOXED.contains(&name)) {
            true => world.boxes(&levels, earlier),
            false => Boxes { each: Pieces::default(), own: Bounds::EMPTY, all: Bounds::EMPTY, other: None },
        };
        let corners = |triangle: usize| world.corners(triangle);
        let mut traced = None;
        let mut made = |name: &str| match name {
            "nodes" => Some(nodes(&pose, earlier.map_or(&pose, |e| &e.pose))),
            "materials" => Some(self.material_table()),
            "textures" => Some(self.texture_table()),
            "vertices" => Some(self.vertex_table()),
            "lights" => Some(self.light_table(&pose)),
            "light_views" => {
                let surfaces = Surfaces { parts: &self.geometry.clusters, boxes: &boxes.each, corners };
                Some(light_view_table(&light_views(self, &pose, &surfaces), boxes.own))
            }
            // Both come of the same sorting.
            "triangles" | "bvh" => {
                let (triangles, bvh, _) = traced.get_or_insert_with(|| traced_tables(&world, &boxes, earlier));
                Some(if name == "bvh" { bvh.clone() } else { triangles.clone() })
            }
            "clusters" => Some(self.cluster_table(&boxes, &levels, earlier)),
            "emitters" => Some(self.emitter_table(corners)),
            "environment" => Some(self.environment.as_ref().map_or_else(Environment::nothing, Environment::table)),
            MOVED => Some(self.moved_table(&boxes, &levels, earlier)),
            _ => None,
        };
        let list = names().filter_map(|name| kept(name).or_else(|| made(name))).collect();
        let traced = traced.map(|(.., of)| of).or_else(|| earlier?.traced.clone());
        Tables { list, boxes, traced, levels, pose }
    }

    fn light_table(&self, pose: &Pose) -> Table {
        let all = &self.lights;
        let mut next = 0;
        let mut first_view = Pieces::default();
        for light in all {
            first_view.push(next);
            next += light.kind.views();
        }
        Table {
            name: "lights",
            rows: all.len(),
            since: None,
            columns: Arc::new([
                ("kind", Column::Uint(all.iter().map(|l| l.kind as u32).collect())),
                ("position", Column::Vec3(pose.lights.iter().map(|l| l.position).collect())),
                ("direction", Column::Vec3(pose.lights.iter().map(|l| l.direction).collect())),
                ("intensity", Column::Vec3(all.iter().map(|l| l.intensity).collect())),
                ("range", Column::Float(all.iter().map(|l| l.range).collect())),
                ("cos_inner", Column::Float(all.iter().map(|l| l.inner.cos()).collect())),
                ("cos_outer", Column::Float(all.iter().map(|l| l.outer.cos()).collect())),
                ("first_view", Column::Uint(first_view)),
                ("views", Column::Uint(all.iter().map(|l| l.kind.views()).collect())),
            ]),
        }
    }

    /// The scene's indices with their clusters, then those of levels.
    fn clustered<'a>(
        &'a self,
        levels: &'a [Arc<Level>],
    ) -> impl Iterator<Item = (&'a [u32], &'a [clusters::Cluster])> + Clone {
        let own = (self.geometry.indices.as_slice(), self.geometry.clusters.as_slice());
        std::iter::once(own).chain(levels.iter().map(|l| (l.indices.as_slice(), l.clusters.as_slice())))
    }

    fn cluster_table(&self, boxes: &Boxes, levels: &[Arc<Level>], earlier: Option<&Tables>) -> Table {
        let known = earlier.filter(|_| boxes.other.is_some()).and_then(|e| Some((e, e.table("clusters")?)));
        let column = |name: &str| known?.1.column(name);
        // Which triangles they are of no move changes.
        let (first, count, node) = match (column("first"), column("count"), column("node")) {
            (Some(first), Some(count), Some(node)) => (first.clone(), count.clone(), node.clone()),
            _ => {
                let (mut all, mut before) = (vec![], 0);
                for (indices, list) in self.clustered(levels) {
                    all.extend(list.iter().map(|c| clusters::Cluster { first: before + c.first, ..*c }));
                    before += indices.len() as u32;
                }
                let of = |what: fn(&clusters::Cluster) -> u32| Column::Uint(all.iter().map(what).collect());
                (of(|c| c.first), of(|c| c.count), of(|c| c.node))
            }
        };
        // Where they are changes for those that move, but for the sides of everything.
        let same = known.filter(|(e, _)| e.boxes.all == boxes.all).zip(boxes.other.as_ref());
        let (lower, upper, sides, since) = match (same, column("lower"), column("upper"), column("sides")) {
            (
                Some(((_, table), other)),
                Some(Column::Vec3(lower)),
                Some(Column::Vec3(upper)),
                Some(Column::Uint(sides)),
            ) => {
                let (mut lower, mut upper, mut sides) = (lower.clone(), upper.clone(), sides.clone());
                for i in other {
                    let found = &boxes.each[*i];
                    let wide = clusters::widened(found);
                    lower.set(*i, wide.min);
                    upper.set(*i, wide.max);
                    sides.set(*i, clusters::sides(found, &boxes.all));
                }
                (lower, upper, sides, Some(Since::of(&table.columns, other.iter().map(|i| *i..*i + 1))))
            }
            _ => {
                let wide = || boxes.each.iter().map(clusters::widened);
                let sides = boxes.each.iter().map(|b| clusters::sides(b, &boxes.all));
                (wide().map(|b| b.min).collect(), wide().map(|b| b.max).collect(), sides.collect(), None)
            }
        };
        Table {
            name: "clusters",
            rows: boxes.each.len(),
            since,
            columns: Arc::new([
                ("lower", Column::Vec3(lower)),
                ("upper", Column::Vec3(upper)),
                ("first", first),
                ("count", count),
                ("node", node),
                ("sides", Column::Uint(sides)),
            ]),
        }
    }

    /// Boxes round what moved since earlier tables; everything, where none are given or the box round everything
    /// changed.
    fn moved_table(&self, boxes: &Boxes, levels: &[Arc<Level>], earlier: Option<&Tables>) -> Table {
        let everywhere = Bounds { min: Vec3::splat(-FAR_AWAY), max: Vec3::splat(FAR_AWAY) };
        let nowhere = Bounds { min: Vec3::splat(FAR_AWAY), max: Vec3::splat(-FAR_AWAY) };
        let before = earlier.map(|e| &e.boxes).filter(|e| e.own == boxes.own && e.all == boxes.all);
        let mut rows = match (before, &boxes.other) {
            (Some(before), Some(other)) => {
                let mut nodes: BTreeMap<u32, [Bounds; 2]> = BTreeMap::new();
                let clusters = self.geometry.clusters.iter().chain(levels.iter().flat_map(|level| &level.clusters));
                let nodes_of: Vec<u32> = match other.is_empty() {
                    true => vec![],
                    false => clusters.map(|c| c.node).collect(),
                };
                for i in other {
                    let of = nodes.entry(nodes_of[*i]).or_insert([Bounds::EMPTY; 2]);
                    *of = [of[0].union(before.each[*i]), of[1].union(boxes.each[*i])];
                }
                // As leaves are wider than their triangles, and as much again for the rounding of whoever asks.
                let margin = Vec3::splat(reach(boxes.own) * 64.0 * f32::EPSILON);
                let all: Vec<Bounds> = nodes.into_values().flatten().filter(|b| b.min.cmple(b.max).all()).collect();
                let wider = |b: Bounds| Bounds { min: b.min - margin, max: b.max + margin };
                Bounds::gathered(&all, MOVED_ROWS).into_iter().map(wider).collect()
            }
            _ => vec![everywhere],
        };
        rows.resize(MOVED_ROWS, nowhere);
        Table {
            name: MOVED,
            rows: rows.len(),
            since: None,
            columns: Arc::new([
                ("lower", Column::Vec3(rows.iter().map(|b| b.min).collect())),
                ("upper", Column::Vec3(rows.iter().map(|b| b.max).collect())),
            ]),
        }
    }
}

/// Whether levels of one scene are the same: it keeps those that were asked for, so they need no look.
fn same_levels(a: &[Arc<Level>], b: &[Arc<Level>]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| Arc::ptr_eq(a, b))
}

/// By node: where its vertices are in the world.
type PlacedVertices = BTreeMap<u32, VertexRun<Vec3>>;

/// The vertices of a triangle, by its place in some indices.
fn corners(indices: &[u32], triangle: usize) -> [u32; 3] {
    let of = &indices[3 * triangle..3 * triangle + 3];
    [of[0], of[1], of[2]]
}

/// The triangles of a scene in world space.
struct World<'a> {
    scene: &'a Scene,
    pose: &'a Pose,
}

impl World<'_> {
    /// The corners of a triangle by its place in the scene's indices.
    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        corners(&self.scene.geometry.indices, triangle).map(|vertex| self.position(vertex as usize))
    }

    /// The boxes of clusters, of those that stand still the earlier ones.
    fn boxes(&self, levels: &[Arc<Level>], earlier: Option<&Tables>) -> Boxes {
        let all = || self.scene.clustered(levels).flat_map(|(indices, list)| list.iter().map(move |c| (indices, c)));
        let count = self.scene.clustered(levels).map(|(_, list)| list.len()).sum::<usize>();
        let known = earlier.filter(|e| same_levels(&e.levels, levels) && e.boxes.each.len() == count);
        let (mut each, mut other) = (Pieces::default(), vec![]);
        match known {
            Some(known) => {
                let changed = self.scene.geometry.owners.changed(&known.pose.nodes, &self.pose.nodes);
                each.clone_from(&known.boxes.each);
                if changed.contains(&true) {
                    let moved = |node: u32| changed.get(node as usize) != Some(&false);
                    let moved = || all().enumerate().filter(|(_, (_, c))| moved(c.node));
                    let placed = self.placed(moved().map(|(_, found)| found));
                    for (i, (indices, c)) in moved() {
                        let of = &placed[&c.node];
                        each.set(i, clusters::bounds(c, |i| of[indices[i]]));
                        other.push(i);
                    }
                }
            }
            None => {
                let round = |(indices, c): (&[u32], &clusters::Cluster)| {
                    clusters::bounds(c, |i| self.position(indices[i] as usize))
                };
                each = all().map(round).collect();
            }
        }
        let (own, all) = match known.filter(|_| other.is_empty()) {
            Some(known) => (known.boxes.own, known.boxes.all),
            None => {
                let count = self.scene.geometry.clusters.len();
                let union = |all: Bounds, b: &Bounds| all.union(*b);
                let own = each.iter().take(count).fold(Bounds::EMPTY, union);
                (own, each.iter_from(count).fold(own, union))
            }
        };
        Boxes { each, own, all, other: known.map(|_| other) }
    }

    /// Where the vertices of some clusters are, given with the indices that they are of: each is worked out once.
    fn placed<'c>(&self, all: impl Iterator<Item = (&'c [u32], &'c clusters::Cluster)>) -> PlacedVertices {
        let mut spans: BTreeMap<u32, Range<usize>> = BTreeMap::new();
        for (indices, c) in all {
            let here = around(indices[c.first as usize..][..c.count as usize].iter().copied());
            let span = spans.entry(c.node).or_insert(here.clone());
            *span = span.start.min(here.start)..span.end.max(here.end);
        }
        spans.into_iter().map(|(node, span)| (node, VertexRun::of(span, |vertex| self.position(vertex)))).collect()
    }

    fn position(&self, vertex: usize) -> Vec3 {
        let v = &self.scene.geometry.vertices[vertex];
        self.pose.nodes[v.node as usize].transform_point3(v.position.into())
    }
}

/// Whether the nodes of tables are where they were in the frame before.
fn stood_still(list: &[Table]) -> bool {
    let of = |matrix| list.iter().find_map(|t| t.matrices(matrix));
    of(NodeMatrix::Transform) == of(NodeMatrix::PreviousTransform)
}

/// The scene's triangles sorted where they stand in the beginning: one order for all poses.
fn sorted(scene: &Scene) -> Tree {
    let pose = scene.pose(0.0);
    let world = World { scene, pose: &pose };
    let Geometry { vertices, indices, .. } = &*scene.geometry;
    let positions: Vec<Vec3> = (0..vertices.len()).map(|i| world.position(i)).collect();
    let (triangles, _) = indices.as_chunks::<3>();
    let corners = |i: usize| triangles[i].map(|vertex| positions[vertex as usize]);
    Tree::new(triangles.len(), corners, |i| scene.geometry.node(i), 1)
}

impl Tables {
    fn table(&self, name: &str) -> Option<&Table> {
        self.list.iter().find(|t| t.name == name)
    }
}

/// The tables `triangles` and `bvh`, and what both come from.
fn traced_tables(world: &World<'_>, boxes: &Boxes, earlier: Option<&Tables>) -> (Table, Table, Arc<Hierarchy>) {
    let known = earlier.and_then(|earlier| Some((earlier, earlier.traced.as_ref()?)));
    let corners = |order| Arc::new(Corners::new(world.scene, world.pose, order));
    let of = Arc::new(match known {
        Some((_, known)) => known.at(corners(known.corners.order().clone()), boxes.own),
        None => {
            let tree = sorted(world.scene);
            let order = Arc::new(TriangleOrder::new(&world.scene.geometry, tree.order.clone()));
            Hierarchy::new(tree, corners(order), boxes.own)
        }
    });
    let since = |name: &str| {
        let (earlier, known) = known?;
        let (before, moved) = (&earlier.table(name)?.columns, of.moved_since(known)?);
        let rows = if name == "triangles" { &moved.places } else { &moved.spans };
        Some(Since::of(before, rows.iter().cloned()))
    };
    let Tree { first, count, .. } = &of.tree;
    let bvh = Table {
        name: "bvh",
        rows: count.len(),
        since: since("bvh"),
        columns: Arc::new([
            ("lower", Column::Box { of: of.clone(), upper: false }),
            ("upper", Column::Box { of: of.clone(), upper: true }),
            ("first", Column::Uint(first.clone())),
            ("count", Column::Uint(count.clone())),
        ]),
    };
    let at = |corner, held| Column::Corner { of: of.corners.clone(), corner, held };
    let triangles = Table {
        name: "triangles",
        rows: of.corners.rows(),
        since: since("triangles"),
        columns: Arc::new([
            ("a", at(0, VertexAttribute::Position)),
            ("b", at(1, VertexAttribute::Position)),
            ("c", at(2, VertexAttribute::Position)),
            ("na", at(0, VertexAttribute::Normal)),
            ("nb", at(1, VertexAttribute::Normal)),
            ("nc", at(2, VertexAttribute::Normal)),
            ("uva", at(0, VertexAttribute::Uv)),
            ("uvb", at(1, VertexAttribute::Uv)),
            ("uvc", at(2, VertexAttribute::Uv)),
            ("uv2a", at(0, VertexAttribute::SecondUv)),
            ("uv2b", at(1, VertexAttribute::SecondUv)),
            ("uv2c", at(2, VertexAttribute::SecondUv)),
            ("ca", at(0, VertexAttribute::Color)),
            ("cb", at(1, VertexAttribute::Color)),
            ("cc", at(2, VertexAttribute::Color)),
            ("ta", at(0, VertexAttribute::Tangent)),
            ("tb", at(1, VertexAttribute::Tangent)),
            ("tc", at(2, VertexAttribute::Tangent)),
            ("material", at(0, VertexAttribute::Material)),
            ("emitter", at(0, VertexAttribute::Emitter)),
        ]),
    };
    (triangles, bvh, of)
}
