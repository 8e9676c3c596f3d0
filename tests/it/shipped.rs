//! Every file in `graphs`, `shaders` and `scenes` is found here, so that none can rot unseen.

use crate::command::lightgraph;
use crate::support::{files, plan_of_choices, plan_without_device, repository};
use lightgraph::internals::diag::{Severity, render};
use lightgraph::internals::plan::fastest::{FIRST, each};
use lightgraph::internals::plan::request::all_sample_facts;
use lightgraph::internals::scene;
use lightgraph::internals::shader::{BindingKind, Library};
use lightgraph::internals::value::{Value, Values};
use lightgraph::{Plan, Project, Scene};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Those of global illumination, then sub-graphs. What one has composed the next need not.
fn graphs() -> Vec<(PathBuf, Project)> {
    let folders = ["graphs/gi", "graphs/post", "graphs/play", "graphs/lists"];
    let mut opened: Vec<(PathBuf, Project)> = folders.into_iter().flat_map(in_folder).collect();
    for i in 1..opened.len() {
        opened[i].1.texts = opened[i].1.texts.clone().after(&opened[i - 1].1.texts);
    }
    opened
}

fn in_folder(folder: &str) -> Vec<(PathBuf, Project)> {
    let open = |path: PathBuf| {
        let project = Project::open(&path, &[]).unwrap_or_else(|faults| panic!("{faults}"));
        (path, project)
    };
    files(folder, &["ron"]).into_iter().map(open).collect()
}

fn plan(path: &Path, project: &Project, outputs: Option<&[String]>, full: bool) -> Plan {
    let planned = plan_without_device(project, &Values::new(), outputs, full);
    let planned = planned.unwrap_or_else(|f| panic!("{} with full facts: {full}\n{f}", path.display()));
    let warnings = planned.notices.iter().filter(|d| d.severity != Severity::Note).cloned().collect::<Vec<_>>();
    assert!(warnings.is_empty(), "{}", render(&warnings));
    planned.plan
}

#[test]
fn every_graph_plans_whatever_the_scene_has() {
    for (path, project) in graphs() {
        for full in [true, false] {
            let whole = plan(&path, &project, None, full);
            assert_eq!(whole.outputs.len(), project.graph.outputs.len(), "{}", path.display());
            for (name, _) in &project.graph.outputs {
                let one = plan(&path, &project, Some(std::slice::from_ref(&name.value)), full);
                assert_eq!(one.outputs.len(), 1);
                assert!(one.steps.len() <= whole.steps.len(), "{}: `{}` alone needs more", path.display(), name.value);
            }
        }
    }
}

#[test]
fn every_ron_file_is_laid_out_as_fmt_does() {
    let folders =
        ["graphs", "scenes", "template", "tests/graphs", "tests/variants"].map(|f| repository(f).display().to_string());
    let args: Vec<&str> = ["fmt", "--check"].into_iter().chain(folders.iter().map(String::as_str)).collect();
    let out = lightgraph(&args, false);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stdout));
}

#[test]
fn every_graph_says_what_it_and_its_parameters_are() {
    for (path, project) in graphs() {
        assert!(!project.graph.about.is_empty(), "{}: `about` is missing", path.display());
        for (name, param) in &project.graph.params {
            assert!(!param.about.is_empty(), "{}: `{}` has no `about`", path.display(), name.value);
        }
        let outputs: Vec<&str> = project.graph.outputs.iter().map(|o| o.0.value.as_str()).collect();
        let image = !path.starts_with(repository("graphs/lists"));
        assert!(!image || outputs.contains(&"color"), "{} has {outputs:?}, not `color`", path.display());
    }
}

/// The defaults; then each switch turned, and each number at 0 that may be, by itself.
fn settings(project: &Project) -> Vec<Values> {
    let other = project.graph.params.iter().filter_map(|(name, param)| {
        let value = match param.default {
            Value::Bool(on) => Value::Bool(!on),
            Value::Uint(_) => Value::Uint(0),
            _ => return None,
        };
        param.accepts(&value).ok().map(|()| Values::from([(name.value.clone(), value)]))
    });
    std::iter::once(Values::new()).chain(other).collect()
}

#[test]
fn every_shader_is_used_by_a_graph_and_composes() {
    let mut used = BTreeSet::new();
    for (path, project) in graphs() {
        for params in settings(&project) {
            let facts = all_sample_facts();
            for (facts, choices) in
                facts.iter().flat_map(|f| each(&project.graph, &FIRST).into_iter().map(move |c| (f, c)))
            {
                let planned = plan_of_choices(&project, &params, &choices, facts);
                let planned = planned.unwrap_or_else(|f| panic!("{} with {params:?}\n{f}", path.display()));
                used.extend(planned.plan.shaders.iter().flat_map(|s| s.sources.iter().cloned()));
            }
        }
    }
    let all = Library::load(&[repository("shaders")]).unwrap();
    // What every project has is no file of the repository.
    let shipped = all.files.keys().filter(|f| !f.starts_with("lightgraph/"));
    let unused: Vec<&String> = shipped.filter(|f| !used.contains(*f)).collect();
    assert!(unused.is_empty(), "no graph uses {unused:?}");
}

/// A stage of any shader has room for what it binds on every WebGPU device.
#[test]
fn no_shader_binds_more_than_every_device_has_room_for() {
    let limits = wgpu::Limits::default();
    type Kinds = fn(&BindingKind) -> bool;
    let most: [(&str, Kinds, u32); 5] = [
        (
            "uniform buffers",
            |k| matches!(k, BindingKind::Uniform(_) | BindingKind::UniformArray { .. }),
            limits.max_uniform_buffers_per_shader_stage,
        ),
        ("storage buffers", |k| matches!(k, BindingKind::Storage { .. }), limits.max_storage_buffers_per_shader_stage),
        (
            "sampled textures",
            |k| matches!(k, BindingKind::Texture { .. }),
            limits.max_sampled_textures_per_shader_stage,
        ),
        (
            "storage textures",
            |k| matches!(k, BindingKind::StorageTexture { .. }),
            limits.max_storage_textures_per_shader_stage,
        ),
        ("samplers", |k| matches!(k, BindingKind::Sampler { .. }), limits.max_samplers_per_shader_stage),
    ];
    for (path, project) in graphs() {
        let facts = all_sample_facts();
        for (facts, choices) in facts.iter().flat_map(|f| each(&project.graph, &FIRST).into_iter().map(move |c| (f, c)))
        {
            let planned = plan_of_choices(&project, &Values::new(), &choices, facts);
            let planned = planned.unwrap_or_else(|f| panic!("{}\n{f}", path.display()));
            for shader in &planned.plan.shaders {
                for (what, is, most) in &most {
                    let bound: Vec<&str> =
                        shader.interface.variables.iter().filter(|v| is(&v.kind)).map(|v| v.name.as_str()).collect();
                    let shown = (path.display(), &shader.path);
                    assert!(bound.len() <= *most as usize, "{}, {}: {what} {bound:?}, of {most}", shown.0, shown.1);
                }
            }
        }
    }
}

#[test]
fn every_graph_has_its_place_in_the_gallery() {
    let read = |path: &str| std::fs::read_to_string(repository(path)).unwrap_or_else(|e| panic!("{path}: {e}"));
    let [pages, list] = ["docs/gallery.md", "docs/gallery.ron"].map(read);
    for (path, _) in in_folder("graphs/gi").into_iter().filter(|(_, project)| project.graph.inputs.is_empty()) {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        assert!(pages.contains(&format!("\n## {name}\n")), "docs/gallery.md has no section `{name}`");
        assert!(list.contains(&format!("graph: \"{name}\"")), "docs/gallery.ron doesn't measure `{name}`");
    }
}

#[test]
fn links_of_documents_lead_to_files() {
    let mut documents = files("docs", &["md"]);
    documents.extend(["README.md", "CHANGELOG.md", "scenes/README.md", "tests/references/README.md"].map(repository));
    documents.push(repository("docs/results/README.md"));
    let mut links = 0;
    for path in &documents {
        let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        for link in text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| link) {
            let file = link.split('#').next().unwrap_or_default();
            if !file.is_empty() && !file.contains("://") {
                links += 1;
                assert!(path.parent().is_some_and(|f| f.join(file).exists()), "{}: {link}", path.display());
            }
        }
    }
    assert!(links > 100, "{links} links");
}

#[test]
fn every_page_stands_once_in_the_book() {
    let docs = repository("docs");
    let mut pages: Vec<String> = files("docs", &["md"])
        .iter()
        .map(|p| p.strip_prefix(&docs).unwrap_or(p).display().to_string())
        .filter(|p| p != "SUMMARY.md")
        .collect();
    pages.push("results/README.md".into());
    let summary = std::fs::read_to_string(docs.join("SUMMARY.md")).unwrap();
    let links = summary.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    let mut listed: Vec<&str> = links.map(|(link, _)| link).collect();
    pages.sort();
    listed.sort_unstable();
    assert_eq!(listed, pages, "docs/SUMMARY.md lists every page of docs/");
}

#[test]
fn every_scene_loads_and_holds_together() {
    for path in files("scenes", &["gltf", "glb", "ron"]) {
        let shown = path.display();
        let loaded = Scene::load(&path).unwrap_or_else(|faults| panic!("{shown}\n{faults}"));
        let warnings: Vec<_> = loaded.notices.iter().filter(|d| d.severity == Severity::Warning).cloned().collect();
        assert!(warnings.is_empty(), "{shown}\n{}", render(&warnings));
        let scene = &loaded.scene;
        // One has neither camera nor light, on purpose: the latter is made up.
        assert!(!scene.cameras.is_empty() || path.ends_with("yard.glb"), "{shown} has no camera");
        let pose = scene.pose(0.0);
        let (values, _) = scene.camera_values(&pose, None, 64, 64).unwrap_or_else(|f| panic!("{shown}\n{f}"));
        assert!(!values.is_empty());
        let facts = scene.facts();
        for (name, _) in scene::FACTS {
            assert!(facts.contains_key(*name), "{shown} lacks the fact `{name}`");
        }
        let emits = scene.materials.iter().any(scene::Material::emits);
        let lit = !scene.lights.is_empty() || scene.environment.is_some() || emits;
        assert!(lit, "{shown} is dark");
    }
}

/// The library's rooms, each of which knows those before it alone.
const ROOMS: [&str; 7] = ["image", "scene", "shader", "graph", "plan", "gpu", "session"];

#[test]
fn no_room_of_the_library_knows_a_later_one() {
    let mut faults = vec![];
    for (i, room) in ROOMS.iter().enumerate() {
        let tests = |path: &PathBuf| path.components().any(|c| c.as_os_str().to_string_lossy().starts_with("tests"));
        for path in walk(&repository("src").join(room)).into_iter().filter(|path| !tests(path)) {
            let text = std::fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            let code = code.lines().filter(|line| !line.trim_start().starts_with("//"));
            for (later, line) in code.flat_map(|line| ROOMS[i + 1..].iter().map(move |later| (later, line))) {
                if line.contains(&format!("crate::{later}::")) || line.contains(&format!("crate::{{{later}")) {
                    faults.push(format!("{}: {}", path.display(), line.trim()));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The type that a line declares for its module: what is indented, an `impl` declares.
fn declared_type(line: &str) -> Option<&str> {
    let mut words = Some(line)
        .filter(|line| !line.starts_with(' '))?
        .split([' ', '(', '<', '{', ';', '=', ':'])
        .filter(|word| !word.is_empty())
        .peekable();
    if words.next_if_eq(&"pub").is_some() {
        while words.next_if(|word| matches!(word.trim_end_matches(')'), "super" | "crate" | "in")).is_some() {}
    }
    words.next_if(|word| ["struct", "enum", "trait", "type", "union"].contains(word))?;
    words.next().filter(|name| name.starts_with(char::is_uppercase))
}

#[test]
fn no_two_types_share_a_name() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let tests = |path: &PathBuf| path.components().any(|c| c.as_os_str().to_string_lossy().starts_with("tests"));
    let files = ["src", "crates", "examples"].into_iter().flat_map(|folder| walk(&repository(folder)));
    for path in files.filter(|path| !tests(path)) {
        let text = std::fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        for name in code.lines().filter_map(declared_type) {
            places.entry(name.into()).or_default().push(path.display().to_string());
        }
    }
    assert!(places.len() > 500, "only {} types were found", places.len());
    let twice: Vec<_> = places.iter().filter(|(_, paths)| paths.len() > 1).collect();
    assert!(twice.is_empty(), "{twice:#?}");
}

/// All Rust files below a folder.
fn walk(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let found = entries.flat_map(|path| match path.is_dir() {
        true => walk(&path),
        false => vec![path],
    });
    found.filter(|path| path.extension().is_some_and(|e| e == "rs")).collect()
}
