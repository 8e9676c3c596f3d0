//! What graphs say that they can't do.

use super::super::build::plan;
use super::super::fastest::FIRST;
use super::super::request::{Request, sample_facts};
use crate::diag::{Checked, Faults, Source};
use crate::graph::load;
use crate::shader::Library;
use crate::value::{Value, Values};
use std::path::Path;

const SUB: &str = r#"Graph(
    inputs: {"hdr": Texture()},
    params: {"deep": Bool(default: true, about: "how")},
    resources: {"out": Texture(format: Rgba16Float, size: "hdr")},
    passes: [Copy(name: "copy", from: "hdr", to: "out")],
    outputs: {"color": "out"},
    warnings: {"deep": Warning(when: "deep", about: "the sub-graph is deep")},
)"#;
const GRAPH: &str = r#"Graph(
    params: {"far": Bool(default: true, about: "how")},
    resources: {"a": Texture(format: Rgba16Float, size: "screen")},
    passes: [
        Clear(name: "clear", target: "a", value: (0, 0, 0, 0)),
        Use(name: "sub", graph: "sub.ron", in: {"hdr": "a"}, when: "far"),
    ],
    outputs: {"color": "sub.color"},
    warnings: {
        "metals": Warning(when: "metallic_materials > 0", about: "metals look matte"),
        "never": Warning(when: "lights > 100000", about: "too many lights"),
    },
)"#;

/// The warnings of a variant of [`GRAPH`] with a parameter, for a scene with everything or nothing.
fn warned(changes: &str, params: &[(&str, Value)], full: bool) -> Checked<Vec<String>> {
    let variant = format!("Variant(base: \"base.ron\", {changes})");
    let read = |path: &Path| {
        let text = match path.file_name().and_then(|n| n.to_str()) {
            Some("sub.ron") => SUB,
            Some("base.ron") => GRAPH,
            _ => variant.as_str(),
        };
        Ok(Source::new(path.display().to_string(), text))
    };
    let graph = load(Path::new("v.ron"), &read)?;
    let params: Values = params.iter().map(|(n, v)| ((*n).to_string(), *v)).collect();
    let request = Request {
        graph: &graph,
        texts: &Library::default(),
        params: &params,
        facts: &sample_facts(full),
        screen: [8, 8],
        outputs: None,
        choices: &FIRST,
        levels: &[],
        limits: &wgpu_types::Limits::default(),
        features: wgpu_types::Features::empty(),
    };
    plan(&request).map(|p| p.warnings.into_iter().map(|d| d.message).collect())
}

#[test]
fn warnings_hold_for_scenes_and_parameters() {
    let shown = |changes, params: &[_], full| warned(changes, params, full).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(shown("", &[], true), ["metals look matte", "the sub-graph is deep"]);
    assert_eq!(shown("", &[], false), ["the sub-graph is deep"]);
    assert_eq!(shown("", &[("sub.deep", Value::Bool(false))], true), ["metals look matte"]);
    assert_eq!(
        shown("passes: {\"sub\": (when: \"false\")}, outputs: {\"color\": \"a\"}", &[], true),
        ["metals look matte"]
    );
    assert_eq!(shown("warnings: {\"metals\": None, \"sub.deep\": None}", &[], true), [""; 0]);
    assert_eq!(shown("warnings: {\"metals\": (about: \"m\")}", &[], true), ["m", "the sub-graph is deep"]);
}

#[test]
fn a_condition_of_a_warning_is_checked() {
    let said = |when: &str| {
        let changes = format!("warnings: {{\"w\": Warning(when: \"{when}\", about: \"w\")}}");
        let Err(Faults(faults)) = warned(&changes, &[], true) else { panic!("`{when}` has no fault") };
        faults.into_iter().map(|d| d.message).collect::<Vec<_>>()
    };
    assert_eq!(said("lighs > 0"), ["unknown name `lighs`"]);
    assert_eq!(said("1.5"), ["expected a condition, found a float"]);
}
