//! The targets. Each takes the bytes of a file as somebody may have written it.

use lightgraph::internals::diag::{Severity, Source, render};
use lightgraph::internals::graph;
use lightgraph::internals::image::exr;
use lightgraph::internals::plan::build::faults;
use lightgraph::internals::plan::fastest::FIRST;
use lightgraph::internals::plan::request::{Request, sample_device, sample_facts};
use lightgraph::internals::shader::{self, Defs, Library, compose};
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, Faults, Scene};
use lightgraph_cli::bench::results::Results;
use lightgraph_cli::snapshot;
use std::path::Path;
use std::sync::Arc;

/// A triangle and a camera, for scene RON that describes them.
const TRIANGLE: &[u8] = include_bytes!("../../scenes/lambert_plane.glb");

/// What a variant stands on.
const BASE: &str = include_str!("../../graphs/gi/direct.ron");

/// The input, where it is UTF-8.
fn text(bytes: &[u8]) -> Option<&str> {
    std::str::from_utf8(bytes).ok()
}

/// What is refused is refused with an error that can be shown on a page.
fn shown<T>(result: Checked<T>) -> Option<T> {
    result
        .map_err(|Faults(faults)| {
            assert!(faults.iter().any(|d| d.severity == Severity::Error), "refused without an error");
            page(&faults);
        })
        .ok()
}

fn page(faults: &[Diagnostic]) {
    let page = render(faults);
    assert!(page.len() < 1 << 20, "{} bytes of faults", page.len());
}

fn read_graph(bytes: &[u8]) -> Option<graph::Graph> {
    let source = Source::new("fuzzed.ron", text(bytes)?);
    let read = |path: &Path| -> Checked<Arc<Source>> {
        match path.to_str() {
            Some("fuzzed.ron") => Ok(source.clone()),
            Some("base.ron") => Ok(Source::new("base.ron", BASE)),
            _ => Err(Diagnostic::error(format!("there is no {}", path.display())).into()),
        }
    };
    shown(graph::load(Path::new("fuzzed.ron"), &read))
}

/// A graph file.
pub fn graph(bytes: &[u8]) {
    read_graph(bytes);
}

/// A variant of a graph that ships, under the name `base.ron`.
pub fn variant(bytes: &[u8]) {
    let Some(text) = text(bytes) else { return };
    read_graph(format!("Variant(base: \"base.ron\", {text})").as_bytes());
}

/// A graph file, planned with the shaders that come with the program.
pub fn plan(bytes: &[u8]) {
    let Some(graph) = read_graph(bytes) else { return };
    let (limits, features) = sample_device();
    let texts = builtin();
    for full in [true, false] {
        page(&faults(&Request {
            graph: &graph,
            texts: &texts,
            params: &Values::new(),
            facts: &sample_facts(full),
            screen: [64, 48],
            outputs: None,
            choices: &FIRST,
            levels: &[],
            limits: &limits,
            features,
        }));
    }
}

fn builtin() -> Library {
    static BUILTIN: std::sync::OnceLock<Library> = std::sync::OnceLock::new();
    let fresh = || {
        let mut library = Library::default();
        library.files.extend(lightgraph::internals::builtin::shaders().map(|(name, source)| (name.to_owned(), source)));
        library
    };
    BUILTIN.get_or_init(fresh).clone()
}

/// A shader, which may import those that come with the program.
pub fn wgsl(bytes: &[u8]) {
    let Some(text) = text(bytes) else { return };
    let mut library = builtin();
    library.files.insert("fuzzed.wgsl".into(), Source::new("fuzzed.wgsl", text));
    shown(compose(&library, "fuzzed.wgsl", &Defs::new(), &[]));
}

/// A glTF or GLB file.
pub fn gltf(bytes: &[u8]) {
    if let Some(loaded) = shown(Scene::from_bytes(bytes, "fuzzed", None)) {
        let pose = loaded.scene.pose(0.5);
        loaded.scene.tables(&pose);
    }
}

/// A scene RON.
pub fn scene(bytes: &[u8]) {
    let Some(text) = text(bytes) else { return };
    if let Some(loaded) = shown(Scene::from_bytes(TRIANGLE, "fuzzed", Some(text))) {
        let pose = loaded.scene.pose(0.5);
        loaded.scene.tables(&pose);
    }
}

/// The file of a snapshot test.
pub fn test(bytes: &[u8]) {
    let Some(text) = text(bytes) else { return };
    shown(snapshot::file::read(Path::new("fuzzed.ron"), &Source::new("fuzzed.ron", text)));
}

/// An EXR file.
pub fn image(bytes: &[u8]) {
    shown(exr::from_bytes(Path::new("fuzzed.exr"), bytes));
}

/// Results of a bench, plain or packed.
pub fn results(bytes: &[u8]) {
    if let Some(results) = shown(Results::from_bytes(bytes.to_vec(), "fuzzed.json")) {
        results.csv();
        lightgraph_cli::bench::report::text(&results);
    }
}

/// What the cache of joined shaders holds behind the seal.
pub fn cache(bytes: &[u8]) {
    shader::kept_module(bytes);
}
