//! `lightgraph test`: graph snapshot tests.

use super::{Failure, notices, print};
use crate::shard::Shard;
use crate::snapshot::{self, Bless, TestOptions, TestState, junit, report};
use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Diagnostic, Faults};
use std::path::PathBuf;

/// Runs graph snapshot tests: each says what a graph renders and what must hold.
#[derive(Debug, Clone, clap::Args)]
pub struct TestArgs {
    /// Test files, or folders of them
    #[arg(value_name = "PATH", default_value = "tests/graphs")]
    pub paths: Vec<PathBuf>,
    /// Write the references of failed tests anew, or of this test only (`--bless=NAME`)
    #[arg(long, value_name = "NAME", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    pub bless: Option<String>,
    /// Run only tests whose names hold this
    #[arg(long, value_name = "TEXT")]
    pub filter: Option<String>,
    /// Run one part of several, such as 2/8
    #[arg(long, value_name = "K/N")]
    pub shard: Option<Shard>,
    /// Run this many tests at a time, each with a device of its own
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: u16,
    /// End each test at its first check that does not hold
    #[arg(long)]
    pub fail_fast: bool,
    /// Where failed tests leave images and texts
    #[arg(long, value_name = "DIR", default_value = "out/test")]
    pub failures: PathBuf,
    /// Write a page of all results, with the images of those that failed
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Write the results as JUnit XML
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Also fail tests whose steps leave NaN, infinite numbers, or those outside of the ranges that graphs state
    #[arg(long)]
    pub watch_numerics: bool,
}

/// Runs, prints a line a test and the counts, writes reports.
///
/// # Errors
/// No test is selected; no adapter, where nothing else failed; files that can't be read or written.
pub fn run(args: &TestArgs) -> Result<u8, Failure> {
    let tests = selection(args)?;
    let bless = match args.bless.as_deref() {
        None => Bless::None,
        Some("") => Bless::All,
        Some(name) => Bless::Named(name.into()),
    };
    let options = TestOptions {
        bless,
        failures: args.failures.clone(),
        jobs: args.jobs.into(),
        fail_fast: args.fail_fast,
        watch: args.watch_numerics,
    };
    let summary = snapshot::run(&tests, &options, &mut |outcome| print(&outcome.to_string()));
    if let Some(adapter) = &summary.adapter {
        print(&format!("on {adapter}\n"));
    }
    if let Some(folder) = &args.report {
        let path = folder.join("index.html");
        write_atomically(&path, report::html(&summary)?.as_bytes())?;
        print(&format!("wrote {}\n", path.display()));
    }
    if let Some(path) = &args.junit {
        write_atomically(path, junit::xml(&summary).as_bytes())?;
        print(&format!("wrote {}\n", path.display()));
    }
    let counts = summary.to_string();
    print(&format!("{}\n", counts.lines().last().unwrap_or_default()));
    match summary.no_adapter {
        Some(d) if summary.outcomes.iter().all(|o| o.state() != TestState::Failed) => Err(Failure::NoAdapter(d)),
        Some(d) => {
            notices(&[d]);
            Ok(1)
        }
        None => Ok(u8::from(!summary.passed())),
    }
}

/// The tests that are meant.
fn selection(args: &TestArgs) -> Result<Vec<(String, PathBuf)>, Failure> {
    let all = snapshot::find(&args.paths)?;
    let names: Vec<String> = all.iter().map(|t| t.0.clone()).collect();
    let empty = |what: String, name: &str| {
        let d = Diagnostic::error(what).nearest(name, names.iter().map(String::as_str));
        Faults::from(d.help(format!("tests: {}", names.join(", "))))
    };
    if let Some(name) = args.bless.as_deref().filter(|n| !n.is_empty() && !names.iter().any(|x| x == n)) {
        return Err(empty(format!("there is no test `{name}` to bless"), name).into());
    }
    let mut tests = all;
    if let Some(text) = &args.filter {
        tests.retain(|(name, _)| name.contains(text.as_str()));
        if tests.is_empty() {
            return Err(empty(format!("no test's name holds `{text}`"), text).into());
        }
    }
    if let Some(shard) = args.shard {
        let count = tests.len();
        tests = tests.into_iter().enumerate().filter(|(i, _)| shard.has(*i)).map(|(_, test)| test).collect();
        if tests.is_empty() {
            let what = format!("shard {shard} is empty: there are {count} tests");
            return Err(empty(what, "").into());
        }
    }
    Ok(tests)
}
