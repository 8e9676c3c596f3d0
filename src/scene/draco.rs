//! `KHR_draco_mesh_compression`: the accessors of a primitive that is compressed.

use super::document::{Document, place};
use crate::{caught::caught, diag::Diagnostic};
use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex};
use gltf::json::{
    accessor::{Accessor, ComponentType},
    mesh::{Mode, Primitive},
    validation::Checked,
};
use serde::Deserialize;
use std::collections::BTreeMap;

/// What it says of a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct DracoMesh {
    buffer_view: usize,
    /// Numbers of Draco's attributes, by what glTF calls them.
    attributes: BTreeMap<String, u32>,
}

/// Bytes that all primitives together may be read from and decoded to. A small file can state any size, and one view
/// many times.
const MAX_BYTES: usize = 1 << 30;

/// The accessors of all compressed primitives, by index; vectors packed.
pub(super) fn accessors(document: &Document<'_>, faults: &mut Vec<Diagnostic>) -> BTreeMap<usize, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut left = MAX_BYTES;
    for (m, mesh) in document.root.meshes.iter().enumerate() {
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let others = primitive.extensions.as_ref().map(|e| &e.others);
            let Some(stated) = others.and_then(|o| o.get("KHR_draco_mesh_compression")) else { continue };
            let read = DracoMesh::deserialize(stated).map_err(|e| e.to_string());
            if let Err(why) = read.and_then(|stated| decode(document, primitive, &stated, &mut left, &mut all)) {
                let at = format!("{} primitive {i}", place("meshes", m, mesh.name.as_deref()));
                faults.push(document.error(at, format!("KHR_draco_mesh_compression: {why}")));
            }
        }
    }
    all
}

fn decode(
    document: &Document<'_>,
    primitive: &Primitive,
    stated: &DracoMesh,
    left: &mut usize,
    all: &mut BTreeMap<usize, Vec<u8>>,
) -> Result<(), String> {
    if primitive.mode != Checked::Valid(Mode::Triangles) {
        return Err("its mode is not that of triangles".into());
    }
    let mut spend = |bytes: usize| {
        let rest = left.checked_sub(bytes);
        // With nothing left, no more is decoded only to be too much.
        *left = rest.unwrap_or(0);
        rest.map(drop).ok_or_else(|| format!("all primitives together take more than {} MiB", MAX_BYTES >> 20))
    };
    let source = document.view(stated.buffer_view)?;
    spend(source.len())?;
    let mesh = caught(|| mesh(source)).unwrap_or_else(|| Err("its data are damaged".into()))?;
    let accessor = |index: usize| {
        let found = document.root.accessors.get(index);
        found.ok_or_else(|| format!("there is no accessor {index}"))
    };
    let index = primitive.indices.as_ref().ok_or("its primitive has no indices")?.value();
    let indices = indices(&mesh, component(accessor(index)?)?)?;
    spend(indices.len())?;
    all.insert(index, indices);
    for (semantic, index) in &primitive.attributes {
        let Checked::Valid(semantic) = semantic else { continue };
        let name = semantic.to_string();
        // An attribute may be beside those that are compressed.
        let Some(id) = stated.attributes.get(&name) else { continue };
        let attribute =
            mesh.attribute_by_unique_id(*id).ok_or_else(|| format!("{name}: its data have no attribute {id}"))?;
        let values = values(attribute, mesh.num_points(), accessor(index.value())?);
        let values = values.map_err(|why| format!("{name}: {why}"))?;
        spend(values.len())?;
        all.insert(index.value(), values);
    }
    Ok(())
}

fn mesh(source: &[u8]) -> Result<Mesh, String> {
    let limits = DecodeLimits::default();
    let limits = limits.with_max_points(1 << 24).with_max_faces(1 << 24).with_max_decoded_bytes(MAX_BYTES as u64 / 2);
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(source).with_limits(limits);
    MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(|e| e.to_string())?;
    Ok(mesh)
}

fn component(accessor: &Accessor) -> Result<ComponentType, String> {
    match accessor.component_type {
        Checked::Valid(component) => Ok(component.0),
        Checked::Invalid => Err("an accessor has an unknown component type".into()),
    }
}

fn indices(mesh: &Mesh, component: ComponentType) -> Result<Vec<u8>, String> {
    let all = mesh.faces().iter().flatten().map(|PointIndex(i)| *i);
    let past = || format!("its indices do not fit {component:?}");
    let bytes: Option<Vec<u8>> = match component {
        ComponentType::U8 => all.map(|i| u8::try_from(i).ok()).collect(),
        ComponentType::U16 => {
            let all: Option<Vec<u16>> = all.map(|i| u16::try_from(i).ok()).collect();
            all.map(|all| all.into_iter().flat_map(u16::to_le_bytes).collect())
        }
        ComponentType::U32 => Some(all.flat_map(u32::to_le_bytes).collect()),
        _ => None,
    };
    bytes.ok_or_else(past)
}

/// How far quantizing moves a number of joints, at most.
const QUANTIZED: f32 = 0.1;

/// The bytes of a whole number, if it is about one of this type.
fn whole(value: f32, component: ComponentType) -> Option<Vec<u8>> {
    let nearest = value.round();
    let off = (value - nearest).abs();
    if off.is_nan() || off > QUANTIZED {
        return None;
    }
    let n = nearest as i64;
    match component {
        ComponentType::I8 => i8::try_from(n).ok().map(|n| n.to_le_bytes().to_vec()),
        ComponentType::U8 => u8::try_from(n).ok().map(|n| n.to_le_bytes().to_vec()),
        ComponentType::I16 => i16::try_from(n).ok().map(|n| n.to_le_bytes().to_vec()),
        ComponentType::U16 => u16::try_from(n).ok().map(|n| n.to_le_bytes().to_vec()),
        ComponentType::U32 => u32::try_from(n).ok().map(|n| n.to_le_bytes().to_vec()),
        ComponentType::F32 => None,
    }
}

/// The values of an attribute for each point, as an accessor states them.
fn values(attribute: &PointAttribute, points: usize, accessor: &Accessor) -> Result<Vec<u8>, String> {
    let (component, Checked::Valid(shape)) = (component(accessor)?, accessor.type_) else {
        return Err("its accessor has an unknown type".into());
    };
    let parts = usize::from(attribute.num_components());
    if parts != shape.multiplicity() {
        return Err(format!("{parts} numbers for each vertex, and an accessor of {shape:?}"));
    }
    let found = attribute.data_type();
    if component == ComponentType::F32 {
        return Ok(attribute.read_f32s(points, parts).into_iter().flat_map(f32::to_le_bytes).collect());
    }
    let same = match component {
        ComponentType::I8 => found == DataType::Int8,
        ComponentType::U8 => found == DataType::Uint8,
        ComponentType::I16 => found == DataType::Int16,
        ComponentType::U16 => found == DataType::Uint16,
        ComponentType::U32 => found == DataType::Uint32,
        ComponentType::F32 => false,
    };
    if !same {
        // Encoders keep joints as floats, too.
        let all = attribute.read_f32s(points, parts).into_iter().map(|x| whole(x, component));
        let bytes = all.collect::<Option<Vec<_>>>().map(|all| all.concat());
        return bytes.ok_or_else(|| format!("its data are {found:?}, and do not fit its accessor of {component:?}"));
    }
    let (size, data) = (component.size() * parts, attribute.buffer().data());
    let stride = usize::try_from(attribute.byte_stride()).map_err(|_| "its data are damaged")?;
    let mut bytes = Vec::with_capacity(points * size);
    for point in 0..points as u32 {
        let start = (attribute.mapped_index(PointIndex(point)).0 as usize).checked_mul(stride);
        let value = start.and_then(|start| data.get(start..start.checked_add(size)?));
        bytes.extend(value.ok_or("its data are damaged")?);
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::{ComponentType, whole};

    #[test]
    fn floats_that_are_whole_numbers_of_a_type_are_told_from_others() {
        assert_eq!(whole(2.04, ComponentType::U8), Some(vec![2]));
        assert_eq!(whole(-3.0, ComponentType::I16), Some(vec![0xfd, 0xff]));
        for value in [2.4, -1.0, 256.0, f32::NAN, f32::INFINITY] {
            assert_eq!(whole(value, ComponentType::U8), None, "{value}");
        }
    }
}
