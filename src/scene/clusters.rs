//! Clusters: the triangles cut into small compact groups, so that a draw can leave out what a view doesn't show.

use super::{bvh::Tree, geometry::Geometry, model::Bounds};
use glam::{Mat4, Vec3};
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
    let node = |t: &[u32; 3]| owners.node(vertices[t[0] as usize].node);
    let mut triangles = indices.as_chunks::<3>().0.to_vec();
    let split = (one_sided as usize / 3).min(triangles.len());
    let placed = |t: &[u32; 3]| {
        Bounds::of(t.map(|i| {
            let v = &vertices[i as usize];
            nodes.get(v.node as usize).copied().unwrap_or_default().transform_point3(v.position.into())
        }))
    };
    let all = triangles.iter().fold(Bounds::EMPTY, |all, t| all.union(placed(t)));
    let kind = |t: &[u32; 3]| (node(t), sides(&placed(t), &all));
    let (front, both) = triangles.split_at_mut(split);
    for part in [&mut *front, &mut *both] {
        part.sort_by_cached_key(|t| sides(&placed(t), &all) != 0);
        part.chunk_by_mut(|a, b| node(a) == node(b))
            .for_each(|group| group.sort_by_cached_key(|t| sides(&placed(t), &all)));
    }
    let mut clusters = vec![];
    let mut sorted: Vec<u32> = Vec::with_capacity(indices.len());
    for group in [front, both].into_iter().flat_map(|part| part.chunk_by(|a, b| kind(a) == kind(b))) {
        let corners = |t: usize| group[t].map(|i| Vec3::from(vertices[i as usize].position));
        let Tree { first, count, order } = Tree::new(group.len(), corners, |_| 0, CLUSTER);
        let mut order = Arc::unwrap_or_clone(order);
        let mut leaves: Vec<(u32, u32)> = first.iter().copied().zip(count.iter().copied()).collect();
        leaves.retain(|(_, count)| *count > 0);
        leaves.sort_unstable();
        for (start, count) in leaves {
            let members = &mut order[start as usize..][..count as usize];
            members.sort_unstable();
            let first = sorted.len() as u32;
            sorted.extend(members.iter().flat_map(|i| group[*i as usize]));
            clusters.push(Cluster { first, count: 3 * count, node: node(&group[0]) });
        }
    }
    (sorted, clusters)
}

/// The box round a cluster's corners, given those of each triangle by its place in [`Geometry::indices`].
pub(super) fn bounds(cluster: &Cluster, corners: impl Fn(usize) -> [Vec3; 3]) -> Bounds {
    Bounds::of(triangles(cluster).flat_map(corners))
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
            .map(|c| widened(&bounds(c, |i| corners[i])))
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
        let corners = |c: &Cluster| {
            bounds(c, |t| [0, 1, 2].map(|i| Vec3::from(g.vertices[g.indices[3 * t + i] as usize].position)))
        };
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
