//! The graphs that trace rays: against the references, and against the same by rasterisation.

use crate::device::Shot;
use crate::support::repository;
use lightgraph::image::Image;
use lightgraph::image::exr::read_exr;
use lightgraph::image::mask::{both, edge_mask, gradient_mask, grow};
use lightgraph::image::metrics::{Metrics, compare};

const SIZE: u32 = 128;

/// Pixels along a side of the blocks whose means are held against the references.
const BLOCK: u32 = 8;

fn reference(name: &str) -> Image {
    read_exr(&repository(&format!("tests/references/{name}.exr"))).unwrap_or_else(|f| panic!("{f}"))
}

fn compared(test: &Image, expected: &Image, mask: Option<&[bool]>) -> Metrics {
    compare(test, expected, mask).unwrap_or_else(|f| panic!("{f}"))
}

/// Direct light of an emissive rectangle within 1 %, two pixels round edges of surfaces and shadows left out.
#[test]
fn an_area_light_agrees_with_the_reference() {
    let [direct] = Shot::new("graphs/direct.ron", "scenes/room_area.gltf", SIZE).render(["direct"]);
    let expected = reference("room_area_direct");
    let [normal, depth, albedo] = ["normal", "depth", "albedo"].map(|what| reference(&format!("room_area_{what}")));
    let mask = edge_mask(&normal, &depth, &albedo)
        .and_then(|surfaces| Ok(both(&surfaces, &gradient_mask(&expected, 0.15)?)))
        .and_then(|mask| grow(&mask, SIZE, SIZE, 2))
        .unwrap_or_else(|f| panic!("{f}"));
    let metrics = compared(&direct, &expected, Some(&mask));
    println!("room_area direct: rmse {:.3} %, bias {:+.3} %", metrics.rmse_percent, metrics.bias_percent);
    assert!(metrics.pixels > 8_000, "only {} pixels are compared", metrics.pixels);
    assert!(metrics.rmse_percent <= 1.0 && metrics.bias_percent.abs() <= 0.2, "{metrics:?}");
}

/// Sum of the channels of a pixel.
fn brightness(image: &Image, pixel: usize) -> f64 {
    let channels = image.channels as usize;
    image.data[pixel * channels..][..3].iter().map(|x| f64::from(*x)).sum()
}

/// How far the mean of two independent images is from the reference, in standard errors: by blocks, and as a whole.
/// The error of a block's mean is estimated from the differences between the two, pixel by pixel, together with the
/// reference's own: `noise`, a share of its mean in each pixel.
fn deviations([a, b]: &[Image; 2], expected: &Image, noise: f64) -> (Vec<f64>, f64) {
    let pixels = (SIZE * SIZE) as usize;
    let mean = (0..pixels).map(|i| brightness(expected, i)).sum::<f64>() / pixels as f64;
    let (mut blocks, mut sum, mut variance) = (vec![], 0.0, 0.0);
    for block in 0..(SIZE / BLOCK).pow(2) {
        let (x, y) = (block % (SIZE / BLOCK) * BLOCK, block / (SIZE / BLOCK) * BLOCK);
        let (mut off, mut spread) = (0.0, 0.0);
        for i in 0..BLOCK * BLOCK {
            let pixel = ((y + i / BLOCK) * SIZE + x + i % BLOCK) as usize;
            let (one, two) = (brightness(a, pixel), brightness(b, pixel));
            off += 0.5 * (one + two) - brightness(expected, pixel);
            spread += (0.5 * (one - two)).powi(2) + (noise * mean).powi(2);
        }
        blocks.push(off / spread.sqrt());
        sum += off;
        variance += spread;
    }
    (blocks, sum / variance.sqrt())
}

#[test]
fn path_tracing_is_unbiased() {
    // The noise of the references, from independent halves: 1.1 % and less of the converged images; at least 2 % of
    // those with a number of bounces.
    for (scene, bounces, name, noise) in [
        ("cornell_point", 64, "indirect", 0.011),
        ("room_spot", 64, "indirect", 0.010),
        ("room_area", 64, "indirect", 0.010),
        ("cornell_point", 1, "b1_indirect", 0.02),
        ("room_spot", 2, "b2_indirect", 0.02),
        ("room_area", 3, "b3_indirect", 0.02),
    ] {
        let path = format!("scenes/{scene}.gltf");
        let half = |seed: u32| {
            let set = format!("samples=8 bounces={bounces} seed={seed}");
            let [image] = Shot { set: &set, ..Shot::new("graphs/pathtrace.ron", &path, SIZE) }.render(["indirect"]);
            image
        };
        let expected = reference(&format!("{scene}_{name}"));
        let (blocks, whole) = deviations(&[half(1), half(2)], &expected, noise);
        let spread = (blocks.iter().map(|z| z * z).sum::<f64>() / blocks.len() as f64).sqrt();
        let far = blocks.iter().filter(|z| z.abs() > 3.0).count();
        println!("{scene} {name}: the whole {whole:+.2} standard errors off, blocks {spread:.2}, {far} beyond 3");
        assert!(whole.abs() <= 3.0, "{scene} {name}: the mean is {whole:.2} standard errors off");
        // 0.3 % of a normal distribution lie beyond 3; path tracing's has longer tails.
        assert!(far <= blocks.len() / 50, "{scene} {name}: {far} of {} blocks are beyond 3", blocks.len());
        assert!(spread <= 1.2, "{scene} {name}: blocks are {spread:.2} standard errors off");
    }
}

/// In a closed room of albedo ρ whose walls emit 1, n bounces after the first give the sum of ρᵏ up to k = n + 1.
#[test]
fn a_furnace_gives_its_closed_form() {
    let [direct] = Shot { set: "emitter_samples=4", ..Shot::new("graphs/direct.ron", "scenes/furnace_80.glb", 16) }
        .render(["direct"]);
    for x in direct.data.chunks(direct.channels as usize).flat_map(|pixel| &pixel[..3]) {
        assert!((x - 1.8).abs() <= 1e-4, "{x} is not 1 + 0.8");
    }
    let set = "samples=64 bounces=6";
    let [color] = Shot { set, ..Shot::new("graphs/pathtrace.ron", "scenes/furnace_80.glb", 32) }.render(["color"]);
    let pixels = color.pixel_count();
    let mean = (0..pixels).map(|i| brightness(&color, i)).sum::<f64>() / (3 * pixels) as f64;
    let expected: f64 = (0..8).map(|k| 0.8_f64.powi(k)).sum();
    println!("furnace: {mean:.5}, on paper {expected:.5}");
    // Some four standard errors.
    assert!((mean / expected - 1.0).abs() <= 0.002, "{mean} is not {expected}");
}

#[test]
fn more_frames_are_less_noise() {
    let shot = Shot { set: "samples=4", ..Shot::new("graphs/pathtrace.ron", "scenes/room_spot.gltf", SIZE) };
    let expected = reference("room_spot_indirect");
    let error = |frames: u32| {
        let [image] = shot.render_frames(frames, ["indirect"]);
        compared(&image, &expected, None).rmse_percent
    };
    let (one, sixteen) = (error(1), error(16));
    println!("rmse of 1 frame {one:.1} %, of 16 {sixteen:.1} %");
    // 4 but for the noise of the estimates themselves.
    assert!((3.3..=4.7).contains(&(one / sixteen)), "rmse of 1 frame {one:.1} %, of 16 {sixteen:.1} %");
}

/// With 4×4×4 probes in a cube, texels look exactly into its corners: rays give them to the triangle that drawing covers
/// them with. What is left lies along edges that rounding moves across a texel's centre. With another number along each
/// axis no texel looks there.
#[test]
fn probes_captured_by_rays_are_those_drawn() {
    for (scene, grid, most) in [
        ("cornell_point", "4,4,4", 0.25),
        ("room_spot", "4,4,4", 0.25),
        ("cornell_point", "4,5,6", 0.1),
        ("room_spot", "4,5,6", 0.1),
    ] {
        let path = format!("scenes/{scene}.gltf");
        let of = |graph: &str| {
            let set = format!("grid={grid} bounces=8 epsilon=0");
            let [image] = Shot { set: &set, ..Shot::new(graph, &path, SIZE) }.render(["indirect"]);
            image
        };
        let metrics = compared(&of("graphs/raycast_capture.ron"), &of("graphs/uniform_grid.ron"), None);
        println!("{scene}, {grid}: rmse {:.4} %, bias {:+.4} %", metrics.rmse_percent, metrics.bias_percent);
        assert!(metrics.rmse_percent <= most, "{scene}, {grid}: {metrics:?}");
    }
}

/// The same triangles cover the same texels, whether the faces of a probe are drawn one by one or at once.
#[test]
#[ignore = "llvmpipe of Mesa 22.3 loses triangles that it clips, in every view but one; not yet run on another driver: run it on a GPU"]
fn probes_captured_through_six_views_are_those_drawn_face_by_face() {
    for scene in ["cornell_point", "room_spot"] {
        let path = format!("scenes/{scene}.gltf");
        let of = |graph: &str| {
            let [image] = Shot { set: "bounces=8 epsilon=0", ..Shot::new(graph, &path, SIZE) }.render(["indirect"]);
            image
        };
        let metrics = compared(&of("graphs/layered_capture.ron"), &of("graphs/uniform_grid.ron"), None);
        println!("{scene}: rmse {:.4} %, bias {:+.4} %", metrics.rmse_percent, metrics.bias_percent);
        assert!(metrics.rmse_percent <= 0.01, "{scene}: {metrics:?}");
    }
}

#[test]
fn a_first_bounce_by_rays_leaves_little_error() {
    for scene in ["cornell_point", "room_spot"] {
        let path = format!("scenes/{scene}.gltf");
        let [indirect] = Shot::new("graphs/first_bounce.ron", &path, SIZE).render(["indirect"]);
        let metrics = compared(&indirect, &reference(&format!("{scene}_indirect")), None);
        println!("{scene}: rmse {:.2} %, bias {:+.2} %", metrics.rmse_percent, metrics.bias_percent);
        assert!(metrics.rmse_percent <= 4.0 && metrics.bias_percent.abs() <= 1.0, "{scene}: {metrics:?}");
    }
}
