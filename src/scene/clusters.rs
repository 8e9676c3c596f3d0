//! Clusters: the triangles cut into small compact groups, so that a draw can leave out what a view doesn't show.

use super::{
    bvh::Tree,
    geometry::{Geometry, Vertex},
    model::Bounds,
};
use glam::{Mat4, Vec3};
use rustc_hash::{FxHashMap, FxHasher};
use std::hash::{Hash, Hasher};
use std::ops::Range;
use std::sync::Arc;

/// Triangles of a cluster at most: few enough that a cluster seldom lies half inside a view, many enough that testing
/// it costs far less than drawing it.
pub const CLUSTER: usize = 32;

/// Neighbouring triangles of one node and one sidedness, and with the same `sides` at time 0. Of each sidedness those
/// come last that lie in a side: draws that leave these out have no gaps then.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cluster {
    /// Its first place in [`Geometry::indices`].
    pub first: u32,
    /// How many indices it has, three a triangle.
    pub count: u32,
    /// Row of the `nodes` table: all its vertices move with it, or belong to it.
    pub node: u32,
}

/// Sorts the triangles into clusters, those of single-sided materials first. The same triangles give the same clusters;
/// triangles that fit one cluster keep their order. `nodes` places them in the world.
pub(super) fn cluster(geometry: &mut Geometry, nodes: &[Mat4]) {
    let (indices, clusters) = clustered(geometry, &geometry.indices, geometry.one_sided, nodes);
    geometry.indices = indices;
    geometry.clusters = clusters;
}

/// The triangles of some indices, of which the first `one_sided` are single-sided, sorted into clusters; and these.
pub(super) fn clustered(
    Geometry { vertices, owners, .. }: &Geometry,
    indices: &[u32],
    one_sided: u32,
    nodes: &[Mat4],
) -> (Vec<u32>, Vec<Cluster>) {
    let world: Vec<Vec3> = vertices
        .iter()
        .map(|v| nodes.get(v.node as usize).map_or(v.position.into(), |m| m.transform_point3(v.position.into())))
        .collect();
    let placed = |t: &[u32; 3]| Bounds::of(t.map(|i| world[i as usize]));
    let all = indices.as_chunks::<3>().0.iter().fold(Bounds::EMPTY, |all, t| all.union(placed(t)));
    let mut triangles: Vec<Sorted> = indices
        .as_chunks::<3>()
        .0
        .iter()
        .map(|t| Sorted {
            corners: *t,
            node: owners.node(vertices[t[0] as usize].node),
            sides: sides(&placed(t), &all),
        })
        .collect();
    let (front, both) = triangles.split_at_mut((one_sided as usize / 3).min(indices.len() / 3));
    for part in [&mut *front, &mut *both] {
        part.sort_by_key(|t| t.sides != 0);
        part.chunk_by_mut(|a, b| a.node == b.node).for_each(|group| group.sort_by_key(|t| t.sides));
    }
    let mut clusters = vec![];
    let mut sorted: Vec<u32> = Vec::with_capacity(indices.len());
    let mut known: FxHashMap<u64, (&[Sorted], Parts)> = FxHashMap::default();
    let alike = |a: &Sorted, b: &Sorted| (a.node, a.sides) == (b.node, b.sides);
    for group in [&*front, &*both].into_iter().flat_map(|part| part.chunk_by(alike)) {
        let corners = |t: &Sorted| t.corners.map(|i| vertices[i as usize].position.map(f32::to_bits));
        let mut hasher = FxHasher::default();
        group.iter().for_each(|t| corners(t).hash(&mut hasher));
        let same = |other: &[Sorted]| other.iter().map(corners).eq(group.iter().map(corners));
        // Nodes that show the same mesh have its triangles sorted once.
        let (of, parts) = known.entry(hasher.finish()).or_insert_with(|| (group, Parts::of(group, vertices)));
        if !same(of) {
            (*of, *parts) = (group, Parts::of(group, vertices));
        }
        sorted.extend(parts.order.iter().flat_map(|i| group[*i as usize].corners));
        for count in &parts.counts {
            let first = clusters.last().map_or(0, |c: &Cluster| c.first + c.count);
            clusters.push(Cluster { first, count: 3 * count, node: group[0].node });
        }
    }
    (sorted, clusters)
}

/// A triangle, with what parts it from others.
struct Sorted {
    /// Of its corners the vertices.
    corners: [u32; 3],
    node: u32,
    sides: u32,
}

/// Triangles of one node in the order of their clusters, and how many each of these has.
struct Parts {
    order: Vec<u32>,
    counts: Vec<u32>,
}

impl Parts {
    fn of(group: &[Sorted], vertices: &[Vertex]) -> Parts {
        let corners = |t: usize| group[t].corners.map(|i| Vec3::from(vertices[i as usize].position));
        let Tree { first, count, order } = Tree::new(group.len(), corners, |_| 0, CLUSTER);
        let mut order = Arc::unwrap_or_clone(order);
        let mut leaves: Vec<(u32, u32)> = first.iter().copied().zip(count.iter().copied()).collect();
        leaves.retain(|(_, count)| *count > 0);
        leaves.sort_unstable();
        for (start, count) in &leaves {
            order[*start as usize..][..*count as usize].sort_unstable();
        }
        Parts { order, counts: leaves.into_iter().map(|(_, count)| count).collect() }
    }
}

/// The box round a cluster's corners, given each by its place in the indices.
pub(super) fn bounds(cluster: &Cluster, corner: impl Fn(usize) -> Vec3) -> Bounds {
    Bounds::of((cluster.first as usize..(cluster.first + cluster.count) as usize).map(corner))
}

/// The places of a cluster's triangles in [`Geometry::indices`].
pub(super) fn triangles(cluster: &Cluster) -> Range<usize> {
    cluster.first as usize / 3..(cluster.first + cluster.count) as usize / 3
}

/// The sides of `all` that a box lies in: bits 0 to 2 the lower ones along x, y, z, bits 3 to 5 the upper ones.
pub(super) fn sides(found: &Bounds, all: &Bounds) -> u32 {
    let flat = found.min.cmpeq(found.max);
    (flat & found.min.cmpeq(all.min)).bitmask() | (flat & found.max.cmpeq(all.max)).bitmask() << 3
}

/// A box that is wider than the corners in it by what a shader may round them to.
pub(super) fn widened(found: &Bounds) -> Bounds {
    let largest = found.min.abs().max(found.max.abs()).max_element();
    let margin = Vec3::splat(largest * 16.0 * f32::EPSILON);
    Bounds { min: found.min - margin, max: found.max + margin }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Vertex;

    /// A grid of `n` × `n` quads in the plane of node `node`, as triangles.
    fn plane(n: u32, node: u32, geometry: &mut Geometry) {
        for (x, y) in (0..n * n).map(|i| (i % n, i / n)) {
            let first = geometry.vertices.len() as u32;
            for (dx, dy) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                let position = [(x + dx) as f32, (y + dy) as f32, node as f32];
                geometry.vertices.push(Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2], node, material: 0 });
            }
            geometry.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
        }
    }

    #[test]
    fn nodes_that_show_the_same_mesh_have_the_same_clusters_as_each_alone() {
        let (mut both, mut alone) = (Geometry::default(), Geometry::default());
        plane(20, 0, &mut both);
        let (vertices, indices) = (both.vertices.clone(), both.indices.clone());
        // Once more, and then with its triangles the other way round.
        for (node, order) in [(1, indices.clone()), (2, indices.iter().rev().copied().collect())] {
            let first = both.vertices.len() as u32;
            both.vertices.extend(vertices.iter().map(|v| Vertex { node, ..*v }));
            both.indices.extend(order.iter().map(|i| first + i));
        }
        plane(20, 0, &mut alone);
        let nodes = [0.0, 5.0, 10.0].map(|x| Mat4::from_translation(Vec3::new(x, 0.0, x)));
        cluster(&mut both, &nodes);
        cluster(&mut alone, &nodes[..1]);
        let of = |g: &Geometry, node: u32| -> Vec<Vec<u32>> {
            let own = g.clusters.iter().filter(|c| c.node == node);
            own.map(|c| g.indices[c.first as usize..][..c.count as usize].iter().map(|i| i % 1600).collect()).collect()
        };
        assert_eq!(of(&both, 1), of(&alone, 0));
        assert!(of(&both, 2) != of(&alone, 0), "the same corners in another order are another mesh");
        assert_eq!(both.clusters.iter().map(|c| c.count).sum::<u32>() as usize, both.indices.len());
    }

    #[test]
    fn clusters_hold_every_triangle_once_and_never_mix_nodes_or_sides() {
        let mut g = Geometry::default();
        plane(20, 0, &mut g);
        plane(3, 1, &mut g);
        g.one_sided = g.indices.len() as u32;
        plane(9, 1, &mut g);
        let before = g.clone();
        cluster(&mut g, &[]);
        let sorted = |g: &Geometry| {
            let mut all: Vec<[u32; 3]> = g.indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
            all.sort_unstable();
            all
        };
        assert_eq!(sorted(&g), sorted(&before));
        assert_eq!(sorted(&Geometry { indices: g.indices[..g.one_sided as usize].to_vec(), ..g.clone() }), {
            sorted(&Geometry { indices: before.indices[..g.one_sided as usize].to_vec(), ..before })
        });
        let mut next = 0;
        for c in &g.clusters {
            assert_eq!(c.first, next);
            next += c.count;
            assert!(c.count > 0 && c.count as usize <= 3 * CLUSTER);
            let all = &g.indices[c.first as usize..next as usize];
            assert!(all.iter().all(|i| g.vertices[*i as usize].node == c.node));
            assert!(next <= g.one_sided || c.first >= g.one_sided, "a cluster has both sides");
        }
        assert_eq!(next as usize, g.indices.len());
    }

    #[test]
    fn a_large_plane_falls_into_compact_parts() {
        let mut g = Geometry::default();
        plane(32, 0, &mut g);
        g.one_sided = g.indices.len() as u32;
        cluster(&mut g, &[]);
        let corners: Vec<[Vec3; 3]> = g
            .indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]].map(|i| Vec3::from(g.vertices[i as usize].position)))
            .collect();
        let area: f32 = g
            .clusters
            .iter()
            .map(|c| widened(&bounds(c, |i| corners[i / 3][i % 3])))
            .map(|b| (b.max.x - b.min.x) * (b.max.y - b.min.y))
            .sum();
        assert!(area < 1.1 * 32.0 * 32.0, "the boxes overlap: {area}");
        assert!(g.clusters.len() <= 2 * (2 * 32 * 32) / CLUSTER, "{} clusters", g.clusters.len());
    }

    #[test]
    fn what_lies_in_a_side_of_everything_has_clusters_of_its_own() {
        let mut g = Geometry::default();
        // Planes at z = 0, 1 and 2 of one node.
        plane(2, 0, &mut g);
        plane(2, 1, &mut g);
        plane(2, 2, &mut g);
        g.vertices.iter_mut().for_each(|v| v.node = 0);
        g.one_sided = g.indices.len() as u32;
        cluster(&mut g, &[]);
        assert_eq!(g.clusters.len(), 3);
        let corners = |c: &Cluster| bounds(c, |i| Vec3::from(g.vertices[g.indices[i] as usize].position));
        let found: Vec<Bounds> = g.clusters.iter().map(corners).collect();
        let all = found.iter().fold(Bounds::EMPTY, |all, b| all.union(*b));
        let lies = |b: &Bounds| (b.min.z, sides(b, &all));
        assert_eq!(found.iter().map(lies).collect::<Vec<_>>(), [(1.0, 0), (0.0, 1 << 2), (2.0, 1 << 5)]);
        let turned = Mat4::from_rotation_x(0.5);
        cluster(&mut g, &[turned]);
        assert_eq!(g.clusters.len(), 1, "turned, none lies in a side");
    }

    #[test]
    fn what_lies_in_a_side_comes_last() {
        let mut g = Geometry::default();
        for z in 0..4 {
            plane(2, z, &mut g);
        }
        // The first and the last plane lie in sides.
        g.one_sided = g.indices.len() as u32;
        cluster(&mut g, &[]);
        assert_eq!(g.clusters.iter().map(|c| c.node).collect::<Vec<_>>(), [1, 2, 0, 3]);
    }

    #[test]
    fn few_triangles_keep_their_order() {
        let mut g = Geometry::default();
        plane(4, 0, &mut g);
        g.one_sided = g.indices.len() as u32;
        let before = g.indices.clone();
        cluster(&mut g, &[]);
        assert_eq!((g.indices.clone(), g.clusters.len()), (before, 1));
    }
}
