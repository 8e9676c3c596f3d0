//! Coarse triangles shaded by smooth normals: neither shadow maps nor what probes see leave spots on them.

use crate::device::Shot;
use crate::support::Scratch;
use glam::{Vec2, Vec3};
use lightgraph::Image;
use std::f32::consts::{PI, TAU};
use std::path::Path;

const SIZE: u32 = 128;

/// A vertex and its normal.
type Corner = (Vec3, Vec3);

/// Squares of a surface over 0 to 1 in both directions, none of which is a plane.
fn squares(n: u32, surface: impl Fn(Vec2) -> Corner, first: u32) -> (Vec<Corner>, Vec<u32>) {
    let places = (0..=n).flat_map(|i| (0..=n).map(move |k| Vec2::new(i as f32, k as f32) / n as f32));
    let square = |i: u32| {
        let a = first + i / n * (n + 1) + i % n;
        [a, a + 1, a + n + 1, a + 1, a + n + 2, a + n + 1]
    };
    (places.map(surface).collect(), (0..n * n).flat_map(square).collect())
}

/// Hills four metres wide, a ball over them and a lamp beside it.
fn hills(folder: &Path) -> String {
    let height =
        |p: Vec2| 0.12 * (4.0 * p.x + 1.0).sin() * (5.0 * p.y).cos() + 0.05 * (9.0 * p.x).sin() * (8.0 * p.y).sin();
    let hill = |at: Vec2| {
        let p = 2.0 * at - 1.0;
        let slope = |d: Vec2| (height(p + d) - height(p - d)) / (2.0 * 1e-2);
        let normal = Vec3::new(-slope(Vec2::X * 1e-2), 1.0, -slope(Vec2::Y * 1e-2)).normalize();
        (2.0 * Vec3::new(p.x, height(p), p.y), normal)
    };
    let ball = |at: Vec2| {
        let (turn, down) = (TAU * at.x, PI * at.y);
        let normal = Vec3::new(down.sin() * turn.cos(), down.cos(), -down.sin() * turn.sin());
        (0.5 * normal + 0.75 * Vec3::Y, normal)
    };
    let (mut corners, mut indices) = squares(16, hill, 0);
    let (more, others) = squares(10, ball, corners.len() as u32);
    corners.extend(more);
    indices.extend(others);
    let places = corners.iter().map(|c| c.0).chain(corners.iter().map(|c| c.1));
    let mut bytes: Vec<u8> = places.flat_map(|v| v.to_array()).flat_map(f32::to_le_bytes).collect();
    let from = bytes.len();
    bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
    let (vertices, length, count) = (corners.len(), bytes.len(), indices.len());
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0, 1, 2]}}],
        "nodes": [
            {{"mesh": 0}},
            {{"camera": 0, "translation": [0, 1.6, 4.2], "rotation": [-0.13, 0, 0, 0.9915]}},
            {{"translation": [1.2, 2.0, 0.8], "extensions": {{"KHR_lights_punctual": {{"light": 0}}}}}}
        ],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {{"KHR_lights_punctual": {{"lights": [{{"type": "point", "intensity": 20}}]}}}},
        "cameras": [{{"type": "perspective", "perspective": {{"yfov": 0.7, "znear": 0.05}}}}],
        "materials": [{{"pbrMetallicRoughness": {{"baseColorFactor": [0.7, 0.7, 0.7, 1], "metallicFactor": 0}}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "NORMAL": 1}}, "indices": 2, "material": 0}}]}}],
        "accessors": [
            {{"bufferView": 0, "componentType": 5126, "count": {vertices}, "type": "VEC3",
              "min": [-2, -1, -2], "max": [2, 2, 2]}},
            {{"bufferView": 0, "byteOffset": {}, "componentType": 5126, "count": {vertices}, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5125, "count": {count}, "type": "SCALAR"}}
        ],
        "bufferViews": [
            {{"buffer": 0, "byteLength": {from}}},
            {{"buffer": 0, "byteOffset": {from}, "byteLength": {}}}
        ],
        "buffers": [{{"byteLength": {length}, "uri": "hills.bin"}}]}}"#,
        from / 2,
        length - from
    );
    std::fs::write(folder.join("hills.bin"), bytes).unwrap();
    let path = folder.join("hills.gltf");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// Percent of the pixels that differ by more than a fourth from the median of the nine round them, where `even` light
/// says that neither a surface nor a shadow ends.
fn spots(image: &Image, even: &Image) -> f64 {
    let round = |image: &Image, x: u32, y: u32| {
        let at = |k: u32| image.pixel(0, x + k % 3 - 1, y + k / 3 - 1).unwrap_or_default()[0];
        let mut nine: Vec<f32> = (0..9).map(at).collect();
        let own = nine[4];
        nine.sort_by(f32::total_cmp);
        (own, nine)
    };
    let (mut all, mut found) = (0, 0);
    for (x, y) in (1..SIZE - 1).flat_map(|y| (1..SIZE - 1).map(move |x| (x, y))) {
        let (_, light) = round(even, x, y);
        if light[0] > 0.02 && light[8] < 1.5 * light[0] {
            let (own, nine) = round(image, x, y);
            all += 1;
            found += u32::from((own - nine[4]).abs() > 0.25 * nine[4]);
        }
    }
    assert!(all > 3_000, "only {all} pixels are looked at");
    100.0 * f64::from(found) / f64::from(all)
}

#[test]
fn smooth_normals_on_coarse_triangles_leave_no_spots() {
    let folder = Scratch::new("smooth-hills");
    let scene = hills(folder.path());
    let [traced] =
        Shot { set: "bounces=0 samples=4", ..Shot::new("graphs/gi/pathtrace.ron", &scene, SIZE) }.render(["direct"]);
    let shot = Shot::new("graphs/gi/fast_grid_visible.ron", &scene, SIZE);
    let [mapped, probed] = shot.render(["direct", "indirect"]).map(|image| spots(&image, &traced));
    println!("spots: {mapped:.2} % of the light by shadow maps, {probed:.2} % of the light of probes");
    assert!(mapped <= 0.1, "{mapped} % of spots by shadow maps");
    assert!(probed <= 4.0, "{probed} % of spots in the light of probes");
}
