//! A court of two storeys of arcades, open to the sky; the sun lights a part of it, the galleries behind the arcades
//! have its light from walls and floors alone.

use crate::figure::figure;
use crate::glb::GlbBuilder;
use crate::mesh::TriangleMesh;
use crate::shapes::{Arch, block, ellipsoid, lathe, smooth_profile, standing_block, tiles};
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Probes fill court and galleries.
pub const SCENE: &str = r#"// Probes fill court and galleries.
Scene(
    gltf: "atrium.glb",
    grid: ((-8.0, 0.0, -11.0), (8.0, 8.4, 11.0)),
    camera: "court",
)
"#;

/// Half the court, how deep the galleries are, a storey's height. Metres.
const HALF_X: f64 = 5.0;
const HALF_Z: f64 = 8.0;
const GALLERY: f64 = 3.0;
const STOREY: f64 = 4.2;
const BAY: f64 = 2.0;
const THICK: f64 = 0.5;
const SPRINGING: f64 = 2.7;

pub fn atrium() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    shell(&mut document);
    arcades(&mut document);
    middle(&mut document);
    document.sun("sun", DVec3::new(4.2, 8.6, 3.0), [16.0, 14.6, 12.4]);
    document.camera("court", DVec3::new(3.6, 1.7, 6.9), DVec3::new(-2.6, 2.7, -3.0), 62.0);
    document.camera("gallery", DVec3::new(-6.6, 5.9, 9.5), DVec3::new(-5.6, 5.2, -6.0), 60.0);
    document
}

fn shell(document: &mut GlbBuilder) {
    let stone = document.matte("flags", [0.60, 0.55, 0.47]);
    let plaster = document.matte("plaster", [0.74, 0.68, 0.58]);
    let red = document.matte("dado", [0.54, 0.20, 0.14]);
    let blue = document.matte("painted ceiling", [0.24, 0.36, 0.56]);
    let (x, z) = (HALF_X + GALLERY, HALF_Z + GALLERY);
    document.fixture("floor", &tiles(DVec3::new(-x, 0.0, -z), DVec2::new(2.0 * x, 2.0 * z), 8, 11), stone);
    let top = 2.0 * STOREY;
    let mut sides = TriangleMesh::new();
    for (a, b) in [((-x, -z), (x, -z)), ((x, -z), (x, z)), ((x, z), (-x, z)), ((-x, z), (-x, -z))] {
        let p = |(px, pz): (f64, f64), y: f64| DVec3::new(px, y, pz);
        sides.quad([p(a, 0.0), p(b, 0.0), p(b, top), p(a, top)]);
    }
    document.fixture("walls", &sides, plaster);
    let mut dado = TriangleMesh::new();
    for level in [0.0, STOREY] {
        for (low, high) in [
            (DVec3::new(-x, level, -z), DVec3::new(x, level + 1.1, -z + 0.03)),
            (DVec3::new(-x, level, z - 0.03), DVec3::new(x, level + 1.1, z)),
            (DVec3::new(-x, level, -z), DVec3::new(-x + 0.03, level + 1.1, z)),
            (DVec3::new(x - 0.03, level, -z), DVec3::new(x, level + 1.1, z)),
        ] {
            dado.add(block(low, high));
        }
    }
    document.fixture("dado", &dado, red);

    // The floor of the upper galleries, and the roof over them: rings round the court.
    let ring = |low: f64, high: f64| {
        let mut mesh = TriangleMesh::new();
        let (inner_x, inner_z) = (HALF_X - THICK / 2.0, HALF_Z - THICK / 2.0);
        mesh.add(block(DVec3::new(-x, low, -z), DVec3::new(x, high, -inner_z)));
        mesh.add(block(DVec3::new(-x, low, inner_z), DVec3::new(x, high, z)));
        mesh.add(block(DVec3::new(-x, low, -inner_z), DVec3::new(-inner_x, high, inner_z)));
        mesh.add(block(DVec3::new(inner_x, low, -inner_z), DVec3::new(x, high, inner_z)));
        mesh
    };
    document.fixture("gallery floor", &ring(STOREY - 0.24, STOREY), blue);
    document.fixture("roof", &ring(2.0 * STOREY, 2.0 * STOREY + 0.3), plaster);
}

fn arcades(document: &mut GlbBuilder) {
    let wall = document.matte("arcade", [0.76, 0.71, 0.61]);
    let marble = document.matte("column", [0.74, 0.72, 0.69]);
    let arch = Arch {
        width: BAY,
        bottom: SPRINGING,
        springing: SPRINGING,
        top: STOREY - 0.24,
        radius: 0.78,
        thickness: THICK,
        segments: 16,
    };
    let mut bay = arch.wall();
    bay.add(arch.moulding(0.1, 0.05));
    bay.add(arch.moulding(0.1, 0.05).transformed(DAffine3::from_rotation_y(PI)));
    let bay = document.mesh("bay", &[(&bay, wall)]);
    let profile = smooth_profile(
        &[(0.24, 0.12), (0.24, 0.2), (0.19, 0.26), (0.175, 1.2), (0.15, 2.3), (0.19, 2.36), (0.16, 2.42), (0.25, 2.56)],
        3,
    );
    let mut column = lathe(&profile, 24);
    column.add(standing_block(0.0, 0.0, DVec3::new(0.52, 0.12, 0.52)));
    column.add(standing_block(0.0, 0.0, DVec3::new(0.52, 0.15, 0.52)).moved(DVec3::Y * 2.55));
    let column = document.mesh("column", &[(&column, marble)]);
    let pier = document.mesh("pier", &[(&standing_block(0.0, 0.0, DVec3::new(0.56, STOREY - 0.24, 0.56)), wall)]);
    let baluster = smooth_profile(
        &[(0.05, 0.0), (0.05, 0.06), (0.03, 0.12), (0.055, 0.3), (0.02, 0.56), (0.05, 0.66), (0.05, 0.74)],
        2,
    );
    let mut rail = block(DVec3::new(-BAY / 2.0, 0.74, -0.09), DVec3::new(BAY / 2.0, 0.86, 0.09));
    for i in 0..7 {
        rail.add(lathe(&baluster, 8).moved(DVec3::X * (0.25 * f64::from(i) - 0.75)));
    }
    let rail = document.mesh("balustrade", &[(&rail, marble)]);

    for level in [0.0, STOREY] {
        let bays = |document: &mut GlbBuilder, half: f64, place: &dyn Fn(f64) -> DVec3, turn: f64| {
            let count = (2.0 * half / BAY).round() as i32;
            for i in 0..count {
                let at = place(BAY * (f64::from(i) + 0.5) - half) + DVec3::Y * level;
                let pose = DAffine3::from_translation(at) * DAffine3::from_rotation_y(turn);
                document.place("bay", bay, pose);
                if level > 0.0 {
                    document.place("balustrade", rail, pose);
                }
                if i > 0 {
                    let at = place(BAY * f64::from(i) - half) + DVec3::Y * level;
                    document.place("column", column, DAffine3::from_translation(at));
                }
            }
        };
        for side in [-1.0, 1.0] {
            bays(document, HALF_X, &|along| DVec3::new(along, 0.0, side * HALF_Z), 0.0);
            bays(document, HALF_Z, &|along| DVec3::new(side * HALF_X, 0.0, along), FRAC_PI_2);
            for end in [-1.0, 1.0] {
                let at = DVec3::new(side * HALF_X, level, end * HALF_Z);
                document.place("pier", pier, DAffine3::from_translation(at));
            }
        }
    }
}

/// A fountain with a figure, urns at the corners, benches in the galleries.
fn middle(document: &mut GlbBuilder) {
    let stone = document.matte("fountain", [0.66, 0.64, 0.60]);
    let bronze = document.matte("bronze", [0.30, 0.34, 0.22]);
    let clay = document.matte("clay", [0.62, 0.34, 0.22]);
    let wood = document.matte("bench", [0.38, 0.24, 0.13]);
    let profile = smooth_profile(
        &[(1.7, 0.0), (1.7, 0.1), (1.55, 0.2), (1.6, 0.5), (1.7, 0.58), (1.45, 0.58), (1.4, 0.2), (0.0, 0.2)],
        3,
    );
    document.fixture("basin", &lathe(&profile, 64), stone);
    let pedestal = [(0.5, 0.2), (0.5, 0.4), (0.36, 0.5), (0.34, 1.1), (0.44, 1.2), (0.44, 1.3), (0.0, 1.3)];
    document.fixture("pedestal", &lathe(&pedestal, 32), stone);
    let mesh = document.mesh("figure", &[(&figure(32), bronze)]);
    document.place("figure", mesh, DAffine3::from_translation(DVec3::Y * 1.3) * DAffine3::from_rotation_y(0.6));
    let urn = smooth_profile(
        &[
            (0.0, 0.0),
            (0.2, 0.0),
            (0.1, 0.14),
            (0.14, 0.22),
            (0.36, 0.6),
            (0.3, 0.9),
            (0.36, 1.0),
            (0.26, 0.98),
            (0.0, 0.7),
        ],
        3,
    );
    let urn = document.mesh("urn", &[(&lathe(&urn, 32), clay)]);
    for (x, z) in [(-3.6, -6.4), (3.6, -6.4), (-3.6, 6.4), (3.6, 3.0)] {
        document.place("urn", urn, DAffine3::from_translation(DVec3::new(x, 0.0, z)));
    }
    let bench = document.mesh("bench", &[(&standing_block(0.0, 0.0, DVec3::new(0.5, 0.45, 1.6)), wood)]);
    for z in [-4.0, 0.0, 4.0] {
        for side in [-1.0, 1.0] {
            document.place("bench", bench, DAffine3::from_translation(DVec3::new(side * 7.2, 0.0, z)));
        }
    }
    let ball = ellipsoid(DVec3::new(-2.4, 0.4, 2.2), DVec3::splat(0.4), 32, 16);
    document.fixture("ball", &ball, clay);
}
