//! A bench in parts: every job in one part, the parts joined equal to the whole.

use crate::command::lightgraph;
use crate::support::{Scratch, repository};
use lightgraph_cli::bench::results::{Entry, Results};
use lightgraph_cli::bench::score::Score;
use std::path::Path;
use std::process::Command;

/// Two scenes, the graph's own setting and two of a sweep, at a size for which there are no images to compare with.
const WORK: [&str; 11] = [
    "bench",
    "--scenes",
    "furnace,cornell_point",
    "--sweep",
    "bias=1,2",
    "--phases",
    "still",
    "--size",
    "16x16",
    "--repeat",
    "1",
];

fn run(words: &[&str], adapter: bool, code: i32) -> String {
    let done = lightgraph(words, adapter);
    let text = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(code), "{words:?}\n{text}");
    text
}

/// All but times, which no two runs share: what was measured, its errors, its fault.
fn errors(results: &Results) -> Vec<(String, &[Score], Option<&str>)> {
    let what = |e: &Entry| format!("{} {} {:?}", e.scene, e.graph, e.params);
    results.entries.iter().map(|e| (what(e), e.scores.as_slice(), e.fault.as_deref())).collect()
}

#[test]
fn parts_of_a_bench_are_joined_to_the_whole() {
    let scratch = Scratch::new("bench-shards");
    let at = |name: &str| scratch.path().join(name).display().to_string();
    // The same graph under two names: four jobs.
    let variant = "Variant(\n    base: \"lightgraph:graphs/gi/direct.ron\",\n    about: \"another\",\n)\n";
    std::fs::write(at("other.ron"), variant).unwrap();
    let graphs = format!("graphs/gi/direct.ron,{}", at("other.ron"));
    let work = [&WORK[..], &["--graphs", &graphs]].concat();
    let listed = run(&[&work[..], &["--jobs"]].concat(), false, 0);
    let jobs: Vec<&str> = listed.lines().filter(|l| l.contains("scenes/")).collect();
    assert_eq!(jobs.len(), 4, "{listed}");
    assert!(jobs[1].contains("furnace:inside  other  its defaults | bias=1 | bias=2"), "{listed}");
    assert!(listed.contains("shard 1/1: 4 of 4 jobs, 12 settings"), "{listed}");

    run(&[&work[..], &["--out", &at("whole")]].concat(), true, 0);
    let whole = Results::read(Path::new(&at("whole/results.json"))).unwrap();
    assert_eq!(whole.entries.len(), 12);
    assert!(whole.entries.iter().all(|e| e.fault.is_none()), "{:?}", errors(&whole));
    assert!(whole.entries.iter().any(|e| !e.scores.is_empty()), "the furnace is compared with its closed form");
    let host = whole.entries[0].host.as_ref().unwrap();
    assert_eq!(host.machine, whole.machine);

    // The script for Slurm does its work without Slurm, a task after the other.
    let script = run(&[&work[..], &["--slurm", "3", "--out", &at("parts")]].concat(), false, 0);
    std::fs::write(at("array.sh"), &script).unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_lightgraph")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let task = |number: &str| {
        let mut command = Command::new("bash");
        command.arg(at("array.sh")).env("SLURM_ARRAY_TASK_ID", number).env("PATH", &path).current_dir(repository(""));
        let done = command.output().unwrap();
        assert!(done.status.success(), "{script}\n{}", String::from_utf8_lossy(&done.stderr));
    };
    let parts = ["1", "2", "3"].map(|number| at(&format!("parts/shard-{number}")));
    let [one, two, three] = [&*parts[0], &*parts[1], &*parts[2]];
    let joined = at("parts");
    let merge =
        |folders: &[&str], code: i32| run(&[&["bench", "--out", &joined, "--merge"], folders].concat(), false, code);
    task("1");
    task("2");
    let text = merge(&[one, two], 1);
    assert!(text.contains("of 4 jobs are in none of the parts") && text.contains("`--shard` 3/3"), "{text}");
    assert!(!Path::new(&at("parts/results.json")).exists());
    task("3");
    let text = merge(&[three, one, two], 0);
    assert!(text.contains("joined 3 parts: 12 entries of 1 hosts"), "{text}");
    let together = Results::read(Path::new(&at("parts/results.json"))).unwrap();
    assert_eq!(errors(&together), errors(&whole), "each once, in the same order, equal to the last digit");
    assert_eq!(together.part, None);
    for entry in &together.entries {
        let picture = entry.picture.as_ref().unwrap();
        assert!(scratch.path().join("parts").join(picture).exists(), "{picture}");
    }
    assert!(Path::new(&at("parts/report.html")).exists());

    let text = merge(&[one, two, three, one], 1);
    assert!(text.contains("hold the same jobs"), "{text}");
    let text = merge(&[one, &at("whole")], 1);
    assert!(text.contains("holds no part of a bench"), "{text}");
    let text = run(&["bench", "--merge", one, "--out", one], false, 1);
    assert!(text.contains("is a part and the place of the whole"), "{text}");

    // A task that was cut off is gone on with: what it measured is not measured again.
    let part = Results::read(&Path::new(two).join("results.json")).unwrap();
    let lines: Vec<String> = part.entries.iter().map(|e| serde_json::to_string(e).unwrap()).collect();
    std::fs::write(Path::new(two).join("entries.jsonl"), format!("{}\n{}", lines[0], &lines[0][..40])).unwrap();
    std::fs::remove_file(Path::new(two).join("results.json")).unwrap();
    let text = merge(&parts.each_ref().map(String::as_str), 1);
    assert!(text.contains("a part that is not finished") && text.contains("--resume"), "{text}");
    task("2");
    let again = Results::read(&Path::new(two).join("results.json")).unwrap();
    assert_eq!((&again.entries[0], errors(&again)), (&part.entries[0], errors(&part)));
    merge(&parts.each_ref().map(String::as_str), 0);

    // A part of another bench.
    let other = at("other");
    run(&[&work[..], &["--shard", "2/3", "--seconds", "0", "--out", &other]].concat(), true, 0);
    let text = merge(&[one, &other], 1);
    assert!(text.contains("parts of different benches"), "{text}");
}

#[test]
fn a_wrong_part_is_refused() {
    for (words, said) in [
        (&["--shard", "4/3"][..], "the second of eight parts"),
        (&["--shard", "1/2", "--merge", "a"], "cannot be used with"),
        (&["--slurm", "0"], "0 is not in"),
    ] {
        let text = run(&[&["bench"], words].concat(), false, 2);
        assert!(text.contains(said), "{words:?}: {text}");
    }
    let text = run(&["bench", "--merge", "nowhere"], false, 1);
    assert!(text.contains("can't read nowhere/results.json"), "{text}");
}
