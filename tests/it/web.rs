//! Pages for browsers: what `export web` writes. `make test-web` looks at pages in a browser.

use crate::command::lightgraph;
use crate::support::{Scratch, repository};
use std::fs;

/// The files of a page that an export takes over.
const PAGE: [&str; 8] =
    ["engine.js", "engine_bg.wasm", "start.js", "page.js", "worker.js", "offline.js", "style.css", "index.html"];

fn export(graph: &str, page: &str, out: &str) -> (Option<i32>, String) {
    let what = ["export", "web", graph, "--scene", "scenes/hall", "--size", "16x12"];
    let output = lightgraph(&[&what[..], &["--out", out, "--page", page]].concat(), true);
    let [said, faults] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    (output.status.code(), format!("{said}{faults}"))
}

#[test]
fn an_exported_page_has_all_that_its_graph_needs() {
    let scratch = Scratch::new("export-web");
    let [page, out] = ["page", "out"].map(|name| scratch.path().join(name));
    fs::create_dir_all(&page).unwrap();
    let [page_name, out_name] = [&page, &out].map(|p| p.display().to_string());
    let graph = "graphs/gi/inset_grid.ron";
    let (code, text) = export(graph, &page_name, &out_name);
    assert!(code == Some(1) && text.contains("make web"), "{text}");
    for name in PAGE {
        fs::write(page.join(name), "<body>").unwrap();
    }
    let (code, text) = export(graph, &page_name, &out_name);
    assert!(code == Some(0) && text.contains("lightgraph serve"), "{text}");
    let told: serde_json::Value = serde_json::from_slice(&fs::read(out.join("project.json")).unwrap()).unwrap();
    assert_eq!(
        (told["graph"].as_str(), told["scene"].as_str()),
        (Some("graphs/inset_grid.ron"), Some("scenes/hall.ron"))
    );
    for file in told["files"].as_array().unwrap() {
        assert!(out.join(file.as_str().unwrap()).is_file(), "{file}");
    }
    // The base of the variant, a shader, what shaders import, and both files of the scene.
    for file in ["graphs/fast_grid.ron", "scenes/hall.glb", "shaders/lib/sh.wgsl", "poster.png"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    assert_eq!(fs::read_to_string(out.join("index.html")).unwrap(), "<body class=\"viewer\">");
    let (code, text) = export(graph, &page_name, &out_name);
    assert!(code == Some(2) && text.contains("not an empty folder"), "{text}");

    // A graph that reads an image.
    let lit = scratch.path().join("lit").display().to_string();
    let (code, text) = export("graphs/play/image_lit.ron", &page_name, &lit);
    assert!(code == Some(0), "{text}");
    let here = fs::read(repository("graphs/play/studio.hdr")).unwrap();
    let there = fs::read(format!("{lit}/graphs/studio.hdr")).unwrap();
    assert_eq!(here, there);
    let told: serde_json::Value = serde_json::from_slice(&fs::read(format!("{lit}/project.json")).unwrap()).unwrap();
    assert!(told["files"].as_array().unwrap().contains(&"graphs/studio.hdr".into()), "{told}");
}

#[test]
fn an_export_that_fails_leaves_nothing() {
    let scratch = Scratch::new("export-fails");
    let [page, out] = ["page", "out"].map(|name| scratch.path().join(name));
    fs::create_dir_all(&page).unwrap();
    let [page_name, out_name] = [&page, &out].map(|p| p.display().to_string());
    for name in &PAGE[1..] {
        fs::write(page.join(name), "<body>").unwrap();
    }
    let (code, text) = export("graphs/gi/direct.ron", &page_name, &out_name);
    assert!(code == Some(1) && text.contains("can't read") && text.contains("engine.js"), "{text}");
    assert!(!out.exists());

    // A name that leaves no room for that of the file which takes it; the page's own files come first.
    fs::write(page.join(PAGE[0]), "").unwrap();
    let long = scratch.path().join(format!("{}.ron", "n".repeat(246)));
    fs::write(&long, "Variant(base: \"lightgraph:graphs/gi/direct.ron\", about: \"another\")\n").unwrap();
    let (code, text) = export(&long.display().to_string(), &page_name, &out_name);
    assert!(code == Some(1) && text.contains("can't write"), "{text}");
    assert!(!out.exists());
}
