//! What extensions say of materials and textures.

use super::{
    document::Document,
    glossiness::{ConvertedMap, GlossyMaterial, HEAD_ON, metal_of},
    import::usable,
    materials::{TextureSlot, Use},
    model::Material,
};
use crate::diag::Diagnostic;
use glam::{Vec3, Vec4};
use gltf::json::material::Material as RawMaterial;
use serde::Deserialize;
use serde_json::Value;

/// What extensions add to a material.
pub(super) fn extend(
    document: &Document<'_>,
    raw: &RawMaterial,
    index: usize,
    at: &str,
    m: &mut Material,
    uses: &mut Vec<Use>,
    faults: &mut Vec<Diagnostic>,
) {
    let Some(others) = raw.extensions.as_ref().map(|e| &e.others) else { return };
    let stated = match Extensions::deserialize(Value::Object(others.clone())) {
        Ok(stated) => stated,
        Err(e) => {
            faults.push(document.error(format!("materials[{index}].extensions"), e));
            return;
        }
    };
    if stated.specular_glossiness.is_some() {
        // It takes the place of metalness and roughness.
        uses.retain(|u| !matches!(u.slot, TextureSlot::BaseColor | TextureSlot::Finish));
    }
    if let Some(s) = stated.specular_glossiness {
        let numbers = [s.diffuse_factor.as_slice(), &s.specular_factor, &[s.glossiness_factor]].concat();
        if !numbers.iter().all(|x| (0.0..=1.0).contains(x)) {
            faults.push(document.error(at, "its factors of specular and glossiness must lie within 0 to 1"));
        }
        m.roughness = 1.0 - s.glossiness_factor;
        let (diffuse, specular) = (Vec4::from(s.diffuse_factor), Vec3::from(s.specular_factor));
        let (base, metallic) = metal_of(diffuse.truncate(), specular);
        (m.base_color, m.metallic) = (base.extend(diffuse.w), metallic);
        let shiny = s.specular_glossiness_texture.is_some();
        let glossy =
            GlossyMaterial { shiny, diffuse_texture: None, diffuse, specular, glossiness: s.glossiness_factor };
        match (s.specular_glossiness_texture, s.diffuse_texture) {
            // Where nothing is a metal, each texel is its factor's share.
            (None, Some(matte)) if specular.max_element() > HEAD_ON => glossy.metals(&matte, m, uses),
            (None, matte) => add(uses, TextureSlot::BaseColor, matte),
            (Some(shine), matte) => match glossy.beside(document, &shine, matte.as_ref()) {
                Some(glossy) => glossy.metals(&shine, m, uses),
                None => {
                    let why = "its diffuse and its specular texture are laid out in different ways; \
                               the glossiness in the alpha of the latter is ignored";
                    faults.push(document.warning(at, why));
                    (m.base_color, m.metallic) = (diffuse, 0.0);
                    m.face.tint = specular / HEAD_ON;
                    add(uses, TextureSlot::BaseColor, matte);
                    add(uses, TextureSlot::FaceTint, Some(shine));
                }
            },
        }
    }
    m.unlit = stated.unlit.is_some();
    if let Some(Ior { ior }) = stated.ior {
        m.face.ior = ior;
        // 0 is the specification's word for a face that reflects all.
        if !(ior >= 1.0 || ior == 0.0) || !ior.is_finite() {
            faults.push(document.error(at, format!("ior {ior} must be 0, or at least 1")));
        }
    }
    if let Some(s) = stated.specular {
        (m.face.strength, m.face.tint) = (s.specular_factor, s.specular_color_factor.into());
        if !(0.0..=1.0).contains(&m.face.strength) || !usable(&s.specular_color_factor) {
            let why =
                format!("specularFactor {} must lie within 0 to 1, specularColorFactor not below 0", m.face.strength);
            faults.push(document.error(at, why));
        }
        add(uses, TextureSlot::FaceStrength, s.specular_texture);
        add(uses, TextureSlot::FaceTint, s.specular_color_texture);
    }
    if let Some(t) = stated.transmission {
        m.transmission = t.transmission_factor;
        if !(0.0..=1.0).contains(&m.transmission) {
            faults.push(document.error(at, format!("transmissionFactor {} must lie within 0 to 1", m.transmission)));
        }
        if m.transmission > 0.0 {
            add(uses, TextureSlot::Transmission, t.transmission_texture);
        }
    }
    if let Some(c) = stated.clearcoat {
        m.coat.strength = c.clearcoat_factor;
        m.coat.roughness = c.clearcoat_roughness_factor;
        if !(0.0..=1.0).contains(&m.coat.strength) || !(0.0..=1.0).contains(&m.coat.roughness) {
            let why = format!("clearcoatFactor {} and clearcoatRoughnessFactor {}", m.coat.strength, m.coat.roughness);
            faults.push(document.error(at, format!("{why} must lie within 0 to 1")));
        }
        if m.coat.strength > 0.0 {
            add(uses, TextureSlot::CoatStrength, c.clearcoat_texture);
            add(uses, TextureSlot::CoatRoughness, c.clearcoat_roughness_texture);
            if let Some(map) = c.clearcoat_normal_texture {
                m.coat.normal_scale = map.scale;
                uses.push(map.texture.used(TextureSlot::CoatNormal));
            }
            if !m.coat.normal_scale.is_finite() {
                faults.push(document.error(at, "the scale of its clearcoat's normal map must be finite"));
            }
        }
    }
    for name in others.keys().filter(|name| !EXTENSIONS.contains(&name.as_str())) {
        faults.push(document.warning(at, format!("its extension `{name}` is ignored")));
    }
}

impl GlossyMaterial {
    /// With the texture of its diffuse colour; `None` where that is not read as the specular one is, texel by texel.
    fn beside(self, document: &Document<'_>, specular: &RawInfo, diffuse: Option<&RawInfo>) -> Option<GlossyMaterial> {
        let read = |info: &RawInfo| {
            let sampler = document.root.textures.get(info.index).map(|t| t.sampler.map(|s| s.value()));
            (sampler, info.tex_coord, info.extensions)
        };
        let alike = diffuse.is_none_or(|diffuse| read(diffuse) == read(specular));
        alike.then_some(GlossyMaterial { diffuse_texture: diffuse.map(|info| info.index), ..self })
    }

    /// Makes a material's textures of its image.
    fn metals(self, own: &RawInfo, m: &mut Material, uses: &mut Vec<Use>) {
        (m.base_color, m.metallic, m.roughness) = (Vec4::ONE, 1.0, 1.0);
        for (slot, made) in
            [(TextureSlot::BaseColor, ConvertedMap::BaseColor), (TextureSlot::Finish, ConvertedMap::Finish)]
        {
            uses.push(Use { made: Some((self, made)), ..own.used(slot) });
        }
    }
}

/// The extensions of materials that are read.
const EXTENSIONS: [&str; 7] = [
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
];

/// What extensions of a texture's use say.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct TextureExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Transform,
}

/// `KHR_texture_transform`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Transform {
    pub offset: [f32; 2],
    pub rotation: f32,
    pub scale: [f32; 2],
    pub tex_coord: Option<u32>,
}

impl Default for Transform {
    fn default() -> Transform {
        Transform { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

impl Transform {
    /// Columns of the matrix. A rotation turns the image clockwise, whose y points down.
    pub fn turn(self) -> Vec4 {
        let (sine, cosine) = self.rotation.sin_cos();
        let [x, y] = self.scale;
        Vec4::new(cosine * x, -sine * x, sine * y, cosine * y)
    }
}

/// A texture in an extension's object.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct RawInfo {
    index: usize,
    #[serde(default)]
    tex_coord: u32,
    #[serde(default)]
    extensions: TextureExtensions,
}

impl RawInfo {
    fn used(&self, slot: TextureSlot) -> Use {
        let TextureExtensions { transform } = self.extensions;
        Use { slot, texture: self.index, set: self.tex_coord, transform, made: None }
    }
}

/// The same of a normal map.
#[derive(Deserialize)]
struct RawNormalMap {
    #[serde(flatten)]
    texture: RawInfo,
    #[serde(default = "whole")]
    scale: f32,
}

fn whole() -> f32 {
    1.0
}

fn add(uses: &mut Vec<Use>, slot: TextureSlot, info: Option<RawInfo>) {
    uses.extend(info.map(|info| info.used(slot)));
}

/// What a material's extensions say.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Extensions {
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    specular_glossiness: Option<SpecularGlossiness>,
    #[serde(rename = "KHR_materials_unlit")]
    unlit: Option<Empty>,
    #[serde(rename = "KHR_materials_ior")]
    ior: Option<Ior>,
    #[serde(rename = "KHR_materials_specular")]
    specular: Option<Specular>,
    #[serde(rename = "KHR_materials_transmission")]
    transmission: Option<Transmission>,
    #[serde(rename = "KHR_materials_clearcoat")]
    clearcoat: Option<Clearcoat>,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SpecularGlossiness {
    diffuse_factor: [f32; 4],
    diffuse_texture: Option<RawInfo>,
    specular_factor: [f32; 3],
    glossiness_factor: f32,
    specular_glossiness_texture: Option<RawInfo>,
}

impl Default for SpecularGlossiness {
    fn default() -> SpecularGlossiness {
        SpecularGlossiness {
            diffuse_factor: [1.0; 4],
            diffuse_texture: None,
            specular_factor: [1.0; 3],
            glossiness_factor: 1.0,
            specular_glossiness_texture: None,
        }
    }
}

#[derive(Deserialize)]
struct Empty {}

#[derive(Deserialize)]
#[serde(default)]
struct Ior {
    ior: f32,
}

impl Default for Ior {
    fn default() -> Ior {
        Ior { ior: 1.5 }
    }
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Specular {
    specular_factor: f32,
    specular_texture: Option<RawInfo>,
    specular_color_factor: [f32; 3],
    specular_color_texture: Option<RawInfo>,
}

impl Default for Specular {
    fn default() -> Specular {
        let (strength, tint) = (1.0, [1.0; 3]);
        Specular {
            specular_factor: strength,
            specular_texture: None,
            specular_color_factor: tint,
            specular_color_texture: None,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Transmission {
    transmission_factor: f32,
    transmission_texture: Option<RawInfo>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Clearcoat {
    clearcoat_factor: f32,
    clearcoat_texture: Option<RawInfo>,
    clearcoat_roughness_factor: f32,
    clearcoat_roughness_texture: Option<RawInfo>,
    clearcoat_normal_texture: Option<RawNormalMap>,
}
