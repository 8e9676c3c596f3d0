//! Simplified triangles: fewer, near the surfaces that they stand for, with their open edges where they were.

use crate::scene::{Column, Level, Scene};
use glam::Vec3;
use std::path::Path;
use std::sync::Arc;

fn hall() -> Scene {
    Scene::load(Path::new("scenes/hall.ron")).unwrap_or_else(|f| panic!("{f}")).scene
}

/// The triangles of one node, in its own space.
fn of_node(scene: &Scene, indices: &[u32], name: &str) -> Vec<[Vec3; 3]> {
    let node = scene.nodes.iter().position(|n| n.name == name).unwrap_or_else(|| panic!("no node {name}")) as u32;
    let vertex = |i: u32| &scene.geometry.vertices[i as usize];
    let triangles = indices.chunks_exact(3).filter(|t| vertex(t[0]).node == node);
    triangles.map(|t| [t[0], t[1], t[2]].map(|i| Vec3::from(vertex(i).position))).collect()
}

/// Distance from a point to a triangle: to the nearest point of its plane, its edges or its corners.
fn distance(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let edge = |a: Vec3, b: Vec3| {
        let t = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-20)).clamp(0.0, 1.0);
        p.distance(a + t * (b - a))
    };
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let foot = p - normal * normal.dot(p - a);
    let within = [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (*b - *a).cross(foot - *a).dot(normal) >= 0.0);
    let to_edges = edge(a, b).min(edge(b, c)).min(edge(c, a));
    if within && normal != Vec3::ZERO { to_edges.min(p.distance(foot)) } else { to_edges }
}

/// Corners and middles: how far the farthest of them lies from other triangles.
fn farthest(from: &[[Vec3; 3]], to: &[[Vec3; 3]]) -> f32 {
    let points = from.iter().flat_map(|[a, b, c]| [*a, *b, *c, (*a + *b + *c) / 3.0]);
    let nearest = |p| to.iter().map(|t| distance(p, *t)).fold(f32::INFINITY, f32::min);
    points.map(nearest).fold(0.0, f32::max)
}

#[test]
fn a_level_lies_near_the_surface_that_it_stands_for() {
    let scene = hall();
    for tolerance in [0.005, 0.02] {
        let level = scene.level(tolerance);
        assert!(level.error <= tolerance, "{} of {tolerance}", level.error);
        for name in ["ball", "urn"] {
            let (full, fewer) = (of_node(&scene, &scene.geometry.indices, name), of_node(&scene, &level.indices, name));
            assert!(!fewer.is_empty() && fewer.len() < full.len(), "{name}: {} of {}", fewer.len(), full.len());
            // The simplifier goes by mean squared distances.
            let off = farthest(&full, &fewer).max(farthest(&fewer, &full));
            println!("{name} within {tolerance}: {} of {} triangles, {off} off", fewer.len(), full.len());
            assert!(off <= 2.0 * tolerance, "{name} lies {off} off, {tolerance} was asked for");
        }
    }
}

#[test]
fn a_larger_tolerance_leaves_fewer_triangles_and_each_is_made_once() {
    let scene = hall();
    let count = |level: &Level| level.indices.len() / 3;
    let all = scene.geometry.indices.len() / 3;
    let (fine, coarse) = (scene.level(0.002), scene.level(0.05));
    assert!(count(&coarse) < count(&fine) && count(&fine) < all, "{} {} {all}", count(&coarse), count(&fine));
    assert!(Arc::ptr_eq(&fine, &scene.level(0.002)));
    let copy = scene.clone();
    assert_eq!(copy, scene);
    assert!(!Arc::ptr_eq(&fine, &copy.level(0.002)), "a copy may be edited");
    assert_eq!(*copy.level(0.002), *fine, "the same triangles are simplified in the same way");
}

#[test]
fn clusters_of_levels_follow_those_of_the_scene() {
    let scene = hall();
    let levels = [scene.level(0.002), scene.level(0.05)];
    let tables = scene.tables_after(scene.pose(0.0), |name| name == "clusters", levels.to_vec(), None).list;
    let column = |name: &str| match tables[0].column(name) {
        Some(Column::Uint(all)) => all.clone(),
        _ => panic!("no column {name}"),
    };
    // Each begins where the one before ends: all indices, then those of one level after the other.
    let mut next = 0;
    for (first, count) in column("first").iter().zip(column("count").iter()) {
        assert_eq!(*first, next);
        next += count;
    }
    let indices = scene.geometry.indices.len() + levels.iter().map(|l| l.indices.len()).sum::<usize>();
    assert_eq!(next as usize, indices);
    for level in &levels {
        let front = level.clusters.iter().take(level.one_sided_clusters()).map(|c| c.count).sum::<u32>();
        assert_eq!(front, level.one_sided);
    }
}
