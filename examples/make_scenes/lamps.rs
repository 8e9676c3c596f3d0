//! A closed hall with pillars and benches under many small coloured lamps, which together give the same light whatever
//! their number.

use crate::glb::GlbBuilder;
use crate::mesh::TriangleMesh;
use crate::shapes::standing_block;
use glam::DVec3;

/// Half the hall's width and length, and its height. Metres.
const HALF_WIDTH: f64 = 8.0;
const HALF_LENGTH: f64 = 6.0;
const HEIGHT: f64 = 4.0;
/// Candela of all lamps, the mean over the channels.
const TOTAL: f64 = 60.0;
/// Least distance of a lamp from walls, pillars and benches. Metres.
const CLEARANCE: f64 = 0.25;
/// Linear, each with a mean of 1.
const COLORS: [[f64; 3]; 6] =
    [[2.4, 0.5, 0.1], [0.1, 0.8, 2.1], [1.7, 1.2, 0.1], [1.9, 0.1, 1.0], [0.2, 2.3, 0.5], [1.0, 1.0, 1.0]];

/// Where the pillars stand, and the benches with their sizes.
const PILLARS: [(f64, f64); 8] =
    [(-5.0, -3.0), (-1.7, -3.0), (1.7, -3.0), (5.0, -3.0), (-5.0, 3.0), (-1.7, 3.0), (1.7, 3.0), (5.0, 3.0)];
/// They reach through the ceiling, so that no light passes over them.
const PILLAR: DVec3 = DVec3::new(0.6, HEIGHT + 0.1, 0.6);
const BENCHES: [(f64, f64); 5] = [(-3.4, 0.4), (0.3, -0.8), (3.6, 0.6), (-6.4, -4.4), (6.2, 4.2)];
const BENCH: DVec3 = DVec3::new(1.8, 0.9, 0.7);

/// The hall under `count` lamps. Those of a smaller number hang where the first of a larger do.
pub fn lamps(count: usize) -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let plaster = document.matte("plaster", [0.56, 0.55, 0.53]);
    let floor = document.matte("floor", [0.50, 0.44, 0.38]);
    let stone = document.matte("stone", [0.62, 0.60, 0.57]);
    let wood = document.matte("wood", [0.48, 0.27, 0.13]);
    let (w, l, h) = (HALF_WIDTH, HALF_LENGTH, HEIGHT);

    let p = DVec3::new;
    let mut ground = TriangleMesh::new();
    ground.quad([p(-w, 0.0, l), p(w, 0.0, l), p(w, 0.0, -l), p(-w, 0.0, -l)]);
    document.fixture("ground", &ground, floor);
    let mut shell = TriangleMesh::new();
    shell.quad([p(-w, h, -l), p(w, h, -l), p(w, h, l), p(-w, h, l)]);
    shell.quad([p(-w, 0.0, -l), p(w, 0.0, -l), p(w, h, -l), p(-w, h, -l)]);
    shell.quad([p(w, 0.0, l), p(-w, 0.0, l), p(-w, h, l), p(w, h, l)]);
    shell.quad([p(-w, 0.0, l), p(-w, 0.0, -l), p(-w, h, -l), p(-w, h, l)]);
    shell.quad([p(w, 0.0, -l), p(w, 0.0, l), p(w, h, l), p(w, h, -l)]);
    document.fixture("shell", &shell, plaster);
    for (name, places, size, material) in
        [("pillars", &PILLARS[..], PILLAR, stone), ("benches", &BENCHES[..], BENCH, wood)]
    {
        let mut solids = TriangleMesh::new();
        for (x, z) in places {
            solids.add(standing_block(*x, *z, size));
        }
        document.fixture(name, &solids, material);
    }

    let colors = COLORS.map(|color| document.lamp("lamp", color, TOTAL / count as f64));
    for (i, position) in places().take(count).enumerate() {
        document.hang(colors[i % colors.len()], position);
    }
    document.camera("hall", p(7.4, 2.3, 1.3), p(-3.0, 1.2, -1.0), 62.0);
    document
}

/// Halton's points in the hall that keep clear of what stands there, in whole centimetres.
fn places() -> impl Iterator<Item = DVec3> {
    let low = DVec3::new(-HALF_WIDTH, 0.9, -HALF_LENGTH) + CLEARANCE;
    let high = DVec3::new(HALF_WIDTH, HEIGHT, HALF_LENGTH) - CLEARANCE;
    let at = move |i: u32| {
        let share = DVec3::new(radical_inverse(i, 2), radical_inverse(i, 3), radical_inverse(i, 5));
        ((low + share * (high - low)) * 100.0).round() / 100.0
    };
    (1..).map(at).filter(|at| {
        let clear = |(x, z): &(f64, f64), size: DVec3| {
            (at.x - x).abs() > 0.5 * size.x + CLEARANCE
                || (at.z - z).abs() > 0.5 * size.z + CLEARANCE
                || at.y > size.y + CLEARANCE
        };
        PILLARS.iter().all(|place| clear(place, PILLAR)) && BENCHES.iter().all(|place| clear(place, BENCH))
    })
}

/// The digits of a number in a base, mirrored at the point.
fn radical_inverse(mut number: u32, base: u32) -> f64 {
    let (mut sum, mut share) = (0.0, 1.0);
    while number > 0 {
        share /= f64::from(base);
        sum += share * f64::from(number % base);
        number /= base;
    }
    sum
}
