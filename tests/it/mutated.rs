//! Damaged graphs, shaders and scenes: each is read, or gives faults with places. Nothing panics, nothing hangs.

use crate::support::{Random, Scratch, files, plan_without_device, repository};
use lightgraph::internals::diag::{Severity, Source, render};
use lightgraph::internals::graph;
use lightgraph::internals::shader::{Defs, Library, compose};
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Faults, Project, Scene};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

/// Words, numbers and single marks, with the spaces between them; together they are the text.
fn tokens(text: &str) -> Vec<&str> {
    let mut tokens = vec![];
    let mut start = 0;
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let mut last = None;
    for (at, c) in text.char_indices() {
        if at > start && !(word(c) && last.is_some_and(word)) {
            tokens.push(&text[start..at]);
            start = at;
        }
        last = Some(c);
    }
    tokens.push(&text[start..]);
    tokens
}

/// What a slip of the hand does, or worse: one to three tokens or bytes lost, doubled, swapped or replaced.
fn damage(text: &str, random: &mut Random) -> String {
    const STRANGERS: [&str; 16] =
        ["0", "-1", "4294967296", "1e999", "NaN", "\"", "(", ")", "[", "{", "//", "/*", "\\", "é", "true", "screen"];
    let mut tokens: Vec<String> = tokens(text).into_iter().map(String::from).collect();
    for _ in 0..=random.below(3) {
        let (a, b) = (random.below(tokens.len()), random.below(tokens.len()));
        match random.below(6) {
            0 => drop(tokens.remove(a)),
            1 => tokens.insert(a, tokens[b].clone()),
            2 => tokens.swap(a, b),
            3 => tokens[a] = STRANGERS[random.below(STRANGERS.len())].into(),
            4 => tokens[a] = tokens[b].clone(),
            _ => {
                let at = random.below(tokens[a].chars().count());
                tokens[a] = tokens[a].chars().enumerate().filter(|(i, _)| *i != at).map(|(_, c)| c).collect();
            }
        }
        if tokens.is_empty() {
            break;
        }
    }
    tokens.concat()
}

/// Runs `work`, and says what it was given when it panics.
fn survives<T>(what: &str, work: impl FnOnce() -> T) -> T {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| panic!("a panic on\n{what}"))
}

/// Every error has a place in its text, and can be shown.
fn placed(what: &str, faults: &Faults) {
    assert!(faults.0.iter().any(|d| d.severity == Severity::Error), "no error among the faults of\n{what}");
    for d in &faults.0 {
        let Some((span, _)) = d.labels.first() else { panic!("no place: {}\n{what}", d.message) };
        assert!(span.start <= span.source.text.len() && span.start <= span.end, "{span:?}: {}\n{what}", d.message);
    }
    assert!(!survives(what, || render(&faults.0)).is_empty());
}

#[test]
fn damaged_graphs_give_faults_with_places() {
    let mut random = Random(1);
    let paths = files("graphs/gi", &["ron"]);
    for path in &paths {
        let path = path.clone();
        let project = Project::open(&path, &[]).unwrap_or_else(|f| panic!("{f}"));
        let text = std::fs::read_to_string(&path).unwrap();
        let mut plans = 60 / paths.len();
        for _ in 0..3000 / paths.len() {
            let damaged = damage(&text, &mut random);
            let what = format!("{}:\n{damaged}", path.display());
            let read = |p: &Path| -> Checked<Arc<Source>> {
                if p == path { Ok(Source::new(p.display().to_string(), damaged.as_str())) } else { Source::read(p) }
            };
            match survives(&what, || graph::load(&path, &read)) {
                Err(faults) => placed(&what, &faults),
                Ok(graph) if plans > 0 => {
                    plans -= 1;
                    let changed = Project { graph, texts: project.texts.clone() };
                    let result = survives(&what, || {
                        plan_without_device(&changed, &Values::new(), None, plans.is_multiple_of(2))
                    });
                    if let Err(faults) = result {
                        placed(&what, &faults);
                    }
                }
                Ok(_) => {}
            }
        }
    }
}

#[test]
fn graphs_cut_short_give_faults_with_places() {
    for path in files("graphs/gi", &["ron"]) {
        let text = std::fs::read_to_string(&path).unwrap();
        for cut in (0..text.trim_end().len()).step_by(13).filter(|i| text.is_char_boundary(*i)) {
            let what = &text[..cut];
            let read = |p: &Path| -> Checked<Arc<Source>> {
                if p == path { Ok(Source::new("cut.ron", what)) } else { Source::read(p) }
            };
            match survives(what, || graph::load(&path, &read)) {
                Err(faults) => placed(what, &faults),
                Ok(_) => panic!("a graph cut at byte {cut} is accepted"),
            }
        }
    }
}

#[test]
fn nested_and_endless_texts_give_faults() {
    let deep = |open: &str, n: usize| format!("Graph(passes: {}", open.repeat(n));
    let sum = format!("Graph(lets: {{\"a\": \"{}1\"}}, passes: [], outputs: {{}})", "1 + ".repeat(200_000));
    let path = "v.x".to_string() + &".x".repeat(200_000);
    let path = format!("Graph(lets: {{\"a\": \"{path}\"}}, passes: [], outputs: {{}})");
    let loops = format!("{}{}", deep("[Loop(name: \"a\", count: 1, passes: ", 200), "])".repeat(200));
    let texts = [deep("[", 100_000), deep("(", 100_000), deep("{\"a\": ", 100_000), sum, path, loops, String::new()];
    for text in texts {
        let what = text.get(..80).unwrap_or(&text).to_string();
        let read = |_: &Path| -> Checked<Arc<Source>> { Ok(Source::new("deep.ron", text.as_str())) };
        match survives(&what, || graph::load(Path::new("deep.ron"), &read)) {
            Err(faults) => placed(&what, &faults),
            Ok(_) => panic!("accepted: {what}"),
        }
    }
}

#[test]
fn damaged_shaders_give_faults_with_places() {
    let mut random = Random(2);
    let library = Library::load(&[repository("shaders")]).unwrap();
    for (path, source) in library.files.iter().filter(|(p, _)| !p.contains('/')) {
        for _ in 0..30 {
            let mut damaged = library.clone();
            let text = damage(&source.text, &mut random);
            let what = format!("{path}:\n{text}");
            damaged.files.insert(path.clone(), Source::new(path.as_str(), text));
            let defs = Defs::new();
            if let Err(faults) = survives(&what, || compose(&damaged, path, &defs, &[])) {
                placed(&what, &faults);
            }
        }
    }
}

#[test]
fn damaged_scenes_are_refused_or_read() {
    let scratch = Scratch::new("damaged-scenes");
    let mut random = Random(3);
    for path in files("scenes", &["gltf", "glb", "ron"]) {
        let bytes = std::fs::read(&path).unwrap();
        // The large ones are sampled, with the same steps through their heads.
        let step = 97.max(bytes.len() / 60 / 97 * 97);
        let name = path.file_name().unwrap();
        let copy = scratch.path().join(name);
        for neighbour in files("scenes", &["gltf", "glb", "ron"]).iter().filter(|p| p.file_stem() == path.file_stem()) {
            std::fs::copy(neighbour, scratch.path().join(neighbour.file_name().unwrap())).unwrap();
        }
        let check = |bytes: &[u8], what: &str| {
            let what = format!("{}: {what}", path.display());
            std::fs::write(&copy, bytes).unwrap();
            match survives(&what, || Scene::load(&copy)) {
                Err(faults) => {
                    assert!(faults.0.iter().any(|d| d.severity == Severity::Error), "{what}: no error");
                    assert!(!render(&faults.0).is_empty());
                    false
                }
                Ok(loaded) => {
                    let pose = loaded.scene.pose(0.5);
                    let tables = survives(&what, || loaded.scene.tables(&pose));
                    assert!(!tables.is_empty());
                    true
                }
            }
        };
        for cut in (0..bytes.len()).step_by(step) {
            let whole = check(&bytes[..cut], &format!("cut at byte {cut}"));
            let white = bytes[cut..].iter().all(u8::is_ascii_whitespace);
            assert!(!whole || white, "{}: cut at byte {cut}, it is accepted", path.display());
        }
        for _ in 0..60 {
            let mut flipped = bytes.clone();
            // Most flips go to the head: it holds the structure.
            let reach = if random.below(3) == 0 { flipped.len() } else { flipped.len().min(2000) };
            let at = random.below(reach);
            flipped[at] ^= 1 << random.below(8);
            check(&flipped, &format!("byte {at} flipped to {:#04x}", flipped[at]));
        }
        for entry in std::fs::read_dir(scratch.path()).unwrap() {
            std::fs::remove_file(entry.unwrap().path()).unwrap();
        }
    }
}
