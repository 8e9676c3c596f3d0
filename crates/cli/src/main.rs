//! The `lightgraph` command: parses, dispatches, exits.

use clap::Parser;
use lightgraph_cli::commands::{Cli, run};
use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(run(&Cli::parse()))
}
