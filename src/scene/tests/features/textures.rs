//! What textures, samplers and images state.

use super::{
    Case,
    Outcome::{Fault, Notice, Silent},
    RED, any, attribute, base_texture, map, material, sampler, texel, texture, transformed,
};
use crate::scene::{Between, Wrap, tests::fixture::Fixture};
use serde_json::json;

pub const TEXTURES: &[Case] = &[
    (
        "sampler's own",
        |f| base_texture(f, RED),
        Silent(|s| map(s).wrap == [Wrap::Repeat; 2] && map(s).between == Between::Linear),
    ),
    (
        "wrap",
        |f| sampler(f, json!({"wrapS": 33071, "wrapT": 33648})),
        Silent(|s| map(s).wrap == [Wrap::Clamp, Wrap::Mirror]),
    ),
    ("unknown wrap", |f| sampler(f, json!({"wrapS": 1})), Fault(&["its sampler has an unknown wrap mode"])),
    (
        "nearest",
        |f| sampler(f, json!({"magFilter": 9728, "minFilter": 9984})),
        Silent(|s| map(s).nearest == [true; 2] && map(s).between == Between::Nearest),
    ),
    ("no mips", |f| sampler(f, json!({"minFilter": 9729})), Silent(|s| map(s).between == Between::None)),
    ("unknown filter", |f| sampler(f, json!({"minFilter": 3})), Fault(&["its sampler has an unknown filter"])),
    (
        "no such sampler",
        |f| {
            base_texture(f, RED);
            f.json["textures"][0]["sampler"] = json!(7);
        },
        Fault(&["materials[0] \"white\": base-colour texture: texture 0: there is no sampler 7"]),
    ),
    (
        "transform",
        |f| transformed(f, json!({"offset": [0.5, 0.25], "scale": [2, 3]})),
        Silent(|s| map(s).turn.to_array() == [2.0, 0.0, 0.0, 3.0] && map(s).offset.to_array() == [0.5, 0.25]),
    ),
    (
        "transform that turns",
        |f| transformed(f, json!({"rotation": 1.570_796_4})),
        Silent(|s| (map(s).turn - glam::Vec4::new(0.0, -1.0, 1.0, 0.0)).abs().max_element() < 1e-6),
    ),
    (
        "transform required",
        |f| {
            transformed(f, json!({"scale": [2, 2]}));
            f.json["extensionsRequired"] = json!(["KHR_texture_transform"]);
        },
        Silent(|s| map(s).turn.x == 2.0),
    ),
    (
        "transform out of range",
        |f| transformed(f, json!({"scale": [1e9, 1]})),
        Fault(&["its transform holds a number"]),
    ),
    (
        "transform of one number",
        |f| transformed(f, json!({"offset": [0.5], "scale": [4, 4]})),
        Fault(&["the extensions of its texture 0", "expected an array of length 2"]),
    ),
    (
        "second coordinates",
        |f| {
            base_texture(f, RED);
            let uv = f.floats(&[[0.5, 0.5]; 4]);
            attribute(f, "TEXCOORD_1", uv);
            material(f)["emissiveTexture"] = json!({"index": 0, "texCoord": 1});
            material(f)["emissiveFactor"] = json!([1, 1, 1]);
        },
        Silent(|s| s.maps[1].set == 1 && s.geometry.more.uvs.iter().all(|uv| *uv == [0.5; 2])),
    ),
    (
        "coordinates that a transform names",
        |f| {
            transformed(f, json!({"texCoord": 1}));
            let uv = f.floats(&[[0.25, 0.75]; 4]);
            attribute(f, "TEXCOORD_1", uv);
        },
        Silent(|s| s.geometry.vertices.iter().all(|v| v.uv == [0.25, 0.75]) && s.geometry.more.uvs.is_empty()),
    ),
    (
        "missing coordinates",
        |f| {
            base_texture(f, RED);
            material(f)["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(2);
        },
        Notice(&["it has no TEXCOORD_2; (0, 0) is used"], any),
    ),
    (
        "webp in its extension",
        |f| {
            base_texture(f, RED);
            let mut bytes = std::io::Cursor::new(vec![]);
            image::RgbaImage::new(5, 3).write_to(&mut bytes, image::ImageFormat::WebP).unwrap();
            let view = f.view(&bytes.into_inner());
            let image = f.push("images", json!({"bufferView": view, "mimeType": "image/webp"}));
            f.json["textures"][0] = json!({"extensions": {"EXT_texture_webp": {"source": image}}});
            f.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
        },
        Silent(|s| map(s).size == [5, 3]),
    ),
    (
        "basis universal alone",
        |f| basis(f, include_bytes!("../compressed/uastc.ktx2")),
        Silent(|s| map(s).size == [8, 8]),
    ),
    (
        "basis universal cut off",
        |f| basis(f, b"\xabKTX 20\xbb\r\n\x1a\n"),
        Notice(&["images[1]: KTX2: its header is cut off", "a magenta checker"], any),
    ),
    (
        "an image that ends early, of a size that few bytes state",
        |f| {
            base_texture(f, RED);
            let texture = texture(f, RED);
            material(f)["emissiveTexture"] = texture;
            material(f)["emissiveFactor"] = json!([1, 1, 1]);
            let mut bytes = std::io::Cursor::new(vec![]);
            image::GrayImage::new(8192, 8192).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
            let view = f.view(&bytes.into_inner()[..100]);
            f.json["images"][0]["bufferView"] = json!(view);
        },
        Notice(&["images[0]: it is no readable PNG", "a magenta checker"], |s| {
            map(s).size == [8, 8] && texel(s, s.materials[0].emission_texture) == RED[0]
        }),
    ),
    (
        "missing normal map",
        |f| {
            let texture = texture(f, RED);
            material(f)["normalTexture"] = texture;
            f.json["images"][0] = json!({"uri": "gone.png"});
        },
        Notice(&["images[0]: can't read gone.png", "it is left out"], |s| s.materials[0].normal_texture.is_none()),
    ),
    (
        "missing emissive texture",
        |f| {
            let texture = texture(f, RED);
            material(f)["emissiveTexture"] = texture;
            material(f)["emissiveFactor"] = json!([1, 1, 1]);
            f.json["images"][0] = json!({"uri": "gone.png"});
        },
        Notice(&["images[0]: can't read gone.png"], |s| s.emitting().count() == 0),
    ),
    (
        "texture without an image",
        |f| {
            base_texture(f, RED);
            f.json["textures"][0] = json!({});
        },
        Fault(&["texture 0 names no image"]),
    ),
    (
        "sizes mixed",
        |f| {
            base_texture(f, RED);
            let mut bytes = std::io::Cursor::new(vec![]);
            image::RgbaImage::new(33, 7).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
            let view = f.view(&bytes.into_inner());
            let image = f.push("images", json!({"bufferView": view}));
            let index = f.push("textures", json!({"source": image}));
            material(f)["normalTexture"] = json!({"index": index});
        },
        Silent(|s| s.maps[0].size == [2, 2] && s.maps[1].size == [33, 7] && s.maps[1].levels == 6),
    ),
];

/// Makes the first texture one that Basis Universal has compressed.
fn basis(f: &mut Fixture, bytes: &[u8]) {
    base_texture(f, RED);
    let view = f.view(bytes);
    let image = f.push("images", json!({"bufferView": view, "mimeType": "image/ktx2"}));
    f.json["textures"][0] = json!({"extensions": {"KHR_texture_basisu": {"source": image}}});
}
