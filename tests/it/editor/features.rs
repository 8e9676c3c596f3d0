//! What an editor asks of a place: completion, hover, definitions, references, renames, fixes.

use super::client::{Client, uri};
use super::{GRAPH, MODULE, SHOW, VARIANT, project, told};
use crate::device;
use crate::support::{Scratch, command};
use lightgraph::Project;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A project and a server that has its graph open.
fn opened(name: &str) -> (Scratch, Client, PathBuf) {
    let scratch = Scratch::new(name);
    project(scratch.path());
    let mut client = Client::start(Some(scratch.path()), Value::Null);
    let graph = scratch.path().join("graph.ron");
    client.open(&graph, GRAPH);
    client.checked(&graph);
    (scratch, client, graph)
}

/// The labels that are offered where `§` stands in a text that takes the document's place.
fn offered(client: &mut Client, path: &Path, text: &str) -> BTreeSet<String> {
    let at = text.find('§').unwrap();
    let whole = text.replace('§', "");
    client.replace(path, &whole);
    let params = json!({"textDocument": {"uri": uri(path)}, "position": super::place(&whole, at)});
    let items = client.request("textDocument/completion", params);
    items.as_array().unwrap().iter().map(|i| i["label"].as_str().unwrap().to_string()).collect()
}

#[test]
fn what_may_stand_at_the_cursor_is_offered() {
    let (_scratch, mut client, graph) = opened("editor-complete");
    let cases: [(&str, &str, &[&str], &[&str]); 14] = [
        ("    lets:", "    §\n    lets:", &["defines", "inputs"], &["base", "params"]),
        ("Texture(format: Rgba16Float", "Tex§ture(format: Rgba16Float", &["Texture", "Buffer", "Sampler"], &["Draw"]),
        ("format: Rgba16Float", "format: Rg§", &["Rg32Float", "Depth32Float"], &["Texture"]),
        ("size: \"half\"", "size: \"ha§\"", &["half", "gain", "screen", "color", "lights"], &["make"]),
        ("size: \"half\"),", "size: \"half\", §),", &["mips", "history"], &["format", "tile"]),
        ("color: \"small\"", "color: \"§\"", &["small", "color"], &["gain"]),
        ("shader: \"make.wgsl\"", "shader: §", &["make.wgsl", "lib/brighter.wgsl"], &[]),
        ("bind: {\"input\"", "bind: {\"§\"", &["input", "gain"], &["small"]),
        ("\"input\": \"small\"", "\"input\": \"§\"", &["small", "gain", "camera_position", "lights"], &["input"]),
        ("color: \"small\")", "color: \"small\", §)", &["when", "bind", "entry"], &["name", "vertices"]),
        ("    passes: [", "    passes: [§", &["Draw", "Fastest", "Use"], &["Texture"]),
        // However broken the rest is.
        ("outputs: {", "outputs: {{{ \"§", &[], &[]),
        ("\"half\": \"screen / 2\"", "\"half\": \"scr§", &["screen", "gain", "ceil_div"], &["small"]),
        ("8.0, about", "8.0, §, about", &["about"], &["format", "min"]),
    ];
    for (from, to, all, none) in cases {
        let text = GRAPH.replacen(from, to, 1);
        assert_ne!(text, GRAPH, "{from}");
        let found = offered(&mut client, &graph, &text);
        for name in all {
            assert!(found.contains(*name), "`{to}` offers no `{name}`: {found:?}");
        }
        for name in none {
            assert!(!found.contains(*name), "`{to}` offers `{name}`: {found:?}");
        }
    }
    client.stop();
}

#[test]
fn shaders_are_offered_modules_items_and_names_of_the_graph() {
    let (scratch, mut client, _) = opened("editor-complete-wgsl");
    let show = scratch.path().join("shaders/show.wgsl");
    client.open(&show, SHOW);
    let found = offered(&mut client, &show, &SHOW.replacen("#import brighter::brighter", "#import §", 1));
    assert!(found.contains("brighter") && found.contains("lightgraph::report"), "{found:?}");
    let found = offered(&mut client, &show, &SHOW.replacen("brighter::brighter", "brighter::§", 1));
    assert!(found.contains("brighter") && found.contains("gain"), "{found:?}");
    let found = offered(&mut client, &show, &SHOW.replacen("var input", "var §", 1));
    assert!(found.contains("small") && found.contains("gain"), "{found:?}");
    let found = offered(&mut client, &show, &SHOW.replacen("return ", "return §", 1));
    assert!(found.contains("brighter") && found.contains("input"), "{found:?}");
    client.stop();
}

fn hover(client: &mut Client, path: &Path, text: &str, mark: &str) -> String {
    let shown = client.request("textDocument/hover", Client::at(path, text, mark));
    shown["contents"]["value"].as_str().unwrap_or("").to_string()
}

#[test]
fn a_name_tells_what_it_is() {
    let (scratch, mut client, graph) = opened("editor-hover");
    for (mark, words) in [
        ("\"sm§all\": Texture", &["Rgba16Float", "320 × 240", "600 KiB", "written by `make`", "read by `show`"][..]),
        ("\"half§\"),", &["let", "= (320, 240)"]),
        ("{\"ga§in\": Float", &["how much brighter", "parameter", "= 2"]),
        ("Tex§ture(format: Rgba16Float", &["2D, or an array of layers", "`mips`"]),
        ("Rgba16§Float", &["three and four"]),
        ("\"sho§w\"", &["Screen", "show.wgsl", "writes `color`", "reads `small`"]),
        ("\"inp§ut\": \"small\"", &["texture_2d<f32>"]),
    ] {
        let said = hover(&mut client, &graph, GRAPH, mark);
        for word in words {
            assert!(said.contains(word), "{mark} does not say `{word}`: {said}");
        }
    }
    let module = scratch.path().join("shaders/lib/brighter.wgsl");
    client.open(&module, MODULE);
    let said = hover(&mut client, &module, MODULE, "ga§in;");
    assert!(said.contains("how much brighter"), "{said}");
    let show = scratch.path().join("shaders/show.wgsl");
    client.open(&show, SHOW);
    let said = hover(&mut client, &show, SHOW, "return brigh§ter");
    assert!(said.contains("fn brighter(c: vec4f) -> vec4f") && said.contains("Times the gain."), "{said}");
    client.stop();
}

/// File name and line, from 0, of locations.
fn places(found: &Value) -> BTreeSet<(String, u64)> {
    let place = |l: &Value| {
        let name = l["uri"].as_str().unwrap().rsplit('/').next().unwrap().to_string();
        (name, l["range"]["start"]["line"].as_u64().unwrap())
    };
    found.as_array().unwrap_or(&vec![]).iter().map(place).collect()
}

fn at(expected: &[(&str, u64)]) -> BTreeSet<(String, u64)> {
    expected.iter().map(|(name, line)| ((*name).to_string(), *line)).collect()
}

#[test]
fn names_lead_to_their_declarations_across_files() {
    let (scratch, mut client, graph) = opened("editor-definition");
    let open = |client: &mut Client, name: &str, text: &str| {
        let path = scratch.path().join(name);
        client.open(&path, text);
        path
    };
    let darker = open(&mut client, "darker.ron", VARIANT);
    let show = open(&mut client, "shaders/show.wgsl", SHOW);
    let module = open(&mut client, "shaders/lib/brighter.wgsl", MODULE);
    for (path, text, mark, expected) in [
        (&graph, GRAPH, "color: \"sm§all\"", ("graph.ron", 5)),
        (&graph, GRAPH, "size: \"ha§lf\"", ("graph.ron", 3)),
        (&graph, GRAPH, "\"make§.wgsl\"", ("make.wgsl", 0)),
        (&graph, GRAPH, "{\"inp§ut\"", ("show.wgsl", 2)),
        (&darker, VARIANT, "\"ga§in\"", ("graph.ron", 2)),
        (&darker, VARIANT, "\"graph§.ron\"", ("graph.ron", 0)),
        (&show, SHOW, "return brigh§ter", ("brighter.wgsl", 5)),
        (&show, SHOW, "brighter::brigh§ter", ("brighter.wgsl", 5)),
        (&show, SHOW, "textureLoad(inp§ut", ("show.wgsl", 2)),
        (&module, MODULE, "c * ga§in", ("brighter.wgsl", 2)),
        (&module, MODULE, "var<uniform> ga§in", ("graph.ron", 2)),
    ] {
        let found = client.request("textDocument/definition", Client::at(path, text, mark));
        assert!(places(&found).contains(&(expected.0.into(), expected.1)), "{mark}: {found}");
    }
    let mut params = Client::at(&graph, GRAPH, "{\"ga§in\"");
    params["context"] = json!({"includeDeclaration": true});
    let found = client.request("textDocument/references", params);
    assert_eq!(places(&found), at(&[("graph.ron", 2), ("darker.ron", 3), ("brighter.wgsl", 2), ("brighter.wgsl", 6)]));
    client.stop();
}

/// Applies the edits of an answer to the files on the disk.
fn apply(edit: &Value) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    for (uri, edits) in edit["changes"].as_object().unwrap() {
        let path = uri.strip_prefix("file://").unwrap();
        let mut text = std::fs::read_to_string(path).unwrap();
        let mut edits = edits.as_array().unwrap().clone();
        let byte = |text: &str, at: &Value| {
            let before: usize =
                text.split_inclusive('\n').take(at["line"].as_u64().unwrap() as usize).map(str::len).sum();
            before + at["character"].as_u64().unwrap() as usize
        };
        edits.sort_by_key(|e| std::cmp::Reverse(byte(&text, &e["range"]["start"])));
        for e in &edits {
            let range = byte(&text, &e["range"]["start"])..byte(&text, &e["range"]["end"]);
            text.replace_range(range, e["newText"].as_str().unwrap());
        }
        std::fs::write(path, text).unwrap();
        counts.insert(Path::new(path).file_name().unwrap().to_string_lossy().into_owned(), edits.len());
    }
    counts
}

#[test]
fn a_rename_goes_through_graphs_variants_and_shaders() {
    let (scratch, mut client, graph) = opened("editor-rename");
    let mut params = Client::at(&graph, GRAPH, "{\"ga§in\"");
    params["newName"] = "strength".into();
    let edit = client.request("textDocument/rename", params.clone());
    let counts: Vec<(String, usize)> = apply(&edit).into_iter().collect();
    let expected = [("brighter.wgsl", 2), ("darker.ron", 1), ("graph.ron", 1)].map(|(n, c)| (n.to_string(), c));
    assert_eq!(counts, expected);
    for name in ["graph.ron", "darker.ron"] {
        let faults = super::checked(&scratch.path().join(name));
        assert_eq!(faults, BTreeSet::new(), "{name}");
        assert!(Project::open(&scratch.path().join(name), &[]).unwrap().graph.params[0].0.value == "strength");
    }
    project(scratch.path());
    for (mark, name, why) in [
        ("{\"ga§in\"", "small", "would have a fault"),
        ("{\"ga§in\"", "no name", "is no name"),
        ("about§:", "x", "no name stands here"),
    ] {
        let mut params = Client::at(&graph, GRAPH, mark);
        params["newName"] = name.into();
        let answer = client.ask("textDocument/rename", params);
        assert!(answer["error"]["message"].as_str().unwrap_or("").contains(why), "{mark} to {name}: {answer}");
    }
    client.stop();
}

#[test]
fn a_fault_offers_its_remedy() {
    let (_scratch, mut client, graph) = opened("editor-fixes");
    let broken = GRAPH
        .replace("color: \"small\"", "color: \"smal\"")
        .replace("lets: {", "lets: {\n        \"idle\": \"1\",\n        ");
    let idle = GRAPH.replace("lets: {", "lets: {\n        \"idle\": \"1\",\n        ");
    let make = "        Screen(name: \"make\", shader: \"make.wgsl\", color: \"small\"),\n";
    let blank = GRAPH.replace(make, "");
    for (from, count) in [(broken.as_str(), 1), (&idle, 1), (&blank, 1)] {
        client.replace(&graph, from);
        client.checked(&graph);
        let diagnostics = client.told[&graph].clone();
        assert_eq!(diagnostics.as_array().unwrap().len(), count, "{diagnostics}");
        let params = json!({
            "textDocument": {"uri": uri(&graph)},
            "range": diagnostics[0]["range"],
            "context": {"diagnostics": diagnostics},
        });
        let actions = client.request("textDocument/codeAction", params);
        std::fs::write(&graph, from).unwrap();
        apply(&actions[0]["edit"]);
        let fixed = std::fs::read_to_string(&graph).unwrap();
        client.replace(&graph, &fixed);
        client.checked(&graph);
        let left: Vec<_> = told(&client).into_iter().filter(|f| !f.4.contains("idle")).collect();
        assert_eq!(left, [], "{fixed}");
    }
    client.stop();
}

#[test]
fn a_run_that_shows_the_graph_leaves_times_beside_its_passes() {
    let _alone = device::gpu();
    let scratch = Scratch::new("editor-lenses");
    project(scratch.path());
    let graph = scratch.path().join("graph.ron");
    let cached = || {
        let mut command = command();
        command.env("XDG_CACHE_HOME", scratch.path().join("cache")).env("HOME", scratch.path());
        command
    };
    let mut client = Client::of(cached(), Some(scratch.path()), Value::Null);
    client.open(&graph, GRAPH);
    client.checked(&graph);
    let lenses = |client: &mut Client| {
        let found = client.request("textDocument/codeLens", json!({"textDocument": {"uri": uri(&graph)}}));
        let title = |l: &Value| (l["range"]["start"]["line"].as_u64().unwrap(), l["command"]["title"].to_string());
        found.as_array().unwrap().iter().map(title).collect::<Vec<_>>()
    };
    assert_eq!(lenses(&mut client), [], "nothing has shown it");
    let run = cached()
        .arg("watch")
        .arg(&graph)
        .args(["--size", "16x16", "--reloads", "0", "--out"])
        .arg(scratch.path().join("out.exr"))
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let found = lenses(&mut client);
    assert_eq!(found.iter().map(|l| l.0).collect::<Vec<_>>(), [9, 10], "{found:?}");
    assert!(found.iter().all(|l| l.1.contains("ms · ran: first run")), "{found:?}");
    client.stop();
}

#[test]
fn a_document_has_an_outline_folds_and_hints() {
    let (scratch, mut client, graph) = opened("editor-outline");
    let document = json!({"textDocument": {"uri": uri(&graph)}});
    let symbols = client.request("textDocument/documentSymbol", document.clone());
    let names: Vec<&str> = symbols.as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["gain", "half", "small", "color", "make", "show", "color"]);
    let folds = client.request("textDocument/foldingRange", document.clone());
    assert!(folds.as_array().unwrap().iter().any(|f| f["startLine"] == 8 && f["endLine"] == 10), "{folds}");
    let range = json!({"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}});
    let hints = client.request("textDocument/inlayHint", json!({"textDocument": {"uri": uri(&graph)}, "range": range}));
    let labels: Vec<&str> = hints.as_array().unwrap().iter().map(|h| h["label"].as_str().unwrap()).collect();
    assert!(labels.contains(&"= (320, 240)") && labels.contains(&"320 × 240, 600 KiB"), "{labels:?}");
    let tokens = client.request("textDocument/semanticTokens/full", document);
    // `screen`, `/` and `2` of `half`.
    let first: Vec<u64> = tokens["data"].as_array().unwrap()[..15].iter().map(|n| n.as_u64().unwrap()).collect();
    assert_eq!(first, [3, 20, 6, 1, 0, 0, 7, 1, 5, 0, 0, 2, 1, 4, 0], "{tokens}");
    let module = scratch.path().join("shaders/lib/brighter.wgsl");
    client.open(&module, MODULE);
    let symbols = client.request("textDocument/documentSymbol", json!({"textDocument": {"uri": uri(&module)}}));
    let names: Vec<&str> = symbols.as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["gain", "brighter"]);
    client.stop();
}
