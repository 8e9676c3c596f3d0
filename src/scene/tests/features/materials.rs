//! What materials state.

use super::{
    Case,
    Outcome::{Fault, Notice, Silent},
    RED, any, attribute, base_texture, extension, map, material, texel, texture,
};
use crate::scene::Alpha;
use glam::Vec3;
use serde_json::json;

pub const MATERIALS: &[Case] = &[
    ("plain", |_| {}, Silent(|s| s.materials[0].alpha == Alpha::Opaque && s.maps.is_empty())),
    ("base colour texture", |f| base_texture(f, RED), Silent(|s| map(s).size == [2, 2] && map(s).levels == 2)),
    (
        "two textures of one image",
        |f| {
            base_texture(f, RED);
            let second = f.push("textures", json!({"source": 0}));
            material(f)["emissiveTexture"] = json!({"index": second});
            material(f)["emissiveFactor"] = json!([1, 1, 1]);
        },
        Silent(|s| s.maps.len() == 1 && s.materials[0].emission_texture == Some(0)),
    ),
    (
        "emissive texture",
        |f| {
            let texture = texture(f, [[255, 255, 255, 255], [0, 0, 0, 255], [0, 0, 0, 255], [0, 0, 0, 255]]);
            material(f)["emissiveTexture"] = texture;
            material(f)["emissiveFactor"] = json!([2, 2, 2]);
        },
        // Of each triangle about a quarter shines.
        Silent(|s| s.glow.len() == 2 && s.glow.iter().all(|g| g.x > 0.1 && g.x < 0.4 && g.x == g.y)),
    ),
    (
        "black emissive texture",
        |f| {
            let texture = texture(f, [[0, 0, 0, 255]; 4]);
            material(f)["emissiveTexture"] = texture;
            material(f)["emissiveFactor"] = json!([1, 1, 1]);
        },
        Silent(|s| s.emitting().count() == 0),
    ),
    (
        "emissive texture without a factor",
        |f| {
            let texture = texture(f, RED);
            material(f)["emissiveTexture"] = texture;
        },
        Silent(|s| s.materials[0].emission_texture.is_none()),
    ),
    (
        "emissive strength",
        |f| {
            material(f)["emissiveFactor"] = json!([1, 0, 0]);
            extension(f, "KHR_materials_emissive_strength", json!({"emissiveStrength": 5}));
        },
        Silent(|s| s.materials[0].emission == Vec3::new(5.0, 0.0, 0.0)),
    ),
    (
        "metallic-roughness texture",
        |f| {
            let texture = texture(f, RED);
            material(f)["pbrMetallicRoughness"] = json!({"metallicRoughnessTexture": texture});
        },
        Silent(|s| s.materials[0].finish_texture == Some(0)),
    ),
    (
        "normal map with tangents made",
        |f| {
            let texture = texture(f, [[128, 128, 255, 255]; 4]);
            material(f)["normalTexture"] = texture;
        },
        Silent(|s| s.geometry.more.tangents.iter().all(|t| t[0] > 0.99 && t[3] == -1.0)),
    ),
    (
        "normal map with tangents given",
        |f| {
            let texture = texture(f, [[128, 128, 255, 255]; 4]);
            material(f)["normalTexture"] = texture;
            let tangent = f.floats(&[[0.0, 1.0, 0.0, -1.0]; 4]);
            attribute(f, "TANGENT", tangent);
        },
        Silent(|s| s.geometry.more.tangents.iter().all(|t| *t == [0.0, 1.0, 0.0, -1.0])),
    ),
    (
        "normal scale",
        |f| {
            let mut texture = texture(f, RED);
            texture["scale"] = json!(0.5);
            material(f)["normalTexture"] = texture;
        },
        Silent(|s| s.materials[0].normal_scale == 0.5),
    ),
    (
        "occlusion texture",
        |f| {
            let texture = texture(f, RED);
            material(f)["occlusionTexture"] = texture;
        },
        Notice(&["occlusion textures are left out"], any),
    ),
    (
        "mask",
        |f| {
            base_texture(f, [[255; 4], [255; 4], [0; 4], [0; 4]]);
            material(f)["alphaMode"] = json!("MASK");
        },
        Silent(|s| s.materials[0].alpha == Alpha::Mask(0.5)),
    ),
    (
        "mask with a cutoff of its own",
        |f| {
            material(f)["alphaMode"] = json!("MASK");
            material(f)["alphaCutoff"] = json!(0.25);
        },
        Silent(|s| s.materials[0].alpha == Alpha::Mask(0.25)),
    ),
    (
        "blend",
        |f| {
            base_texture(f, [[255, 255, 255, 90]; 4]);
            material(f)["alphaMode"] = json!("BLEND");
        },
        Notice(&["materials[0] \"white\": graphs that trace paths blend it"], |s| s.materials[0].alpha == Alpha::Blend),
    ),
    (
        "blend of what is opaque",
        |f| material(f)["alphaMode"] = json!("BLEND"),
        Silent(|s| s.materials[0].alpha == Alpha::Opaque),
    ),
    (
        "blend by vertices",
        |f| {
            material(f)["alphaMode"] = json!("BLEND");
            let color = f.floats(&[[1.0, 1.0, 1.0, 0.5]; 4]);
            attribute(f, "COLOR_0", color);
        },
        Notice(&["blend it"], |s| s.materials[0].alpha == Alpha::Blend),
    ),
    (
        "unknown alpha mode",
        |f| material(f)["alphaMode"] = json!("DITHER"),
        Notice(&["unknown alpha mode; it is drawn opaque"], any),
    ),
    (
        "unlit",
        |f| {
            material(f)["emissiveFactor"] = json!([1, 1, 1]);
            extension(f, "KHR_materials_unlit", json!({}));
        },
        Silent(|s| s.materials[0].unlit && s.materials[0].emission == Vec3::ZERO && s.emitting().count() == 0),
    ),
    (
        "ior",
        |f| extension(f, "KHR_materials_ior", json!({"ior": 1.8})),
        Notice(&["reflect at its face"], |s| s.materials[0].face.ior == 1.8),
    ),
    (
        "ior below 1",
        |f| extension(f, "KHR_materials_ior", json!({"ior": 0.5})),
        Fault(&["ior 0.5 must be 0, or at least 1"]),
    ),
    (
        "specular",
        |f| extension(f, "KHR_materials_specular", json!({"specularFactor": 0.5, "specularColorFactor": [1, 0.5, 0]})),
        Notice(&["reflect at its face"], |s| s.materials[0].face.tint == Vec3::new(1.0, 0.5, 0.0)),
    ),
    (
        "specular above 1",
        |f| extension(f, "KHR_materials_specular", json!({"specularFactor": 2})),
        Fault(&["specularFactor 2 must lie within 0 to 1"]),
    ),
    (
        "specular and glossiness",
        |f| {
            base_texture(f, RED);
            let other = texture(f, [[0, 255, 0, 255]; 4]);
            let mut stated =
                json!({"diffuseFactor": [0.5, 1, 0, 1], "diffuseTexture": other, "glossinessFactor": 0.75});
            stated["specularFactor"] = json!([0.04, 0.08, 0.2]);
            extension(f, "KHR_materials_pbrSpecularGlossiness", stated);
        },
        Silent(|s| {
            // Worked out by hand from the formulas of the extension's text: of green, and of no red.
            // Base colour (0.0003, 0.9053, 0.0134) in sRGB, metalness 0.0820, roughness 0.25.
            let m = &s.materials[0];
            texel(s, m.base_color_texture) == [1, 244, 31, 255]
                && texel(s, m.finish_texture) == [255, 64, 21, 255]
                && (m.base_color, m.roughness, m.metallic) == (glam::Vec4::ONE, 1.0, 1.0)
        }),
    ),
    (
        "specular without diffuse",
        |f| {
            let stated = json!({"diffuseFactor": [0, 0, 0, 1], "specularFactor": [0.9, 0.6, 0.3]});
            extension(f, "KHR_materials_pbrSpecularGlossiness", stated);
        },
        Silent(|s| {
            let m = &s.materials[0];
            (m.metallic - 1.0).abs() < 1e-5 && m.base_color.truncate().distance(Vec3::new(0.9, 0.6, 0.3)) < 1e-4
        }),
    ),
    (
        "glossiness in a texture",
        |f| {
            let texture = texture(f, [[255, 255, 255, 64]; 4]);
            extension(f, "KHR_materials_pbrSpecularGlossiness", json!({"specularGlossinessTexture": texture}));
        },
        Silent(|s| {
            let m = &s.materials[0];
            // A mirror of white, as rough as a fourth of glossiness leaves it.
            texel(s, m.base_color_texture) == [255, 255, 255, 255] && texel(s, m.finish_texture) == [255, 191, 255, 255]
        }),
    ),
    (
        "diffuse and specular laid out in different ways",
        |f| {
            let (matte, mut shine) = (texture(f, RED), texture(f, RED));
            shine["extensions"] = json!({"KHR_texture_transform": {"scale": [2, 2]}});
            let stated = json!({"specularGlossinessTexture": shine, "diffuseTexture": matte});
            extension(f, "KHR_materials_pbrSpecularGlossiness", stated);
        },
        Notice(&["laid out in different ways", "the glossiness in the alpha of the latter is ignored"], |s| {
            s.materials[0].face.tint_texture.is_some()
        }),
    ),
    (
        "glossiness above 1",
        |f| extension(f, "KHR_materials_pbrSpecularGlossiness", json!({"glossinessFactor": 2})),
        Fault(&["specular and glossiness must lie within 0 to 1"]),
    ),
    (
        "transmission",
        |f| extension(f, "KHR_materials_transmission", json!({"transmissionFactor": 0.9})),
        Notice(&["let light through it"], |s| s.materials[0].transmission == 0.9),
    ),
    (
        "transmission above 1",
        |f| extension(f, "KHR_materials_transmission", json!({"transmissionFactor": 1.5})),
        Fault(&["transmissionFactor 1.5 must lie within 0 to 1"]),
    ),
    (
        "clearcoat",
        |f| extension(f, "KHR_materials_clearcoat", json!({"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.2})),
        Notice(&["show its clearcoat"], |s| {
            s.materials[0].coat.strength == 1.0 && s.materials[0].coat.roughness == 0.2
        }),
    ),
    (
        "clearcoat with a normal map",
        |f| {
            let texture = texture(f, RED);
            let map = json!({"index": texture["index"], "scale": 0.5});
            extension(f, "KHR_materials_clearcoat", json!({"clearcoatFactor": 1, "clearcoatNormalTexture": map}));
        },
        Notice(&["show its clearcoat"], |s| {
            let m = &s.materials[0];
            m.normal_texture.is_none() && m.coat.normal_texture.is_some() && m.coat.normal_scale == 0.5
        }),
    ),
    (
        "extension of another shape",
        |f| extension(f, "KHR_materials_ior", json!({"ior": "high"})),
        Fault(&["materials[0].extensions"]),
    ),
    (
        "extension that is not read",
        |f| extension(f, "KHR_materials_sheen", json!({})),
        Notice(&["its extension `KHR_materials_sheen` is ignored"], any),
    ),
];
