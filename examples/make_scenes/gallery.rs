//! An art gallery of three rooms in a row, with pictures, sculptures, benches and ropes, lit by one spot light.

use crate::figure::figure;
use crate::glb::{GlbBuilder, MaterialIndex, MeshId};
use crate::mesh::TriangleMesh;
use crate::paintings;
use crate::shapes::{Arch, block, ellipsoid, frame, lathe, panel, smooth_profile, standing_block, tube};
use glam::{DAffine3, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Probes fill the rooms.
pub const SCENE: &str = r#"// Probes fill the three rooms.
Scene(
    gltf: "art_gallery.glb",
    grid: ((-9.0, 0.0, -6.0), (9.0, 4.0, 6.0)),
    camera: "main",
)
"#;

/// Half the building's length and width, and its height. Metres.
const HALF_X: f64 = 9.0;
const HALF_Z: f64 = 6.0;
const HEIGHT: f64 = 4.0;
/// Where the inner walls stand, and how thick they are.
const INNER_X: f64 = 3.2;
const INNER_THICKNESS: f64 = 0.36;

pub fn gallery() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    building(&mut document);
    pictures(&mut document);
    sculptures(&mut document);
    benches(&mut document);
    ropes(&mut document);
    document.spot_light("spot", DVec3::new(-2.6, 3.7, 2.3), DVec3::new(1.3, 0.2, -0.5), 340.0, [24.0, 30.0]);
    document.camera("main", DVec3::new(-2.55, 1.65, 5.4), DVec3::new(0.9, 1.35, -1.2), 55.0);
    document.camera("through", DVec3::new(-8.3, 1.65, 1.9), DVec3::new(0.0, 1.3, -0.4), 50.0);
    document.camera("far", DVec3::new(8.3, 1.65, 4.6), DVec3::new(4.5, 1.2, -2.5), 55.0);
    document
}

/// At `position`, turned `degrees` to the left of +Z.
fn pose(position: DVec3, degrees: f64) -> DAffine3 {
    DAffine3::from_translation(position) * DAffine3::from_rotation_y(degrees.to_radians())
}

fn building(document: &mut GlbBuilder) {
    let floor_material = document.matte("floor", [0.70, 0.54, 0.24]);
    let wall = document.matte("wall", [0.76, 0.74, 0.70]);
    let ceiling_material = document.matte("ceiling", [0.80, 0.80, 0.78]);
    let skirting = document.matte("skirting", [0.30, 0.20, 0.12]);
    let feature = document.matte("left wall", [0.62, 0.16, 0.12]);
    let end = document.matte("right wall", [0.16, 0.36, 0.46]);
    let (x, z) = (HALF_X, HALF_Z);
    let flat = |y: f64, corners: [(f64, f64); 4]| {
        let mut mesh = TriangleMesh::new();
        mesh.quad(corners.map(|(x, z)| DVec3::new(x, y, z)));
        mesh
    };
    document.fixture("floor", &flat(0.0, [(-x, z), (x, z), (x, -z), (-x, -z)]), floor_material);
    document.fixture("ceiling", &flat(HEIGHT, [(-x, -z), (x, -z), (x, z), (-x, z)]), ceiling_material);
    let mid = DVec3::Y * (HEIGHT / 2.0);
    let long = panel(2.0 * x, HEIGHT).moved(mid - DVec3::Z * z);
    let mut walls = long.clone();
    walls.add(long.transformed(DAffine3::from_rotation_y(PI)));
    document.fixture("long walls", &walls, wall);
    let short = panel(2.0 * z, HEIGHT).moved(mid - DVec3::Z * x);
    document.fixture("left wall", &short.clone().transformed(DAffine3::from_rotation_y(FRAC_PI_2)), feature);
    document.fixture("right wall", &short.transformed(DAffine3::from_rotation_y(-FRAC_PI_2)), end);

    let arch = Arch {
        width: 2.0 * HALF_Z,
        bottom: 0.0,
        springing: 1.95,
        top: HEIGHT,
        radius: 0.95,
        thickness: INNER_THICKNESS,
        segments: 32,
    };
    let mut trim = arch.moulding(0.14, 0.04);
    trim.add(trim.clone().transformed(DAffine3::from_rotation_y(PI)));
    for side in [-1.0, 1.0] {
        let depth = INNER_THICKNESS / 2.0;
        for face in [-1.0, 1.0] {
            let from = DVec3::new(side * arch.radius, 0.0, face * depth);
            let to = DVec3::new(side * (arch.radius + 0.14), arch.springing, face * (depth + 0.04));
            trim.add(block(from.min(to), from.max(to)));
        }
    }
    let doorway = document.mesh("doorway", &[(&arch.wall(), wall), (&trim, skirting)]);
    for side in [-1.0, 1.0] {
        document.place("doorway", doorway, pose(DVec3::X * (side * INNER_X), 90.0));
    }

    let mut beams = TriangleMesh::new();
    for i in -3..=3 {
        let z = 1.7 * f64::from(i);
        beams.add(block(DVec3::new(-x, HEIGHT - 0.22, z - 0.09), DVec3::new(x, HEIGHT, z + 0.09)));
    }
    document.fixture("beams", &beams, skirting);
    let mut boards = TriangleMesh::new();
    for side in [-1.0, 1.0] {
        let edge = side * (z - 0.03);
        boards.add(block(DVec3::new(-x, 0.0, edge - 0.03), DVec3::new(x, 0.14, edge + 0.03)));
    }
    document.fixture("skirting", &boards, skirting);
}

/// A framed picture: the mesh stands with its back on Z = 0, its middle at the origin.
fn picture(
    document: &mut GlbBuilder,
    name: &str,
    size: [f64; 2],
    frame_material: MaterialIndex,
    canvas: FrameContent,
) -> MeshId {
    let [width, height] = size;
    let profile = [
        (0.11, 0.0),
        (0.11, 0.035),
        (0.10, 0.05),
        (0.08, 0.055),
        (0.065, 0.04),
        (0.05, 0.04),
        (0.035, 0.055),
        (0.012, 0.05),
        (0.0, 0.025),
        (0.0, 0.012),
    ];
    let outside = frame(width, height, &profile);
    let back = panel(width, height).moved(DVec3::Z * 0.012);
    match canvas {
        FrameContent::Painted(material) => document.mesh(name, &[(&outside, frame_material), (&back, material)]),
        FrameContent::Fields(ground, fields) => {
            // The fields lie a millimetre and a half before the ground, each a closed slab.
            let mut upper = TriangleMesh::new();
            let (w, h) = (0.40 * width, height);
            upper.add(block(DVec3::new(-w, 0.05 * h, 0.006), DVec3::new(w, 0.42 * h, 0.0135)));
            let lower = block(DVec3::new(-w, -0.42 * h, 0.006), DVec3::new(w, -0.02 * h, 0.0135));
            let parts = [(&outside, frame_material), (&back, ground), (&upper, fields[0]), (&lower, fields[1])];
            document.mesh(name, &parts)
        }
    }
}

/// What is in a frame: an image, or two fields of colour on a ground.
enum FrameContent {
    Painted(MaterialIndex),
    Fields(MaterialIndex, [MaterialIndex; 2]),
}

fn pictures(document: &mut GlbBuilder) {
    let gold = document.matte("gilt frame", [0.70, 0.50, 0.18]);
    let black = document.matte("dark frame", [0.10, 0.08, 0.07]);
    let landscape = document.textured("landscape", &paintings::landscape());
    let composition = document.textured("composition", &paintings::composition());
    let hues = [
        ("vermilion", [0.72, 0.14, 0.06]),
        ("ultramarine", [0.07, 0.11, 0.52]),
        ("saffron", [0.82, 0.56, 0.08]),
        ("viridian", [0.06, 0.36, 0.24]),
        ("plum", [0.32, 0.07, 0.26]),
        ("ivory", [0.80, 0.76, 0.64]),
    ]
    .map(|(name, albedo)| document.matte(name, albedo));
    let fields =
        |ground: usize, upper: usize, lower: usize| FrameContent::Fields(hues[ground], [hues[upper], hues[lower]]);
    let kinds = [
        picture(document, "landscape", [1.9, 1.3], gold, FrameContent::Painted(landscape)),
        picture(document, "warm fields", [1.2, 1.6], black, fields(0, 2, 4)),
        picture(document, "composition", [1.4, 1.4], black, FrameContent::Painted(composition)),
        picture(document, "cool fields", [1.2, 1.6], black, fields(1, 3, 5)),
        picture(document, "night fields", [1.6, 1.1], gold, fields(4, 1, 2)),
        picture(document, "green fields", [1.0, 1.3], gold, fields(3, 5, 2)),
    ];
    let inner = INNER_X - INNER_THICKNESS / 2.0;
    let outer = INNER_X + INNER_THICKNESS / 2.0;
    // Kind, x, z, degrees to the left of +Z.
    let hung = [
        (0, 0.0, -HALF_Z, 0.0),
        (5, -2.1, -HALF_Z, 0.0),
        (3, 2.1, -HALF_Z, 0.0),
        (2, inner, -3.1, -90.0),
        (1, inner, 2.6, -90.0),
        (4, inner, 4.6, -90.0),
        (1, -inner, -2.6, 90.0),
        (2, -inner, 3.4, 90.0),
        (4, 0.0, HALF_Z, 180.0),
        (0, 6.1, -HALF_Z, 0.0),
        (1, 4.3, -HALF_Z, 0.0),
        (2, 7.9, -HALF_Z, 0.0),
        (0, HALF_X, 0.0, -90.0),
        (3, HALF_X, -3.4, -90.0),
        (5, HALF_X, 3.4, -90.0),
        (3, outer, 3.0, 90.0),
        (4, outer, -3.2, 90.0),
        (0, -6.1, -HALF_Z, 0.0),
        (5, -4.4, -HALF_Z, 0.0),
        (3, -7.9, -HALF_Z, 0.0),
        (2, -HALF_X, 0.0, 90.0),
        (5, -HALF_X, 3.2, 90.0),
        (1, -outer, 3.0, -90.0),
        (5, -outer, -3.0, -90.0),
    ];
    for (kind, x, z, degrees) in hung {
        document.place("picture", kinds[kind], pose(DVec3::new(x, 1.75, z), degrees));
    }
}

fn sculptures(document: &mut GlbBuilder) {
    let marble = document.matte("marble", [0.78, 0.76, 0.72]);
    let bronze = document.matte("bronze", [0.36, 0.22, 0.10]);
    let jade = document.matte("jade", [0.14, 0.44, 0.32]);
    let terracotta = document.matte("terracotta", [0.60, 0.24, 0.12]);
    let plinth_material = document.matte("plinth", [0.66, 0.65, 0.63]);

    let statue = document.mesh("statue", &[(&figure(56), marble)]);
    let knot = document.mesh("knot", &[(&knot(), bronze)]);
    let outline =
        [(0.0, 0.0), (0.20, 0.0), (0.22, 0.04), (0.14, 0.12), (0.30, 0.42), (0.33, 0.62), (0.16, 0.92), (0.15, 1.02)];
    let mut profile = smooth_profile(&outline, 4);
    profile.extend([(0.22, 1.08), (0.21, 1.10), (0.12, 1.02), (0.0, 0.96)]);
    let vase = lathe(&profile, 44);
    let green_vase = document.mesh("green vase", &[(&vase, jade)]);
    let red_vase = document.mesh("red vase", &[(&vase, terracotta)]);
    let spheres = document.mesh("spheres", &[(&spheres(), jade)]);
    let plinth = document.mesh("plinth", &[(&standing_block(0.0, 0.0, DVec3::new(0.8, 0.75, 0.8)), plinth_material)]);
    let low = document.mesh("low plinth", &[(&standing_block(0.0, 0.0, DVec3::new(1.0, 0.35, 1.0)), plinth_material)]);

    let shown = [
        (statue, low, 0.35, 0.55, -1.55, 12.0),
        (knot, plinth, 0.75, -1.9, -3.6, 30.0),
        (red_vase, plinth, 0.75, 2.3, -4.9, 0.0),
        (green_vase, plinth, 0.75, 2.35, 1.55, 0.0),
        (statue, low, 0.35, 6.2, -1.9, -35.0),
        (knot, plinth, 0.75, 6.2, 2.4, 0.0),
        (red_vase, plinth, 0.75, 8.2, 5.2, 0.0),
        (spheres, plinth, 0.75, 4.2, 5.2, 0.0),
        (statue, low, 0.35, -6.2, -2.4, 40.0),
        (spheres, plinth, 0.75, -6.0, 2.4, 0.0),
        (green_vase, plinth, 0.75, -8.2, -5.2, 0.0),
        (red_vase, plinth, 0.75, -4.2, 5.2, 0.0),
    ];
    for (sculpture, stand, height, x, z, degrees) in shown {
        document.place("plinth", stand, pose(DVec3::new(x, 0.0, z), 0.0));
        document.place("sculpture", sculpture, pose(DVec3::new(x, height, z), degrees));
    }
}

/// A (2, 3) torus knot on a small foot, 1 m tall.
fn knot() -> TriangleMesh {
    let steps = 132;
    let path: Vec<(DVec3, f64)> = (0..steps)
        .map(|i| {
            let t = TAU * i as f64 / steps as f64;
            let radius = 0.27 + 0.11 * (3.0 * t).cos();
            (DVec3::new(radius * (2.0 * t).cos(), 0.56 + radius * (2.0 * t).sin(), 0.15 * (3.0 * t).sin()), 0.062)
        })
        .collect();
    let mut mesh = tube(&path, 18, true);
    mesh.add(lathe(&[(0.22, 0.0), (0.22, 0.05), (0.05, 0.09), (0.05, 0.3), (0.0, 0.3)], 36));
    mesh
}

/// Four balls of falling size, one on another.
fn spheres() -> TriangleMesh {
    let mut mesh = TriangleMesh::new();
    let mut top = 0.0;
    for radius in [0.30, 0.22, 0.15, 0.09] {
        mesh.add(ellipsoid(DVec3::Y * (top + radius), DVec3::splat(radius), 32, 18));
        top += 1.94 * radius;
    }
    mesh
}

fn benches(document: &mut GlbBuilder) {
    let wood = document.matte("bench", [0.34, 0.19, 0.09]);
    let leather = document.matte("cushion", [0.46, 0.12, 0.08]);
    let leg_outline = [(0.035, 0.0), (0.028, 0.06), (0.05, 0.12), (0.03, 0.2), (0.05, 0.28), (0.045, 0.38)];
    let leg = lathe(&smooth_profile(&leg_outline, 2), 14);
    let mut frame = block(DVec3::new(-0.85, 0.37, -0.25), DVec3::new(0.85, 0.42, 0.25));
    for (x, z) in [(-0.75, -0.17), (0.75, -0.17), (0.75, 0.17), (-0.75, 0.17)] {
        frame.add(leg.clone().moved(DVec3::new(x, 0.0, z)));
    }
    let cushion = block(DVec3::new(-0.83, 0.42, -0.24), DVec3::new(0.83, 0.50, 0.24));
    let bench = document.mesh("bench", &[(&frame, wood), (&cushion, leather)]);
    for (x, z, degrees) in
        [(-0.5, 2.6, 90.0), (0.0, 4.9, 0.0), (6.1, 0.1, 90.0), (6.2, -4.0, 0.0), (-6.1, 0.1, 90.0), (-6.2, 4.4, 0.0)]
    {
        document.place("bench", bench, pose(DVec3::new(x, 0.0, z), degrees));
    }
}

/// Posts with hanging ropes round the statues.
fn ropes(document: &mut GlbBuilder) {
    let brass = document.matte("brass", [0.66, 0.48, 0.16]);
    let velvet = document.matte("velvet", [0.50, 0.04, 0.08]);
    let outline =
        [(0.16, 0.0), (0.16, 0.02), (0.03, 0.05), (0.022, 0.1), (0.022, 0.86), (0.04, 0.9), (0.03, 0.94), (0.0, 0.97)];
    let post = document.mesh("post", &[(&lathe(&outline, 24), brass)]);
    let span = 1.8;
    let steps = 20;
    let path: Vec<(DVec3, f64)> = (0..=steps)
        .map(|i| {
            let t = f64::from(i) / f64::from(steps);
            let sag = 0.30 * (1.0 - (2.0 * t - 1.0).powi(2));
            (DVec3::new((t - 0.5) * span, 0.88 - sag, 0.0), 0.02)
        })
        .collect();
    let rope = document.mesh("rope", &[(&tube(&path, 12, false), velvet)]);
    let half = span / 2.0;
    for (x, z) in [(0.55, -1.55), (6.2, -1.9), (-6.2, -2.4)] {
        for (px, pz) in [(-half, -half), (half, -half), (half, half), (-half, half)] {
            document.place("post", post, pose(DVec3::new(x + px, 0.0, z + pz), 0.0));
        }
        for (px, pz, degrees) in [(0.0, -half, 0.0), (half, 0.0, 90.0), (0.0, half, 0.0), (-half, 0.0, 90.0)] {
            document.place("rope", rope, pose(DVec3::new(x + px, 0.0, z + pz), degrees));
        }
    }
}
