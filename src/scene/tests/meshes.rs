//! Meshes to vertices and indices.

use super::fixture::{Fixture, QUAD};
use crate::{diag::render, scene::Scene};
use glam::{Vec2, Vec3};
use serde_json::json;

/// World corners of every triangle.
fn corners(scene: &Scene) -> Vec<[Vec3; 3]> {
    let pose = scene.pose(0.0);
    scene
        .corners()
        .map(|c| {
            c.map(|i| {
                let v = &scene.geometry.vertices[i as usize];
                pose.nodes[v.node as usize].transform_point3(v.position.into())
            })
        })
        .collect()
}

fn winding(c: &[Vec3; 3]) -> Vec3 {
    (c[1] - c[0]).cross(c[2] - c[0]).normalize()
}

#[test]
fn missing_normals_are_those_of_the_faces() {
    let scene = Fixture::quad().scene();
    assert_eq!(scene.geometry.indices, [0, 1, 2, 3, 4, 5]);
    assert!(scene.geometry.vertices.iter().all(|v| v.normal == [0.0, 0.0, 1.0]));
    assert_eq!(scene.geometry.one_sided, 6);
}

#[test]
fn given_normals_are_kept_unit_and_vertices_shared() {
    let mut f = Fixture::quad();
    let normals = f.floats(&[[0.0, 0.0, 2.0], [0.0, 3.0, 4.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    f.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    let scene = f.scene();
    assert_eq!(scene.geometry.indices, [0, 1, 2, 0, 2, 3]);
    let found: Vec<[f32; 3]> = scene.geometry.vertices.iter().map(|v| v.normal).collect();
    // A normal without length takes the face's.
    assert_eq!(found, [[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
}

#[test]
fn strips_fans_and_plain_lists_face_the_same_way() {
    let strip = [QUAD[0], QUAD[1], QUAD[3], QUAD[2]];
    let list = [QUAD[0], QUAD[1], QUAD[2], QUAD[0], QUAD[2], QUAD[3]];
    for (mode, positions) in [(5, strip.to_vec()), (6, QUAD.to_vec()), (4, list.to_vec())] {
        let mut f = Fixture::new();
        let position = f.floats(&positions);
        f.mesh(json!({"attributes": {"POSITION": position}, "mode": mode}));
        f.node(json!({"mesh": 0}));
        let triangles = corners(&f.scene());
        assert_eq!(triangles.len(), 2, "mode {mode}");
        assert!(triangles.iter().all(|t| winding(t) == Vec3::Z), "mode {mode}: {triangles:?}");
        let area: f32 = triangles.iter().map(|t| (t[1] - t[0]).cross(t[2] - t[0]).length() / 2.0).sum();
        assert!((area - 1.0).abs() < 1e-6, "mode {mode}: {area}");
    }
}

#[test]
fn mirrored_nodes_keep_their_front_in_front() {
    for scale in [[-1.0, 1.0, 1.0], [1.0, -2.0, 1.0], [-1.0, -1.0, 1.0], [1.0, 1.0, -1.0]] {
        let mut f = Fixture::quad();
        f.json["nodes"][0]["scale"] = json!(scale);
        let scene = f.scene();
        let expected = Vec3::new(0.0, 0.0, scale[2]);
        for triangle in corners(&scene) {
            assert!(winding(&triangle).distance(expected) < 1e-6, "{scale:?}: {triangle:?}");
        }
        let tables = scene.tables(&scene.pose(0.0));
        let normal = tables[4].columns[3].1.get(0).unwrap();
        assert_eq!(normal, crate::value::Value::Vec3(expected), "{scale:?}");
    }
}

#[test]
fn an_instanced_mesh_stands_once_for_each_node() {
    let mut f = Fixture::quad();
    f.node(json!({"name": "second", "mesh": 0, "translation": [0, 0, 5], "children": [2]}));
    f.push("nodes", json!({"name": "third", "mesh": 0, "translation": [0, 0, 5]}));
    let scene = f.scene();
    assert_eq!(scene.geometry.indices.len(), 18);
    let nodes: Vec<u32> = scene.geometry.vertices.chunks(6).map(|c| c[0].node).collect();
    assert_eq!(nodes, [0, 1, 2]);
    assert_eq!(scene.nodes[2].parent, Some(1));
    // Those in sides of the box round everything come last.
    let depths: Vec<f32> = corners(&scene).iter().map(|c| c[0].z).collect();
    assert_eq!(depths, [5.0, 5.0, 0.0, 0.0, 10.0, 10.0]);
    assert_eq!((scene.bounds.min, scene.bounds.max), (Vec3::ZERO, Vec3::new(1.0, 1.0, 10.0)));
}

#[test]
fn double_sided_triangles_come_last() {
    let mut f = Fixture::new();
    let leaf = f.material(json!({"name": "leaf", "doubleSided": true}));
    let stone = f.material(json!({"name": "stone"}));
    f.wall("leaf", QUAD, leaf);
    f.wall("stone", QUAD, stone);
    f.wall("leaf 2", QUAD, leaf);
    let scene = f.scene();
    assert_eq!(scene.geometry.one_sided, 6);
    let materials: Vec<u32> =
        scene.geometry.indices.iter().map(|i| scene.geometry.vertices[*i as usize].material).collect();
    assert_eq!(materials, [[1; 6], [0; 6], [0; 6]].concat());
}

#[test]
fn a_mesh_without_a_material_gets_gltf_s_own() {
    let mut f = Fixture::quad();
    f.json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
    let scene = f.scene();
    assert_eq!(scene.materials.len(), 2);
    assert_eq!(scene.materials[1].name, "default");
    assert!(scene.geometry.vertices.iter().all(|v| v.material == 1));
}

#[test]
fn triangles_without_area_are_dropped_with_a_notice() {
    let mut f = Fixture::quad();
    let indices = f.shorts(&[0, 1, 2, 0, 2, 2, 0, 2, 3]);
    f.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    let line = f.floats(&[[0.0; 3], [1.0; 3], [2.0; 3]]);
    let mesh = f.mesh(json!({"attributes": {"POSITION": line}}));
    f.node(json!({"name": "line", "mesh": mesh}));
    f.node(json!({"name": "flat", "mesh": 0, "scale": [1, 0, 1]}));
    let (scene, notices) = f.read().unwrap();
    assert_eq!(scene.geometry.indices.len(), 6);
    let text = render(&notices);
    for expected in [
        "meshes[0] \"mesh\" primitive 0: 1 of 3 triangles have no area and are dropped",
        "meshes[1] \"mesh\" primitive 0: 1 of 1 triangles have no area and are dropped",
        "node \"flat\": its transform leaves 2 triangles without area",
    ] {
        assert!(text.contains(expected), "no {expected:?} in\n{text}");
    }
}

#[test]
fn a_node_flattened_along_its_normal_stays_and_keeps_its_normal() {
    let mut f = Fixture::quad();
    f.json["nodes"][0]["scale"] = json!([1, 1, 0]);
    let scene = f.scene();
    let tables = scene.tables(&scene.pose(0.0));
    assert_eq!(tables[4].rows, 2);
    assert_eq!(tables[4].columns[3].1.get(0), Some(crate::value::Value::Vec3(Vec3::Z)));
}

#[test]
fn textures_are_read_with_the_set_their_material_names() {
    let png = {
        let mut bytes = std::io::Cursor::new(vec![]);
        let image = image::RgbaImage::from_pixel(2, 2, image::Rgba([200, 100, 50, 255]));
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    let mut f = Fixture::quad();
    let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let uv = f.floats(&uvs);
    f.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(uv);
    let view = f.view(&png);
    f.json["images"] = json!([{"uri": "unused.png"}, {"bufferView": view, "mimeType": "image/png"}]);
    f.json["textures"] = json!([{"source": 0}, {"source": 1}]);
    f.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": 1, "texCoord": 1}});
    let second = json!({"name": "same", "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}});
    f.material(second);
    let scene = f.scene();
    let textures = scene.textures.as_ref().unwrap();
    // Two by two texels, and the mip right of them.
    assert_eq!((textures.width, textures.height, textures.layers), (4, 2, 1));
    assert_eq!(textures.mips[0][..12], [[200, 100, 50, 255]; 3].concat());
    assert_eq!((scene.maps.len(), scene.maps[0].size, scene.maps[0].levels), (1, [2, 2], 2));
    assert_eq!(scene.materials[0].base_color_texture, Some(0));
    assert_eq!(scene.materials[1].base_color_texture, Some(0));
    let found: Vec<Vec2> = scene.geometry.vertices.iter().map(|v| v.uv.into()).collect();
    assert_eq!(found, [0, 1, 2, 0, 2, 3].map(|i| Vec2::from(uvs[i])));
}

#[test]
fn a_texture_without_coordinates_is_a_notice() {
    let mut f = Fixture::quad();
    f.json["images"] = json!([{"uri": PIXEL}]);
    f.json["textures"] = json!([{"source": 0}]);
    f.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": 0}});
    let (scene, notices) = f.read().unwrap();
    assert_eq!(scene.textures.unwrap().mips[0][..4], [255, 0, 0, 255]);
    assert!(render(&notices).contains("it has no TEXCOORD_0"), "{}", render(&notices));
}

/// One red texel.
const PIXEL: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR4nGP4z8DwHwAFAAH/iZk9HQAAAABJRU5ErkJggg==";
