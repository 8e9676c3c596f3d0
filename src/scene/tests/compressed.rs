//! What Draco and Basis Universal have compressed. `compressed/` holds what their own encoders made (in C++, by DracoPy
//! 2.2.0 and alktx2 0.1.7): a unit quad with normals and texture coordinates, and images of 8 × 8 texels, whose upper
//! half is red and whose lower is blue.

use super::fixture::Fixture;
use crate::scene::{Scene, basis};
use glam::Vec3;
use serde_json::{Value, json};

const QUAD: &[u8] = include_bytes!("compressed/quad.drc");
const IMAGES: [(&str, &[u8]); 3] = [
    ("ETC1S", include_bytes!("compressed/etc1s.ktx2")),
    ("UASTC", include_bytes!("compressed/uastc.ktx2")),
    ("UASTC in Zstandard", include_bytes!("compressed/uastc_zstd.ktx2")),
];

/// A mesh whose accessors no buffer holds: bytes of Draco do. Its texture is of Basis Universal.
fn draco(bytes: &[u8]) -> Fixture {
    let mut f = Fixture::new();
    let view = f.view(bytes);
    let image = f.view(IMAGES[0].1);
    f.json["images"] = json!([{"bufferView": image, "mimeType": "image/ktx2"}]);
    f.json["textures"] = json!([{"extensions": {"KHR_texture_basisu": {"source": 0}}}]);
    f.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let mut accessor = |kind: u32, shape: &str, count: usize| {
        f.push("accessors", json!({"componentType": kind, "type": shape, "count": count}))
    };
    let [position, normal, uv] = [accessor(5126, "VEC3", 4), accessor(5126, "VEC3", 4), accessor(5126, "VEC2", 4)];
    let indices = accessor(5123, "SCALAR", 6);
    f.mesh(json!({
        "attributes": {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv},
        "indices": indices,
        "material": 0,
        "extensions": {"KHR_draco_mesh_compression": {
            "bufferView": view, "attributes": {"POSITION": 2, "NORMAL": 1, "TEXCOORD_0": 0},
        }},
    }));
    f.node(json!({"name": "quad", "mesh": 0}));
    f.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression", "KHR_texture_basisu"]);
    f
}

fn holds_the_quad(scene: &Scene) {
    let (vertices, indices) = (&scene.geometry.vertices, &scene.geometry.indices);
    assert_eq!((vertices.len(), indices.len()), (4, 6));
    for v in vertices {
        let [x, y, z] = v.position;
        assert!([x, y].iter().all(|c| *c == 0.0 || *c == 1.0) && z == 0.0, "{v:?}");
        assert!(Vec3::from(v.normal).distance(Vec3::Z) < 1e-3, "{v:?}");
        assert!((v.uv[0] - x).abs() < 1e-3 && (v.uv[1] - y).abs() < 1e-3, "{v:?}");
    }
    for t in indices.as_chunks::<3>().0 {
        let [a, b, c] = t.map(|i| Vec3::from(vertices[i as usize].position));
        assert_eq!((b - a).cross(c - a), Vec3::Z);
    }
}

#[test]
fn draco_s_own_bytes_are_read() {
    holds_the_quad(&draco(QUAD).scene());
}

#[test]
fn an_accessor_that_draco_holds_may_be_beside_it_too() {
    let mut f = draco(QUAD);
    // What readers without Draco take: nothing here, and not looked at.
    let wrong = f.floats(&[[7.0_f32; 3]; 4]);
    let accessor = f.json["accessors"][wrong].clone();
    f.json["accessors"][0] = accessor;
    holds_the_quad(&f.scene());
}

#[test]
fn what_is_wrong_with_draco_is_said_of_its_primitive() {
    let extension = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
    let cases: [(String, Value, &str); 6] = [
        (format!("{extension}/bufferView"), json!(9), "there is no buffer view 9"),
        (format!("{extension}/bufferView"), json!("x"), "invalid type"),
        (format!("{extension}/attributes/POSITION"), json!(9), "POSITION: its data have no attribute 9"),
        (
            format!("{extension}/attributes/POSITION"),
            json!(0),
            "POSITION: 2 numbers for each vertex, and an accessor of Vec3",
        ),
        ("/accessors/3/componentType".into(), json!(5126), "its indices do not fit F32"),
        ("/meshes/0/primitives/0/mode".into(), json!(5), "its mode is not that of triangles"),
    ];
    for (pointer, value, word) in cases {
        let mut f = draco(QUAD);
        f.json["meshes"][0]["primitives"][0]["mode"] = json!(4);
        *f.json.pointer_mut(&pointer).unwrap() = value;
        let text = f.faults();
        let at = "meshes[0] \"mesh\" primitive 0: KHR_draco_mesh_compression: ";
        assert!(text.contains(word) && text.contains(at), "no `{word}` in:\n{text}");
    }
}

/// As encoders keep joints.
#[test]
fn whole_numbers_of_draco_may_be_kept_as_floats() {
    let mut f = draco(QUAD);
    f.json["accessors"][2]["componentType"] = json!(5121);
    f.json["accessors"][2]["normalized"] = json!(true);
    let scene = f.scene();
    let uvs = scene.geometry.vertices.iter().map(|v| v.uv);
    assert!(uvs.flatten().all(|x| [0.0, 1.0 / 255.0].contains(&x)), "{:?}", scene.geometry.vertices);
}

/// Every cut of some bytes, and every byte changed.
fn damaged(bytes: &[u8]) -> impl Iterator<Item = Vec<u8>> {
    let cut = (0..bytes.len()).map(|end| bytes[..end].to_vec());
    let changed = (0..bytes.len()).flat_map(move |i| {
        [0, 0xff, bytes[i] ^ 1, bytes[i] ^ 0x80].map(|byte| {
            let mut other = bytes.to_vec();
            other[i] = byte;
            other
        })
    });
    cut.chain(changed)
}

#[test]
fn damaged_bytes_of_draco_are_a_fault_or_another_mesh() {
    for bytes in damaged(QUAD) {
        let _ = draco(&bytes).read();
    }
}

#[test]
fn basis_universal_s_own_images_are_read() {
    for (what, bytes) in IMAGES {
        let picture = basis::decode(bytes).unwrap_or_else(|why| panic!("{what}: {why}"));
        assert_eq!((picture.width, picture.height, basis::stated_size(bytes)), (8, 8, Some([8, 8])), "{what}");
        for (i, texel) in picture.texels.iter().enumerate() {
            let expected = if i < 32 { [200, 60, 20, 255] } else { [20, 60, 200, 255] };
            let off = texel.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max();
            assert!(off <= Some(12), "{what}, texel {i}: {texel:?}, not {expected:?}");
        }
    }
}

#[test]
fn damaged_images_are_a_fault_or_another_image() {
    for (_, bytes) in IMAGES {
        for bytes in damaged(bytes) {
            let _ = basis::decode(&bytes);
        }
    }
}

#[test]
fn files_of_ktx2_that_hold_something_else_are_told_so() {
    for (at, value, word) in [
        (12, 37, "something else than ETC1S or UASTC"),
        (44, 3, "something else than ETC1S or UASTC"),
        (28, 4, "several images"),
        (36, 6, "several images"),
        (20, 0, "no texels"),
        (24, 1 << 20, "larger than 8192 × 8192 texels"),
        (80 + 16, 1 << 20, "larger than its image"),
        (80 + 20, 1, "larger than its image"),
    ] {
        let mut bytes = IMAGES[2].1.to_vec();
        bytes[at..at + 4].copy_from_slice(&u32::to_le_bytes(value));
        let why = basis::decode(&bytes).expect_err(word);
        assert!(why.contains(word), "no `{word}` in `{why}`");
    }
}
