//! A workshop under many small lamps of two kinds, full of things: benches, crates, pipes, shelves with tins and tools.

use crate::glb::GlbBuilder;
use crate::mesh::TriangleMesh;
use crate::paintings::hash;
use crate::shapes::{block, lathe, standing_block, surface, tube};
use glam::{DAffine3, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Probes fill the room.
pub const SCENE: &str = r#"// Probes fill the room.
Scene(
    gltf: "workshop.glb",
    grid: ((-6.0, 0.0, -4.0), (6.0, 3.6, 4.0)),
    camera: "corner",
)
"#;

/// Half the room's width and length, and its height. Metres.
const HALF_X: f64 = 6.0;
const HALF_Z: f64 = 4.0;
const HEIGHT: f64 = 3.6;

pub fn workshop() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let concrete = document.matte("concrete", [0.46, 0.45, 0.43]);
    let wall = document.matte("limewash", [0.72, 0.70, 0.65]);
    let room = block(DVec3::new(-HALF_X, 0.0, -HALF_Z), DVec3::new(HALF_X, HEIGHT, HALF_Z)).inside_out();
    document.fixture("room", &room, wall);
    let mut floor = TriangleMesh::new();
    let (x, z) = (HALF_X, HALF_Z);
    floor.quad([(-x, z), (x, z), (x, -z), (-x, -z)].map(|(x, z)| DVec3::new(x, 0.004, z)));
    document.fixture("floor", &floor, concrete);
    lamps(&mut document);
    benches(&mut document);
    clutter(&mut document);
    document.camera("corner", DVec3::new(5.4, 1.75, 3.5), DVec3::new(-1.6, 0.95, -1.6), 60.0);
    document.camera("bench", DVec3::new(-5.2, 1.6, 2.9), DVec3::new(-1.0, 0.9, -2.6), 60.0);
    document
}

/// A tent of four sides over a square lamp that hangs from the ceiling and lights downwards; and tubes along the beams.
fn lamps(document: &mut GlbBuilder) {
    let warm = document.glowing("bulb", [120.0, 84.0, 48.0]);
    let cool = document.glowing("tube", [26.0, 32.0, 36.0]);
    let shade = document.cloth("lampshade", [0.16, 0.34, 0.26]);
    let beam = document.matte("beam", [0.34, 0.23, 0.14]);
    let tent = surface(12, 1, true, |side, row| {
        let angle = -TAU * side as f64 / 12.0;
        let (radius, height) = [(0.2, 0.0), (0.05, 0.16)][row];
        DVec3::new(radius * angle.cos(), height, radius * angle.sin())
    });
    let mut glow = TriangleMesh::new();
    let p = |x: f64, z: f64| DVec3::new(x, 0.04, z);
    glow.quad([p(-0.06, -0.06), p(0.06, -0.06), p(0.06, 0.06), p(-0.06, 0.06)]);
    let cord = tube(&[(DVec3::Y * 0.14, 0.008), (DVec3::Y * 1.4, 0.008)], 5, false);
    let lamp = document.mesh("hanging lamp", &[(&tent, shade), (&glow, warm), (&cord, beam)]);
    for i in 0..12u32 {
        let (column, row) = (i % 4, i / 4);
        let drop = 2.15 + 0.05 * f64::from(hash(i, 5) % 7);
        let at = DVec3::new(
            3.0 * f64::from(column) - 4.5 + 0.1 * f64::from(hash(i, 9) % 5),
            drop,
            2.6 * f64::from(row) - 2.7,
        );
        document.place("hanging lamp", lamp, DAffine3::from_translation(at));
    }
    let mut beams = TriangleMesh::new();
    for k in -2..=2 {
        let x = 2.4 * f64::from(k);
        beams.add(block(DVec3::new(x - 0.1, HEIGHT - 0.26, -HALF_Z), DVec3::new(x + 0.1, HEIGHT, HALF_Z)));
    }
    document.fixture("beams", &beams, beam);
    let mut lit = TriangleMesh::new();
    for (x, z) in [(-2.4, -2.0), (2.4, 2.0), (0.0, 0.0)] {
        let y = HEIGHT - 0.27;
        lit.quad(
            [(-0.03, -0.5), (0.03, -0.5), (0.03, 0.5), (-0.03, 0.5)].map(|(dx, dz)| DVec3::new(x + dx, y, z + dz)),
        );
    }
    document.fixture("tubes", &lit, cool);
}

/// Three workbenches with a vice, a lathe's bed and shelves along the back wall.
fn benches(document: &mut GlbBuilder) {
    let wood = document.matte("bench", [0.50, 0.33, 0.18]);
    let steel = document.matte("steel", [0.34, 0.36, 0.38]);
    let green = document.matte("machine", [0.16, 0.34, 0.24]);
    let mut bench = block(DVec3::new(-1.1, 0.82, -0.4), DVec3::new(1.1, 0.9, 0.4));
    for (x, z) in [(1.0, 0.3), (-1.0, 0.3), (1.0, -0.3), (-1.0, -0.3)] {
        bench.add(standing_block(x, z, DVec3::new(0.1, 0.82, 0.1)));
    }
    bench.add(block(DVec3::new(-1.0, 0.2, -0.3), DVec3::new(1.0, 0.24, 0.3)));
    let mut vice = standing_block(0.8, 0.2, DVec3::new(0.16, 0.12, 0.2)).moved(DVec3::Y * 0.9);
    vice.add(block(DVec3::new(0.74, 1.0, 0.34), DVec3::new(0.86, 1.08, 0.44)));
    let rod = tube(&[(DVec3::new(0.62, 0.98, 0.44), 0.012), (DVec3::new(0.98, 0.98, 0.44), 0.012)], 8, false);
    vice.add(rod);
    let bench = document.mesh("workbench", &[(&bench, wood), (&vice, steel)]);
    for (x, z, turn) in [(-1.2, -3.2, 0.0), (-4.2, -3.2, 0.0), (0.4, 0.2, 0.35)] {
        let pose = DAffine3::from_translation(DVec3::new(x, 0.0, z)) * DAffine3::from_rotation_y(turn);
        document.place("workbench", bench, pose);
    }
    let mut machine = block(DVec3::new(2.6, 0.0, -3.4), DVec3::new(4.8, 0.75, -2.6));
    machine.add(block(DVec3::new(2.6, 0.75, -3.3), DVec3::new(3.2, 1.35, -2.7)));
    machine.add(block(DVec3::new(4.3, 0.75, -3.2), DVec3::new(4.7, 1.2, -2.8)));
    document.fixture("lathe", &machine, green);
    let spindle = lathe(&[(0.0, 0.0), (0.12, 0.0), (0.12, 0.2), (0.05, 0.22), (0.05, 1.1), (0.0, 1.1)], 20);
    let pose = DAffine3::from_translation(DVec3::new(3.2, 1.05, -3.0)) * DAffine3::from_rotation_z(-FRAC_PI_2);
    document.fixture("spindle", &spindle.transformed(pose), steel);
    let mut shelves = TriangleMesh::new();
    for level in 0..3 {
        let y = 1.35 + 0.5 * f64::from(level);
        shelves.add(block(DVec3::new(-5.6, y, -HALF_Z), DVec3::new(1.0, y + 0.03, -HALF_Z + 0.3)));
    }
    for x in [-5.6, -3.4, -1.2, 0.96] {
        shelves.add(block(DVec3::new(x, 1.35, -HALF_Z), DVec3::new(x + 0.04, 2.7, -HALF_Z + 0.28)));
    }
    document.fixture("shelves", &shelves, wood);
}

/// Tins and boxes on the shelves and benches, crates and barrels on the floor, pipes along the walls.
fn clutter(document: &mut GlbBuilder) {
    let share = |i: u32, salt: u32| f64::from(hash(i, salt) % 1000) / 1000.0;
    let colors = [[0.58, 0.14, 0.10], [0.62, 0.50, 0.12], [0.14, 0.26, 0.46], [0.58, 0.56, 0.52], [0.22, 0.40, 0.20]];
    for (k, color) in (0u32..).zip(colors) {
        let material = document.matte(&format!("tin {k}"), color);
        let mut things = TriangleMesh::new();
        for i in (0..120u32).filter(|i| hash(*i, 1) % 5 == k) {
            let size = 0.05 + 0.07 * share(i, 2);
            let at = if i < 80 {
                let shelf = f64::from(i % 3);
                DVec3::new(-5.5 + 6.3 * share(i, 3), 1.38 + 0.5 * shelf, -HALF_Z + 0.16)
            } else {
                let (x, z) = [(-1.2, -3.2), (-4.2, -3.2), (0.4, 0.2)][i as usize % 3];
                DVec3::new(x - 0.9 + 1.5 * share(i, 3), 0.9, z - 0.2 + 0.3 * share(i, 4))
            };
            if hash(i, 6).is_multiple_of(2) {
                let tall = 2.4 * size;
                let profile = [(0.0, 0.0), (size, 0.0), (size, tall), (0.9 * size, tall + 0.01), (0.0, tall + 0.01)];
                things.add(lathe(&profile, 14).moved(at));
            } else {
                things.add(
                    standing_block(at.x, at.z, DVec3::new(1.6, 1.4 + share(i, 7), 1.4) * size).moved(DVec3::Y * at.y),
                );
            }
        }
        document.fixture(&format!("tins {k}"), &things, material);
    }
    let plank = document.matte("crate", [0.58, 0.44, 0.26]);
    let mut crate_mesh = TriangleMesh::new();
    for side in 0..4 {
        let turn = DAffine3::from_rotation_y(f64::from(side) * FRAC_PI_2);
        for k in 0..4 {
            let low = 0.02 + 0.15 * f64::from(k);
            let board = block(DVec3::new(-0.3, low, 0.27), DVec3::new(0.3, low + 0.12, 0.3));
            crate_mesh.add(board.transformed(turn));
        }
        let post = block(DVec3::new(0.24, 0.0, 0.24), DVec3::new(0.3, 0.62, 0.3));
        crate_mesh.add(post.transformed(turn));
    }
    crate_mesh.add(block(DVec3::new(-0.27, 0.02, -0.27), DVec3::new(0.27, 0.05, 0.27)));
    let crate_mesh = document.mesh("crate", &[(&crate_mesh, plank)]);
    for (x, y, z, turn) in [
        (-4.8, 0.0, 1.2, 0.2),
        (-4.7, 0.64, 1.25, 0.5),
        (-4.0, 0.0, 1.5, -0.1),
        (2.6, 0.0, -0.9, 0.6),
        (-2.4, 0.0, 2.6, 0.9),
        (3.4, 0.0, 0.6, 0.1),
        (3.5, 0.64, 0.55, 0.4),
    ] {
        let pose = DAffine3::from_translation(DVec3::new(x, y, z)) * DAffine3::from_rotation_y(turn);
        document.place("crate", crate_mesh, pose);
    }
    let rust = document.matte("rust", [0.48, 0.22, 0.11]);
    let profile = [
        (0.0, 0.0),
        (0.28, 0.0),
        (0.3, 0.03),
        (0.3, 0.3),
        (0.32, 0.32),
        (0.3, 0.34),
        (0.3, 0.85),
        (0.27, 0.88),
        (0.27, 0.84),
        (0.0, 0.84),
    ];
    let barrel = document.mesh("barrel", &[(&lathe(&profile, 28), rust)]);
    for (x, z) in [(5.4, -1.2), (5.35, -0.5), (-5.5, -0.6), (-1.0, 3.4), (-0.3, 3.5)] {
        document.place("barrel", barrel, DAffine3::from_translation(DVec3::new(x, 0.0, z)));
    }
    let copper = document.matte("pipe", [0.60, 0.34, 0.22]);
    let mut pipes = TriangleMesh::new();
    for (radius, y, z) in [(0.05, 3.1, 3.85), (0.04, 2.95, 3.88), (0.06, 0.3, 3.86)] {
        pipes.add(tube(&[(DVec3::new(-HALF_X, y, z), radius), (DVec3::new(HALF_X, y, z), radius)], 12, false));
    }
    for x in [-5.85, 5.85] {
        pipes.add(tube(&[(DVec3::new(x, 0.0, 2.0), 0.06), (DVec3::new(x, HEIGHT, 2.0), 0.06)], 12, false));
    }
    document.fixture("pipes", &pipes, copper);
}
