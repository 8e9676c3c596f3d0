//! `lightgraph plan`: what a graph compiles to. No device.

use super::{Failure, ShaderFolders, notices, print, size};
use crate::plan::build::plan;
use crate::plan::request::{Request, sample_facts};
use crate::scene;
use crate::session::Project;
use std::path::PathBuf;

/// Prints the plan of a graph.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// The graph file
    #[arg(value_name = "GRAPH")]
    pub graph: PathBuf,
    /// The scene; without it, one that has one of everything
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Size of the image in pixels
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = size)]
    pub size: [u32; 2],
    /// Set a parameter (may be repeated)
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Plan for these outputs only (may be repeated)
    #[arg(long = "output", value_name = "NAME")]
    pub outputs: Vec<String>,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// Plans and prints.
///
/// # Errors
/// Faults of the graph or the scene.
pub fn run(args: &Args) -> Result<u8, Failure> {
    let project = Project::open(&args.graph, &args.shaders.folders)?;
    let params = project.params(&args.set)?;
    let facts = match &args.scene {
        Some(path) => scene::load(path)?.scene.facts(),
        None => sample_facts(true),
    };
    let planned = plan(&Request {
        graph: &project.graph,
        library: &project.library,
        params: &params,
        facts: &facts,
        screen: args.size,
        outputs: (!args.outputs.is_empty()).then_some(args.outputs.as_slice()),
        limits: &wgpu::Limits::default(),
        features: wgpu::Features::FLOAT32_FILTERABLE,
    })?;
    notices(&planned.notices);
    print(&format!("{:#?}\n", planned.plan.order));
    Ok(0)
}
