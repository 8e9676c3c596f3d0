//! `lightgraph bench --page`: what kept results say, measuring nothing; and how every bench ends.

use super::bench::BenchArgs;
use super::{Failure, print};
use crate::bench::against::against;
use crate::bench::report;
use crate::bench::results::Results;
use lightgraph::internals::image::file::write_atomically;
use std::path::Path;

/// Writes the page of kept results, of whatever commit and machine. Needs no adapter.
///
/// # Errors
/// Results that can't be read, a page that can't be written.
pub fn run(args: &BenchArgs, kept: &Path) -> Result<u8, Failure> {
    let old = args.against.as_deref().map(Results::read).transpose()?;
    let results = Results::read(kept)?;
    // Their pictures are named relative to the file.
    publish(args, &results, kept.parent().unwrap_or(Path::new("")), old.as_ref())
}

/// Writes the page, prints the fronts and, where there are old results, the comparison with them. `pictures` is the
/// folder that the results name theirs in. Returns the exit code.
///
/// # Errors
/// A page that can't be written.
pub fn publish(args: &BenchArgs, results: &Results, pictures: &Path, old: Option<&Results>) -> Result<u8, Failure> {
    let page = args.out.join("report.html");
    write_atomically(&page, report::html(results, pictures, args.images)?.as_bytes())?;
    print(&report::text(results));
    print(&format!("wrote {}\n", page.display()));
    let Some(old) = old else { return Ok(0) };
    let verdict = against(old, results);
    print(&verdict.to_string());
    Ok(u8::from(!verdict.worse.is_empty()))
}
