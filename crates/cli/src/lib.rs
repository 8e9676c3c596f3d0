//! The `lightgraph` command and what it is made of, beside the library `lightgraph`.
//!
//! - [`commands`]: the commands, one a file
//! - [`mod@bench`]: run time against error; [`snapshot`]: tests of graphs; [`stress`]: numerical stability
//! - `view`: the window: graphs seen live, with what can be set, compared and looked into
//! - `web`: the page for a browser: where it stands, how it is served
//! - [`mod@show`]: a plan as JSON, DOT, SVG, and the difference of two
//! - `base64`: bytes as text, for reports; `glb`: generated scenes as files; `paths`: the files that a command line names
//! - `probe_report`: what a probed invocation computes, in sections; `shard`: parts of work that several machines share

#![forbid(unsafe_code)]

mod base64;
pub mod bench;
pub mod commands;
mod glb;
mod paths;
mod probe_report;
mod shard;
pub mod show;
pub mod snapshot;
pub mod stress;
#[cfg(feature = "window")]
pub mod view;
mod web;

/// A path in the repository.
#[cfg(test)]
fn repository(path: &str) -> std::path::PathBuf {
    let here = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).map_or_else(|| path.into(), |root| root.join(path))
}
