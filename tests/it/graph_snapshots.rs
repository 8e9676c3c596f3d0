//! Every file of `tests/graphs`: plans, images, steps and relations between runs of the shipped graphs.

use crate::device;
use crate::support::{files, repository};
use lightgraph_cli::snapshot::{TestOptions, run_dir};
use std::path::Path;

#[test]
fn graph_snapshots_hold() {
    // One test at a time on the device; this one opens its own, as the command does.
    let _alone = device::gpu();
    let failures = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphs");
    let options = TestOptions { failures, ..TestOptions::default() };
    let summary = run_dir(&repository("tests/graphs"), &options).unwrap_or_else(|f| panic!("{f}"));
    assert!(summary.passed(), "{summary}");
}

/// A test's plan is that of the graph it ends with: a test that swaps says nothing of the one it begins with.
#[test]
fn every_graph_has_a_plan_snapshot() {
    let tests = files("tests/graphs", &["ron"]);
    let tests: Vec<String> = tests.iter().map(|p| std::fs::read_to_string(p).unwrap_or_default()).collect();
    for graph in files("graphs/gi", &["ron"]) {
        let name = graph.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let begins = format!("    graph: \"../../graphs/gi/{name}\"");
        let of = |t: &&String| t.contains(&begins) && !t.contains("Swap(") && t.contains("Plan()");
        assert!(tests.iter().any(|t| of(&t)), "no test of tests/graphs holds the plan of {name}");
    }
}
