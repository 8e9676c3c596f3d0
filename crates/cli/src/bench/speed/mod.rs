//! How fast: graphs against each other, the executor against a program written by hand, times against what the adapter
//! can do at all. What is compared is data, a [`List`]; every figure is a [`Row`], and ratios come of one run.
//!
//! - `list` is the file that says what to measure
//! - `pairs` times two graphs in turn, `renderers` a graph and other programs; `steps` times each step alone and sets it beside its bound
//! - `chain` measures the framework's own cost, `load` that of a large scene; `rows` is what comes of it, as table, JSON and HTML

mod chain;
pub mod list;
mod load;
mod pairs;
mod renderers;
pub mod rows;
mod steps;
#[cfg(test)]
mod tests;

mod handwritten;

pub use handwritten::Handwritten;
pub use list::SpeedList;
pub use rows::{Goal, SpeedRow, SpeedRows};

use lightgraph::internals::fastest::Policy;
use lightgraph::{Checked, Gpu, Project};
use std::path::{Path, PathBuf};

/// What all measurements share.
pub struct Bench<'a> {
    pub gpu: &'a Gpu,
    /// Paths of a list are relative to this folder.
    pub root: &'a Path,
    /// More folders of shaders.
    pub shaders: &'a [PathBuf],
    /// The folder of reference images.
    pub references: &'a Path,
    /// Timed frames of each side at most.
    pub repeat: u32,
    /// Which of a graph's alternatives run.
    pub fastest: Policy,
}

impl Bench<'_> {
    fn project(&self, graph: &str) -> Checked<Project> {
        Project::open(&self.root.join(graph), self.shaders)
    }

    /// Measures all that a list asks for; `done` is told each row as it comes.
    ///
    /// # Errors
    /// Graphs, scenes and settings that can't be read or run.
    pub fn run(&self, list: &SpeedList, done: &mut dyn FnMut(&SpeedRow)) -> Checked<Vec<SpeedRow>> {
        let mut rows = vec![];
        let mut add = |more: Vec<SpeedRow>| {
            more.iter().for_each(&mut *done);
            rows.extend(more);
        };
        // First: what a process held before and let go it may fill again, and a peak of memory wouldn't show that.
        for load in &list.loads {
            add(self.load(load)?);
        }
        for chain in &list.chains {
            add(self.chain(chain)?);
        }
        for pair in &list.pairs {
            add(self.pair(pair)?);
        }
        for published in &list.published {
            add(self.published(published)?);
        }
        for row in renderers::rows(self, &list.renderers) {
            add(row?);
        }
        for scaling in &list.scaling {
            add(self.scaling(scaling)?);
        }
        for start in &list.starts {
            add(self.start(start)?);
        }
        for times in &list.times {
            add(self.time(times)?);
        }
        if let Some(bounds) = &list.bounds {
            add(self.bounds(bounds)?);
        }
        Ok(rows)
    }
}
