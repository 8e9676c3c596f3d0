//! glTF's JSON, with what the types of the `gltf` crate ask for and the specification does not.

use super::document::json_fault;
use crate::diag::Diagnostic;
use gltf::json::Root;
use serde_json::{Value, json};

/// Reads a document, and what of it is left out.
pub(super) fn root(text: &[u8], shown: &str) -> Result<(Root, Vec<Diagnostic>), Diagnostic> {
    let fault = match Root::from_slice(text) {
        Ok(root) => return Ok((root, vec![])),
        Err(fault) => fault,
    };
    let as_it_is = |_| json_fault(text, shown, &fault);
    let mut value: Value = serde_json::from_slice(text).map_err(as_it_is)?;
    if let Some(version) = first_version(&value) {
        let d = Diagnostic::error(format!("{shown}: asset: version {version} is not glTF 2"));
        return Err(d.help("export the scene as glTF 2.0; Blender and `gltf-transform` read and write it"));
    }
    // Any other fault has its place in the text.
    if !fault.to_string().starts_with("missing field") {
        return Err(json_fault(text, shown, &fault));
    }
    let left_out = completed(&mut value);
    let root = serde_json::from_value(value).map_err(as_it_is)?;
    let d = Diagnostic::warning(format!("{shown}: animations: {left_out} channels move no node; they are left out"));
    Ok((root, if left_out > 0 { vec![d] } else { vec![] }))
}

/// The version of a file of glTF 1, which had maps where glTF 2 has lists.
fn first_version(value: &Value) -> Option<String> {
    let version = value.pointer("/asset/version").and_then(Value::as_str);
    match version {
        Some(version) => version.starts_with("1.").then(|| version.to_owned()),
        None => value.get("scenes").is_some_and(Value::is_object).then(|| "1.0".to_owned()),
    }
}

/// Puts in empty lists that may be left out, and takes out channels without a node, as extensions have them. Returns
/// how many.
fn completed(value: &mut Value) -> usize {
    let mut left_out = 0;
    for scene in list(value, "scenes") {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert(json!([]));
        }
    }
    for animation in list(value, "animations") {
        if let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) {
            let before = channels.len();
            channels.retain(|c| c.pointer("/target/node").is_some());
            left_out += before - channels.len();
        }
        if let Some(animation) = animation.as_object_mut() {
            animation.entry("channels").or_insert(json!([]));
            animation.entry("samplers").or_insert(json!([]));
        }
    }
    left_out
}

fn list<'v>(value: &'v mut Value, key: &str) -> impl Iterator<Item = &'v mut Value> {
    value.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten()
}
