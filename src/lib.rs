//! lightgraph: a data-driven render-graph framework.

#![forbid(unsafe_code)]

pub mod bench;
pub mod cli;
pub mod diag;
pub mod gpu;
pub mod graph;
pub mod image;
pub mod math;
pub mod plan;
pub mod scene;
pub mod session;
pub mod shader;
pub mod snapshot;
pub mod value;
pub mod verify;
