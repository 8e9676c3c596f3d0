//! `lightgraph bench --page`: the page of kept results without an adapter, and what a visitor finds on it.

use crate::browser::visited;
use crate::command::lightgraph;
use crate::support::{Scratch, repository};
use serde_json::{Value, json};
use std::fs;

/// What a visitor does, and writes down what is to be seen.
const VISITOR: &str = r#"<script type="module">
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
// The page unpacks its data first.
while (!document.querySelector("section")) await wait(20);
const seen = [], section = document.querySelector("section");
const tip = document.getElementById("tip");
const cells = (column) => [...section.querySelectorAll("tbody tr")].map((r) => r.children[column].textContent);
seen.push(`scenes: ${[...document.querySelectorAll("h2")].map((h) => h.textContent)}`);
seen.push(`points: ${section.querySelectorAll(".dot").length}, of the front: ${section.querySelectorAll(".dot.best").length}`);
seen.push(`front: ${[...section.querySelectorAll("text.name")].map((t) => t.textContent)}`);
seen.push(`peers: ${section.querySelectorAll(".curve").length} curve, ${[...section.querySelectorAll(".legend button")].at(-1).textContent}`);
seen.push(`absent: ${document.querySelector("header .note").textContent}`);
const first = section.querySelector(".dot[data-graph='other']");
first.dispatchEvent(new Event("focus"));
seen.push(`tip: ${tip.hidden} ${tip.textContent.split("\n").slice(0, 2).join(" | ")}`);
seen.push(`dim: ${section.querySelectorAll(".dot.dim").length}`);
first.dispatchEvent(new Event("blur"));
seen.push(`tip: ${tip.hidden}, dim: ${section.querySelectorAll(".dim").length}`);
const table = [...section.querySelectorAll("details")].find((d) => d.textContent.startsWith("All"));
table.open = true;
await wait(100);
seen.push(`by rmse: ${cells(4)}`);
const wall = [...section.querySelectorAll("th button")].find((b) => b.textContent === "wall ms");
wall.click();
seen.push(`by time: ${cells(2)}`);
wall.click();
seen.push(`and down: ${cells(2)}`);
[...section.querySelectorAll(".legend button")][0].click();
const again = document.querySelector("section");
seen.push(`hidden: ${again.querySelectorAll(".dot").length}, still open: ${again.querySelectorAll("tbody tr").length} rows`);
const out = document.createElement("pre");
out.id = "seen";
out.textContent = seen.join("\n");
document.body.append(out);
</script>
"#;

fn entry(graph: &str, peer: Option<&str>, setting: &str, ms: Option<f64>, rmse: f64) -> Value {
    let metrics = json!({
        "pixels": 4, "mean_test": 1.0, "mean_reference": 1.0, "rmse_percent": rmse, "bias_percent": -1.0, "relmse": 0.1,
        "block_rmse_percent": rmse / 2.0, "p95_error": 0.1, "max_error": 0.2,
    });
    let score = json!({
        "output": "color", "only_when": [], "origin": "closed form", "stderr_percent": 0.6, "metrics": metrics,
        "fine_percent": 0.1, "flip": 0.25,
    });
    let phase = if peer.is_some() { "whole" } else { "everything" };
    let time = |ms: f64| {
        json!({
            "phase": phase, "repeats": 1, "wall_ms": {"median": ms, "min": ms, "max": ms}, "gpu_ms": null, "steps_run": 1,
            "steps_skipped": 0, "iterations": {}, "passes": [], "change_percent": null,
        })
    };
    let fault = ms.is_none().then_some("left out: </script> takes 9 s");
    json!({
        "graph": graph, "peer": peer, "scene": "room", "camera": null, "size": [2, 2], "params": {"n": setting, "m": "7"},
        "setting": format!("n={setting}"), "inputs": "", "bytes": 1 << 20, "bytes_without_sharing": 0, "start_up_ms": {},
        "phases": ms.map(time).into_iter().collect::<Vec<_>>(), "scores": if ms.is_some() { json!([score]) } else { json!([]) },
        "leak": null, "picture": null, "fault": fault,
    })
}

fn results() -> Value {
    json!({
        "version": "0.0.1", "commit": "of another day", "repeat": 1, "size": [2, 2], "main_output": "color", "published": [],
        "machine": {
            "adapter": "A", "driver": "D", "backend": "B", "software": true, "cpu": "C", "cores": 2, "os": "linux",
        },
        "entries": [
            entry("own", None, "1", Some(10.0), 40.0), entry("own", None, "2", Some(100.0), 20.0),
            entry("own", None, "4", None, 0.0), entry("slow", None, "2", Some(1234.5), 10.0),
            entry("other", Some("1.2.3"), "4", Some(200.0), 50.0), entry("other", Some("1.2.3"), "64", Some(2000.0), 5.0),
        ],
        "absent": [{"name": "far", "why": "it is <not> installed"}],
    })
}

#[test]
fn bench_renders_kept_results_of_any_commit_without_an_adapter() {
    let scratch = Scratch::new("bench-page");
    let at = |file: &str| scratch.path().join(file).display().to_string();
    fs::write(at("kept.json"), results().to_string()).unwrap();
    let run = |words: &[&str]| {
        let done = lightgraph(&[&["bench"], words].concat(), false);
        let text = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
        (done.status.code().unwrap(), text)
    };
    let (code, text) = run(&["--page", &at("kept.json"), "--out", &at("new/folder")]);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("report.html") && text.contains("far is absent: it is <not> installed"), "{text}");

    let page = fs::read_to_string(at("new/folder/report.html")).unwrap();
    fs::write(at("page.html"), page + VISITOR).unwrap();
    let document = visited(&scratch.path().join("page.html"), &scratch.path().join("browser"));
    let seen = document.split("<pre id=\"seen\">").nth(1).and_then(|t| t.split("</pre>").next());
    let seen = seen.unwrap_or_else(|| panic!("the visitor did not get to the end:\n{document}"));
    let expected = "scenes: room
points: 5, of the front: 3
front: own,slow
peers: 1 curve, other 1.2.3
absent: far is absent: it is &lt;not&gt; installed
tip: false other 1.2.3, n=4 | 200 ms wall (200 to 200 in 1)
dim: 3
tip: true, dim: 0
by rmse: ≈ 5.00,10.0,20.0,40.0,50.0,–
by time: 10.0,100,200,1235,2000,–
and down: 2000,1235,200,100,10.0,–
hidden: 3, still open: 6 rows";
    assert_eq!(seen, expected);

    let (code, text) = run(&["--page", &at("kept.json"), "--against", &at("kept.json"), "--out", &at("new")]);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("errors: 3 of 3 rows are equal to the last digit"), "{text}");
    assert!(text.contains("times: of 3 pairs of settings more than 20 % apart, 3 (100.00 %) are"), "{text}");
}

#[test]
fn bench_says_what_is_wrong_with_kept_results() {
    let scratch = Scratch::new("bench-page-faults");
    let at = |file: &str| scratch.path().join(file).display().to_string();
    let said = |words: &[&str], code: i32, part: &str| {
        let done = lightgraph(&[&["bench"], words, &["--out", &at("out")]].concat(), false);
        let text = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(code), "{text}");
        assert!(text.contains(part), "{part}: {text}");
        assert!(!scratch.path().join("out").exists());
    };
    said(&["--page", &at("none.json")], 1, "can't read");
    fs::write(at("other.json"), "{\"rows\": []}").unwrap();
    said(&["--page", &at("other.json")], 1, "holds no results");
    fs::write(at("cut.gz"), [0x1f, 0x8b, 8, 0]).unwrap();
    said(&["--page", &at("cut.gz")], 1, "can't read");
    said(&["--page", &at("other.json"), "--resume"], 2, "cannot be used with");
}

/// Those that the repository shows are of another commit.
#[test]
fn bench_renders_the_results_in_docs_anew() {
    let scratch = Scratch::new("bench-page-docs");
    let kept = repository("docs/results/llvmpipe/results.json.gz").display().to_string();
    let done = lightgraph(&["bench", "--page", &kept, "--out", &scratch.path().display().to_string()], false);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let size = fs::metadata(scratch.path().join("report.html")).unwrap().len();
    assert!(size < 400_000, "{size} bytes");
}
