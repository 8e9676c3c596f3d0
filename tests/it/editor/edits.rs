//! Edits without end: half-typed and hostile texts never end the server, and leave nothing behind.

use super::client::{Client, place};
use super::{GRAPH, MODULE, SHOW, project, told};
use crate::support::{Random, Scratch};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Seconds of edits; `make editor` takes more.
fn seconds() -> u64 {
    std::env::var("LIGHTGRAPH_EDITS").ok().and_then(|s| s.parse().ok()).unwrap_or(4)
}

/// Pieces that hands and strangers type.
const PIECES: [&str; 24] = [
    "(", ")", "[", "]", "{", "}", "\"", ",", ":", "//", "/*", "*/", "#", "#import ", "::", "\\", "None", "gain", "é𝄞",
    "\n", "\r", "-", "0", "Texture(",
];

fn mutate(text: &str, random: &mut Random) -> (Value, String) {
    let edges: Vec<usize> = text.char_indices().map(|c| c.0).chain([text.len()]).collect();
    let from = random.below(edges.len());
    let to = (from + if random.below(2) == 0 { 0 } else { random.below(12) }).min(edges.len() - 1);
    let piece = if random.below(3) == 0 { "" } else { PIECES[random.below(PIECES.len())] };
    let (start, end) = (edges[from], edges[to]);
    let range = json!({"start": place(text, start), "end": place(text, end)});
    (json!([{"range": range, "text": piece}]), format!("{}{piece}{}", &text[..start], &text[end..]))
}

#[test]
fn mutated_edits_never_end_the_server() {
    let scratch = Scratch::new("editor-edits");
    project(scratch.path());
    let mut client = Client::start(Some(scratch.path()), Value::Null);
    let sound: Vec<(PathBuf, &str)> =
        [("graph.ron", GRAPH), ("shaders/lib/brighter.wgsl", MODULE), ("shaders/show.wgsl", SHOW)]
            .map(|(name, text)| (scratch.path().join(name), text))
            .into();
    for (path, text) in &sound {
        client.open(path, text);
    }
    let mut texts: Vec<String> = sound.iter().map(|s| s.1.into()).collect();
    let mut random = Random(37);
    let start = Instant::now();
    let (mut edits, mut before) = (0u64, None);
    while start.elapsed() < Duration::from_secs(seconds()) {
        let at = random.below(sound.len());
        let (path, text) = &sound[at];
        // Now and then a hand undoes it all, so that most texts are near to sound ones.
        if random.below(12) == 0 {
            texts[at] = (*text).into();
            client.replace(path, text);
        } else {
            let (change, after) = mutate(&texts[at], &mut random);
            client.edit(path, change);
            texts[at] = after;
        }
        edits += 1;
        if edits.is_multiple_of(8) {
            let byte = random.below(texts[at].len() + 1);
            let byte = (0..=byte).rev().find(|b| texts[at].is_char_boundary(*b)).unwrap_or(0);
            super::questions(&mut client, path, &texts[at], byte, &mut random);
        }
        if edits.is_multiple_of(50) {
            client.checked(path);
            let own = told(&client).into_iter().find(|f| f.4.contains("a fault of its own"));
            assert_eq!(own, None, "{:#?}", texts);
            // What is kept of texts is bounded; the first edits fill it.
            before = before.or(client.memory().filter(|_| start.elapsed() > Duration::from_secs(seconds() / 2)));
        }
    }
    for (path, text) in &sound {
        client.replace(path, text);
        client.checked(path);
    }
    client.until(|client| told(client).is_empty());
    println!("{edits} edits in {} s, {before:?} kB halfway, {:?} kB at the end", seconds(), client.memory());
    if let (Some(before), Some(after)) = (before, client.memory()) {
        assert!(after < before + before / 4 + 16_384, "{before} kB, then {after} kB");
    }
    client.stop();
}
