//! The materials of a document: their numbers checked, their textures and images looked up and read.

use super::{
    document::{Document, place},
    extensions::{TextureExtensions, Transform, extend},
    glossiness::{ConvertedMap, GlossyMaterial},
    import::usable,
    mips::TexelCoding,
    model::{Alpha, Face, Material},
    textures::{self, Between, MaterialTexture, TextureArray, WantedImage, Wrap},
};
use crate::diag::Diagnostic;
use glam::{Vec2, Vec3, Vec4};
use gltf::json::{
    material::{AlphaMode, Material as RawMaterial},
    texture::{MagFilter, MinFilter, WrappingMode},
    validation::Checked,
};
use serde::Deserialize;
use serde_json::{Map, Value};
use std::{collections::BTreeSet, path::PathBuf};

/// Materials with what they refer to.
pub(super) struct Materials {
    pub all: Vec<Material>,
    /// By material: which texture coordinates of a mesh its two sets are.
    pub sets: Vec<[Option<u32>; 2]>,
    /// By material: whether its base-colour texture is less than opaque somewhere.
    pub holed: Vec<bool>,
    pub maps: Vec<MaterialTexture>,
    pub pages: Option<TextureArray>,
}

/// What a material uses a texture for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TextureSlot {
    BaseColor,
    Normal,
    Finish,
    Emission,
    Transmission,
    FaceStrength,
    FaceTint,
    CoatStrength,
    CoatRoughness,
    CoatNormal,
}

impl TextureSlot {
    fn name(self) -> &'static str {
        match self {
            TextureSlot::BaseColor => "base-colour texture",
            TextureSlot::Normal => "normal map",
            TextureSlot::Finish => "metallic-roughness texture",
            TextureSlot::Emission => "emissive texture",
            TextureSlot::Transmission => "transmission texture",
            TextureSlot::FaceStrength => "specular texture",
            TextureSlot::FaceTint => "specular colour texture",
            TextureSlot::CoatStrength => "clearcoat texture",
            TextureSlot::CoatRoughness => "clearcoat roughness texture",
            TextureSlot::CoatNormal => "clearcoat normal map",
        }
    }

    fn coding(self) -> TexelCoding {
        match self {
            TextureSlot::BaseColor | TextureSlot::Emission | TextureSlot::FaceTint => TexelCoding::Color,
            _ => TexelCoding::Data,
        }
    }

    fn of(self, m: &mut Material) -> &mut Option<u32> {
        match self {
            TextureSlot::BaseColor => &mut m.base_color_texture,
            TextureSlot::Normal => &mut m.normal_texture,
            TextureSlot::Finish => &mut m.finish_texture,
            TextureSlot::Emission => &mut m.emission_texture,
            TextureSlot::Transmission => &mut m.transmission_texture,
            TextureSlot::FaceStrength => &mut m.face.strength_texture,
            TextureSlot::FaceTint => &mut m.face.tint_texture,
            TextureSlot::CoatStrength => &mut m.coat.strength_texture,
            TextureSlot::CoatRoughness => &mut m.coat.roughness_texture,
            TextureSlot::CoatNormal => &mut m.coat.normal_texture,
        }
    }
}

/// A material's use of a texture, as the file states it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Use {
    pub slot: TextureSlot,
    pub texture: usize,
    pub set: u32,
    pub transform: Transform,
    /// What is made of it instead.
    pub made: Option<(GlossyMaterial, ConvertedMap)>,
}

/// The materials, with the images that they use.
pub(super) fn read(document: &Document<'_>, files: &mut Vec<PathBuf>, faults: &mut Vec<Diagnostic>) -> Materials {
    let mut found = Materials { all: vec![], sets: vec![], holed: vec![], maps: vec![], pages: None };
    let mut used: Vec<Vec<Use>> = vec![];
    for (i, raw) in document.root.materials.iter().enumerate() {
        let at = place("materials", i, raw.name.as_deref());
        let (mut material, uses) = material(document, raw, i, &at, faults);
        material.name = raw.name.clone().unwrap_or_else(|| format!("material {i}"));
        found.all.push(material);
        used.push(uses);
    }
    if document.root.materials.iter().any(|m| m.occlusion_texture.is_some()) {
        let text =
            format!("{}: materials: occlusion textures are left out: what they stand for is computed", document.shown);
        faults.push(Diagnostic::note(text));
    }
    if document.complete() {
        textured(document, &mut found, &used, files, faults);
    }
    found
}

/// One material without textures, and what it uses some for.
fn material(
    document: &Document<'_>,
    raw: &RawMaterial,
    index: usize,
    at: &str,
    faults: &mut Vec<Diagnostic>,
) -> (Material, Vec<Use>) {
    let pbr = &raw.pbr_metallic_roughness;
    let strength =
        raw.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |e| e.emissive_strength.0);
    let base_color = Vec4::from(pbr.base_color_factor.0);
    let emission = Vec3::from(raw.emissive_factor.0) * strength;
    if !usable(&base_color.to_array()) {
        let why = format!("baseColorFactor {base_color} must be finite and not negative");
        faults.push(document.error(at, why));
    } else if base_color.max_element() > 1.0 {
        let why = format!("baseColorFactor {base_color} exceeds 1: the surface gives more light than it gets");
        faults.push(document.warning(at, why));
    }
    if !usable(&emission.to_array()) || strength < 0.0 {
        let why = format!("emission {emission} (emissiveFactor × strength) must be finite and not negative");
        faults.push(document.error(at, why));
    }
    let finish = [pbr.roughness_factor.0, pbr.metallic_factor.0];
    if !finish.iter().all(|x| (0.0..=1.0).contains(x)) {
        let why = format!("roughnessFactor {} and metallicFactor {} must lie within 0 to 1", finish[0], finish[1]);
        faults.push(document.error(at, why));
    }
    let mut uses = vec![];
    let mut add = |slot, texture: usize, set, others: Option<&Map<String, Value>>| {
        let stated = Value::Object(others.cloned().unwrap_or_default());
        match TextureExtensions::deserialize(stated) {
            Ok(TextureExtensions { transform }) => uses.push(Use { slot, texture, set, transform, made: None }),
            Err(e) => faults.push(document.error(at, format!("the extensions of its texture {texture}: {e}"))),
        }
    };
    let plain = [
        (TextureSlot::BaseColor, &pbr.base_color_texture),
        (TextureSlot::Finish, &pbr.metallic_roughness_texture),
        (TextureSlot::Emission, &raw.emissive_texture),
    ];
    for (slot, info) in plain.into_iter().filter_map(|(slot, info)| Some((slot, info.as_ref()?))) {
        add(slot, info.index.value(), info.tex_coord, info.extensions.as_ref().map(|e| &e.others));
    }
    if let Some(info) = &raw.normal_texture {
        add(TextureSlot::Normal, info.index.value(), info.tex_coord, info.extensions.as_ref().map(|e| &e.others));
    }
    let mut material = Material {
        base_color,
        emission,
        double_sided: raw.double_sided,
        roughness: finish[0],
        metallic: finish[1],
        normal_scale: raw.normal_texture.as_ref().map_or(1.0, |n| n.scale),
        alpha: alpha(document, raw, at, faults),
        ..Material::plain()
    };
    if !material.normal_scale.is_finite() {
        faults.push(document.error(at, "the scale of its normal map must be finite"));
    }
    extend(document, raw, index, at, &mut material, &mut uses, faults);
    if material.unlit {
        // What is left is its colour.
        uses.retain(|u| u.slot == TextureSlot::BaseColor);
        material.emission = Vec3::ZERO;
        (material.metallic, material.roughness) = (0.0, 1.0);
    }
    uses.retain(|u| !(u.slot == TextureSlot::Emission && material.emission == Vec3::ZERO));
    (material, uses)
}

fn alpha(document: &Document<'_>, raw: &RawMaterial, at: &str, faults: &mut Vec<Diagnostic>) -> Alpha {
    let cutoff = raw.alpha_cutoff.map_or(0.5, |c| c.0);
    match raw.alpha_mode {
        Checked::Valid(AlphaMode::Opaque) => Alpha::Opaque,
        Checked::Valid(AlphaMode::Mask) if cutoff > 0.0 => Alpha::Mask(cutoff),
        Checked::Valid(AlphaMode::Mask) if cutoff <= 0.0 => Alpha::Opaque,
        Checked::Valid(AlphaMode::Mask) => {
            faults.push(document.error(at, format!("alphaCutoff {cutoff} is no usable number")));
            Alpha::Opaque
        }
        Checked::Valid(AlphaMode::Blend) => Alpha::Blend,
        Checked::Invalid => {
            faults.push(document.warning(at, "unknown alpha mode; it is drawn opaque"));
            Alpha::Opaque
        }
    }
}

/// Gives materials their textures, with the images on pages.
fn textured(
    document: &Document<'_>,
    found: &mut Materials,
    used: &[Vec<Use>],
    files: &mut Vec<PathBuf>,
    faults: &mut Vec<Diagnostic>,
) {
    // By row of `maps`: which of the wanted images.
    let (mut wanted, mut of): (Vec<WantedImage>, Vec<usize>) = (vec![], vec![]);
    let mut slots: Vec<(usize, TextureSlot, u32)> = vec![];
    for (i, uses) in used.iter().enumerate() {
        let at = place("materials", i, document.root.materials[i].name.as_deref());
        let mut sets: Vec<u32> = vec![];
        for u in uses {
            let what = u.slot.name();
            let (mut map, image) = match map(document, u) {
                Ok(found) => found,
                Err(why) => {
                    faults.push(document.error(&at, format!("{what}: {why}")));
                    continue;
                }
            };
            let set = u.transform.tex_coord.unwrap_or(u.set);
            let place = sets.iter().position(|s| *s == set).unwrap_or_else(|| {
                sets.push(set);
                sets.len() - 1
            });
            if place > 1 {
                let why = format!("{what}: a third set of texture coordinates; TEXCOORD_{} is used instead", sets[0]);
                faults.push(document.warning(&at, why));
            }
            map.set = if place == 1 { 1 } else { 0 };
            let coding = u.slot.coding();
            let made = u.made.map(|(glossy, made)| {
                let beside = glossy.diffuse_texture.map(|texture| self::map(document, &Use { texture, ..*u }));
                (glossy, made, beside.and_then(Result::ok).map(|(_, image)| image))
            });
            let want = WantedImage { image, coding, made };
            let want = wanted.iter().position(|w| *w == want).unwrap_or_else(|| {
                wanted.push(want);
                wanted.len() - 1
            });
            let known = found.maps.iter().zip(&of).position(|(m, w)| (m, *w) == (&map, want));
            let row = known.unwrap_or_else(|| {
                found.maps.push(map);
                of.push(want);
                of.len() - 1
            });
            slots.push((i, u.slot, row as u32));
        }
        found.sets.push([sets.first().copied(), sets.get(1).copied()]);
    }
    let read = textures::read(document, &wanted, files);
    faults.extend(read.note.map(|note| Diagnostic::note(format!("{}: images: {note}", document.shown))));
    for (image, w) in read.all.iter().zip(&wanted) {
        let Some(why) = &image.missing else { continue };
        let at = place("images", w.image, document.root.images[w.image].name.as_deref());
        let instead = match w.coding {
            TexelCoding::Color => "where it is a base colour, a magenta checker stands for it; else it is left out",
            TexelCoding::Data => "it is left out",
        };
        faults.push(document.warning(at, format!("{why}; {instead}")));
    }
    let images = read.all;
    for (map, want) in found.maps.iter_mut().zip(&of) {
        let image = &images[*want];
        (map.corner, map.layer) = (image.place.corner, image.place.layer);
        (map.size, map.levels) = (image.size, image.levels);
    }
    found.pages = read.pages;
    for (material, slot, row) in slots {
        let m = &mut found.all[material];
        if images[of[row as usize]].missing.is_some() && slot != TextureSlot::BaseColor {
            if slot == TextureSlot::Emission {
                m.emission = Vec3::ZERO;
            }
            continue;
        }
        *slot.of(m) = Some(row);
    }
    let holed = |m: &Material| m.base_color_texture.is_some_and(|row| images[of[row as usize]].clear);
    found.holed = found.all.iter().map(holed).collect();
}

/// Takes what alpha says back where nothing has any, and says what only some graphs show. `thin`: rows that vertices
/// make less than opaque.
pub(super) fn settle(
    document: &Document<'_>,
    found: &mut Materials,
    thin: &BTreeSet<u32>,
    faults: &mut Vec<Diagnostic>,
) {
    for (i, m) in found.all.iter_mut().enumerate() {
        let holed = found.holed.get(i) == Some(&true) || m.base_color.w < 1.0 || thin.contains(&(i as u32));
        if m.alpha == Alpha::Blend && !holed {
            m.alpha = Alpha::Opaque;
        }
        let at = place("materials", i, Some(&m.name));
        let mut note = |text: &str| faults.push(Diagnostic::note(format!("{}: {at}: {text}", document.shown)));
        if m.alpha == Alpha::Blend {
            note("graphs that trace paths blend it; others draw it where its alpha is one half or more");
        }
        if m.is_mostly_clear() {
            note("graphs that trace paths let light through it, straight on; others leave it out");
        } else if m.transmission > 0.0 {
            note("graphs that trace paths let light through it, straight on; to others it is opaque");
        }
        if m.coat.strength > 0.0 {
            note("graphs that trace paths show its clearcoat; others leave it out");
        }
        if m.face != Face::default() {
            note("graphs that trace paths reflect at its face as its ior and specular say; others do not");
        }
    }
}

/// A row of `maps`, but for where its image stands, and the image's index.
fn map(document: &Document<'_>, u: &Use) -> Result<(MaterialTexture, usize), String> {
    let root = &document.root;
    let raw = root.textures.get(u.texture).ok_or_else(|| format!("there is no texture {}", u.texture))?;
    let in_extension = |name: &str| {
        let stated = raw.extensions.as_ref()?.others.get(name)?.get("source")?.as_u64()?;
        usize::try_from(stated).ok()
    };
    let own = Some(raw.source.value()).filter(|source| *source != u32::MAX as usize);
    let image = in_extension("EXT_texture_webp").or(own).or_else(|| in_extension("KHR_texture_basisu"));
    let image = image.ok_or_else(|| format!("texture {} names no image", u.texture))?;
    if image >= root.images.len() {
        return Err(format!("texture {}: there is no image {image}", u.texture));
    }
    let sampler = match raw.sampler {
        Some(index) => {
            let found = root.samplers.get(index.value());
            found.cloned().ok_or_else(|| format!("texture {}: there is no sampler {index}", u.texture))?
        }
        None => gltf::json::texture::Sampler::default(),
    };
    let numbers = [u.transform.offset, u.transform.scale, [u.transform.rotation, 0.0]];
    if !numbers.as_flattened().iter().all(|x| x.abs() <= 1e6) {
        return Err("its transform holds a number that is no usable one".into());
    }
    let wrap = |mode: Checked<WrappingMode>| match mode {
        Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
        Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::Clamp),
        Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::Mirror),
        Checked::Invalid => Err(format!("texture {}: its sampler has an unknown wrap mode", u.texture)),
    };
    let unknown = || format!("texture {}: its sampler has an unknown filter", u.texture);
    let near = match sampler.mag_filter {
        Some(Checked::Valid(MagFilter::Nearest)) => true,
        Some(Checked::Valid(MagFilter::Linear)) | None => false,
        Some(Checked::Invalid) => return Err(unknown()),
    };
    let (far, between) = match sampler.min_filter {
        Some(Checked::Valid(filter)) => match filter {
            MinFilter::Nearest => (true, Between::None),
            MinFilter::Linear => (false, Between::None),
            MinFilter::NearestMipmapNearest => (true, Between::Nearest),
            MinFilter::LinearMipmapNearest => (false, Between::Nearest),
            MinFilter::NearestMipmapLinear => (true, Between::Linear),
            MinFilter::LinearMipmapLinear => (false, Between::Linear),
        },
        None => (false, Between::Linear),
        Some(Checked::Invalid) => return Err(unknown()),
    };
    let texture = MaterialTexture {
        corner: [0; 2],
        layer: 0,
        size: [1; 2],
        levels: 1,
        wrap: [wrap(sampler.wrap_s)?, wrap(sampler.wrap_t)?],
        nearest: [near, far],
        between,
        coding: u.slot.coding(),
        turn: u.transform.turn(),
        offset: Vec2::from(u.transform.offset),
        set: 0,
    };
    // Several images may name one file: each is decoded once.
    let source = |i: usize| (root.images[i].uri.as_deref(), root.images[i].buffer_view.map(|v| v.value()));
    let first = (0..image).find(|i| source(*i) == source(image) && source(image) != (None, None));
    Ok((texture, first.unwrap_or(image)))
}
