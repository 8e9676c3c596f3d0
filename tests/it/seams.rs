//! Seams: steps of light on flat walls where one probe's view gives way to another's.

use crate::device::Shot;
use crate::support::repository;
use lightgraph::image::Image;
use lightgraph::image::exr::read_exr;

/// Pixels along a side, and times as many as the references have.
const SIZE: usize = 256;
const FINER: usize = 2;

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
    assert_eq!(edge * FINER, SIZE);
    let flat = |p: usize, q: usize| {
        let same: f32 = (0..3).map(|c| channel(&normal, p, c) * channel(&normal, q, c)).sum();
        let near = (channel(&depth, p, 0) - channel(&depth, q, 0)).abs() < 0.1 * channel(&depth, p, 0);
        same > 0.999 && near && (0..3).any(|c| channel(&normal, p, c).abs() > 0.999)
    };
    let inner = |i: usize| i > 0 && i + 1 < edge;
    let all_round = |p: usize| (0..9).all(|i| flat(p, p + i / 3 * edge + i % 3 - edge - 1));
    (0..edge * edge).map(|p| inner(p % edge) && inner(p / edge) && all_round(p)).collect()
}

/// The largest seam on flat walls, by the mean of the image: by how much the step from a pixel to the next exceeds the
/// steps before and after it. A slope, however steep, is none.
fn largest_seam(image: &Image, walls: &[bool]) -> f32 {
    let mean = image.data.chunks(image.channels as usize).map(|p| p[..3].iter().sum::<f32>()).sum::<f32>()
        / (3 * image.pixel_count()) as f32;
    let coarse = SIZE / FINER;
    let on_wall = |p: usize| walls[p / SIZE / FINER * coarse + p % SIZE / FINER];
    let mut largest = 0.0_f32;
    for stride in [1, SIZE] {
        for p in 0..SIZE * SIZE - 3 * SIZE {
            let run = [p, p + stride, p + 2 * stride, p + 3 * stride];
            // Pixels that the image covers and the reference doesn't, or the other way round, are black.
            if run.iter().all(|q| on_wall(*q) && (0..3).any(|c| channel(image, *q, c) > 0.0)) {
                let step = |i: usize| {
                    let change = |c: usize| (channel(image, run[i + 1], c) - channel(image, run[i], c)).abs();
                    (0..3).map(change).fold(0.0, f32::max)
                };
                largest = largest.max(step(1) - step(0).max(step(2)));
            }
        }
    }
    largest / mean
}

#[test]
fn soft_visibility_leaves_no_seams() {
    let walls = walls("cornell_point");
    let seam = |graph: &str| {
        let set = "grid=4,4,4 face=8 bounces=8";
        let [indirect] =
            Shot { set, ..Shot::new(graph, "scenes/cornell_point.gltf", SIZE as u32) }.render(["indirect"]);
        largest_seam(&indirect, &walls)
    };
    let (hard, soft) = (seam("graphs/indirect_shadow.ron"), seam("graphs/moment_visibility.ron"));
    println!("largest seam by the mean: {hard:.3} with 0/1 weights, {soft:.3} with soft ones");
    assert!(hard > 0.1, "no seam to compare with: {hard}");
    assert!(soft <= 0.5 * hard, "{soft} is more than half of {hard}");
}
