//! `lightgraph lsp`, driven as an editor drives it.

mod client;
mod edits;
mod features;
mod latency;

use crate::support::{Random, Scratch, files, repository};
use client::{Client, place, uri};
use lightgraph::internals::diag::Severity;
use lightgraph::internals::plan::request::all_sample_facts;
use lightgraph::internals::value::Values;
use lightgraph::{Diagnostic, Faults, Project};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;

/// File, line and column from 0, weight, and message with all remedies.
type Fault = (String, u64, u64, u64, String);

/// What `lightgraph check` finds in a graph.
fn checked(path: &Path) -> BTreeSet<Fault> {
    let found = Project::open(path, &[]).map(|project| project.faults(&Values::new(), &all_sample_facts()));
    found.unwrap_or_else(|Faults(faults)| faults).iter().map(|d| of_check(path, d)).collect()
}

fn of_check(graph: &Path, d: &Diagnostic) -> Fault {
    let weight = match d.severity {
        Severity::Error => 1,
        Severity::Warning => 2,
        Severity::Note => 3,
    };
    let mut message = d.message.clone();
    let (mut file, mut line, mut column) = (graph.display().to_string(), 0, 0);
    if let Some((span, label)) = d.labels.first() {
        let place = span.source.line_column(span.start);
        if !label.is_empty() {
            message += &format!("\n{label}");
        }
        (file, line, column) = (span.source.path.clone(), place.0 as u64 - 1, place.1 as u64 - 1);
    }
    d.help.iter().for_each(|help| message += &format!("\nhelp: {help}"));
    (file, line, column, weight, message)
}

/// What the server has told of all files.
fn told(client: &Client) -> BTreeSet<Fault> {
    let all = client.told.iter().flat_map(|(path, told)| told.as_array().unwrap().iter().map(move |d| (path, d)));
    let fault = |(path, d): (&std::path::PathBuf, &Value)| {
        let start = &d["range"]["start"];
        let number = |v: &Value| v.as_u64().unwrap();
        let message = d["message"].as_str().unwrap().to_string();
        (
            path.display().to_string(),
            number(&start["line"]),
            number(&start["character"]),
            number(&d["severity"]),
            message,
        )
    };
    all.map(fault).collect()
}

#[test]
fn the_editor_shows_what_check_says() {
    let mut client = Client::start(None, Value::Null);
    let mut failures = String::new();
    for path in files("tests/bad", &["ron"]) {
        let text = std::fs::read_to_string(&path).unwrap();
        client.open(&path, &text);
        client.checked(&path);
        let (told, checked) = (told(&client), checked(&path));
        if told != checked {
            failures += &format!("{}: told\n{told:#?}\nbut check says\n{checked:#?}\n", path.display());
        }
        client.close(&path);
    }
    assert!(failures.is_empty(), "{failures}");
    client.stop();
}

/// A project of one graph, a variant of it and two shaders with a module.
const GRAPH: &str = r#"Graph(
    about: "A picture, brighter",
    params: {"gain": Float(default: 2.0, min: 0.0, max: 8.0, about: "how much brighter")},
    lets: {"half": "screen / 2"},
    resources: {
        "small": Texture(format: Rgba16Float, size: "half"),
        "color": Texture(format: Rgba32Float, size: "screen"),
    },
    passes: [
        Screen(name: "make", shader: "make.wgsl", color: "small"),
        Screen(name: "show", shader: "show.wgsl", color: "color", bind: {"input": "small"}),
    ],
    outputs: {"color": "color"},
)
"#;

const MODULE: &str = "#define_import_path brighter\n\nvar<uniform> gain: f32;\n\n// Times the gain.\nfn brighter(c: vec4f) -> vec4f {\n    return c * gain;\n}\n";

const MAKE: &str = "#import brighter::brighter\n\n@fragment\nfn main(@builtin(position) at: vec4f) -> @location(0) vec4f {\n    return brighter(vec4f(at.xy, 0.0, 1.0));\n}\n";

const SHOW: &str = "#import brighter::brighter\n\nvar input: texture_2d<f32>;\n\n@fragment\nfn main(@builtin(position) at: vec4f) -> @location(0) vec4f {\n    return brighter(textureLoad(input, vec2u(at.xy) / 2u, 0));\n}\n";

const VARIANT: &str = "Variant(\n    base: \"graph.ron\",\n    about: \"Darker\",\n    params: {\"gain\": (default: 0.5)},\n    resources: {\"small\": (format: Rgba8Unorm)},\n)\n";

/// Writes the project into a folder.
fn project(folder: &Path) {
    std::fs::create_dir_all(folder.join("shaders/lib")).unwrap();
    let files = [
        ("graph.ron", GRAPH),
        ("darker.ron", VARIANT),
        ("shaders/make.wgsl", MAKE),
        ("shaders/show.wgsl", SHOW),
        ("shaders/lib/brighter.wgsl", MODULE),
    ];
    for (name, text) in files {
        std::fs::write(folder.join(name), text).unwrap();
    }
}

#[test]
fn an_edit_of_one_file_is_a_fault_in_another() {
    let scratch = Scratch::new("editor-files");
    project(scratch.path());
    let mut client = Client::start(Some(scratch.path()), Value::Null);
    let (graph, module) = (scratch.path().join("graph.ron"), scratch.path().join("shaders/lib/brighter.wgsl"));
    // The module alone: the workspace has the graphs that use it.
    client.open(&module, MODULE);
    client.checked(&module);
    assert_eq!(told(&client), BTreeSet::new());
    let shows = |file: &Path, word: &str| {
        let (file, word) = (file.display().to_string(), word.to_string());
        move |client: &Client| told(client).iter().any(|f| f.0 == file && f.4.contains(&word))
    };
    client.replace(&module, &MODULE.replace("gain", "gian"));
    client.until(shows(&module, "gian"));
    client.replace(&module, MODULE);
    client.until(|client| told(client).is_empty());
    // What is not saved counts, in the shader too.
    client.open(&graph, GRAPH);
    client.checked(&graph);
    client.replace(&graph, &GRAPH.replace("\"gain\"", "\"grain\""));
    client.until(shows(&module, "gain"));
    client.close(&graph);
    client.close(&module);
    client.stop();
}

/// Asks what an editor asks about a place; any answer will do.
fn questions(client: &mut Client, path: &Path, text: &str, byte: usize, random: &mut Random) {
    let document = json!({"uri": uri(path)});
    let at = json!({"textDocument": document, "position": place(text, byte)});
    let whole = json!({"textDocument": document});
    let with = |more: Value| {
        let mut params = at.clone();
        params.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        params
    };
    let questions = [
        ("formatting", with(json!({"options": {"tabSize": 4, "insertSpaces": true}}))),
        ("hover", at.clone()),
        ("completion", at.clone()),
        ("definition", at.clone()),
        ("references", with(json!({"context": {"includeDeclaration": true}}))),
        ("rename", with(json!({"newName": "other"}))),
        ("documentSymbol", whole.clone()),
        ("foldingRange", whole),
        ("inlayHint", with(json!({"range": {"start": place(text, 0), "end": place(text, text.len())}}))),
    ];
    let (method, params) = questions[random.below(questions.len())].clone();
    let answer = client.ask(&format!("textDocument/{method}"), params);
    assert_ne!(answer["error"]["code"], -32603, "{method}: {answer}");
}

#[test]
fn a_document_is_laid_out_as_fmt_does() {
    let scratch = Scratch::new("editor-format");
    project(scratch.path());
    let mut client = Client::start(Some(scratch.path()), Value::Null);
    let graph = scratch.path().join("graph.ron");
    let untidy = GRAPH.replace("    lets", "  lets").replace("\"half\": ", "\"half\":");
    client.open(&graph, &untidy);
    let options = json!({"tabSize": 4, "insertSpaces": true});
    let edits =
        client.request("textDocument/formatting", json!({"textDocument": {"uri": uri(&graph)}, "options": options}));
    let edits = edits.as_array().unwrap().clone();
    assert_eq!(edits.len(), 1, "{edits:?}");
    assert_eq!(edits[0]["range"]["start"]["line"], 3, "{edits:?}");
    client.edit(&graph, json!([{"range": edits[0]["range"], "text": edits[0]["newText"]}]));
    let again =
        client.request("textDocument/formatting", json!({"textDocument": {"uri": uri(&graph)}, "options": options}));
    assert_eq!(again, json!([]));
    client.replace(&graph, "Graph(");
    let broken =
        client.request("textDocument/formatting", json!({"textDocument": {"uri": uri(&graph)}, "options": options}));
    assert_eq!(broken, Value::Null);
    client.stop();
}

#[test]
fn unknown_requests_and_wrong_parameters_are_refused() {
    let mut client = Client::start(Some(&repository("graphs")), json!({"scene": "no/such.gltf", "shaders": 3}));
    assert_eq!(client.ask("textDocument/unheardOf", json!({}))["error"]["code"], -32601);
    assert_eq!(client.ask("textDocument/formatting", json!({"a": 1}))["error"]["code"], -32602);
    client.notify("textDocument/didOpen", json!({"a": 1}));
    client.stop();
}
