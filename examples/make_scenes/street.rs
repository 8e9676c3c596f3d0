//! A street between two rows of houses under the sun and a clear sky. The sky and the sunlit side light what lies in
//! the shade.

use crate::glb::{GlbBuilder, MaterialIndex};
use crate::mesh::TriangleMesh;
use crate::paintings::{self, hash};
use crate::shapes::{block, ellipsoid, lathe, pierced_wall, standing_block, tiles, tube};
use crate::studio;
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::FRAC_PI_2;

/// Probes fill the street.
pub const SCENE: &str = r#"// Probes fill the street.
Scene(
    gltf: "street.glb",
    grid: ((-6.0, 0.0, -20.0), (6.0, 9.0, 20.0)),
    environment: File(file: "street.hdr"),
    camera: "along",
)
"#;

/// Where the sun stands, seen from the ground.
const SUN: DVec3 = DVec3::new(5.5, 9.0, 2.6);

/// Half the width between the houses and half the length, a house's width and a storey's height. Metres.
const HALF_WIDTH: f64 = 5.0;
const HALF_LENGTH: f64 = 20.0;
const HOUSE: f64 = 5.0;
const STOREY: f64 = 3.0;
const THICK: f64 = 0.4;

pub fn street() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let asphalt = document.matte("asphalt", [0.20, 0.20, 0.21]);
    let paving = document.matte("paving", [0.52, 0.50, 0.47]);
    let ground = tiles(DVec3::new(-24.0, 0.0, -32.0), DVec2::new(48.0, 64.0), 6, 8);
    document.fixture("ground", &ground, asphalt);
    let mut pavements = TriangleMesh::new();
    for side in [-1.0, 1.0] {
        let (from, to) = (side * 3.2, side * (HALF_WIDTH + 3.0));
        let (low, high) = (from.min(to), from.max(to));
        pavements.add(block(DVec3::new(low, 0.0, -HALF_LENGTH), DVec3::new(high, 0.14, HALF_LENGTH)));
    }
    document.fixture("pavements", &pavements, paving);
    houses(&mut document);
    furniture(&mut document);
    document.sun("sun", SUN, [18.0, 16.6, 14.4]);
    document.camera("along", DVec3::new(2.3, 1.7, 16.5), DVec3::new(-1.2, 2.6, 0.0), 60.0);
    document.camera("door", DVec3::new(-3.4, 1.6, 3.0), DVec3::new(4.9, 2.2, -2.0), 60.0);
    document
}

/// The CIE's clear sky (Kittler, "Standardisation of outdoor conditions for the calculation of daylight factor with
/// clear skies", 1967). It is blue and brings a sixth of the irradiance of open ground. Texels below the horizon have
/// the ground's radiance.
pub fn sky() -> Vec<u8> {
    studio::panorama(|x, y| {
        let towards = studio::towards(x, y);
        if towards.y <= 0.0 {
            return [0.9, 0.85, 0.8];
        }
        let near = towards.dot(SUN.normalize());
        let round_the_sun = 0.91 + 10.0 * (-3.0 * near.min(1.0).acos()).exp() + 0.45 * near * near;
        let radiance = round_the_sun * (1.0 - (-0.32 / towards.y).exp());
        [0.63, 0.9, 1.35].map(|color| color * radiance)
    })
}

fn houses(document: &mut GlbBuilder) {
    let colors = [[0.70, 0.62, 0.46], [0.62, 0.36, 0.28], [0.72, 0.70, 0.66], [0.46, 0.54, 0.58], [0.68, 0.54, 0.38]];
    let mut fronts: Vec<MaterialIndex> =
        (0..).zip(colors).map(|(i, color)| document.matte(&format!("front {i}"), color)).collect();
    fronts.push(document.textured("bricks", &paintings::bricks()));
    let inside = document.matte("inside", [0.40, 0.36, 0.32]);
    let glass = document.matte("pane", [0.08, 0.09, 0.11]);
    let trim = document.matte("trim", [0.74, 0.73, 0.70]);
    let door = document.matte("door", [0.14, 0.28, 0.22]);
    let roof = document.matte("roof", [0.36, 0.18, 0.13]);
    let count = (2.0 * HALF_LENGTH / HOUSE).round() as u32;
    for side in [-1.0_f64, 1.0] {
        for i in 0..count {
            let chance = hash(i, if side < 0.0 { 3 } else { 11 });
            let storeys = 2 + chance % 2;
            let height = STOREY * f64::from(storeys) + 0.4;
            let mut openings: Vec<Vec<[f64; 4]>> = vec![];
            for storey in 0..storeys {
                let (low, high) = if storey == 0 { (0.0, 2.4) } else { (0.8, 2.3) };
                let first = if storey == 0 { [0.6, 1.6, low, high] } else { [0.7, 1.7, low, high] };
                openings.push(vec![first, [2.2, 3.0, 0.8, 2.3], [3.5, 4.3, 0.8, 2.3]]);
            }
            let mut front = TriangleMesh::new();
            let (mut panes, mut trims, mut doors) = (TriangleMesh::new(), TriangleMesh::new(), TriangleMesh::new());
            for (storey, row) in (0u32..).zip(&openings) {
                let lift = STOREY * f64::from(storey);
                front.add(pierced_wall(HOUSE, STOREY, THICK, row).moved(DVec3::Y * lift));
                for (k, [from, to, low, high]) in row.iter().copied().enumerate() {
                    let back = block(
                        DVec3::new(from, lift + low, -THICK / 2.0),
                        DVec3::new(to, lift + high, 0.02 - THICK / 2.0),
                    );
                    if storey == 0 && k == 0 {
                        doors.add(back)
                    } else {
                        panes.add(back)
                    }
                    let z = THICK / 2.0;
                    let sill = DVec3::new(from - 0.08, lift + low - 0.08, z);
                    trims.add(block(sill, DVec3::new(to + 0.08, lift + low.max(0.05), z + 0.14)));
                    let lintel = DVec3::new(from - 0.1, lift + high, z);
                    trims.add(block(lintel, DVec3::new(to + 0.1, lift + high + 0.16, z + 0.08)));
                    trims.add(block(
                        DVec3::new((from + to) / 2.0 - 0.02, lift + low, -0.14),
                        DVec3::new((from + to) / 2.0 + 0.02, lift + high, -0.1),
                    ));
                }
            }
            // The upper end of the front, a cornice, the house behind and its roof.
            let top = STOREY * f64::from(storeys);
            front.add(block(DVec3::new(0.0, top, -THICK / 2.0), DVec3::new(HOUSE, height, THICK / 2.0)));
            trims
                .add(block(DVec3::new(0.0, height, -THICK / 2.0), DVec3::new(HOUSE, height + 0.22, THICK / 2.0 + 0.3)));
            let body = block(DVec3::new(0.0, 0.0, -6.0), DVec3::new(HOUSE, height, -THICK / 2.0));
            let slope = block(DVec3::new(-0.02, height, -6.0), DVec3::new(HOUSE + 0.02, height + 0.5, -0.6));
            let mesh = document.mesh(
                "house",
                &[
                    (&front, fronts[chance as usize / 16 % fronts.len()]),
                    (&panes, glass),
                    (&doors, door),
                    (&trims, trim),
                    (&body, inside),
                    (&slope, roof),
                ],
            );
            let along = HOUSE * f64::from(i) - HALF_LENGTH;
            // The front looks into the street.
            let (turn, at) = if side < 0.0 {
                (FRAC_PI_2, DVec3::new(-HALF_WIDTH, 0.14, -along))
            } else {
                (-FRAC_PI_2, DVec3::new(HALF_WIDTH, 0.14, along))
            };
            document.place("house", mesh, DAffine3::from_translation(at) * DAffine3::from_rotation_y(turn));
        }
    }
}

/// Trees, lamps, cars, awnings and a bench.
fn furniture(document: &mut GlbBuilder) {
    let bark = document.matte("bark", [0.28, 0.20, 0.14]);
    let leaves = document.matte("leaves", [0.16, 0.34, 0.09]);
    let iron = document.matte("iron", [0.12, 0.13, 0.14]);
    let rubber = document.matte("rubber", [0.05, 0.05, 0.05]);
    let window = document.matte("windscreen", [0.10, 0.12, 0.14]);
    let mut trunk = tube(&[(DVec3::ZERO, 0.14), (DVec3::Y * 1.4, 0.11), (DVec3::new(0.1, 2.6, 0.05), 0.08)], 10, false);
    trunk.add(tube(&[(DVec3::Y * 1.5, 0.07), (DVec3::new(-0.5, 2.4, 0.2), 0.04)], 8, false));
    let mut crown = TriangleMesh::new();
    for k in 0..14u32 {
        let share = |bits: u32| f64::from(hash(k, bits) % 1000) / 500.0 - 1.0;
        let at = DVec3::new(0.8 * share(1), 3.1 + 0.7 * share(2), 0.8 * share(3));
        crown.add(ellipsoid(at, DVec3::splat(0.42 + 0.1 * share(4)), 12, 7));
    }
    let tree = document.mesh("tree", &[(&trunk, bark), (&crown, leaves)]);
    for (x, z) in [(-3.9, 9.5), (-3.9, -1.5), (-3.9, -12.0), (3.9, 4.5), (3.9, -7.0)] {
        let pose = DAffine3::from_translation(DVec3::new(x, 0.14, z)) * DAffine3::from_rotation_y(z);
        document.place("tree", tree, pose);
    }
    let mut lamp =
        lathe(&[(0.14, 0.0), (0.12, 0.2), (0.05, 0.3), (0.04, 3.4), (0.16, 3.6), (0.2, 3.9), (0.0, 4.0)], 12);
    lamp.add(standing_block(0.0, 0.0, DVec3::new(0.3, 0.06, 0.3)));
    let lamp = document.mesh("lamp", &[(&lamp, iron)]);
    for (x, z) in [(-3.5, 4.0), (3.5, 10.5), (-3.5, -7.0), (3.5, -2.0)] {
        document.place("lamp", lamp, DAffine3::from_translation(DVec3::new(x, 0.14, z)));
    }
    let mut wheels = TriangleMesh::new();
    for (x, z) in [(0.75, 1.2), (-0.75, 1.2), (0.75, -1.2), (-0.75, -1.2)] {
        let wheel = lathe(&[(0.0, -0.1), (0.31, -0.1), (0.31, 0.1), (0.0, 0.1)], 16);
        let pose = DAffine3::from_translation(DVec3::new(x, 0.31, z)) * DAffine3::from_rotation_z(FRAC_PI_2);
        wheels.add(wheel.transformed(pose));
    }
    let body = block(DVec3::new(-0.85, 0.25, -2.0), DVec3::new(0.85, 0.85, 2.0));
    let cabin = block(DVec3::new(-0.72, 0.85, -1.5), DVec3::new(0.72, 1.4, 0.9));
    for (k, (color, x, z)) in
        [([0.60, 0.08, 0.07], 2.2, 6.0), ([0.12, 0.24, 0.50], -2.2, 2.0), ([0.66, 0.66, 0.62], 2.2, -5.0)]
            .into_iter()
            .enumerate()
    {
        let paint = document.matte(&format!("paint {k}"), color);
        let mut roof = block(DVec3::new(-0.74, 1.4, -1.52), DVec3::new(0.74, 1.44, 0.92));
        roof.add(body.clone());
        let car = document.mesh("car", &[(&roof, paint), (&cabin, window), (&wheels, rubber)]);
        document.place("car", car, DAffine3::from_translation(DVec3::new(x, 0.0, z)));
    }
    let cloth = [[0.66, 0.16, 0.12], [0.16, 0.40, 0.34]].map(|color| document.cloth("awning", color));
    for (i, (side, z)) in [(-1.0, 6.4), (1.0, -0.4), (-1.0, -6.6), (1.0, 9.6)].into_iter().enumerate() {
        let x = side * (HALF_WIDTH - 0.2);
        let out = side * (HALF_WIDTH - 1.5);
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let mut awning = TriangleMesh::new();
        awning.quad([p(out, 2.5, z), p(out, 2.5, z + 2.2), p(x, 3.0, z + 2.2), p(x, 3.0, z)]);
        document.fixture("awning", &awning, cloth[i % 2]);
    }
    document.fixture("bench", &standing_block(-4.2, 13.5, DVec3::new(0.5, 0.6, 1.6)), bark);
}
