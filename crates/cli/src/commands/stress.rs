//! `lightgraph stress`: numerical stability.

use super::{Failure, ShaderFolders, print};
use crate::paths::{is_whole, ron_files};
use crate::stress::{self, Cases, RowState, StressGraph, StressOptions};
use lightgraph::{Checked, Diagnostic, Faults, Gpu};
use std::path::PathBuf;

/// Runs every graph through cases whose answers are known, random parameters, a long flight and other adapters.
#[derive(Debug, Clone, clap::Args)]
pub struct StressArgs {
    /// Graph files, or folders that hold some, separated by commas
    #[arg(long, value_name = "FILES", value_delimiter = ',', default_value = "graphs/gi")]
    pub graphs: Vec<PathBuf>,
    /// The time to spend; without it, all cases and random parameters once
    #[arg(long, value_name = "N", value_parser = seconds)]
    pub seconds: Option<f64>,
    /// The seed of everything random: the same one draws the same
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// Only the cases that matter most
    #[arg(long)]
    pub quick: bool,
    /// Only cases whose names hold this; `random`, `flight` and `adapters` are names too
    #[arg(long, value_name = "TEXT")]
    pub filter: Option<String>,
    /// The file of cases
    #[arg(long, value_name = "FILE", default_value = "tests/stress/cases.ron")]
    pub cases: PathBuf,
    /// Where results.json and report.html go
    #[arg(long, value_name = "DIR", default_value = "out/stress")]
    pub out: PathBuf,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// Runs, prints failures as they come and the table, writes the report.
///
/// # Errors
/// Faults of the cases and graphs; no adapter; files that can't be written.
pub fn run(args: &StressArgs) -> Result<u8, Failure> {
    let cases = Cases::read(&args.cases)?;
    let graphs = graphs(args)?;
    let program = std::env::current_exe()
        .map_err(|e| Faults::from(Diagnostic::error(format!("can't find the program's own file: {e}"))))?;
    let gpu = Gpu::open()?;
    let options = StressOptions {
        seconds: args.seconds,
        seed: args.seed,
        quick: args.quick,
        filter: args.filter.clone(),
        cases: args.cases.clone(),
        folder: args.out.clone(),
        program,
        shaders: args.shaders.folders.clone(),
    };
    let report = stress::run(&gpu, &cases, &graphs, &options, &mut |row| {
        if row.state == RowState::Failed {
            let number = |x: Option<f64>| x.map_or("-".to_string(), |x| format!("{x:e}"));
            print(&format!(
                "FAIL {}, {} {}: error {} over {}: {}\n",
                row.case,
                row.graph,
                row.setting,
                number(row.error),
                number(row.bound),
                row.notice
            ));
        }
    })?;
    report.write(&args.out)?;
    print(&report.table());
    print(&format!("wrote {}\n", args.out.join("report.html").display()));
    Ok(u8::from(report.count(RowState::Failed) > 0))
}

/// The graphs that are meant, all of them or none.
fn graphs(args: &StressArgs) -> Checked<Vec<StressGraph>> {
    let paths = ron_files(&args.graphs)?;
    let mut faults = vec![];
    let mut graphs = vec![];
    for path in &paths {
        match StressGraph::open(path, &args.shaders.folders) {
            Ok(graph) if is_whole(&args.graphs, path, &graph.project.graph) => graphs.push(graph),
            Ok(_) => {}
            Err(f) => faults.extend(f.0),
        }
    }
    Faults::check(faults, graphs)
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite()).ok_or_else(|| "it isn't a positive number".into())
}
