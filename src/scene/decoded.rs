//! Buffer views and accessors that are not in a file as they are read: compressed by meshoptimizer, or sparse.

use super::document::{Document, place};
use crate::diag::Diagnostic;
use gltf::json::{
    accessor::{Accessor, ComponentType, IndexComponentType},
    buffer::Buffer,
    validation::Checked,
};
use meshoptimizer_rs::{
    Workspace,
    codec::{BufferView, Filter, Mode},
};
use serde::Deserialize;
use std::collections::BTreeMap;

/// By index in the document.
#[derive(Default)]
pub(super) struct DecodedParts {
    pub views: BTreeMap<usize, Vec<u8>>,
    pub accessors: BTreeMap<usize, Vec<u8>>,
}

/// The extension's names: what vendors agreed on, and what Khronos made of it.
const MESHOPT: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// Bytes of all views together after they are decoded. A small file can state any size.
pub(super) const MAX_DECODED: usize = 1 << 30;

/// What `EXT_meshopt_compression` says of a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: usize,
    count: usize,
    mode: String,
    filter: Option<String>,
}

/// Whether a buffer only states a size, for readers that know no compression.
pub(super) fn is_fallback(buffer: &Buffer) -> bool {
    let found = buffer.extensions.iter().flat_map(|e| MESHOPT.iter().filter_map(|name| e.others.get(*name)));
    found.filter_map(|e| e.get("fallback")).any(|f| f.as_bool() == Some(true))
}

/// The views that are compressed, decoded.
pub(super) fn views(document: &Document<'_>, faults: &mut Vec<Diagnostic>) -> BTreeMap<usize, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut left = MAX_DECODED;
    for (i, view) in document.root.buffer_views.iter().enumerate() {
        let others = view.extensions.as_ref().map(|e| &e.others);
        let Some(stated) = others.and_then(|o| MESHOPT.iter().find_map(|name| o.get(*name))) else { continue };
        let read = Compressed::deserialize(stated).map_err(|e| e.to_string());
        match read.and_then(|compressed| decoded(document, &compressed, &mut left)) {
            Ok(bytes) => {
                all.insert(i, bytes);
            }
            Err(why) => faults.push(document.error(format!("bufferViews[{i}]"), format!("meshopt compression: {why}"))),
        }
    }
    all
}

fn decoded(document: &Document<'_>, view: &Compressed, left: &mut usize) -> Result<Vec<u8>, String> {
    let mode = match view.mode.as_str() {
        "ATTRIBUTES" => Mode::Attributes,
        "TRIANGLES" => Mode::Triangles,
        "INDICES" => Mode::Indices,
        other => return Err(format!("unknown mode `{other}`")),
    };
    let name = view.filter.as_deref().unwrap_or("NONE");
    let filter = Filter::parse(name).map_err(|_| format!("unknown filter `{name}`"))?;
    let source = document
        .buffer_part(view.buffer, view.byte_offset, view.byte_length)
        .ok_or_else(|| format!("it reaches past buffer {}", view.buffer))?;
    let layout = BufferView::new(mode, filter, view.count, view.byte_stride).map_err(|e| e.to_string())?;
    *left = left
        .checked_sub(layout.byte_length())
        .ok_or_else(|| format!("all views together decode to more than {} MiB", MAX_DECODED >> 20))?;
    layout.decode(source, &mut Workspace::default()).map_err(|e| e.to_string())
}

/// The accessors that are sparse, filled in. Source: glTF 2.0, section 3.6.2.3, "Sparse Accessors".
pub(super) fn sparse(document: &Document<'_>, faults: &mut Vec<Diagnostic>) -> BTreeMap<usize, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut left = MAX_DECODED;
    for (i, accessor) in document.root.accessors.iter().enumerate().filter(|(_, a)| a.sparse.is_some()) {
        match filled(document, accessor, &mut left) {
            Ok(bytes) => {
                all.insert(i, bytes);
            }
            Err(why) => faults.push(document.error(place("accessors", i, None), why)),
        }
    }
    all
}

fn filled(document: &Document<'_>, accessor: &Accessor, left: &mut usize) -> Result<Vec<u8>, String> {
    let Some(sparse) = &accessor.sparse else { return Err("it is not sparse".into()) };
    let (Checked::Valid(shape), Checked::Valid(component)) = (accessor.type_, accessor.component_type) else {
        return Err("its type is unknown".into());
    };
    let size = component.0.size() * shape.multiplicity();
    let mut bytes = document.packed(accessor, component.0, size, left)?;
    let Checked::Valid(IndexComponentType(width)) = sparse.indices.component_type else {
        return Err("its sparse indices have an unknown component type".into());
    };
    let width = match width {
        ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => width.size(),
        other => return Err(format!("its sparse indices hold {other:?}, not unsigned integers")),
    };
    let part = |what: &str, view: usize, offset: u64, size: usize| {
        let count = usize::try_from(sparse.count.0).ok().and_then(|count| count.checked_mul(size));
        let start = usize::try_from(offset).ok();
        let all = document.view(view)?;
        let past = || format!("its sparse {what} reach past their buffer view of {} bytes", all.len());
        let range = start.zip(count).and_then(|(start, count)| Some(start..start.checked_add(count)?));
        all.get(range.ok_or_else(past)?).ok_or_else(past)
    };
    let indices = part("indices", sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0, width)?;
    let values = part("values", sparse.values.buffer_view.value(), sparse.values.byte_offset.0, size)?;
    if sparse.count.0 > accessor.count.0 {
        return Err(format!("it has {} sparse values for {} elements", sparse.count.0, accessor.count.0));
    }
    for (index, value) in indices.chunks_exact(width).zip(values.chunks_exact(size)) {
        let index = index.iter().rev().fold(0usize, |n, byte| n << 8 | usize::from(*byte));
        let place = index.checked_mul(size).and_then(|start| bytes.get_mut(start..start.checked_add(size)?));
        place.ok_or_else(|| format!("sparse index {index} is out of range"))?.copy_from_slice(value);
    }
    Ok(bytes)
}
