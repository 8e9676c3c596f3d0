//! `lightgraph plan`: what a graph compiles to. No device.

use super::additions::{AdditionArgs, load_some};
use super::fastest::{FastestArgs, Which};
use super::{Failure, ShaderFolders, notices, print, print_data, size};
use crate::show;
use lightgraph::internals::fastest::Policy;
use lightgraph::internals::plan::build::{Planned, plan};
use lightgraph::internals::plan::draw::{asked_parts, parts};
use lightgraph::internals::plan::request::{Request, sample_device, sample_facts};
use lightgraph::{Diagnostic, Project, Scene};
use std::path::{Path, PathBuf};

/// How a plan is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// For people, snapshots and diffs
    Text,
    Json,
    /// Graphviz
    Dot,
    /// A picture
    Svg,
}

/// Prints the plan of a graph.
#[derive(Debug, Clone, clap::Args)]
pub struct PlanArgs {
    /// The graph file
    #[arg(value_name = "GRAPH")]
    pub graph: PathBuf,
    /// The scene; without it, one that has one of everything
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    pub additions: AdditionArgs,
    /// Size of the image in pixels
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = size)]
    pub size: [u32; 2],
    /// Set a parameter (may be repeated)
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Plan for these outputs only (may be repeated)
    #[arg(long = "output", value_name = "NAME")]
    pub outputs: Vec<String>,
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Print what differs in the plan of another graph, for the same scene
    #[arg(long, value_name = "GRAPH", conflicts_with = "format")]
    pub diff: Option<PathBuf>,
    #[command(flatten)]
    pub fastest: FastestArgs,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// Plans and prints.
///
/// # Errors
/// Faults of the graphs or the scene.
pub fn run(args: &PlanArgs) -> Result<u8, Failure> {
    if args.fastest.fastest.contains(&Which::Rest(Policy::Measure)) {
        let d = Diagnostic::error("`plan` has no device to measure alternatives on");
        return Err(Failure::Usage(
            d.help("without it the first of each group is planned; GROUP=PASS plans another").into(),
        ));
    }
    let scene = load_some(args.scene.as_deref(), &args.additions)?.map(|loaded| loaded.scene);
    let planned = planned(args, &args.graph, scene.as_ref())?;
    if let Some(other) = &args.diff {
        let other = self::planned(args, other, scene.as_ref())?;
        print(&show::diff(&planned.plan, &other.plan));
        return Ok(0);
    }
    notices(&planned.notices);
    if scene.is_some() {
        notices(&planned.warnings);
    }
    let plan = &planned.plan;
    print_data(&match args.format {
        Format::Text => lightgraph::internals::diag::tame(&plan.to_string(), usize::MAX),
        Format::Json => format!("{:#}\n", show::to_json(plan)),
        Format::Dot => show::to_dot(plan),
        Format::Svg => show::to_svg(plan),
    });
    Ok(0)
}

/// A plan for a scene, or for one of many sorts of things.
fn planned(args: &PlanArgs, graph: &Path, scene: Option<&Scene>) -> Result<Planned, Failure> {
    let project = Project::open(graph, &args.shaders.folders)?;
    let (limits, features) = sample_device();
    let request = Request {
        graph: &project.graph,
        texts: &project.texts,
        params: &project.params(&args.set).map_err(Failure::Usage)?,
        facts: &scene.map_or_else(|| sample_facts(true), Scene::facts),
        screen: args.size,
        outputs: (!args.outputs.is_empty()).then_some(args.outputs.as_slice()),
        choices: &args.fastest.named(&project.graph)?,
        levels: &[],
        limits: &limits,
        features,
    };
    let levels = match scene {
        Some(scene) => parts(&asked_parts(&request), scene)?,
        None => vec![],
    };
    Ok(plan(&Request { levels: &levels, ..request })?)
}
