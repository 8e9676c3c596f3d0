//! A glTF document to a scene, every number checked: the hierarchy, the materials and the meshes at its nodes.
//!
//! Units and conventions are glTF's: metres, right-handed, +Y up, lights and cameras look down −Z.

use super::{
    animation::{self, Weights},
    attached,
    deform::Deformed,
    deformer::{Deformer, Stated},
    document::{Document, place},
    geometry::{self, Instance, MAX_COORDINATE, MAX_ELEMENTS, MAX_TRIANGLES, Surface},
    instancing,
    materials::{self, Materials},
    model::{Bounds, Material, Node, Scene},
};
use crate::diag::Diagnostic;
use glam::{Mat3, Mat4, Quat, Vec3, Vec4};
use gltf::json::Node as RawNode;
use std::{collections::BTreeSet, path::PathBuf};

/// A node of the scene with what its place in the document says.
pub(super) struct Placed {
    pub node: Node,
    /// Index in the document.
    pub index: usize,
    /// Node to world, before any motion.
    pub world: Mat4,
    /// The mesh that it shows.
    pub mesh: Option<usize>,
    /// How the file's animation moves its morph targets.
    pub weights: Option<Weights>,
    /// It only repeats the mesh of a node: what else that node holds is there once.
    pub copy: bool,
}

/// The scene of a document, without what a scene RON adds. With errors among the faults it is not to be used.
pub(super) fn import(
    document: &Document<'_>,
    name: &str,
    files: &mut Vec<PathBuf>,
    faults: &mut Vec<Diagnostic>,
) -> Scene {
    let mut placed = hierarchy(document, faults);
    animation::animate(document, &mut placed, faults);
    let mut materials = materials::read(document, files, faults);
    let (geometry, deformed) = geometry_of(document, &placed, &mut materials, faults);
    let lights = attached::lights(document, &placed, faults);
    let cameras = attached::cameras(document, &placed, faults);
    Scene {
        name: name.to_owned(),
        geometry: geometry.into(),
        deformed: deformed.into(),
        nodes: placed.into_iter().map(|p| p.node).collect(),
        materials: materials.all,
        lights,
        default_camera: (!cameras.is_empty()).then_some(0),
        cameras,
        maps: materials.maps,
        textures: materials.pages,
        glow: Default::default(),
        environment: None,
        bounds: Bounds::EMPTY,
        grid: Bounds::EMPTY,
        params: vec![],
        origin: Vec3::ZERO,
        levels: Default::default(),
    }
}

/// All nodes reachable from the scene's roots, parents first.
fn hierarchy(document: &Document<'_>, faults: &mut Vec<Diagnostic>) -> Vec<Placed> {
    let root = &document.root;
    let all = &root.nodes;
    if root.scenes.len() > 1 {
        let shown = root.scene.map_or(0, |index| index.value());
        let name = root.scenes.get(shown).and_then(|s| s.name.as_deref());
        let (at, count) = (place("scenes", shown, name), root.scenes.len());
        let d = Diagnostic::note(format!("{}: {at} is shown, one of {count}", document.shown));
        faults.push(d.help("what only the others hold is left out"));
    }
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
    let mut copies_left = instancing::MOST;
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
        let this = placed.len();
        let name = raw.name.clone().unwrap_or_else(|| format!("node {index}"));
        let node = Node { name, parent, translation, linear, motion: vec![], animation: None };
        let copies = instancing::transforms(document, raw, &at, &mut copies_left, faults);
        let mesh = raw.mesh.map(|m| m.value()).filter(|_| copies.is_none());
        placed.push(Placed { node, index, world, mesh, weights: None, copy: false });
        instancing::place(copies.unwrap_or_default(), raw, this, &mut placed);
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

fn geometry_of(
    document: &Document<'_>,
    placed: &[Placed],
    materials: &mut Materials,
    faults: &mut Vec<Diagnostic>,
) -> (geometry::Geometry, Vec<Deformed>) {
    let root = &document.root;
    if !document.complete() {
        return Default::default();
    }
    let extents: Vec<[usize; 2]> = root.meshes.iter().map(|mesh| geometry::extent(document, mesh)).collect();
    let shown: Vec<usize> = placed.iter().filter_map(|p| p.mesh).filter(|mesh| *mesh < extents.len()).collect();
    let triangles = shown.iter().map(|mesh| extents[*mesh][0]).fold(0, usize::saturating_add);
    let distinct: BTreeSet<usize> = shown.into_iter().collect();
    let elements = distinct.iter().map(|mesh| extents[*mesh][1]).fold(0, usize::saturating_add);
    for (count, what, most) in [
        (triangles, "triangles over all nodes", MAX_TRIANGLES),
        (elements, "vectors and indices over all primitives", MAX_ELEMENTS),
    ] {
        if count > most {
            let d = document.error("scene", format!("{count} {what}; at most {most} fit"));
            faults.push(d.help("thin the meshes out, or place them at fewer nodes"));
            return Default::default();
        }
    }
    // Meshes are read once, whatever the number of nodes that show them.
    let mut meshes: Vec<Option<Vec<geometry::Primitive>>> = root.meshes.iter().map(|_| None).collect();
    let mut default_material = None;
    for p in placed {
        let Some(index) = p.mesh else { continue };
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
                    materials.all.push(Material::plain());
                    materials.sets.push([None; 2]);
                    materials.all.len() - 1
                }),
            };
            let material = &materials.all[row];
            let normal_map = material.normal_texture.or(material.coat.normal_texture);
            let normal_map = normal_map.map(|map| materials.maps[map as usize].set);
            let (uv_sets, lit) = (materials.sets[row], !materials.all[row].unlit);
            let surface = Surface { material: row as u32, lit, uv_sets, normal_map };
            primitives.extend(geometry::primitive(document, raw, &at, &surface, faults));
        }
        meshes[index] = Some(primitives);
    }
    let mut instances = vec![];
    let stated = Stated::of(document, placed);
    let deformers = placed.iter().map(|p| Deformer::of(document, &stated, placed, p, faults));
    let deformers: Vec<Deformer> = deformers.collect();
    for (row, p) in placed.iter().enumerate() {
        let mesh = p.mesh.and_then(|m| meshes.get(m)?.as_ref());
        if let Some(why) = mesh.into_iter().flatten().find_map(|primitive| deformers[row].fault(&primitive.deformable))
        {
            faults.push(document.error(place("nodes", p.index, Some(&p.node.name)), why));
        }
        instances.extend(mesh.into_iter().flatten().map(|primitive| Instance {
            primitive,
            node: row as u32,
            node_name: &p.node.name,
            world: deformers[row].orientation(&primitive.deformable).unwrap_or(p.world),
            deformer: Some(&deformers[row]).filter(|deformer| deformer.deforms(&primitive.deformable)),
            double_sided: materials.all[primitive.material()].double_sided,
        }));
    }
    let thin = meshes.iter().flatten().flatten().filter(|p| p.is_thin());
    let thin: BTreeSet<u32> = thin.map(|p| p.material() as u32).collect();
    materials::settle(document, materials, &thin, faults);
    geometry::assemble(document, placed.len(), &instances, faults)
}

pub(super) fn usable(numbers: &[f32]) -> bool {
    numbers.iter().all(|x| *x >= 0.0 && x.is_finite())
}
