//! `lightgraph bench --speed`: how fast, as ratios in one run.

use super::bench::{BenchArgs, commit};
use super::{Failure, print};
use crate::bench::host::Machine;
use crate::bench::speed::{Bench, SpeedList, SpeedRows, rows};
use lightgraph::Gpu;
use std::path::Path;

/// Measures what a list asks for, says each figure as it comes, and writes all of them.
///
/// # Errors
/// A list, graph or scene that can't be read; no adapter. A figure that misses what it is held to is no fault: machines
/// differ.
pub fn run(args: &BenchArgs, list: &Path) -> Result<u8, Failure> {
    let list = SpeedList::read(list)?;
    let gpu = Gpu::open()?;
    if gpu.is_software() {
        print(&format!("{}: a software driver; no time here is a GPU's\n", gpu.info.name));
    }
    let bench = Bench {
        gpu: &gpu,
        root: Path::new(""),
        shaders: &args.shaders.folders,
        references: &args.references,
        repeat: args.repeat,
        fastest: args.fastest,
    };
    let found = bench.run(&list, &mut |row| print(&rows::line(row)))?;
    let all = SpeedRows {
        version: env!("CARGO_PKG_VERSION").into(),
        commit: commit(),
        machine: Machine::of(&gpu),
        rows: found,
    };
    all.write(&args.out)?;
    print(&format!("wrote {}\n", args.out.join("speed.html").display()));
    Ok(0)
}
