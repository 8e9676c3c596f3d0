//! Run time against error: every graph on every scene at many settings, beside references and other renderers.
//!
//! - `sweep` makes settings of a text such as `grid=2,4;face=8,16`
//! - `references` finds what a scene is compared with; `score` compares
//! - `measure` renders one graph on one scene at one setting, phase by phase: the only part that needs a device
//! - `jobs` parts the work into jobs, and jobs among machines; `merge` joins what came of the parts; `host` is where
//!   an entry was measured
//! - `results` is what is kept of it, as JSON and CSV; `journal` keeps its entries until the run is over
//! - `front` says which entries nothing beats
//! - `speed` holds run times against each other and against what the adapter can do
//! - `against` compares two results, `repeat` says how much of the old ones came out again
//! - `tune` chooses a graph and its setting for one scene
//! - `peers` runs other renderers; `report` writes a page of it all, `overview` its first plot

pub mod against;
pub mod front;
pub mod host;
pub mod jobs;
pub mod journal;
pub mod measure;
pub mod merge;
pub mod overview;
pub mod peers;
pub mod references;
pub mod repeat;
pub mod report;
pub mod results;
pub mod score;
pub mod speed;
pub mod sweep;
#[cfg(test)]
mod tests;
pub mod tune;
