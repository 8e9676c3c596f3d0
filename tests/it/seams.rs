//! Seams: steps of light on flat walls where one probe's view gives way to another's.

use crate::device::Shot;
use crate::support::repository;
use lightgraph::Image;
use lightgraph::internals::image::exr::read_exr;

/// Pixels along a side of the references.
const EDGE: usize = 128;

fn reference(name: &str) -> Image {
    read_exr(&repository(&format!("tests/references/{name}.exr"))).unwrap_or_else(|f| panic!("{f}"))
}

fn channel(image: &Image, pixel: usize, channel: usize) -> f32 {
    image.data[pixel * image.channels as usize + channel]
}

/// Pixels of the reference whose neighbours all lie on the same wall, parallel to two axes.
fn walls(scene: &str) -> Vec<bool> {
    let (normal, depth) = (reference(&format!("{scene}_normal")), reference(&format!("{scene}_depth")));
    let edge = normal.width as usize;
    assert_eq!(edge, EDGE);
    let flat = |p: usize, q: usize| {
        let same: f32 = (0..3).map(|c| channel(&normal, p, c) * channel(&normal, q, c)).sum();
        let near = (channel(&depth, p, 0) - channel(&depth, q, 0)).abs() < 0.1 * channel(&depth, p, 0);
        same > 0.999 && near && (0..3).any(|c| channel(&normal, p, c).abs() > 0.999)
    };
    let inner = |i: usize| i > 0 && i + 1 < edge;
    let all_round = |p: usize| (0..9).all(|i| flat(p, p + i / 3 * edge + i % 3 - edge - 1));
    (0..edge * edge).map(|p| inner(p % edge) && inner(p / edge) && all_round(p)).collect()
}

/// What there is between neighbouring pixels on flat walls, at most and by the mean of the image.
#[derive(Debug, Clone, Copy)]
struct Jumps {
    /// By how much the step from a pixel to the next exceeds the steps before and after it. A slope, however steep, is
    /// none.
    seam: f32,
    /// The step itself: where the image is coarse, the slope of the light at the foot of things.
    step: f32,
}

/// Those of a square image, a whole number of times as large as the reference that `walls` is of.
fn jumps(image: &Image, walls: &[bool]) -> Jumps {
    let mean = image.data.chunks(image.channels as usize).map(|p| p[..3].iter().sum::<f32>()).sum::<f32>()
        / (3 * image.pixel_count()) as f32;
    let size = image.width as usize;
    let finer = size / EDGE;
    let on_wall = |p: usize| walls[p / size / finer * EDGE + p % size / finer];
    let mut largest = Jumps { seam: 0.0, step: 0.0 };
    for stride in [1, size] {
        for p in 0..size * size - 3 * size {
            let run = [p, p + stride, p + 2 * stride, p + 3 * stride];
            // Pixels that the image covers and the reference doesn't, or the other way round, are black.
            if run.iter().all(|q| on_wall(*q) && (0..3).any(|c| channel(image, *q, c) > 0.0)) {
                let step = |i: usize| {
                    let change = |c: usize| (channel(image, run[i + 1], c) - channel(image, run[i], c)).abs();
                    (0..3).map(change).fold(0.0, f32::max)
                };
                largest.seam = largest.seam.max(step(1) - step(0).max(step(2)));
                largest.step = largest.step.max(step(1));
            }
        }
    }
    Jumps { seam: largest.seam / mean, step: largest.step / mean }
}

/// Of 0/1 weights and of soft ones, on the Cornell box.
fn hard_and_soft(set: &str, size: u32) -> [Jumps; 2] {
    let walls = walls("cornell_point");
    ["indirect_shadow", "moment_visibility"].map(|graph| {
        let path = format!("graphs/gi/{graph}.ron");
        let [indirect] = Shot { set, ..Shot::new(&path, "scenes/cornell_point.gltf", size) }.render(["indirect"]);
        let found = jumps(&indirect, &walls);
        println!("{graph}, {set}, {size} pixels: by the mean, seam {:.3}, step {:.3}", found.seam, found.step);
        found
    })
}

#[test]
fn soft_visibility_leaves_no_seams() {
    let [hard, soft] = hard_and_soft("grid=4,4,4 face=8 bounces=8", 256);
    assert!(hard.seam > 0.1, "no seam to compare with: {hard:?}");
    assert!(soft.seam <= 0.5 * hard.seam, "{soft:?} is more than half of {hard:?}");
    assert!(soft.step <= 0.5 * hard.step, "{soft:?} is more than half of {hard:?}");
}

/// Where the 0/1 graph's own seams are small, and a pixel is a few millimetres. Steps are slopes there.
#[test]
fn soft_visibility_leaves_no_seams_between_many_probes() {
    let [hard, soft] = hard_and_soft("grid=8,8,8 face=8 bounces=8", 1024);
    assert!(hard.seam > 0.1, "no seam to compare with: {hard:?}");
    assert!(soft.seam <= 0.5 * hard.seam, "{soft:?} is more than half of {hard:?}");
}
