//! `lightgraph check`: every fault of graphs and their shaders. No device.

use super::{Failure, ShaderFolders, notices, print};
use crate::paths::ron_files;
use lightgraph::internals::diag::{Severity, Source, strict};
use lightgraph::internals::parallel;
use lightgraph::internals::plan::request::all_sample_facts;
use lightgraph::internals::shader::Library;
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, Faults, Project, Scene};
use std::path::{Path, PathBuf};

/// Reports every fault of graphs and their shaders.
#[derive(Debug, Clone, clap::Args)]
pub struct CheckArgs {
    /// Graph files, or folders that hold some
    #[arg(value_name = "GRAPH", required = true)]
    pub graphs: Vec<PathBuf>,
    /// Check for this scene, rather than for one that has everything and one that has nothing
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Set a parameter (may be repeated)
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Count warnings as faults: what the graph declares and nothing uses
    #[arg(long)]
    pub strict: bool,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// Checks each graph; faults of all of them are shown.
///
/// # Errors
/// Only faults that concern no graph, such as a scene that can't be read.
pub fn run(args: &CheckArgs) -> Result<u8, Failure> {
    let facts = match &args.scene {
        Some(path) => vec![Scene::load(path)?.scene.facts()],
        None => all_sample_facts(),
    };
    let paths = ron_files(&args.graphs)?;
    // What one graph has read and composed, the others reuse.
    let first = paths.first().map(|path| Project::open(path, &args.shaders.folders));
    let library = first.and_then(Result::ok).map(|project| project.texts).unwrap_or_default();
    let found = parallel::each(0..paths.len(), |i| check(&paths[i], args, &facts, &library));
    let mut code = 0;
    for (path, found) in paths.iter().zip(found) {
        let mut faults = match found {
            Ok(faults) => faults,
            Err(Faults(faults)) => {
                notices(&faults);
                code = 2;
                continue;
            }
        };
        if args.strict {
            strict(&mut faults);
        }
        notices(&faults);
        if faults.iter().any(|d| d.severity == Severity::Error) {
            code = code.max(1);
        } else {
            print(&format!("{}: no faults\n", path.display()));
        }
    }
    Ok(code)
}

/// The faults of one graph under each set of facts, whichever alternatives run, none of them twice; and its shaders.
/// What an `earlier` graph used too is not composed again.
///
/// # Errors
/// Parameters that the graph has not, or not with such values.
fn check(path: &Path, args: &CheckArgs, facts: &[Values], earlier: &Library) -> Checked<Vec<Diagnostic>> {
    let project = match Project::open_with(path, &args.shaders.folders, &Source::read, earlier) {
        Ok(project) => project,
        Err(Faults(faults)) => return Ok(faults),
    };
    let params = project.params(&args.set)?;
    Ok(project.faults(&params, facts))
}
