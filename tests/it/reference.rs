//! `docs/reference.md` lists all of the language, and nothing that it does not have: every name in the first column of
//! its tables, and those in the second where a row has fields or columns.

use crate::support::{files, repository};
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph::expr::FUNCTIONS;
use lightgraph::internals::graph::parse::FORMATS;
use lightgraph::internals::graph::{self, variant};
use lightgraph::internals::scene::{FACTS, FRAME_VALUES, TABLES, VERTEX_ATTRIBUTES};
use lightgraph::{Faults, Scene};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// By name: what belongs to it.
pub type Listed = BTreeMap<String, BTreeSet<String>>;

/// The words in backticks.
fn quoted(text: &str) -> BTreeSet<String> {
    text.split('`').skip(1).step_by(2).map(String::from).collect()
}

/// The tables of a section: names of the first column, with those of the second.
fn documented(section: &str) -> Listed {
    let text = std::fs::read_to_string(repository("docs/reference.md")).unwrap();
    let start = text.find(&format!("\n## {section}\n")).unwrap_or_else(|| panic!("no section `{section}`"));
    let rest = &text[start + 4..];
    let rows = rest[..rest.find("\n## ").unwrap_or(rest.len())].lines().filter(|l| l.starts_with("| `"));
    let mut listed = Listed::new();
    for row in rows {
        let cells: Vec<&str> = row.split(" | ").collect();
        for name in quoted(cells[0]) {
            let more = if cells.len() > 2 { quoted(cells[1]) } else { BTreeSet::new() };
            assert!(listed.insert(name.clone(), more).is_none(), "`{name}` stands twice in {section}");
        }
    }
    listed
}

fn hold(section: &str, real: &Listed) {
    let listed = documented(section);
    let names = |l: &Listed| l.keys().cloned().collect::<BTreeSet<_>>();
    let (there, told) = (names(real), names(&listed));
    let missing: Vec<_> = there.difference(&told).collect();
    let made_up: Vec<_> = told.difference(&there).collect();
    assert!(missing.is_empty() && made_up.is_empty(), "{section} lacks {missing:?} and makes up {made_up:?}");
    for (name, fields) in real.iter().filter(|(_, fields)| !fields.is_empty()) {
        let missing: Vec<_> = fields.difference(&listed[name]).collect();
        let made_up: Vec<_> = listed[name].difference(fields).collect();
        assert!(missing.is_empty() && made_up.is_empty(), "`{name}` lacks {missing:?} and makes up {made_up:?}");
    }
}

fn plain<'n>(names: impl IntoIterator<Item = &'n str>) -> Listed {
    names.into_iter().map(|n| (n.to_string(), BTreeSet::new())).collect()
}

/// What the reader says of a graph file: messages and remedies.
fn said(text: &str) -> String {
    let read = |path: &Path| Ok(Source::new(path.display().to_string(), text));
    let Err(Faults(faults)) = graph::load(Path::new("g.ron"), &read) else { panic!("{text} has no fault") };
    faults.iter().flat_map(|d| std::iter::once(&d.message).chain(&d.help)).cloned().collect::<Vec<_>>().join("\n")
}

/// The fields of each kind of a thing, as the faults of a file with an unknown one list them.
pub fn kinds(of: &dyn Fn(&str) -> String) -> Listed {
    let unknown = said(&of("Zzz()"));
    let expected = unknown.lines().find_map(|l| l.split_once("`Zzz`, expected ")).expect("the kinds are listed").1;
    let fields = |kind: &str| {
        let told = said(&of(&format!("{kind}(zzzzzzzzz: 1)")));
        let list = told.lines().find_map(|l| l.strip_prefix("it has ")).unwrap_or_else(|| panic!("{kind}: {told}"));
        list.split(", ").map(String::from).collect()
    };
    quoted(expected).into_iter().map(|kind| (kind.clone(), fields(&kind))).collect()
}

#[test]
fn passes_resources_and_parameters_are_listed_with_their_fields() {
    hold("Passes", &kinds(&|kind| format!("Graph(passes: [{kind}], outputs: {{}})")));
    hold("Resources", &kinds(&|kind| format!("Graph(resources: {{\"a\": {kind}}}, passes: [], outputs: {{}})")));
    hold("Parameters", &kinds(&|kind| format!("Graph(params: {{\"a\": {kind}}}, passes: [], outputs: {{}})")));
    let variant: Listed = plain(variant::FIELDS);
    let graph = said("Graph(zzzzzzzzz: 1)");
    let graph = plain(graph.lines().find_map(|l| l.strip_prefix("it has ")).unwrap().split(", "));
    hold("Sections", &variant.into_iter().chain(graph).collect());
}

#[test]
fn words_of_the_language_are_listed() {
    hold("Functions", &plain(FUNCTIONS.iter().map(|f| f.0)));
    let formats: Vec<String> = FORMATS.iter().map(|f| format!("{f:?}")).collect();
    hold("Formats", &plain(formats.iter().map(String::as_str)));
}

#[test]
fn what_scenes_and_frames_provide_is_listed() {
    hold("Facts", &plain(FACTS.iter().map(|f| f.0)));
    hold("Frame values", &plain(FRAME_VALUES.iter().map(|f| f.0)));
    hold("Vertex attributes", &plain(VERTEX_ATTRIBUTES.iter().map(|a| a.0)));
    let columns = |columns: &[(&str, _)]| columns.iter().map(|c| c.0.to_string()).collect();
    hold("Tables", &TABLES.iter().map(|t| (t.name.to_string(), columns(t.columns))).collect());
}

#[test]
fn keys_of_scene_files_are_listed() {
    let listed = |text: &str, before: &str| -> BTreeSet<String> {
        let glb = std::fs::read(repository("scenes/cornell.glb")).unwrap();
        let faults = Scene::from_bytes(&glb, "cornell", Some(text)).unwrap_err().to_string();
        let list = faults.split_once(before).unwrap_or_else(|| panic!("{faults}")).1;
        list.lines().next().unwrap_or_default().split(", ").map(String::from).collect()
    };
    let keys = |text: &str| listed(text, "the keys here are ");
    let mut all = Listed::from([
        ("Scene".to_string(), keys("Scene(zzz: 1)")),
        ("materials".to_string(), keys("Scene(materials: {\"a\": (zzz: 1)})")),
        ("motion".to_string(), keys("Scene(motion: {\"a\": [(zzz: 1)]})")),
        ("params".to_string(), keys("Scene(params: {\"a\": [(zzz: 1)]})")),
        ("cameras".to_string(), keys("Scene(cameras: {\"a\": (zzz: 1)})")),
    ]);
    let lights = |kind: &str| format!("Scene(lights: {{\"a\": {kind}}})");
    let environment = |kind: &str| format!("Scene(environment: {kind})");
    for of in [&lights as &dyn Fn(&str) -> String, &environment] {
        for kind in listed(&of("Zzz()"), "the kinds here are ") {
            let found = keys(&of(&format!("{kind}(zzz: 1)")));
            all.insert(kind, found);
        }
    }
    hold("Scene file", &all);
}

#[test]
fn modules_of_the_library_are_listed() {
    let path = |file: &Path| {
        let text = std::fs::read_to_string(file).unwrap();
        let line = text.lines().find_map(|l| l.strip_prefix("#define_import_path "));
        line.unwrap_or_else(|| panic!("{}", file.display())).trim().to_string()
    };
    let mut modules: Vec<String> = files("shaders/lib", &["wgsl"]).iter().map(|f| path(f)).collect();
    modules.push("lightgraph::report".into());
    hold("Shader modules", &plain(modules.iter().map(String::as_str)));
}
