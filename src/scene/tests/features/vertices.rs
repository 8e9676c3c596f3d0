//! What vertices state, and how accessors hold it.

use super::{
    Case,
    Outcome::{Fault, Notice, Silent},
    RED, accessor, any, attribute, extension, material, texture,
};
use crate::scene::tests::fixture::{Fixture, QUAD};
use glam::Vec3;
use meshoptimizer_rs::{
    Workspace,
    codec::{VertexEncoding, encode_vertex_buffer},
};
use serde_json::{Value, json};

pub const VERTICES: &[Case] = &[
    (
        "vertex colours",
        |f| {
            let color = f.floats(&[[1.0, 0.5, 0.25]; 4]);
            attribute(f, "COLOR_0", color);
        },
        Silent(|s| s.geometry.more.colors.iter().all(|c| *c == [1.0, 0.5, 0.25, 1.0])),
    ),
    (
        "vertex colours in bytes",
        |f| {
            let color = accessor(f, &[255, 0, 51, 255].repeat(4), 5121, "VEC4", 4, true);
            attribute(f, "COLOR_0", color);
        },
        Silent(|s| s.geometry.more.colors.iter().all(|c| *c == [1.0, 0.0, 0.2, 1.0])),
    ),
    (
        "white vertices",
        |f| {
            let color = f.floats(&[[1.0; 4]; 4]);
            attribute(f, "COLOR_0", color);
        },
        Silent(|s| s.geometry.more.colors.is_empty()),
    ),
    (
        "negative vertex colours",
        |f| {
            let color = f.floats(&[[-1.0, 0.0, 0.0]; 4]);
            attribute(f, "COLOR_0", color);
        },
        Notice(&["meshes[0] \"mesh\" primitive 0: COLOR_0 of vertex 0", "its colours are left out"], |s| {
            s.geometry.more.color(0) == [1.0; 4]
        }),
    ),
    (
        "too few vertex colours",
        |f| {
            let color = f.floats(&[[1.0, 0.0, 0.0]; 3]);
            attribute(f, "COLOR_0", color);
        },
        Fault(&["3 of COLOR_0, but 4 of POSITION"]),
    ),
    (
        "tangents that are no numbers",
        |f| {
            let texture = texture(f, RED);
            material(f)["normalTexture"] = texture;
            let tangent = f.floats(&[[f32::NAN, 0.0, 0.0, 1.0]; 4]);
            attribute(f, "TANGENT", tangent);
        },
        Fault(&["TANGENT of vertex 0"]),
    ),
    (
        "normals that point to the back",
        |f| {
            let normal = f.floats(&[[0.0, 0.0, -1.0]; 4]);
            attribute(f, "NORMAL", normal);
        },
        Notice(&["primitive 0: its normals point to the backs of its triangles", "flipped"], |s| {
            s.geometry.vertices.iter().all(|v| v.normal == [0.0, 0.0, 1.0]) && s.geometry.indices[..3] == [0, 1, 2]
        }),
    ),
    (
        "normals that point to the back of what no light shows",
        |f| {
            let normal = f.floats(&[[0.0, 0.0, -1.0]; 4]);
            attribute(f, "NORMAL", normal);
            extension(f, "KHR_materials_unlit", json!({}));
        },
        Silent(|s| s.geometry.vertices.iter().all(|v| v.normal == [0.0, 0.0, -1.0])),
    ),
    (
        "a solid whose triangles look inwards",
        |f| {
            let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let normals = corners.map(|c: [f32; 3]| (Vec3::from(c) - 0.25).normalize().to_array());
            let (position, normal) = (f.floats(&corners), f.floats(&normals));
            let indices = f.shorts(&[0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2]);
            attribute(f, "POSITION", position);
            attribute(f, "NORMAL", normal);
            f.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
        },
        Notice(&["its triangles' fronts look inwards, its normals outwards"], |s| {
            s.geometry.indices.chunks_exact(3).all(|t| {
                let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(s.geometry.vertices[t[i] as usize].position));
                (b - a).cross(c - a).dot(a + b + c - 0.75) > 0.0
            })
        }),
    ),
    (
        "quantized positions",
        |f| {
            let shorts = QUAD.map(|p| p.map(|x| ((x * 32767.0) as i16).to_le_bytes())).as_flattened().concat();
            let position = accessor(f, &shorts, 5122, "VEC3", 4, true);
            attribute(f, "POSITION", position);
            f.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        },
        Silent(|s| s.bounds.max == Vec3::new(1.0, 1.0, 0.0)),
    ),
    (
        "positions in whole bytes",
        |f| {
            let bytes = QUAD.map(|p| p.map(|x| (x * 5.0) as u8)).as_flattened().to_vec();
            let position = accessor(f, &bytes, 5121, "VEC3", 4, false);
            attribute(f, "POSITION", position);
        },
        Silent(|s| s.bounds.max == Vec3::new(5.0, 5.0, 0.0)),
    ),
    (
        "sparse positions",
        |f| {
            let (indices, values) =
                (f.view(&2u16.to_le_bytes()), f.view(&[3f32, 4.0, 0.0].map(f32::to_le_bytes).concat()));
            f.json["accessors"][0]["sparse"] = json!({
                "count": 1,
                "indices": {"bufferView": indices, "componentType": 5123},
                "values": {"bufferView": values},
            });
        },
        Silent(|s| s.bounds.max == Vec3::new(3.0, 4.0, 0.0)),
    ),
    (
        "sparse without a view of its own",
        |f| {
            let (indices, values) = (
                f.view(&[0, 0, 1, 0, 2, 0, 3, 0]),
                f.view(&QUAD.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>()),
            );
            f.json["accessors"][0] = json!({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": {
                "count": 4,
                "indices": {"bufferView": indices, "componentType": 5123},
                "values": {"bufferView": values},
            }});
        },
        Silent(|s| s.bounds.max == Vec3::new(1.0, 1.0, 0.0)),
    ),
    (
        "sparse of any size",
        |f| {
            let view = f.view(&[0; 16]);
            f.json["accessors"][0] = json!({"componentType": 5126, "count": 1u64 << 40, "type": "VEC3", "sparse": {
                "count": 1, "indices": {"bufferView": view, "componentType": 5121}, "values": {"bufferView": view},
            }});
        },
        Fault(&["accessors[0]: of 1099511627776 elements takes more than 256 MiB"]),
    ),
    (
        "sparse indices of a wrong kind",
        |f| {
            let view = f.view(&[0; 16]);
            f.json["accessors"][0]["sparse"] = json!({
                "count": 1, "indices": {"bufferView": view, "componentType": 5126}, "values": {"bufferView": view},
            });
        },
        Fault(&["accessors[0]: its sparse indices"]),
    ),
    (
        "compressed positions",
        |f| {
            let packed: Vec<u8> = QUAD.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
            let bytes =
                encode_vertex_buffer(&packed, 4, 12, VertexEncoding::new(0, 2).unwrap(), &mut Workspace::default())
                    .unwrap();
            compress(f, &bytes, json!({"byteStride": 12, "count": 4, "mode": "ATTRIBUTES"}));
        },
        Silent(|s| s.bounds.max == Vec3::new(1.0, 1.0, 0.0)),
    ),
    (
        "compressed by no known mode",
        |f| compress(f, &[0; 8], json!({"byteStride": 12, "count": 4, "mode": "ZIP"})),
        Fault(&["bufferViews[0]: meshopt compression: unknown mode `ZIP`"]),
    ),
    (
        "compressed to any size",
        |f| compress(f, &[0xa0; 64], json!({"byteStride": 256, "count": 1u64 << 40, "mode": "ATTRIBUTES"})),
        Fault(&["bufferViews[0]: meshopt compression: all views together decode to more than 1024 MiB"]),
    ),
    (
        "compressed and cut off",
        |f| compress(f, &[0xa0, 1], json!({"byteStride": 12, "count": 4, "mode": "ATTRIBUTES"})),
        Fault(&["bufferViews[0]: meshopt compression: "]),
    ),
    (
        "lines beside triangles",
        |f| {
            let position = f.floats(&QUAD);
            let mesh = f.mesh(json!({"attributes": {"POSITION": position}, "mode": 1}));
            f.node(json!({"name": "lines", "mesh": mesh}));
        },
        Notice(&["meshes[1] \"mesh\" primitive 0: Lines are not drawn; only triangles are"], any),
    ),
    (
        "extension of vertices that is not read",
        |f| f.json["extensionsRequired"] = json!(["NV_vertices_of_tomorrow"]),
        Fault(&["extension `NV_vertices_of_tomorrow` is required but not supported"]),
    ),
];

/// Makes the first buffer view one that is compressed.
fn compress(f: &mut Fixture, bytes: &[u8], stated: Value) {
    let offset = f.bytes.len();
    f.bytes.extend(bytes);
    f.bytes.resize(f.bytes.len().next_multiple_of(4), 0);
    let mut stated = stated;
    stated["buffer"] = json!(0);
    stated["byteOffset"] = json!(offset);
    stated["byteLength"] = json!(bytes.len());
    f.json["bufferViews"][0]["extensions"] = json!({"EXT_meshopt_compression": stated});
}
