//! The path tracer against the references: as near as chance allows, block by block and as a whole.

use crate::device::gpu;
use crate::support::repository;
use glam::{DVec2, DVec4, Vec3};
use lightgraph::internals::image::exr::read_exr;
use lightgraph::internals::value::Value;
use lightgraph::{Gpu, Image, Project, Scene, Session, Settings};
use lightgraph_cli::bench::references::{Listed, Manifest};
use std::sync::Arc;

const SIZE: u32 = 128;

/// Pixels along a side of the blocks whose means are compared; the references' errors are of such.
const BLOCK: u32 = 8;

/// Share of the mean block's light below which a block is dim: a few paths bring all of it, and the sum of few is no
/// normal distribution.
const DIM: f64 = 0.1;

/// Independent images of which each comparison takes the mean.
const IMAGES: u32 = 4;

/// Paths a pixel in each of them: a first look, and what decides where that leaves a doubt. The mean of few paths is no
/// normal distribution yet: what they miss makes a block both dim and seemingly sure.
const PATHS: [u32; 2] = [4, 64];

/// Of a normal distribution, what lies beyond three standard errors.
const BEYOND: f64 = 0.0027;

/// Chance that a test fails though nothing is wrong, by the number of its blocks beyond three standard errors.
const FALSE_ALARM: f64 = 0.01;

fn image(file: &str) -> Image {
    read_exr(&repository(&format!("tests/references/{file}"))).unwrap_or_else(|f| panic!("{f}"))
}

/// Sum of the channels of a pixel.
fn brightness(image: &Image, pixel: usize) -> f64 {
    let channels = image.channels as usize;
    image.data[pixel * channels..][..3].iter().map(|x| f64::from(*x)).sum()
}

/// The path tracer before a scene and camera.
struct Tracer {
    project: Project,
    scene: Arc<Scene>,
    camera: Option<String>,
    session: Option<Session>,
}

impl Tracer {
    fn of(listed: &Listed) -> Tracer {
        // A scene file, where there is one, names its glTF.
        let paths = ["ron", "glb", "gltf"].map(|e| repository(&format!("scenes/{}.{e}", listed.scene)));
        let path = paths.into_iter().find(|p| p.exists()).unwrap_or_else(|| panic!("no {}", listed.scene));
        let project = Project::open(&repository("graphs/gi/pathtrace.ron"), &[]).unwrap_or_else(|f| panic!("{f}"));
        let scene = Arc::new(Scene::load(&path).unwrap_or_else(|f| panic!("{f}")).scene);
        Tracer { project, scene, camera: listed.camera.clone(), session: None }
    }

    /// Light in independent images; other numbers of paths are other paths.
    fn images(&mut self, gpu: &Gpu, output: &str, bounces: u32, paths: u32) -> Vec<Image> {
        let image = |i| {
            let set = [("samples", paths), ("bounces", bounces), ("seed", paths * IMAGES + i)];
            let settings = Settings {
                params: self
                    .project
                    .params(&set.map(|(name, x)| format!("{name}={x}")))
                    .unwrap_or_else(|f| panic!("{f}")),
                size: [SIZE, SIZE],
                camera: self.camera.clone(),
                outputs: Some(vec![output.into()]),
                ..Settings::default()
            };
            let before = self.session.as_ref();
            let session = Session::after(gpu, &self.project, self.scene.clone(), settings, before);
            let session = self.session.insert(session.unwrap_or_else(|f| panic!("{f}")));
            session.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
            session.image(gpu, output).unwrap_or_else(|f| panic!("{f}"))
        };
        (1..=IMAGES).map(image).collect()
    }
}

/// The pixels that look at an edge of a triangle, up to a thousandth of a pixel: what they see is up to rounding, so
/// that even two images of one reference may differ there. The cornell box's corners run along the image's diagonals.
/// Of an edge that passes the viewer, what lies a millimetre before it and farther.
fn at_edges(scene: &Scene, camera: Option<&str>) -> Vec<bool> {
    const NEAR: f64 = 1e-3;
    let pose = scene.pose(0.0);
    let (values, _) = scene.camera_values(&pose, camera, SIZE, SIZE).unwrap_or_else(|f| panic!("{f}"));
    let Value::Mat4(view) = values["camera_view_projection"] else { panic!("no matrix") };
    let corner = |i: u32| {
        let v = &scene.geometry.vertices[i as usize];
        view.as_dmat4() * (pose.nodes[v.node as usize] * Vec3::from(v.position).extend(1.0)).as_dvec4()
    };
    let size = f64::from(SIZE);
    let place = |p: DVec4| DVec2::new(0.5 + 0.5 * p.x / p.w, 0.5 - 0.5 * p.y / p.w) * size - 0.5;
    let mut found = vec![false; (SIZE * SIZE) as usize];
    for triangle in scene.geometry.indices.chunks_exact(3) {
        for i in 0..3 {
            let (mut a, mut b) = (corner(triangle[i]), corner(triangle[(i + 1) % 3]));
            if a.w < NEAR && b.w < NEAR {
                continue;
            }
            let cut = a + (b - a) * ((NEAR - a.w) / (b.w - a.w));
            a = if a.w < NEAR { cut } else { a };
            b = if b.w < NEAR { cut } else { b };
            let (a, b) = (place(a), place(b));
            let along = (b - a).normalize_or_zero();
            let low = (a.min(b) - NEAR).ceil().max(DVec2::ZERO).as_ivec2();
            let high = (a.max(b) + NEAR).floor().min(DVec2::splat(size - 1.0)).as_ivec2();
            for (x, y) in (low.y..=high.y).flat_map(|y| (low.x..=high.x).map(move |x| (x, y))) {
                let off = DVec2::new(f64::from(x), f64::from(y)) - a;
                if along.perp_dot(off).abs() < NEAR {
                    found[(y * SIZE as i32 + x) as usize] = true;
                }
            }
        }
    }
    found
}

/// How far the mean of independent images is from the reference, in standard errors: each block, and the whole. The
/// variance of a block is the sum of its pixels', as the images spread there, and the reference's own: `errors` holds
/// that of a block's mean over pixels and channels. Blocks of less than `DIM` light are taken together as one. Pixels
/// that are `left_out` don't count.
fn deviations(images: &[Image], expected: &Image, errors: &Image, left_out: &[bool]) -> (Vec<f64>, f64) {
    let along = SIZE / BLOCK;
    let n = images.len() as f64;
    let dim =
        DIM * (0..expected.pixel_count()).map(|i| brightness(expected, i)).sum::<f64>() / f64::from(along * along);
    let (mut blocks, mut dim_ones, mut whole) = (vec![], (0.0, 0.0), (0.0, 0.0));
    for block in 0..along * along {
        let (x, y) = (block % along * BLOCK, block / along * BLOCK);
        let mut light = 0.0;
        let (mut off, mut variance) = (0.0, (f64::from(BLOCK * BLOCK) * brightness(errors, block as usize)).powi(2));
        for i in 0..BLOCK * BLOCK {
            let pixel = ((y + i / BLOCK) * SIZE + x + i % BLOCK) as usize;
            if left_out[pixel] {
                continue;
            }
            let found: Vec<f64> = images.iter().map(|image| brightness(image, pixel)).collect();
            let mean = found.iter().sum::<f64>() / n;
            light += brightness(expected, pixel);
            off += mean - brightness(expected, pixel);
            variance += found.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
        }
        if light >= dim {
            blocks.push(off / variance.sqrt());
        } else {
            dim_ones = (dim_ones.0 + off, dim_ones.1 + variance);
        }
        whole = (whole.0 + off, whole.1 + variance);
    }
    // Where neither finds light there is nothing to say; where chance has no part, any difference is one too many.
    if dim_ones != (0.0, 0.0) {
        blocks.push(dim_ones.0 / dim_ones.1.sqrt());
    }
    (blocks, whole.0 / whole.1.sqrt())
}

/// The most of independent blocks that lie beyond three standard errors by chance: in `comparisons` of so many blocks,
/// more of them in any is as rare as a false alarm (binomial distribution).
fn most_by_chance(blocks: usize, comparisons: usize) -> usize {
    let n = blocks as f64;
    let mut term = (1.0 - BEYOND).powf(n);
    let mut sum = term;
    let mut most = 0;
    while 1.0 - sum > FALSE_ALARM / comparisons as f64 {
        most += 1;
        term *= (n + 1.0 - most as f64) / most as f64 * BEYOND / (1.0 - BEYOND);
        sum += term;
    }
    most
}

/// What of images lies farther from a reference than chance puts it; empty where nothing does.
fn beyond_chance(
    what: &str,
    images: &[Image],
    edges: &[bool],
    listed: &Listed,
    quantity: &str,
    comparisons: usize,
) -> String {
    let [expected, errors, normal] =
        [&listed.files[quantity], &listed.errors[quantity], &listed.files["normal"]].map(|file| image(file));
    // At silhouettes where an interpolated normal turns away from the viewer, the reference is black and its normal 0.
    let away = |pixel: usize| normal.data[pixel * normal.channels as usize..][..3] == [0.0; 3];
    let left_out: Vec<bool> = edges.iter().enumerate().map(|(pixel, edge)| *edge || away(pixel)).collect();
    let (blocks, whole) = deviations(images, &expected, &errors, &left_out);
    let spread = (blocks.iter().map(|z| z * z).sum::<f64>() / blocks.len() as f64).sqrt();
    let far = blocks.iter().filter(|z| z.abs() > 3.0).count();
    let most = most_by_chance(blocks.len(), comparisons);
    let farthest = blocks.iter().fold(0.0_f64, |far, z| far.max(z.abs()));
    let found = format!(
        "{what}: the whole {whole:+.2} standard errors off, {} blocks {spread:.2}, the farthest {farthest:.1}, {far} beyond 3 (by chance up to {most})",
        blocks.len(),
    );
    println!("{found}");
    // Chance puts the spread round 1 with a standard error of 1/sqrt(2 n): 0.04 for 256 blocks, so that 1.2 is 4.5 of
    // them.
    let wide = 1.0 + 4.5 / (2.0 * blocks.len() as f64).sqrt();
    if whole.abs() <= 3.0 && far <= most && spread <= wide { String::new() } else { format!("{found}\n") }
}

/// Holds the path tracer to some references: entry, quantity, bounces. Where no light comes, none may be found.
fn hold(references: &[(&Listed, &str, u32)]) {
    let gpu = gpu();
    let mut faults = String::new();
    let mut last: Option<(&Listed, Tracer)> = None;
    for &(listed, quantity, bounces) in references {
        let (_, tracer) = match last.take() {
            Some(same) if same.0 == listed => last.insert(same),
            _ => last.insert((listed, Tracer::of(listed))),
        };
        let output = if quantity == "full" { "color" } else { "indirect" };
        let what = format!("{} {} {quantity}", listed.scene, listed.camera.as_deref().unwrap_or("-"));
        let found = tracer.images(&gpu, output, bounces, PATHS[0]);
        if !listed.errors.contains_key(quantity) {
            let dark = |image: &Image| (0..image.pixel_count()).all(|p| brightness(image, p) == 0.0);
            assert!(dark(&image(&listed.files[quantity])), "{what}: nothing says how large the reference's errors are");
            println!("{what}: no light");
            if !found.iter().all(dark) {
                faults += &format!("{what}: light where there is none\n");
            }
            continue;
        }
        let edges = at_edges(&tracer.scene, tracer.camera.as_deref());
        let held = |found: &[Image], paths| {
            let what = format!("{what}, {} paths", paths * IMAGES);
            beyond_chance(&what, found, &edges, listed, quantity, references.len())
        };
        // Sixteen times the paths are four times as sure: what is a bias shows all the more.
        if !held(&found, PATHS[0]).is_empty() {
            faults += &held(&tracer.images(&gpu, output, bounces, PATHS[1]), PATHS[1]);
        }
    }
    assert!(faults.is_empty(), "{faults}");
}

fn manifest() -> Manifest {
    Manifest::read(&repository("tests/references")).unwrap_or_else(|f| panic!("{f}"))
}

fn listed<'a>(manifest: &'a Manifest, scene: &str) -> &'a Listed {
    manifest.entries.iter().find(|e| e.scene == scene).unwrap_or_else(|| panic!("no {scene}"))
}

#[test]
fn path_tracing_is_unbiased() {
    let manifest = manifest();
    let some = [
        ("cornell_point", "indirect", 64),
        ("room_spot", "indirect", 64),
        ("room_area", "indirect", 64),
        ("cornell_point", "b1_indirect", 1),
        ("room_spot", "b2_indirect", 2),
        ("room_area", "b3_indirect", 3),
        ("metal_balls", "b2_indirect", 2),
    ];
    hold(&some.map(|(scene, quantity, bounces)| (listed(&manifest, scene), quantity, bounces)));
}

/// A board of balls and panels under a panorama: roughness by metalness, each kind of texture, holes, vertex colours.
#[test]
fn path_tracing_shows_materials_as_mitsuba_does() {
    let manifest = manifest();
    hold(&[(listed(&manifest, "materials"), "full", 64)]);
}

/// Every reference image of indirect light, converged and after one, two and three bounces.
#[test]
#[ignore = "takes minutes on two cores: cargo test --release every_reference -- --ignored --nocapture"]
fn path_tracing_is_unbiased_on_every_reference() {
    let manifest = manifest();
    // Of all light only what stands under a panorama has errors: elsewhere direct light is compared by itself.
    let quantities = [("full", 64), ("indirect", 64), ("b1_indirect", 1), ("b2_indirect", 2), ("b3_indirect", 3)];
    let all = manifest.entries.iter().flat_map(|listed| quantities.map(|(name, bounces)| (listed, name, bounces)));
    let all: Vec<_> = all
        .filter(|(listed, name, _)| listed.files.contains_key(*name))
        .filter(|(listed, name, _)| *name != "full" || listed.errors.contains_key(*name))
        .collect();
    assert!(all.len() >= 40, "only {} references are compared", all.len());
    hold(&all);
}
