//! `lightgraph probe`: what one invocation of a pass computes.

use super::additions::AdditionArgs;
use super::{Failure, ShaderFolders, needs_no_scene, notices, print, scene_or_none, size};
use crate::probe_report::ProbeReport;
use lightgraph::internals::session::Probing;
use lightgraph::{Gpu, Project, Session, Settings};
use std::path::PathBuf;
use std::sync::Arc;

/// Asks one invocation of a pass what it computes.
#[derive(Debug, Clone, clap::Args)]
pub struct ProbeArgs {
    /// The graph file
    #[arg(value_name = "GRAPH", default_value = super::DEFAULT_GRAPH)]
    pub graph: PathBuf,
    /// The scene: a glTF, GLB or scene RON; its ending may be left out, and all of it for a graph that uses none
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// The pass, or one of its steps as `lightgraph plan` lists them: Screen, Draw or Compute
    #[arg(long, value_name = "NAME")]
    pub pass: String,
    /// The pixel of a Screen or Draw pass, or the global invocation of a Compute pass
    #[arg(long, value_name = "X,Y[,Z]", value_parser = place)]
    pub at: [u32; 3],
    /// Of `let`s, `var`s and what is read show this one alone (may be repeated)
    #[arg(long = "value", value_name = "NAME")]
    pub values: Vec<String>,
    /// Ask in the last of so many frames
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    /// The camera, by name
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    #[command(flatten)]
    pub additions: AdditionArgs,
    /// Size of the image in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: [u32; 2],
    /// Set a parameter of the graph (may be repeated)
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// Renders, and prints what the invocation computed.
///
/// # Errors
/// Faults of files, graph, scene and device; a pass that can't be probed; a place where nothing ran; no adapter.
pub fn run(args: &ProbeArgs) -> Result<u8, Failure> {
    let project = Project::open(&args.graph, &args.shaders.folders)?;
    let params = project.params(&args.set).map_err(Failure::Usage)?;
    let loaded = scene_or_none(args.scene.as_deref(), &args.additions)?;
    notices(&loaded.notices);
    let gpu = Gpu::open()?;
    let probe = Some(Probing { pass: args.pass.clone(), values: args.values.clone() });
    let settings = Settings { params, size: args.size, camera: args.camera.clone(), probe, ..Settings::default() };
    let mut session = Session::new(&gpu, &project, Arc::new(loaded.scene), settings)?;
    needs_no_scene(args.scene.as_deref(), &project, &session.plan)?;
    for frame in 0..args.frames {
        if frame + 1 == args.frames {
            session.probe(&gpu, args.at)?;
        }
        session.frame(&gpu, frame, frame as f32 / 60.0)?;
    }
    print(&ProbeReport::read(&session, &gpu, args.at)?.to_string());
    Ok(0)
}

/// `X,Y` or `X,Y,Z`, whole numbers from 0.
fn place(text: &str) -> Result<[u32; 3], String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([x, y]) => Ok([*x, *y, 0]),
        Some([x, y, z]) => Ok([*x, *y, *z]),
        _ => Err("write it as X,Y or X,Y,Z: whole numbers, counted from 0".into()),
    }
}
