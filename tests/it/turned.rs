//! A room that is turned against the grid of probes, whose outer probes then stand in its walls or beyond them.

use crate::device::gpu;
use crate::support::repository;
use glam::{Mat3, Vec3};
use lightgraph::internals::scene::{Bounds, Scene};
use lightgraph::{Project, Session, Settings};
use std::sync::Arc;

/// The Cornell box, all of it with lights and cameras, turned by some degrees round the vertical axis.
fn turned(degrees: f32) -> Scene {
    let mut scene = Scene::load(&repository("scenes/cornell.glb")).unwrap_or_else(|f| panic!("{f}")).scene;
    let turn = Mat3::from_rotation_y(degrees.to_radians());
    for node in scene.nodes.iter_mut().filter(|n| n.parent.is_none()) {
        node.linear = turn * node.linear;
        node.translation = turn * node.translation;
    }
    let b = scene.bounds;
    let corners = (0..8).map(|i| {
        let at = Vec3::new([b.min.x, b.max.x][i & 1], [b.min.y, b.max.y][i >> 1 & 1], [b.min.z, b.max.z][i >> 2]);
        turn * at
    });
    let (min, max) = corners.fold((Vec3::MAX, Vec3::MIN), |(min, max), at| (min.min(at), max.max(at)));
    scene.bounds = Bounds { min, max };
    scene.grid = scene.bounds;
    scene
}

/// Mean of `indirect` over the image.
fn mean(graph: &str, scene: Scene) -> f32 {
    let gpu = gpu();
    let path = repository(&format!("graphs/gi/{graph}.ron"));
    let project = Project::open(&path, &[]).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings {
        params: project.params(&["grid=6,6,6".into()]).unwrap_or_else(|f| panic!("{f}")),
        size: [32, 32],
        outputs: Some(vec!["indirect".into()]),
        ..Settings::default()
    };
    let mut session = Session::new(&gpu, &project, Arc::new(scene), settings).unwrap_or_else(|f| panic!("{f}"));
    session.frame(&gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let image = session.image(&gpu, "indirect").unwrap_or_else(|f| panic!("{f}"));
    image.rgb().map(|p| p.iter().sum::<f32>()).sum()
}

/// Probes beyond the walls know nothing of the room: they must not darken it, however little it is turned.
#[test]
fn a_turned_room_keeps_its_light() {
    for graph in ["fast_grid_visible", "indirect_shadow", "moment_visibility"] {
        let straight = mean(graph, turned(0.0));
        let little = mean(graph, turned(1.5));
        println!("{graph}: {:+.2} %", 100.0 * (little / straight - 1.0));
        assert!((little / straight - 1.0).abs() < 0.04, "{graph}: {straight} straight, {little} turned");
    }
}
