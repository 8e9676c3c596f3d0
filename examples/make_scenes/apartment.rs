//! A furnished apartment of three rooms: the sun comes in through two windows, a lamp of its own lights the room at the
//! back.

use crate::glb::GlbBuilder;
use crate::mesh::TriangleMesh;
use crate::paintings;
use crate::shapes::{block, ellipsoid, frame, lathe, panel, pierced_wall, smooth_profile, standing_block, tiles, tube};
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Probes fill the rooms.
pub const SCENE: &str = r#"// Probes fill the rooms.
Scene(
    gltf: "apartment.glb",
    grid: ((0.0, 0.0, 0.0), (10.0, 2.7, 7.0)),
    camera: "living",
)
"#;

/// Skylight through windows, and next to nothing else.
pub const OVERCAST: &str = r#"// The apartment under a sky that outshines its sun and its lamp.
Scene(
    gltf: "apartment.glb",
    grid: ((0.0, 0.0, 0.0), (10.0, 2.7, 7.0)),
    environment: Constant(radiance: (100, 100, 100)),
    camera: "living",
)
"#;

/// The rooms' extents inside the outer walls, and how thick walls are. Metres; z = 0 is the side of the windows' back.
const LENGTH: f64 = 10.0;
const DEPTH: f64 = 7.0;
const HEIGHT: f64 = 2.7;
const WALL: f64 = 0.24;
/// Where the wall between living room and bedroom stands, and the one behind the bedroom.
const SPLIT_X: f64 = 6.2;
const SPLIT_Z: f64 = 3.0;

pub fn apartment() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    building(&mut document);
    living_room(&mut document);
    dining(&mut document);
    bedroom(&mut document);
    document.sun("sun", DVec3::new(-1.4, 4.0, 5.2), [60.0, 54.0, 45.0]);
    document.camera("living", DVec3::new(0.5, 1.6, 0.6), DVec3::new(4.6, 0.95, 5.0), 62.0);
    document.camera("bedroom", DVec3::new(9.7, 1.6, 6.6), DVec3::new(6.9, 0.8, 3.6), 60.0);
    document.camera("dining", DVec3::new(6.6, 1.6, 0.5), DVec3::new(9.0, 0.9, 2.6), 62.0);
    document
}

/// A wall that begins at a place and runs along +X, or along +Z when turned.
fn wall_at(mesh: TriangleMesh, x: f64, z: f64, along_z: bool) -> TriangleMesh {
    let turn = if along_z { -FRAC_PI_2 } else { 0.0 };
    mesh.transformed(DAffine3::from_translation(DVec3::new(x, 0.0, z)) * DAffine3::from_rotation_y(turn))
}

fn building(document: &mut GlbBuilder) {
    let plaster = document.matte("plaster", [0.78, 0.76, 0.72]);
    let accent = document.matte("accent wall", [0.32, 0.46, 0.44]);
    let white = document.matte("woodwork", [0.80, 0.80, 0.78]);
    let boards = document.textured("boards", &paintings::boards());
    let floor = tiles(DVec3::new(-WALL, 0.0, -WALL), DVec2::new(LENGTH + 2.0 * WALL, DEPTH + 2.0 * WALL), 10, 7);
    document.fixture("floor", &floor, boards);
    let ceiling = block(DVec3::new(-WALL, HEIGHT, -WALL), DVec3::new(LENGTH + WALL, HEIGHT + 0.2, DEPTH + WALL));
    document.fixture("ceiling", &ceiling, white);

    let half = WALL / 2.0;
    let mut outer = TriangleMesh::new();
    let windows = [[1.2, 3.6, 0.5, 2.3], [7.6, 9.0, 0.9, 2.2]];
    outer.add(wall_at(pierced_wall(LENGTH, HEIGHT, WALL, &windows), 0.0, DEPTH + half, false));
    outer.add(wall_at(pierced_wall(LENGTH, HEIGHT, WALL, &[]), 0.0, -half, false));
    for x in [-half, LENGTH + half] {
        outer.add(wall_at(pierced_wall(DEPTH + 2.0 * WALL, HEIGHT, WALL, &[]), x, -WALL, true));
    }
    document.fixture("outer walls", &outer, plaster);

    let mut inner = TriangleMesh::new();
    let doors = [[0.9, 1.8, 0.0, 2.1], [4.6, 5.5, 0.0, 2.1]];
    inner.add(wall_at(pierced_wall(DEPTH, HEIGHT, 0.12, &doors), SPLIT_X, 0.0, true));
    document.fixture("accent wall", &inner, accent);
    let back = pierced_wall(LENGTH - SPLIT_X - 0.06, HEIGHT, 0.12, &[[2.2, 3.1, 0.0, 2.1]]);
    document.fixture("partition", &wall_at(back, SPLIT_X + 0.06, SPLIT_Z, false), plaster);

    // Frames and crossbars of the windows, skirting along the living room's back.
    let mut woodwork = TriangleMesh::new();
    for [from, to, low, high] in windows {
        let z = DEPTH + half;
        let bar =
            |x0: f64, x1: f64, y0: f64, y1: f64| block(DVec3::new(x0, y0, z - 0.03), DVec3::new(x1, y1, z + 0.03));
        let middle = (from + to) / 2.0;
        for x in [from + 0.03, middle, to - 0.03] {
            woodwork.add(bar(x - 0.03, x + 0.03, low, high));
        }
        for y in [low + 0.03, low + 0.62 * (high - low), high - 0.03] {
            woodwork.add(bar(from, to, y - 0.03, y + 0.03));
        }
        woodwork.add(block(DVec3::new(from - 0.1, low - 0.05, DEPTH - 0.2), DVec3::new(to + 0.1, low, DEPTH)));
    }
    woodwork.add(block(DVec3::new(0.0, 0.0, 0.0), DVec3::new(SPLIT_X - 0.06, 0.09, 0.02)));
    woodwork.add(block(DVec3::new(0.0, 0.0, 0.02), DVec3::new(0.02, 0.09, DEPTH)));
    document.fixture("woodwork", &woodwork, white);
}

/// A cushion: a box with round edges.
fn cushion(at: DVec3, size: DVec3) -> TriangleMesh {
    let profile: Vec<(f64, f64)> =
        (0..=6).map(|i| PI * (f64::from(i) / 6.0 - 0.5)).map(|a| (a.cos().max(0.0).powf(0.4), a.sin())).collect();
    let round = lathe(&profile, 24);
    round.transformed(DAffine3::from_scale_rotation_translation(size / 2.0, glam::DQuat::IDENTITY, at))
}

fn living_room(document: &mut GlbBuilder) {
    let fabric = document.matte("sofa", [0.36, 0.40, 0.48]);
    let pillow = document.matte("pillow", [0.76, 0.46, 0.14]);
    let wood = document.matte("oak", [0.46, 0.30, 0.17]);
    let dark = document.matte("walnut", [0.22, 0.13, 0.08]);
    let rug = document.textured("rug", &paintings::rug());
    document.fixture("rug", &tiles(DVec3::new(2.0, 0.012, 2.6), DVec2::new(2.6, 2.0), 1, 1), rug);

    let mut sofa = TriangleMesh::new();
    sofa.add(block(DVec3::new(5.1, 0.1, 2.3), DVec3::new(6.05, 0.4, 4.5)));
    sofa.add(block(DVec3::new(5.85, 0.4, 2.3), DVec3::new(6.05, 0.85, 4.5)));
    for z in [2.3, 4.3] {
        sofa.add(block(DVec3::new(5.1, 0.4, z), DVec3::new(5.85, 0.6, z + 0.2)));
    }
    for z in [2.95, 3.85] {
        sofa.add(cushion(DVec3::new(5.48, 0.46, z), DVec3::new(0.74, 0.16, 0.88)));
        sofa.add(cushion(DVec3::new(5.78, 0.68, z), DVec3::new(0.2, 0.4, 0.84)));
    }
    document.fixture("sofa", &sofa, fabric);
    document.fixture("pillows", &cushion(DVec3::new(5.55, 0.66, 2.7), DVec3::new(0.2, 0.36, 0.36)), pillow);

    let mut table = TriangleMesh::new();
    table.add(lathe(&[(0.0, 0.4), (0.5, 0.4), (0.52, 0.42), (0.5, 0.44), (0.0, 0.44)], 32));
    for (x, z) in [(0.3, 0.3), (-0.3, 0.3), (0.3, -0.3), (-0.3, -0.3)] {
        table.add(standing_block(x, z, DVec3::new(0.05, 0.4, 0.05)));
    }
    document.fixture("table", &table.moved(DVec3::new(3.4, 0.0, 3.6)), wood);

    // Shelves with books along the left wall.
    let mut shelves = TriangleMesh::new();
    for i in 0..5 {
        let y = 0.4 * f64::from(i);
        shelves.add(block(DVec3::new(0.02, y + 0.1, 1.6), DVec3::new(0.34, y + 0.13, 3.4)));
    }
    for z in [1.57, 3.4] {
        shelves.add(block(DVec3::new(0.02, 0.0, z), DVec3::new(0.34, 1.8, z + 0.03)));
    }
    document.fixture("shelves", &shelves, dark);
    let colors = [[0.55, 0.12, 0.10], [0.14, 0.28, 0.48], [0.62, 0.56, 0.42], [0.18, 0.38, 0.20], [0.60, 0.42, 0.10]];
    for (k, color) in colors.into_iter().enumerate() {
        let material = document.matte(&format!("books {k}"), color);
        let mut books = TriangleMesh::new();
        for shelf in 0..4u32 {
            let mut z = 1.64;
            for book in 0..40u32 {
                let chance = paintings::hash(book, shelf);
                let (thick, tall) = (0.02 + 0.001 * f64::from(chance % 35), 0.2 + 0.001 * f64::from(chance / 64 % 120));
                if z + thick > 3.36 - 0.1 * f64::from(chance / 9000 % 5) {
                    break;
                }
                if chance as usize / 7 % colors.len() == k {
                    let low = 0.13 + 0.4 * f64::from(shelf);
                    books.add(block(DVec3::new(0.06, low, z), DVec3::new(0.3, low + tall, z + thick - 0.002)));
                }
                z += thick;
            }
        }
        document.fixture(&format!("books {k}"), &books, material);
    }

    // Two pictures on the accent wall and one on the back wall.
    let landscape = document.textured("landscape", &paintings::landscape());
    let composition = document.textured("composition", &paintings::composition());
    let profile = [(0.05, 0.0), (0.05, 0.03), (0.0, 0.02), (0.0, 0.0)];
    for (name, canvas, width, height, place) in [
        ("landscape", landscape, 1.2, 0.8, (DVec3::new(SPLIT_X - 0.062, 1.6, 3.2), -FRAC_PI_2)),
        ("composition", composition, 0.8, 0.8, (DVec3::new(3.2, 1.6, 0.002), 0.0)),
    ] {
        let picture = document.mesh(
            name,
            &[(&panel(width, height).moved(DVec3::Z * 0.008), canvas), (&frame(width, height, &profile), dark)],
        );
        document.place(name, picture, DAffine3::from_translation(place.0) * DAffine3::from_rotation_y(place.1));
    }

    // A plant by the window.
    let pot = document.matte("pot", [0.62, 0.32, 0.20]);
    let leaf = document.cloth("leaf", [0.12, 0.34, 0.10]);
    let at = DVec3::new(0.55, 0.0, 6.3);
    let profile = smooth_profile(&[(0.0, 0.0), (0.16, 0.0), (0.2, 0.2), (0.24, 0.4), (0.2, 0.4), (0.0, 0.36)], 3);
    document.fixture("pot", &lathe(&profile, 24).moved(at), pot);
    let mut leaves = TriangleMesh::new();
    for i in 0..28u32 {
        let turn = 2.4 * f64::from(i);
        let (reach, rise) = (0.25 + 0.012 * f64::from(i % 9), 0.5 + 0.032 * f64::from(i));
        let blade = |along: f64, side: f64| {
            let width = 0.07 * (PI * along).sin() * side;
            DVec3::new(reach * along + 0.02, rise * along - 0.35 * along * along * along, width)
        };
        let mut one = TriangleMesh::new();
        for k in 0..4 {
            let (a, b) = (f64::from(k) / 4.0, f64::from(k + 1) / 4.0);
            one.quad([blade(a, 1.0), blade(a, -1.0), blade(b, -1.0), blade(b, 1.0)]);
        }
        leaves.add(one.transformed(DAffine3::from_translation(at + DVec3::Y * 0.36) * DAffine3::from_rotation_y(turn)));
    }
    document.fixture("plant", &leaves, leaf);
}

/// A table and four chairs in the room at the windows' back.
fn dining(document: &mut GlbBuilder) {
    let wood = document.matte("beech", [0.62, 0.47, 0.30]);
    let seat = document.matte("seat", [0.56, 0.16, 0.13]);
    let cabinet = document.matte("cabinet", [0.70, 0.70, 0.66]);
    let china = document.matte("china", [0.78, 0.78, 0.76]);
    let (x, z) = (8.1, 1.45);
    let mut table = block(DVec3::new(x - 0.7, 0.71, z - 0.42), DVec3::new(x + 0.7, 0.75, z + 0.42));
    for (dx, dz) in [(0.62, 0.34), (-0.62, 0.34), (0.62, -0.34), (-0.62, -0.34)] {
        table.add(standing_block(x + dx, z + dz, DVec3::new(0.06, 0.71, 0.06)));
    }
    document.fixture("dining table", &table, wood);
    let mut chair = TriangleMesh::new();
    for (dx, dz) in [(0.19, 0.19), (-0.19, 0.19), (0.19, -0.19), (-0.19, -0.19)] {
        let height = if dz < 0.0 { 0.92 } else { 0.44 };
        chair.add(standing_block(dx, dz, DVec3::new(0.04, height, 0.04)));
    }
    for y in [0.62, 0.74, 0.86] {
        chair.add(block(DVec3::new(-0.19, y, -0.2), DVec3::new(0.19, y + 0.05, -0.18)));
    }
    let chair =
        document.mesh("chair", &[(&chair, wood), (&cushion(DVec3::Y * 0.46, DVec3::new(0.44, 0.07, 0.44)), seat)]);
    for (dx, dz, turn) in [(-0.35, -0.62, 0.1), (0.35, -0.6, -0.05), (-0.35, 0.62, PI), (0.36, 0.66, PI + 0.2)] {
        let at = DVec3::new(x + dx, 0.0, z + dz);
        document.place("chair", chair, DAffine3::from_translation(at) * DAffine3::from_rotation_y(turn));
    }
    let mut kitchen = block(DVec3::new(9.4, 0.0, 0.0), DVec3::new(10.0, 0.9, 2.6));
    kitchen.add(block(DVec3::new(9.65, 1.5, 0.0), DVec3::new(10.0, 2.2, 2.0)));
    document.fixture("kitchen", &kitchen, cabinet);
    let vase = smooth_profile(
        &[(0.0, 0.0), (0.07, 0.0), (0.11, 0.1), (0.05, 0.22), (0.07, 0.27), (0.05, 0.27), (0.0, 0.1)],
        3,
    );
    document.fixture("vase", &lathe(&vase, 20).moved(DVec3::new(x, 0.75, z)), china);
}

/// A bed, a wardrobe and a lamp.
fn bedroom(document: &mut GlbBuilder) {
    let linen = document.matte("linen", [0.76, 0.75, 0.78]);
    let blanket = document.matte("blanket", [0.24, 0.30, 0.52]);
    let wood = document.matte("teak", [0.40, 0.24, 0.14]);
    let glow = document.glowing("lamp", [16.0, 12.0, 7.5]);
    let mut bed = block(DVec3::new(6.32, 0.0, 4.9), DVec3::new(8.4, 0.3, 6.7));
    bed.add(block(DVec3::new(6.27, 0.0, 4.9), DVec3::new(6.33, 1.0, 6.7)));
    document.fixture("bed", &bed, wood);
    let mut sheets = cushion(DVec3::new(7.36, 0.38, 5.8), DVec3::new(2.04, 0.24, 1.76));
    for z in [5.35, 6.25] {
        sheets.add(cushion(DVec3::new(6.62, 0.54, z), DVec3::new(0.4, 0.16, 0.66)));
    }
    document.fixture("sheets", &sheets, linen);
    document.fixture("blanket", &cushion(DVec3::new(7.8, 0.42, 5.8), DVec3::new(1.2, 0.26, 1.84)), blanket);
    document.fixture("wardrobe", &block(DVec3::new(9.4, 0.0, 3.2), DVec3::new(10.0, 2.2, 5.2)), wood);
    // A hanging lamp that lights downwards, under a shade.
    let shade = document.cloth("shade", [0.72, 0.60, 0.42]);
    let at = DVec3::new(7.9, 1.85, 4.3);
    document.fixture("shade", &lathe(&[(0.3, 0.0), (0.18, 0.3)], 24).moved(at), shade);
    let cord = tube(&[(at + DVec3::Y * 0.28, 0.01), (DVec3::new(at.x, HEIGHT, at.z), 0.01)], 6, false);
    document.fixture("cord", &cord, wood);
    let mut bulb = TriangleMesh::new();
    let p = |x: f64, z: f64| at + DVec3::new(x, 0.08, z);
    bulb.quad([p(-0.14, -0.14), p(0.14, -0.14), p(0.14, 0.14), p(-0.14, 0.14)]);
    document.fixture("lamp", &bulb, glow);
    document.fixture("ball", &ellipsoid(DVec3::new(9.0, 0.16, 6.2), DVec3::splat(0.16), 24, 12), blanket);
}
