//! A board of materials: every part of glTF's metallic-roughness model and each kind of texture once, under a
//! panorama.

use crate::glb::GlbBuilder;
use crate::mesh::TriangleMesh;
use crate::shapes::{ellipsoid, panel, surface};
use crate::studio;
use glam::{DAffine3, DMat3, DVec3};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use serde_json::{Value, json};
use std::f64::consts::TAU;

const COLUMNS: [f64; 4] = [-2.1, -0.7, 0.7, 2.1];
const ROUGHNESS: [f64; 4] = [0.15, 0.35, 0.65, 1.0];
/// Texels along a picture.
const SIZE: u32 = 32;

pub fn board() -> GlbBuilder {
    let mut d = GlbBuilder::new();
    let p = DVec3::new;
    let stone = d.matte("stone", [0.42, 0.4, 0.38]);
    let mut room = TriangleMesh::new();
    room.quad([p(-5.0, -0.8, -1.2), p(5.0, -0.8, -1.2), p(5.0, 5.4, -1.2), p(-5.0, 5.4, -1.2)]);
    room.quad([p(-5.0, -0.8, 3.0), p(5.0, -0.8, 3.0), p(5.0, -0.8, -1.2), p(-5.0, -0.8, -1.2)]);
    d.fixture("room", &room, stone);

    for (x, roughness) in COLUMNS.into_iter().zip(ROUGHNESS) {
        let gold = d.metal(&format!("gold {roughness}"), [0.95, 0.7, 0.35], roughness);
        d.fixture(&format!("gold ball {roughness}"), &ball(x, 4.0), gold);
        let half = d.described(
            &format!("half {roughness}"),
            finish(json!({ "baseColorFactor": [0.25, 0.5, 0.8, 1.0] }), 0.5, roughness),
        );
        d.fixture(&format!("half ball {roughness}"), &ball(x, 2.7), half);
    }

    let [color, made, bumps, glow, leaves] = [
        ("color", color as fn(f64, f64) -> [f64; 4], false),
        ("finish", made, false),
        ("bumps", bumps, false),
        ("glow", glow, false),
        ("leaves", leaves, true),
    ]
    .map(|(name, of, nearest)| d.image(name, &png(of), nearest));
    let read = |index: usize| json!({ "index": index });
    let flat = |surface: Value| json!({ "pbrMetallicRoughness": surface });
    let base = |factor: [f64; 3]| {
        let [r, g, b] = factor;
        json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 })
    };

    let mut tinted = flat(base([1.0, 0.8, 0.6]));
    tinted["pbrMetallicRoughness"]["baseColorTexture"] = read(color);
    let mut worn = finish(json!({ "baseColorFactor": [0.9, 0.85, 0.8, 1.0] }), 0.9, 1.0);
    worn["pbrMetallicRoughness"]["metallicRoughnessTexture"] = read(made);
    let mut plaster = flat(base([0.8, 0.75, 0.7]));
    plaster["normalTexture"] = read(bumps);
    let mut hammered = finish(json!({ "baseColorFactor": [0.95, 0.6, 0.5, 1.0] }), 1.0, 0.4);
    hammered["normalTexture"] = read(bumps);
    let mut screen = flat(base([0.3, 0.3, 0.3]));
    screen["emissiveTexture"] = read(glow);
    screen["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    screen["extensions"] = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 2.5 } });
    let mut leaf = flat(base([1.0; 3]));
    leaf["pbrMetallicRoughness"]["baseColorTexture"] = read(leaves);
    leaf["alphaMode"] = json!("MASK");
    leaf["doubleSided"] = json!(true);
    let mut all = finish(json!({ "baseColorFactor": [1.0, 1.0, 1.0, 1.0] }), 1.0, 0.9);
    all["pbrMetallicRoughness"]["baseColorTexture"] = read(color);
    all["pbrMetallicRoughness"]["metallicRoughnessTexture"] = read(made);
    all["normalTexture"] = read(bumps);

    for (i, (name, value)) in [
        ("tinted", tinted),
        ("worn", worn),
        ("plaster", plaster),
        ("hammered", hammered),
        ("screen", screen),
        ("leaf", leaf),
        ("all", all),
    ]
    .into_iter()
    .enumerate()
    {
        let material = d.described(name, value);
        d.fixture(&format!("{name} panel"), &panel(1.15, 1.15).transformed(stand(i)), material);
    }
    let chalk = d.matte("chalk", [0.9, 0.9, 0.9]);
    let sheet = surface(6, 6, false, |x, y| p(x as f64 / 6.0 - 0.5, y as f64 / 6.0 - 0.5, 0.0) * 1.15);
    let place = stand(7);
    let chalk_panel = d.mesh_with("chalk panel", &sheet.transformed(place), chalk, |d, positions, primitive| {
        let color = |at: &[f32; 3]| {
            let at = place.inverse().transform_point3(DVec3::from(at.map(f64::from)));
            // In steps that systems agree on.
            let steps = |c: f64| ((c * 1024.0).round() / 1024.0) as f32;
            [0.5 + at.x / 1.3, 0.5 + at.y / 1.3, 0.5 - at.x * at.y].map(steps)
        };
        let colors: Vec<[f32; 3]> = positions.iter().map(color).collect();
        primitive["attributes"]["COLOR_0"] = json!(d.floats(&colors));
    });
    d.place("chalk panel", chalk_panel, DAffine3::IDENTITY);

    d.camera("front", p(0.0, 2.2, 9.0), p(0.0, 1.95, 0.0), 36.0);
    d
}

fn ball(x: f64, y: f64) -> TriangleMesh {
    ellipsoid(DVec3::new(x, y, 0.0), DVec3::splat(0.55), 40, 20)
}

fn finish(mut surface: Value, metallic: f64, roughness: f64) -> Value {
    surface["metallicFactor"] = json!(metallic);
    surface["roughnessFactor"] = json!(roughness);
    json!({ "pbrMetallicRoughness": surface })
}

/// Where a panel stands: two rows of four, each leaning back and turned a little.
fn stand(index: usize) -> DAffine3 {
    let x = COLUMNS[index % 4];
    let y = if index < 4 { 1.35 } else { 0.0 };
    let turn = DMat3::from_rotation_y(-0.12 * x) * DMat3::from_rotation_x(-0.35);
    DAffine3::from_mat3_translation(turn, DVec3::new(x, y, 0.0))
}

/// A picture whose texels hold this at places from 0 to 1, from the upper left.
fn png(of: fn(f64, f64) -> [f64; 4]) -> Vec<u8> {
    let texel = |i: u32| {
        let at = |k: u32| (f64::from(k) + 0.5) / f64::from(SIZE);
        of(at(i % SIZE), at(i / SIZE)).map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8)
    };
    let pixels: Vec<u8> = (0..SIZE * SIZE).flat_map(texel).collect();
    let mut png = Vec::new();
    let written = PngEncoder::new(&mut png).write_image(&pixels, SIZE, SIZE, ExtendedColorType::Rgba8);
    written.expect("a PNG fits into memory");
    png
}

fn color(x: f64, y: f64) -> [f64; 4] {
    [0.75 + 0.2 * (TAU * x).sin(), 0.6 + 0.3 * (TAU * (x + y)).cos(), 0.5 + 0.3 * (2.0 * TAU * y).sin(), 1.0]
}

/// Roughness in green, metalness in blue.
fn made(x: f64, y: f64) -> [f64; 4] {
    [0.0, 0.25 + 0.7 * x, 0.5 + 0.5 * (TAU * y).sin(), 1.0]
}

/// Normals of a field of bumps, green being up.
fn bumps(x: f64, y: f64) -> [f64; 4] {
    let slope = 0.45;
    let (dx, dy) = (slope * (2.0 * TAU * x).cos(), -slope * (2.0 * TAU * y).sin());
    let n = DVec3::new(-dx, dy, 1.0).normalize() * 0.5 + 0.5;
    [n.x, n.y, n.z, 1.0]
}

fn glow(x: f64, y: f64) -> [f64; 4] {
    let spot = |cx: f64, cy: f64| (-20.0 * ((x - cx).powi(2) + (y - cy).powi(2))).exp();
    [spot(0.3, 0.3) + 0.1, 0.8 * spot(0.7, 0.4) + 0.05, spot(0.5, 0.75), 1.0]
}

/// Leaves: five ovals round the middle.
fn leaves(x: f64, y: f64) -> [f64; 4] {
    let (dx, dy) = (x - 0.5, y - 0.5);
    let (far, turn) = ((dx * dx + dy * dy).sqrt(), dy.atan2(dx));
    let petal = 0.46 * (2.5 * turn).cos().abs() + 0.06;
    [0.2 + 0.3 * y, 0.6, 0.15, if far < petal { 1.0 } else { 0.0 }]
}

/// A bright spot on the left, a dim one behind, and a sky that grows darker towards the ground.
pub fn panorama() -> Vec<u8> {
    studio::panorama(|x, y| {
        let towards = studio::towards(x, y);
        let spot = |from: DVec3, narrow: f64| (narrow * (towards.dot(from.normalize()) - 1.0)).exp();
        let warm = 8.0 * spot(DVec3::new(-2.0, 1.0, 1.5), 18.0);
        let cold = 4.0 * spot(DVec3::new(2.0, 0.3, 1.0), 10.0);
        let sky = 0.15 + 0.25 * (1.0 + towards.y);
        [sky + warm + 0.4 * cold, sky + 0.7 * warm + 0.7 * cold, 1.2 * sky + 0.4 * warm + cold]
    })
}

pub const SCENE: &str = "\
// The board of materials under a panorama.
Scene(
    gltf: \"materials.glb\",
    grid: ((-4.0, -0.8, -1.2), (4.0, 5.0, 3.0)),
    environment: File(file: \"materials.hdr\"),
)
";
