//! A long corridor: pilasters, benches and a portal stand near its lit end, the rest is bare.

use crate::glb::GlbBuilder;
use crate::mesh::TriangleMesh;
use crate::shapes::{block, standing_block};
use glam::DVec3;

/// Half the corridor's width and length, and its height. Metres.
const HALF_WIDTH: f64 = 1.5;
const HALF_LENGTH: f64 = 15.0;
const HEIGHT: f64 = 3.0;

pub fn corridor() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let wall = document.matte("wall", [0.74, 0.71, 0.66]);
    let stone = document.matte("stone", [0.60, 0.57, 0.52]);
    let wood = document.matte("wood", [0.55, 0.30, 0.14]);
    let end = document.matte("end", [0.16, 0.34, 0.58]);
    let (w, l, h) = (HALF_WIDTH, HALF_LENGTH, HEIGHT);

    let p = DVec3::new;
    let mut shell = TriangleMesh::new();
    shell.quad([p(-w, 0.0, l), p(w, 0.0, l), p(w, 0.0, -l), p(-w, 0.0, -l)]);
    shell.quad([p(-w, h, -l), p(w, h, -l), p(w, h, l), p(-w, h, l)]);
    shell.quad([p(-w, 0.0, l), p(-w, 0.0, -l), p(-w, h, -l), p(-w, h, l)]);
    shell.quad([p(w, 0.0, -l), p(w, 0.0, l), p(w, h, l), p(w, h, -l)]);
    shell.quad([p(w, 0.0, l), p(-w, 0.0, l), p(-w, h, l), p(w, h, l)]);
    document.fixture("shell", &shell, wall);
    let mut far = TriangleMesh::new();
    far.quad([p(-w, 0.0, -l), p(w, 0.0, -l), p(w, h, -l), p(-w, h, -l)]);
    document.fixture("far end", &far, end);

    let mut pilasters = TriangleMesh::new();
    for i in 0..5 {
        let z = 6.0 + 1.6 * f64::from(i);
        for side in [-1.0, 1.0] {
            let (from, to) = (side * (w - 0.35), side * w);
            pilasters.add(block(p(from.min(to), 0.0, z - 0.2), p(from.max(to), h, z + 0.2)));
        }
    }
    document.fixture("pilasters", &pilasters, stone);

    let mut portal = TriangleMesh::new();
    for side in [-1.0, 1.0] {
        let (from, to) = (side * 0.75, side * w);
        portal.add(block(p(from.min(to), 0.0, 4.0), p(from.max(to), h, 4.4)));
    }
    portal.add(block(p(-0.75, 2.2, 4.0), p(0.75, h, 4.4)));
    document.fixture("portal", &portal, stone);

    let mut benches = TriangleMesh::new();
    for (x, z) in [(-1.2, 8.4), (1.2, 10.0)] {
        benches.add(standing_block(x, z, p(0.45, 0.45, 1.0)));
    }
    document.fixture("benches", &benches, wood);

    document.point_light("lamp", p(0.3, 2.5, 8.6), 20.0);
    document.camera("along", p(-0.35, 1.6, 14.3), p(0.15, 1.35, 4.0), 55.0);
    document
}
