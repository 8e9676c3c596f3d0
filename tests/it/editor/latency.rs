//! How long an editor waits: from a keystroke to the faults, and for what may stand at the cursor.

use super::client::{Client, place, uri};
use crate::support::Scratch;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Keystrokes of which the median is taken.
const STROKES: usize = 21;

/// Writes a chain of passes, which take turns among some shaders that all import one module.
fn chain(folder: &Path, passes: usize, shaders: usize) -> (PathBuf, String) {
    std::fs::create_dir_all(folder.join("shaders/lib")).unwrap();
    std::fs::write(folder.join("shaders/lib/mix.wgsl"), MODULE).unwrap();
    for i in 0..shaders {
        let text = format!(
            "#import mixed::mixed\nvar input: texture_2d<f32>;\n@fragment fn main(@builtin(position) at: vec4f) -> @location(0) vec4f {{\n    \
             return mixed(textureLoad(input, vec2u(at.xy), 0)) + {i}.0;\n}}\n"
        );
        std::fs::write(folder.join(format!("shaders/s{i}.wgsl")), text).unwrap();
    }
    let mut text = String::from(
        "Graph(\n    about: \"A long chain\",\n    params: {\"amount\": Float(default: 0.5, about: \"of each\")},\n    resources: {\n",
    );
    for i in 0..passes {
        // Writing to a string can't fail.
        let _ = writeln!(text, "        \"r{i}\": Texture(format: Rgba16Float, size: \"screen / {}\"),", 1 + i % 2);
    }
    text += "    },\n    passes: [\n        Clear(name: \"p0\", target: \"r0\", value: (1, 0, 0, 1)),\n";
    for i in 1..passes {
        let _ = writeln!(
            text,
            "        Screen(name: \"p{i}\", shader: \"s{}.wgsl\", color: \"r{i}\", bind: {{\"input\": \"r{}\"}}, when: \"amount > 0\"),",
            i % shaders,
            i - 1
        );
    }
    let _ = write!(text, "    ],\n    outputs: {{\"color\": \"r{}\"}},\n)\n", passes - 1);
    let graph = folder.join("long.ron");
    std::fs::write(&graph, &text).unwrap();
    (graph, text)
}

const MODULE: &str =
    "#define_import_path mixed\nvar<uniform> amount: f32;\nfn mixed(c: vec4f) -> vec4f {\n    return c * amount;\n}\n";

/// The median time from a keystroke to its faults. No two leave the same text, and all leave a sound one.
fn median(client: &mut Client, path: &Path, text: &str, behind: &str, first: &str) -> Duration {
    let mut end = text.find(behind).unwrap() + behind.len();
    let mut now = text.to_string();
    let mut times = vec![];
    for i in 0..STROKES {
        let typed = if i == 0 { first } else { "1" };
        let at = place(&now, end);
        let begun = Instant::now();
        client.edit(path, json!([{"range": {"start": at, "end": at}, "text": typed}]));
        client.checked(path);
        times.push(begun.elapsed());
        assert_eq!(client.told[path], json!([]), "{now}");
        now.insert_str(end, typed);
        end += typed.len();
    }
    client.replace(path, text);
    client.checked(path);
    times.sort();
    times[STROKES / 2]
}

fn completion(client: &mut Client, path: &Path, text: &str, word: &str) -> Duration {
    let params = json!({"textDocument": {"uri": uri(path)}, "position": place(text, text.find(word).unwrap() + 1)});
    let mut times = vec![];
    for _ in 0..STROKES {
        client.edit(path, json!([{"range": {"start": place(text, 0), "end": place(text, 0)}, "text": ""}]));
        let begun = Instant::now();
        client.request("textDocument/completion", params.clone());
        times.push(begun.elapsed());
        client.checked(path);
    }
    times.sort();
    times[STROKES / 2]
}

#[test]
fn faults_and_proposals_come_while_a_hand_types() {
    let scratch = Scratch::new("editor-latency");
    // Without optimisation only what is out of all proportion shows.
    let slower = if cfg!(debug_assertions) { 20 } else { 1 };
    let hold = |what: &str, took: Duration, most: u64| {
        println!("{what}: {:.1} ms (median of {STROKES})", took.as_secs_f64() * 1e3);
        assert!(took <= Duration::from_millis(most * slower), "{what}: {took:?}");
    };
    for (passes, shaders, most) in [(100, 20, 50), (1000, 8, 200)] {
        let folder = scratch.path().join(passes.to_string());
        let (graph, text) = chain(&folder, passes, shaders);
        let mut client = Client::start(Some(&folder), Value::Null);
        client.open(&graph, &text);
        client.checked(&graph);
        hold(
            &format!("faults of a graph of {passes} passes"),
            median(&mut client, &graph, &text, "A long chain", " "),
            most,
        );
        hold(
            &format!("proposals in a graph of {passes} passes"),
            completion(&mut client, &graph, &text, "\"amount > 0"),
            20,
        );
        if shaders == 20 {
            let module = folder.join("shaders/lib/mix.wgsl");
            client.open(&module, MODULE);
            client.checked(&module);
            hold(
                "faults of a module that 20 shaders import",
                median(&mut client, &module, MODULE, "c * amount", " * 1.5"),
                50,
            );
            hold("proposals in that module", completion(&mut client, &module, MODULE, "c * amount"), 20);
        }
        client.stop();
    }
}
