//! `EXT_mesh_gpu_instancing`: a node's mesh at many places.

use super::{animation, document::Document, geometry::MAX_COORDINATE, import::Placed, model::Node, names::short};
use crate::diag::Diagnostic;
use glam::{Mat3, Mat4, Quat, Vec3};
use gltf::json::Node as RawNode;
use serde::Deserialize;

/// Copies of all nodes together, at most: each is a row of a table.
pub(super) const MOST: usize = 1 << 18;

#[derive(Deserialize)]
struct Instancing {
    attributes: Attributes,
}

/// Accessors; those that are absent say that nothing is moved, turned or scaled.
#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
struct Attributes {
    translation: Option<usize>,
    rotation: Option<usize>,
    scale: Option<usize>,
}

/// Where the copies of a node's mesh stand in the node's space; `None`: it is shown once, as it is. `left`: how many
/// more copies there may be.
pub(super) fn transforms(
    document: &Document<'_>,
    raw: &RawNode,
    at: &str,
    left: &mut usize,
    faults: &mut Vec<Diagnostic>,
) -> Option<Vec<(Vec3, Mat3)>> {
    let stated = raw.extensions.as_ref()?.others.get("EXT_mesh_gpu_instancing")?;
    let read = Instancing::deserialize(stated).map_err(|e| e.to_string());
    let read = read.and_then(|stated| read_all(document, &stated.attributes, left));
    read.map_err(|why| faults.push(document.error(at, format!("EXT_mesh_gpu_instancing: {why}")))).ok()
}

fn read_all(document: &Document<'_>, of: &Attributes, left: &mut usize) -> Result<Vec<(Vec3, Mat3)>, String> {
    let vectors = |accessor: Option<usize>| accessor.map(|a| document.floats::<3>(a)).transpose();
    let (translations, scales) = (vectors(of.translation)?, vectors(of.scale)?);
    let rotations = of.rotation.map(|a| document.floats::<4>(a)).transpose()?;
    let counts = [translations.map(|v| v.len()), rotations.map(|v| v.len()), scales.map(|v| v.len())];
    let count = counts.into_iter().flatten().next().ok_or("it has none of TRANSLATION, ROTATION and SCALE")?;
    if counts.into_iter().flatten().any(|other| other != count) {
        return Err("its attributes differ in their counts".into());
    }
    let over = || format!("{count} instances, {} over all nodes; at most {MOST} fit", MOST - *left + count);
    *left = left.checked_sub(count).ok_or_else(over)?;
    let one = |i: usize| {
        let translation = translations.map_or(Vec3::ZERO, |v| v.get(i).into());
        let scale = scales.map_or(Vec3::ONE, |v| v.get(i).into());
        let rotation = rotations.map_or(Quat::IDENTITY, |v| animation::unit(v.get(i).into()));
        let linear = Mat3::from_quat(rotation) * Mat3::from_diagonal(scale);
        let usable =
            Mat4::from_mat3_translation(linear, translation).to_cols_array().iter().all(|x| x.abs() <= MAX_COORDINATE);
        usable.then_some((translation, linear)).ok_or_else(|| format!("instance {i} has no usable transform"))
    };
    (0..count).map(one).collect()
}

/// Adds copies of a node below it.
pub(super) fn place(copies: Vec<(Vec3, Mat3)>, raw: &RawNode, of: usize, placed: &mut Vec<Placed>) {
    let Placed { index, world, ref node, .. } = placed[of];
    let name = short(&node.name).to_owned();
    for (i, (translation, linear)) in copies.into_iter().enumerate() {
        let (name, parent) = (format!("{name} instance {i}"), Some(of));
        let node = Node { name, parent, translation, linear, motion: vec![], animation: None };
        let world = world * Mat4::from_mat3_translation(linear, translation);
        placed.push(Placed { node, index, world, mesh: raw.mesh.map(|m| m.value()), weights: None, copy: true });
    }
}
