//! A long closed hall: two rows of columns carry arches, drapes hang in the aisles, and a figure and a ball stand in
//! the light of one spot. After the hall of Nijasure, Pattanaik and Goel, "Real-Time Global Illumination on GPU".

use crate::figure::figure;
use crate::glb::GlbBuilder;
use crate::mesh::TriangleMesh;
use crate::shapes::{Arch, block, ellipsoid, lathe, smooth_profile, standing_block, surface};
use glam::{DAffine3, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The probes' box leaves out the vault, so that the cells of any grid have their middle inside the room.
pub const SCENE: &str = r#"// Probes fill the hall up to where the vault begins.
Scene(
    gltf: "hall.glb",
    grid: ((-4.2, 0.0, -9.0), (4.2, 4.8, 9.0)),
    camera: "nave",
)
"#;

/// The same with a glossy ball.
pub const GLOSSY: &str = r#"// The hall with a glossy ball and a figure of polished stone.
Scene(
    gltf: "hall.glb",
    grid: ((-4.2, 0.0, -9.0), (4.2, 4.8, 9.0)),
    materials: {
        "ball": (specular: 0.25, shininess: 40),
        "figure": (specular: 0.2, shininess: 12),
    },
    camera: "nave",
)
"#;

/// The same with a ball that rolls across the light.
pub const MOVING: &str = r#"// The hall with a ball that rolls to and fro through the light.
Scene(
    gltf: "hall.glb",
    grid: ((-4.2, 0.0, -9.0), (4.2, 4.8, 9.0)),
    motion: {
        "ball": [
            (time: 0.0, translation: (0.85, 0.47, 1.6)),
            (time: 2.0, translation: (-1.2, 0.47, 2.2)),
            (time: 4.0, translation: (0.85, 0.47, 1.6)),
        ],
    },
    camera: "nave",
)
"#;

/// Half the hall's width, half its length, and the height at which walls end. Metres.
const HALF_WIDTH: f64 = 4.2;
const HALF_LENGTH: f64 = 9.0;
const WALL: f64 = 4.8;
/// The columns' distance from the middle and from each other.
const COLUMN_X: f64 = 2.4;
const BAY: f64 = 3.0;
/// The nave between the arcades, and how far its vault rises above the walls.
const NAVE: f64 = 2.15;
const VAULT_RISE: f64 = 1.15;
const SPRINGING: f64 = 2.5;

pub fn hall() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    shell(&mut document);
    arcades(&mut document);
    end_walls(&mut document);
    drapes(&mut document);
    figure_and_ball(&mut document);
    document.spot_light("spot", DVec3::new(-1.7, 4.7, 4.9), DVec3::new(1.0, 0.4, 0.6), 560.0, [24.0, 30.0]);
    document.camera("nave", DVec3::new(-0.65, 1.62, 7.4), DVec3::new(0.12, 1.72, 0.0), 50.0);
    document.camera("aisle", DVec3::new(3.5, 1.7, 7.0), DVec3::new(-0.6, 1.4, -2.0), 55.0);
    document
}

/// Floor, carpet, walls, aisle ceilings and the vault with its ribs.
fn shell(document: &mut GlbBuilder) {
    let stone = document.matte("floor", [0.68, 0.63, 0.54]);
    let carpet = document.matte("carpet", [0.62, 0.07, 0.06]);
    let plaster = document.matte("plaster", [0.80, 0.76, 0.68]);
    let ochre = document.matte("aisle wall", [0.76, 0.50, 0.22]);
    let sky = document.matte("vault", [0.60, 0.68, 0.78]);

    let (w, l) = (HALF_WIDTH, HALF_LENGTH);
    let mut floor = TriangleMesh::new();
    floor.quad([(-w, l), (w, l), (w, -l), (-w, -l)].map(|(x, z)| DVec3::new(x, 0.0, z)));
    document.fixture("floor", &floor, stone);
    document.fixture("carpet", &block(DVec3::new(-0.95, 0.0, -7.6), DVec3::new(0.95, 0.02, 8.6)), carpet);

    let mut sides = TriangleMesh::new();
    let mut ceilings = TriangleMesh::new();
    for turn in [0.0, PI] {
        let turned = DAffine3::from_rotation_y(turn);
        let mut side = TriangleMesh::new();
        side.quad([(-l, 0.0), (l, 0.0), (l, WALL), (-l, WALL)].map(|(z, y)| DVec3::new(w, y, z)));
        sides.add(side.transformed(turned));
        let mut ceiling = TriangleMesh::new();
        ceiling.quad([(NAVE, -l), (w, -l), (w, l), (NAVE, l)].map(|(x, z)| DVec3::new(x, WALL, z)));
        ceilings.add(ceiling.transformed(turned));
    }
    document.fixture("side walls", &sides, ochre);
    document.fixture("aisle ceilings", &ceilings, plaster);

    let segments = 14;
    let vault = surface(segments, 1, false, |segment, row| {
        vault_point(segment, segments, 0.0).extend(if row == 0 { -l } else { l })
    });
    document.fixture("vault", &vault, sky);
    let rib = surface(segments, 3, false, |segment, row| {
        let (depth, z) = [(0.0, -0.16), (0.14, -0.16), (0.14, 0.16), (0.0, 0.16)][row];
        vault_point(segment, segments, depth).extend(z)
    });
    let rib = document.mesh("rib", &[(&rib, plaster)]);
    let corbel = document.mesh("corbel", &[(&standing_block(0.0, 0.0, DVec3::new(0.2, 0.3, 0.4)), plaster)]);
    for i in -2..=2 {
        document.place("rib", rib, DAffine3::from_translation(DVec3::new(0.0, 0.0, BAY * f64::from(i))));
        for side in [-1.0, 1.0] {
            let at = DVec3::new(side * (NAVE - 0.1), WALL - 0.3, BAY * f64::from(i));
            document.place("corbel", corbel, DAffine3::from_translation(at));
        }
    }
}

/// A point of the vault's cross-section from the left wall to the right one, `depth` below the surface.
fn vault_point(segment: usize, segments: usize, depth: f64) -> glam::DVec2 {
    let angle = PI * (1.0 - segment as f64 / segments as f64);
    glam::DVec2::new((NAVE - depth) * angle.cos(), WALL + (VAULT_RISE - depth) * angle.sin())
}

/// Columns on bases, and the walls with arches that they carry.
fn arcades(document: &mut GlbBuilder) {
    let wall = document.matte("arcade", [0.80, 0.76, 0.68]);
    let marble = document.matte("column", [0.78, 0.74, 0.67]);
    let arch = Arch {
        width: BAY,
        bottom: SPRINGING,
        springing: SPRINGING,
        top: WALL,
        radius: 1.2,
        thickness: 2.0 * (COLUMN_X - NAVE),
        segments: 11,
    };
    let mut bay = arch.wall();
    bay.add(arch.moulding(0.12, 0.05));
    let bay = document.mesh("bay", &[(&bay, wall)]);

    let profile = [
        (0.31, 0.14),
        (0.31, 0.20),
        (0.25, 0.25),
        (0.232, 1.2),
        (0.195, 2.22),
        (0.235, 2.24),
        (0.235, 2.27),
        (0.30, 2.40),
    ];
    let mut column = lathe(&profile, 12);
    column.add(standing_block(0.0, 0.0, DVec3::new(0.66, 0.14, 0.66)));
    column.add(standing_block(0.0, 0.0, DVec3::new(0.64, 0.11, 0.64)).moved(DVec3::Y * 2.39));
    let column = document.mesh("column", &[(&column, marble)]);
    let pilaster = document.mesh("pilaster", &[(&standing_block(0.0, 0.0, DVec3::new(0.5, SPRINGING, 0.32)), wall)]);

    for side in [-1.0, 1.0] {
        let facing = DAffine3::from_rotation_y(-side * FRAC_PI_2);
        for i in 0..6 {
            let z = BAY * (f64::from(i) - 2.5);
            document.place("bay", bay, DAffine3::from_translation(DVec3::new(side * COLUMN_X, 0.0, z)) * facing);
        }
        for i in -2..=2 {
            let at = DVec3::new(side * COLUMN_X, 0.0, BAY * f64::from(i));
            document.place("column", column, DAffine3::from_translation(at));
        }
        for end in [-1.0, 1.0] {
            let at = DVec3::new(side * COLUMN_X, 0.0, end * (HALF_LENGTH - 0.16));
            document.place("pilaster", pilaster, DAffine3::from_translation(at));
        }
    }
}

/// The walls at both ends under the vault; at the far one an arch frames a blue niche over three steps.
fn end_walls(document: &mut GlbBuilder) {
    let plaster = document.matte("end wall", [0.80, 0.76, 0.68]);
    let blue = document.matte("niche", [0.12, 0.30, 0.58]);
    let gold = document.matte("gold", [0.80, 0.56, 0.18]);
    let stone = document.matte("steps", [0.70, 0.66, 0.58]);
    let segments = 14;
    let (w, l) = (HALF_WIDTH, HALF_LENGTH);
    let mut wall = TriangleMesh::new();
    wall.quad([(-w, 0.0), (w, 0.0), (w, WALL), (-w, WALL)].map(|(x, y)| DVec3::new(x, y, 0.0)));
    for segment in 0..segments {
        let point = |s: usize| vault_point(s, segments, 0.0).extend(0.0);
        wall.triangle([DVec3::new(0.0, WALL, 0.0), point(segment + 1), point(segment)]);
    }
    let wall = document.mesh("end wall", &[(&wall, plaster)]);
    document.place("near wall", wall, DAffine3::from_translation(DVec3::Z * l) * DAffine3::from_rotation_y(PI));
    document.place("far wall", wall, DAffine3::from_translation(DVec3::Z * -l));

    let arch =
        Arch { width: 2.0 * NAVE, bottom: 0.0, springing: 2.6, top: WALL, radius: 1.35, thickness: 0.5, segments: 18 };
    let to_wall = DVec3::Z * (0.25 - l);
    document.fixture("apse", &arch.wall().moved(to_wall), plaster);
    document.fixture("apse moulding", &arch.moulding(0.18, 0.06).moved(to_wall), gold);
    let cornice = block(DVec3::new(-NAVE, WALL, -l), DVec3::new(NAVE, WALL + 0.12, 0.56 - l));
    document.fixture("cornice", &cornice, gold);
    let mut back = TriangleMesh::new();
    let z = 0.02 - l;
    back.quad([(-1.4, 0.0), (1.4, 0.0), (1.4, 4.0), (-1.4, 4.0)].map(|(x, y)| DVec3::new(x, y, z)));
    document.fixture("niche", &back, blue);
    let mut steps = TriangleMesh::new();
    for i in 0..3 {
        let (width, depth, height) = (3.4 - 0.5 * f64::from(i), 1.35 - 0.35 * f64::from(i), 0.15 * f64::from(i + 1));
        let half = width / 2.0;
        steps.add(block(DVec3::new(-half, 0.0, 0.5 - l), DVec3::new(half, height, 0.5 - l + depth)));
    }
    document.fixture("steps", &steps, stone);
    let urn = [(0.0, 0.0), (0.22, 0.0), (0.24, 0.05), (0.09, 0.14), (0.12, 0.2), (0.38, 0.6), (0.34, 0.9), (0.26, 1.0)];
    let mut urn = smooth_profile(&urn, 1);
    urn.extend([(0.32, 1.06), (0.30, 1.08), (0.2, 1.0), (0.0, 0.95)]);
    document.fixture("urn", &lathe(&urn, 10).moved(DVec3::new(0.0, 0.45, 0.95 - l)), gold);
}

/// A pleated cloth in each bay of both aisles, in turn of three colours.
fn drapes(document: &mut GlbBuilder) {
    let colours = [("crimson", [0.58, 0.05, 0.07]), ("teal", [0.04, 0.38, 0.40]), ("emerald", [0.08, 0.42, 0.12])];
    let (pleats, a_pleat) = (4, 4);
    let columns = pleats * a_pleat;
    let cloth = surface(columns, 2, false, |column, row| {
        let along = column as f64 / columns as f64;
        let wave = (TAU * along * pleats as f64).cos();
        let spread = [1.0, 0.96, 0.9][row];
        DVec3::new((along - 0.5) * 1.7 * spread, [0.35, 2.2, 3.75][row], 0.12 + [0.07, 0.06, 0.035][row] * wave)
    });
    let brass = document.matte("rod", [0.62, 0.46, 0.18]);
    let rod = block(DVec3::new(-0.95, 3.73, 0.0), DVec3::new(0.95, 3.79, 0.16));
    let hung = colours.map(|(name, albedo)| {
        let material = document.cloth(name, albedo);
        document.mesh(name, &[(&cloth, material), (&rod, brass)])
    });
    for (side, shift) in [(-1.0, 0), (1.0, 1)] {
        for i in 0..6 {
            let at = DVec3::new(side * HALF_WIDTH, 0.0, BAY * (i as f64 - 2.5));
            let facing = DAffine3::from_rotation_y(-side * FRAC_PI_2);
            document.place("drape", hung[(i + shift) % 3], DAffine3::from_translation(at) * facing);
        }
    }
}

fn figure_and_ball(document: &mut GlbBuilder) {
    let stone = document.matte("plinth", [0.62, 0.60, 0.58]);
    let figure_material = document.matte("figure", [0.66, 0.62, 0.56]);
    let ball_material = document.matte("ball", [0.16, 0.30, 0.72]);
    let (x, z) = (-0.25, 0.2);
    let plinth =
        lathe(&[(0.56, 0.0), (0.56, 0.12), (0.46, 0.16), (0.46, 0.44), (0.52, 0.48), (0.52, 0.56), (0.0, 0.56)], 8);
    document.fixture("plinth", &plinth.moved(DVec3::new(x, 0.0, z)), stone);
    let mesh = document.mesh("figure", &[(&figure(18), figure_material)]);
    let stand = DAffine3::from_translation(DVec3::new(x, 0.56, z)) * DAffine3::from_rotation_y(-0.25);
    document.place("figure", mesh, stand);
    let ball = document.mesh("ball", &[(&ellipsoid(DVec3::ZERO, DVec3::splat(0.45), 24, 12), ball_material)]);
    document.place("ball", ball, DAffine3::from_translation(DVec3::new(0.85, 0.47, 1.6)));
}
