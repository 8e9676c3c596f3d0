//! A glTF document to a scene, every number checked: the hierarchy, the materials and the meshes at its nodes.
//!
//! Units and conventions are glTF's: metres, right-handed, +Y up, lights and cameras look down −Z.

use super::{
    attached,
    document::{Document, place},
    geometry::{self, Instance, MAX_COORDINATE, Surface},
    model::{Bounds, Material, Node, Scene},
    textures,
};
use crate::diag::Diagnostic;
use glam::{Mat3, Mat4, Quat, Vec3, Vec4};
use gltf::json::{Node as RawNode, material::Material as RawMaterial, validation::Checked};
use std::path::PathBuf;

/// A node of the scene with what its place in the document says.
pub(super) struct Placed {
    pub node: Node,
    /// Index in the document.
    pub index: usize,
    /// Node to world, before any motion.
    pub world: Mat4,
}

/// The scene of a document, without what a scene RON adds. With errors among the faults it is not to be used.
pub(super) fn import(
    document: &Document<'_>,
    name: &str,
    files: &mut Vec<PathBuf>,
    faults: &mut Vec<Diagnostic>,
) -> Scene {
    if !document.root.animations.is_empty() {
        let d = document.warning("animations", "glTF animations are ignored");
        faults.push(d.help("state motion in a scene RON beside the file"));
    }
    let placed = hierarchy(document, faults);
    let (mut materials, mut uv_sets) = materials(document, faults);
    let textures = texture_array(document, &mut materials, files, faults);
    let geometry = geometry_of(document, &placed, &mut materials, &mut uv_sets, faults);
    let lights = attached::lights(document, &placed, faults);
    let cameras = attached::cameras(document, &placed, faults);
    Scene {
        name: name.to_owned(),
        geometry: geometry.into(),
        nodes: placed.into_iter().map(|p| p.node).collect(),
        materials,
        lights,
        default_camera: (!cameras.is_empty()).then_some(0),
        cameras,
        textures,
        environment: None,
        bounds: Bounds::EMPTY,
        grid: Bounds::EMPTY,
        origin: Vec3::ZERO,
        levels: Default::default(),
    }
}

/// All nodes reachable from the scene's roots, parents first.
fn hierarchy(document: &Document<'_>, faults: &mut Vec<Diagnostic>) -> Vec<Placed> {
    let root = &document.root;
    let all = &root.nodes;
    let mut pending: Vec<(usize, Option<usize>)> = match (root.scene, root.scenes.first()) {
        (Some(index), _) if root.scenes.get(index.value()).is_none() => {
            faults.push(document.error("scene", format!("there is no scene {}", index.value())));
            return vec![];
        }
        (Some(index), _) => root.scenes[index.value()].nodes.iter().map(|n| (n.value(), None)).collect(),
        (None, Some(first)) => first.nodes.iter().map(|n| (n.value(), None)).collect(),
        (None, None) => {
            let mut child = vec![false; all.len()];
            for c in all.iter().flat_map(|n| n.children.iter().flatten()) {
                child.get_mut(c.value()).into_iter().for_each(|c| *c = true);
            }
            (0..all.len()).filter(|i| !child[*i]).map(|i| (i, None)).collect()
        }
    };
    pending.reverse();
    let mut seen = vec![false; all.len()];
    let mut placed: Vec<Placed> = vec![];
    while let Some((index, parent)) = pending.pop() {
        let Some(raw) = all.get(index) else {
            faults.push(document.error("nodes", format!("there is no node {index}, yet it is used")));
            continue;
        };
        let at = place("nodes", index, raw.name.as_deref());
        if std::mem::replace(&mut seen[index], true) {
            let d = document.error(at, "it has two parents, or is its own ancestor");
            faults.push(d.help("each node may be the child of one node, or a root of the scene"));
            continue;
        }
        let (translation, linear) = match local(raw) {
            Ok(local) => local,
            Err(why) => {
                faults.push(document.error(at, why));
                continue;
            }
        };
        let above = parent.map_or(Mat4::IDENTITY, |p| placed[p].world);
        let world = above * Mat4::from_mat3_translation(linear, translation);
        if !world.to_cols_array().iter().all(|x| x.abs() <= MAX_COORDINATE) {
            faults.push(document.error(at, "its transform, with those above it, leaves the range of usable numbers"));
            continue;
        }
        if raw.skin.is_some() {
            faults.push(document.warning(at, "its skin is ignored"));
        }
        let this = placed.len();
        let name = raw.name.clone().unwrap_or_else(|| format!("node {index}"));
        let node = Node { name, parent, translation, linear, motion: vec![] };
        placed.push(Placed { node, index, world });
        pending.extend(raw.children.iter().flatten().rev().map(|c| (c.value(), Some(this))));
    }
    placed
}

/// A node's own translation, and rotation with scale.
fn local(raw: &RawNode) -> Result<(Vec3, Mat3), String> {
    if let Some(matrix) = raw.matrix {
        let matrix = Mat4::from_cols_array(&matrix);
        if !matrix.is_finite() {
            return Err("its matrix holds a number that is not finite".into());
        }
        if matrix.row(3) != Vec4::W {
            return Err("the last row of its matrix is not (0, 0, 0, 1)".into());
        }
        return Ok((matrix.w_axis.truncate(), Mat3::from_mat4(matrix)));
    }
    let translation = Vec3::from(raw.translation.unwrap_or([0.0; 3]));
    let scale = Vec3::from(raw.scale.unwrap_or([1.0; 3]));
    let rotation = Quat::from_array(raw.rotation.unwrap_or_default().0);
    if !(translation.is_finite() && scale.is_finite() && rotation.is_finite()) {
        return Err("its transform holds a number that is not finite".into());
    }
    if !(rotation.length_squared() > 0.0 && rotation.length_squared().is_finite()) {
        return Err("its rotation is no unit quaternion".into());
    }
    Ok((translation, Mat3::from_quat(rotation.normalize()) * Mat3::from_diagonal(scale)))
}

/// The materials, and for each the texture coordinate set of its base-colour texture.
fn materials(document: &Document<'_>, faults: &mut Vec<Diagnostic>) -> (Vec<Material>, Vec<Option<u32>>) {
    let mut all = vec![];
    let mut sets = vec![];
    for (i, raw) in document.root.materials.iter().enumerate() {
        let at = place("materials", i, raw.name.as_deref());
        let strength =
            raw.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |e| e.emissive_strength.0);
        let base_color = Vec4::from(raw.pbr_metallic_roughness.base_color_factor.0);
        let emission = Vec3::from(raw.emissive_factor.0) * strength;
        if !usable(&base_color.to_array()) {
            let why = format!("baseColorFactor {base_color} must be finite and not negative");
            faults.push(document.error(&at, why));
        } else if base_color.max_element() > 1.0 {
            let why = format!("baseColorFactor {base_color} exceeds 1: the surface gives more light than it gets");
            faults.push(document.warning(&at, why));
        }
        if !usable(&emission.to_array()) || strength < 0.0 {
            let why = format!("emission {emission} (emissiveFactor × strength) must be finite and not negative");
            faults.push(document.error(&at, why));
        }
        let finish = [raw.pbr_metallic_roughness.roughness_factor.0, raw.pbr_metallic_roughness.metallic_factor.0];
        if !finish.iter().all(|x| (0.0..=1.0).contains(x)) {
            let why = format!("roughnessFactor {} and metallicFactor {} must lie within 0 to 1", finish[0], finish[1]);
            faults.push(document.error(&at, why));
        }
        warn_ignored(document, &at, raw, faults);
        sets.push(raw.pbr_metallic_roughness.base_color_texture.as_ref().map(|t| t.tex_coord));
        all.push(Material {
            name: raw.name.clone().unwrap_or_else(|| format!("material {i}")),
            base_color,
            base_color_texture: None,
            emission,
            double_sided: raw.double_sided,
            specular: 0.0,
            shininess: 1.0,
            roughness: finish[0],
            metallic: finish[1],
        });
    }
    (all, sets)
}

fn warn_ignored(document: &Document<'_>, at: &str, raw: &RawMaterial, faults: &mut Vec<Diagnostic>) {
    use gltf::json::material::AlphaMode;
    if raw.emissive_texture.is_some() {
        faults.push(document.warning(at, "its emissive texture is ignored; the factor alone holds"));
    }
    if raw.normal_texture.is_some() {
        faults.push(document.warning(at, "its normal map is ignored"));
    }
    if raw.pbr_metallic_roughness.metallic_roughness_texture.is_some() {
        faults.push(document.warning(at, "its metallic-roughness texture is ignored; the factors alone hold"));
    }
    match raw.alpha_mode {
        Checked::Valid(AlphaMode::Opaque) => {}
        Checked::Valid(mode) => faults.push(document.warning(at, format!("alpha mode {mode:?} is drawn opaque"))),
        Checked::Invalid => faults.push(document.warning(at, "unknown alpha mode; it is drawn opaque")),
    }
}

/// Loads the base-colour images that materials use, each once, and tells the materials their layers.
fn texture_array(
    document: &Document<'_>,
    materials: &mut [Material],
    files: &mut Vec<PathBuf>,
    faults: &mut Vec<Diagnostic>,
) -> Option<textures::TextureArray> {
    if !document.complete() {
        return None;
    }
    let root = &document.root;
    // Several images may name one file: each is decoded once.
    let mut sources = vec![];
    let mut pictures = vec![];
    for (i, (raw, material)) in root.materials.iter().zip(materials).enumerate() {
        let Some(texture) = &raw.pbr_metallic_roughness.base_color_texture else { continue };
        let found = textures::image_of(root, texture.index.value()).and_then(|image| {
            let image = &root.images[image];
            let source = (image.uri.as_deref(), image.buffer_view.map(|v| v.value()));
            if let Some(layer) = sources.iter().position(|known| *known == source) {
                return Ok(layer);
            }
            pictures.push(textures::picture(document, image, files)?);
            sources.push(source);
            Ok(sources.len() - 1)
        });
        match found {
            Ok(layer) => material.base_color_texture = u32::try_from(layer).ok(),
            Err(why) => {
                let at = place("materials", i, raw.name.as_deref());
                faults.push(document.error(at, format!("base-colour texture: {why}")));
            }
        }
    }
    textures::array(&pictures)
}

fn geometry_of(
    document: &Document<'_>,
    placed: &[Placed],
    materials: &mut Vec<Material>,
    uv_sets: &mut Vec<Option<u32>>,
    faults: &mut Vec<Diagnostic>,
) -> geometry::Geometry {
    let root = &document.root;
    if !document.complete() {
        return geometry::Geometry::default();
    }
    // Meshes are read once, whatever the number of nodes that show them.
    let mut meshes: Vec<Option<Vec<geometry::Primitive>>> = root.meshes.iter().map(|_| None).collect();
    let mut default_material = None;
    for p in placed {
        let Some(index) = root.nodes[p.index].mesh.map(|m| m.value()) else { continue };
        let Some(mesh) = root.meshes.get(index) else {
            let at = place("nodes", p.index, Some(&p.node.name));
            faults.push(document.error(at, format!("there is no mesh {index}")));
            continue;
        };
        if meshes[index].is_some() {
            continue;
        }
        let mut primitives = vec![];
        for (j, raw) in mesh.primitives.iter().enumerate() {
            let at = geometry::primitive_place(index, mesh.name.as_deref(), j);
            let row = match raw.material {
                Some(material) if material.value() >= root.materials.len() => {
                    faults.push(document.error(at, format!("there is no material {material}")));
                    continue;
                }
                Some(material) => material.value(),
                None => *default_material.get_or_insert_with(|| {
                    materials.push(plain_material());
                    uv_sets.push(None);
                    materials.len() - 1
                }),
            };
            let surface = Surface { material: row as u32, uv_set: uv_sets[row] };
            primitives.extend(geometry::primitive(document, raw, &at, &surface, faults));
        }
        meshes[index] = Some(primitives);
    }
    let mut instances = vec![];
    for (row, p) in placed.iter().enumerate() {
        let mesh = root.nodes[p.index].mesh.and_then(|m| meshes.get(m.value())?.as_ref());
        instances.extend(mesh.into_iter().flatten().map(|primitive| Instance {
            primitive,
            node: row as u32,
            node_name: &p.node.name,
            world: p.world,
            double_sided: materials[primitive.material()].double_sided,
        }));
    }
    geometry::assemble(document, &instances, faults)
}

/// What glTF gives a primitive without a material.
fn plain_material() -> Material {
    Material {
        name: "default".into(),
        base_color: Vec4::ONE,
        base_color_texture: None,
        emission: Vec3::ZERO,
        double_sided: false,
        specular: 0.0,
        shininess: 1.0,
        roughness: 1.0,
        metallic: 1.0,
    }
}

pub(super) fn usable(numbers: &[f32]) -> bool {
    numbers.iter().all(|x| *x >= 0.0 && x.is_finite())
}
