//! Every file of `tests/graphs`: plans, images, steps and relations between runs of the shipped graphs.

use crate::device;
use crate::support::repository;
use lightgraph::snapshot::{Bless, Options, run_dir};
use std::path::Path;

#[test]
fn graph_snapshots_hold() {
    // One test at a time on the device; this one opens its own, as the command does.
    let _alone = device::gpu();
    let failures = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphs");
    let options = Options { bless: Bless::None, failures };
    let summary = run_dir(&repository("tests/graphs"), &options).unwrap_or_else(|f| panic!("{f}"));
    assert!(summary.passed(), "{summary}");
}
