//! Shaders against the Rust that states the same mathematics: `math` in f64.

use crate::device::gpu;
use crate::support::{Scratch, repository};
use glam::{DVec3, UVec3};
use lightgraph::internals::math::grid::Grid;
use lightgraph::internals::math::{cube, lobe, sh};
use lightgraph::internals::value::Value;
use lightgraph::{Image, Project, Scene, Session, Settings};
use std::f64::consts::PI;

const SCENE: &str = "scenes/hall_glossy.ron";
const COUNTS: UVec3 = UVec3::new(3, 2, 2);
const FACE: u32 = 6;
const ORDER: usize = 4;

/// What the probes see, and what that sends them, can be read back.
const VARIANT: &str = r#"Variant(base: "lightgraph:graphs/gi/uniform_grid.ron", about: "for tests", outputs: {
    "cube_albedo": "cube_albedo", "cube_normal": "cube_normal",
    "cube_direct": "cube_direct", "cube_light": "cube_light",
})"#;

/// Outputs of the uniform grid after so many bounces, in this order.
fn render<const N: usize>(bounces: u32, outputs: [&str; N]) -> [Image; N] {
    let gpu = gpu();
    let scratch = Scratch::new("twins");
    let variant = scratch.path().join("variant.ron");
    std::fs::write(&variant, VARIANT).unwrap();
    let project = Project::open(&variant, &[repository("shaders")]);
    let project = project.unwrap_or_else(|f| panic!("{f}"));
    let set = format!("grid=3,2,2 face={FACE} order={ORDER} bounces={bounces} epsilon=0 behind_captured=0.1");
    let set: Vec<String> = set.split_whitespace().map(String::from).collect();
    let settings = Settings {
        params: project.params(&set).unwrap_or_else(|f| panic!("{f}")),
        size: [8, 8],
        outputs: Some(outputs.iter().map(ToString::to_string).collect()),
        ..Settings::default()
    };
    let scene = Scene::load(&repository(SCENE)).unwrap_or_else(|f| panic!("{f}")).scene;
    let mut session = Session::new(&gpu, &project, scene, settings).unwrap_or_else(|f| panic!("{f}"));
    session.frame(&gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    outputs.map(|name| session.image(&gpu, name).unwrap_or_else(|f| panic!("{f}")))
}

fn probes() -> impl Iterator<Item = UVec3> {
    (0..COUNTS.element_product()).map(|i| UVec3::new(i % COUNTS.x, i / COUNTS.x % COUNTS.y, i / (COUNTS.x * COUNTS.y)))
}

/// A texel of probe number `probe` in an atlas.
fn texel(atlas: &Image, probe: u32, face: u32, [x, y]: [u32; 2]) -> [f64; 4] {
    let (tile, columns) = (probe * cube::FACES + face, atlas.width / FACE);
    let at = (tile / columns * FACE + y) * atlas.width + tile % columns * FACE + x;
    std::array::from_fn(|channel| f64::from(atlas.data[at as usize * 4 + channel]))
}

/// Every texel of a probe's cube: face and place.
fn texels() -> impl Iterator<Item = (u32, [u32; 2])> {
    (0..cube::FACES * FACE * FACE).map(|i| (i / (FACE * FACE), [i % FACE, i / FACE % FACE]))
}

/// A probe's coefficients of one channel.
fn coefficients(slices: &Image, probe: UVec3, channel: usize) -> Vec<f64> {
    let value = |k: usize| slices.pixel(probe.z + k as u32 * COUNTS.z, probe.x, probe.y).unwrap()[channel];
    (0..sh::count(ORDER)).map(|k| f64::from(value(k))).collect()
}

#[test]
fn coefficients_are_the_projection_of_what_the_probes_see() {
    let [light, slices] = render(2, ["cube_light", "sh"]);
    for (number, probe) in probes().enumerate() {
        for channel in 0..4 {
            let mut expected = vec![0.0; sh::count(ORDER)];
            for (face, place) in texels() {
                let value = texel(&light, number as u32, face, place)[channel];
                for (sum, factor) in expected.iter_mut().zip(sh::factors(ORDER, face, place, FACE)) {
                    *sum += value * factor;
                }
            }
            for (k, (found, expected)) in coefficients(&slices, probe, channel).iter().zip(&expected).enumerate() {
                let error = (found - expected).abs() / (4.0 * PI).sqrt();
                assert!(error < 1e-4, "probe {probe}, coefficient {k}: {found}, not {expected}");
            }
        }
    }
}

#[test]
fn captured_surfaces_reflect_the_interpolated_coefficients() {
    let [slices] = render(1, ["sh"]);
    let [albedo, normal, direct, light] = render(2, ["cube_albedo", "cube_normal", "cube_direct", "cube_light"]);
    let scene = Scene::load(&repository(SCENE)).unwrap_or_else(|f| panic!("{f}")).scene;
    let facts = scene.facts();
    let corner = |name: &str| match facts.get(name) {
        Some(Value::Vec3(v)) => v.as_dvec3(),
        other => panic!("{name}: {other:?}"),
    };
    let grid = Grid { counts: COUNTS, min: corner("grid_min"), max: corner("grid_max"), inset: 0.5 };
    let open = |probe: UVec3| coefficients(&slices, probe, 3)[0] / (4.0 * PI).sqrt();
    let (mut lambert, mut phong) = (0, 0);
    for (number, probe) in probes().enumerate() {
        for (face, place) in texels() {
            let [at, n, was, is] = [&albedo, &normal, &direct, &light].map(|i| texel(i, number as u32, face, place));
            if at[3] == 0.0 {
                continue;
            }
            let ray = cube::direction_beside(face, place, FACE);
            let n3 = DVec3::new(n[0], n[1], n[2]);
            let material = &scene.materials[at[3].abs() as usize - 1];
            let shares = grid.facing(grid.position(probe) + ray * n[3], n3, 0.1, open);
            let (strength, shininess) = (f64::from(material.specular), f64::from(material.shininess));
            lambert += 1;
            phong += usize::from(strength > 0.0);
            for channel in 0..3 {
                let gathered: Vec<f64> = (0..sh::count(ORDER))
                    .map(|k| shares.iter().map(|(p, share)| share * coefficients(&slices, *p, channel)[k]).sum())
                    .collect();
                let diffuse = sh::convolve(&gathered, &lobe::lambert(ORDER, at[channel]), n3);
                let mirror = sh::convolve(&gathered, &lobe::phong(ORDER, strength, shininess), ray.reflect(n3));
                let (found, expected) = (is[channel] - was[channel], diffuse + mirror);
                let size = expected.abs().max(gathered[0]).max(was[channel]).max(1e-2);
                assert!(
                    (found - expected).abs() < 1e-4 * size,
                    "probe {probe}, face {face}, texel {place:?}: {found}, not {expected}"
                );
            }
        }
    }
    assert!(lambert > 1000 && phong > 5, "{lambert} texels show a surface, {phong} of them a glossy one");
}
