//! What extensions say of materials and textures.

use super::{
    document::Document,
    import::usable,
    materials::{TextureSlot, Use},
    model::Material,
};
use crate::diag::Diagnostic;
use glam::{Vec3, Vec4};
use gltf::json::material::Material as RawMaterial;
use serde::Deserialize;
use serde_json::{Map, Value};

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
    let mut add = |slot, info: Option<RawInfo>| {
        uses.extend(info.map(|info| Use {
            slot,
            texture: info.index,
            set: info.tex_coord,
            transform: transform(Some(&info.extensions)),
        }));
    };
    if let Some(s) = stated.specular_glossiness {
        let numbers = [s.diffuse_factor.as_slice(), &s.specular_factor, &[s.glossiness_factor]].concat();
        if !numbers.iter().all(|x| (0.0..=1.0).contains(x)) {
            faults.push(document.error(at, "its factors of specular and glossiness must lie within 0 to 1"));
        }
        m.roughness = 1.0 - s.glossiness_factor;
        let (diffuse, specular) = (Vec4::from(s.diffuse_factor), Vec3::from(s.specular_factor));
        if s.specular_glossiness_texture.is_some() {
            faults.push(document.warning(at, "the glossiness in the alpha of its specular texture is ignored"));
            (m.base_color, m.metallic) = (diffuse, 0.0);
            m.face.tint = specular / HEAD_ON;
        } else {
            let (base, metallic) = metal_of(diffuse.truncate(), specular);
            (m.base_color, m.metallic) = (base.extend(diffuse.w), metallic);
        }
        add(TextureSlot::BaseColor, s.diffuse_texture);
        add(TextureSlot::FaceTint, s.specular_glossiness_texture);
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
        add(TextureSlot::FaceStrength, s.specular_texture);
        add(TextureSlot::FaceTint, s.specular_color_texture);
    }
    if let Some(t) = stated.transmission {
        m.transmission = t.transmission_factor;
        if !(0.0..=1.0).contains(&m.transmission) {
            faults.push(document.error(at, format!("transmissionFactor {} must lie within 0 to 1", m.transmission)));
        }
        if m.transmission > 0.0 {
            add(TextureSlot::Transmission, t.transmission_texture);
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
            add(TextureSlot::CoatStrength, c.clearcoat_texture);
            add(TextureSlot::CoatRoughness, c.clearcoat_roughness_texture);
            if c.clearcoat_normal_texture.is_some() {
                faults.push(document.warning(at, "the normal map of its clearcoat is ignored; the coat is smooth"));
            }
        }
    }
    for name in others.keys().filter(|name| !EXTENSIONS.contains(&name.as_str())) {
        faults.push(document.warning(at, format!("its extension `{name}` is ignored")));
    }
}

/// What a face of the ior of 1.5 reflects head on.
const HEAD_ON: f32 = 0.04;

/// The base colour and metalness that look most like a diffuse and a specular colour (after the conversion that the
/// Khronos Group gives beside the text of KHR_materials_pbrSpecularGlossiness).
fn metal_of(diffuse: Vec3, specular: Vec3) -> (Vec3, f32) {
    let brightness = |c: Vec3| (c * c).dot(Vec3::new(0.299, 0.587, 0.114)).sqrt();
    let kept = 1.0 - specular.max_element();
    let (bright, shiny) = (brightness(diffuse), brightness(specular));
    // The metalness at which a base colour gives both.
    let b = bright * kept / (1.0 - HEAD_ON) + shiny - 2.0 * HEAD_ON;
    let root = (b * b + 4.0 * HEAD_ON * (shiny - HEAD_ON)).max(0.0).sqrt();
    let metallic = if shiny < HEAD_ON { 0.0 } else { ((root - b) / (2.0 * HEAD_ON)).clamp(0.0, 1.0) };
    let matte = diffuse * (kept / (1.0 - HEAD_ON) / (1.0 - metallic).max(1e-6));
    let metal = (specular - HEAD_ON * (1.0 - metallic)) / metallic.max(1e-6);
    (matte.lerp(metal, metallic * metallic).clamp(Vec3::ZERO, Vec3::ONE), metallic)
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

pub(super) fn transform(extensions: Option<&Map<String, Value>>) -> Transform {
    let stated = extensions.and_then(|e| e.get("KHR_texture_transform"));
    stated.and_then(|t| Transform::deserialize(t).ok()).unwrap_or_default()
}

/// `KHR_texture_transform`.
#[derive(Debug, Clone, Copy, Deserialize)]
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
    extensions: Map<String, Value>,
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
    clearcoat_normal_texture: Option<RawInfo>,
}
