//! Clear coats in a graph that traces paths.

use crate::device::Shot;
use crate::support::Scratch;
use glam::Vec3;
use lightgraph::Image;
use serde_json::{Value, json};
use std::path::Path;

const SIZE: u32 = 64;

/// The texel of the normal map; what it says in the square's frame: x along the tangent, z up.
const TEXEL: [u8; 3] = [166, 90, 240];

/// A square of two metres under a lamp, that reflects by nothing but its coat.
fn square(folder: &Path, name: &str, normal: Vec3, coat: &Value) -> String {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0_f32]];
    let positions = corners.iter().flat_map(|[x, y]| [*x, *y, 0.0]);
    let normals = corners.iter().flat_map(|_| normal.to_array());
    let tangents = corners.iter().flat_map(|_| [1.0, 0.0, 0.0, 1.0]);
    let places = corners.iter().flatten().map(|x| 0.5 + 0.5 * x);
    let floats = positions.chain(normals).chain(tangents).chain(places);
    let mut bytes: Vec<u8> = floats.flat_map(f32::to_le_bytes).collect();
    bytes.extend([0_u32, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    std::fs::write(folder.join("square.bin"), &bytes).unwrap();
    image::RgbImage::from_pixel(4, 4, image::Rgb(TEXEL)).save(folder.join("tilted.png")).unwrap();
    let view = |from: usize, length: usize| json!({"buffer": 0, "byteOffset": from, "byteLength": length});
    let floats = |view: usize, kind: &str| json!({"bufferView": view, "componentType": 5126, "count": 4, "type": kind});
    let kinds = ["VEC3", "VEC3", "VEC4", "VEC2"];
    let mut accessors: Vec<Value> = kinds.iter().enumerate().map(|(i, kind)| floats(i, kind)).collect();
    (accessors[0]["min"], accessors[0]["max"]) = (json!([-1, -1, 0]), json!([1, 1, 0]));
    accessors.push(json!({"bufferView": 4, "componentType": 5125, "count": 6, "type": "SCALAR"}));
    let attributes = json!({"POSITION": 0, "NORMAL": 1, "TANGENT": 2, "TEXCOORD_0": 3});
    let text = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [
            {"mesh": 0},
            {"camera": 0, "translation": [0, 0, 3]},
            {"translation": [0.7, -0.4, 2], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_clearcoat", "KHR_materials_specular"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 50}]}},
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.05}}],
        "images": [{"uri": "tilted.png"}],
        "textures": [{"source": 0}],
        "materials": [{
            "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
            "extensions": {"KHR_materials_specular": {"specularFactor": 0}, "KHR_materials_clearcoat": coat},
        }],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 4, "material": 0}]}],
        "accessors": accessors,
        "bufferViews": [view(0, 48), view(48, 48), view(96, 64), view(160, 32), view(192, 24)],
        "buffers": [{"byteLength": bytes.len(), "uri": "square.bin"}],
    });
    let path = folder.join(name);
    std::fs::write(&path, text.to_string()).unwrap();
    path.display().to_string()
}

/// Whether bent by its own map or by the geometry, the coat reflects alike; a smooth one reflects otherwise.
#[test]
fn a_coat_is_bent_by_its_own_normal_map() {
    let folder = Scratch::new("coats");
    let [x, y, z] = TEXEL.map(|code| f32::from(code) / 127.5 - 1.0);
    let smooth = json!({"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.5});
    let mut mapped = smooth.clone();
    mapped["clearcoatNormalTexture"] = json!({"index": 0, "scale": 0.5});
    let render = |name, normal, coat| {
        let scene = square(folder.path(), name, normal, coat);
        let shot = Shot { set: "bounces=0 samples=4", ..Shot::new("graphs/gi/pathtrace.ron", &scene, SIZE) };
        let [image] = shot.render(["direct"]);
        image
    };
    let by_map = render("mapped.gltf", Vec3::Z, &mapped);
    let by_geometry = render("turned.gltf", Vec3::new(0.5 * x, 0.5 * y, z).normalize(), &smooth);
    let without = render("smooth.gltf", Vec3::Z, &smooth);
    let mean = |image: &Image| image.rgb().map(|p| f64::from(p[0])).sum::<f64>() / f64::from(SIZE * SIZE);
    let off = |a: &Image, b: &Image| {
        let apart = a.rgb().zip(b.rgb()).map(|(a, b)| f64::from((a[0] - b[0]).abs()));
        apart.sum::<f64>() / f64::from(SIZE * SIZE) / mean(b)
    };
    let (same, other) = (off(&by_map, &by_geometry), off(&without, &by_geometry));
    println!("mean {:.4}; {same:.2e} apart by map and by geometry, {other:.3} without either", mean(&by_map));
    assert!(mean(&by_map) > 0.01 && same < 1e-4, "{same}");
    assert!(other > 0.1, "{other}");
}
