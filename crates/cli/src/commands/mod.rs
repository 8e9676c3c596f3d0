//! The commands, one a file: each parses its arguments, does its work and returns an exit code.
//!
//! Exit codes: 0 done; 1 the work found a fault; 2 wrong usage; 3 no usable adapter or display.

mod additions;
pub mod bench;
mod capture;
pub mod check;
pub mod compare;
mod course;
pub mod export;
mod fastest;
mod film;
pub mod fmt;
pub mod lsp;
pub mod new;
mod npy;
mod outputs;
mod page;
pub mod plan;
pub mod probe;
pub mod render;
pub mod serve;
mod shards;
mod speed;
mod stats;
pub mod stress;
mod table;
pub mod test;
mod trace;
pub mod tune;
pub mod view;
pub mod watch;

use additions::AdditionArgs;
use lightgraph::internals::diag::{render as show, tame};
use lightgraph::internals::gpu::{self, OpenError};
use lightgraph::internals::plan::tables::scene_use;
use lightgraph::internals::scene::Loaded;
use lightgraph::internals::{caches, files, shader};
use lightgraph::{Checked, Diagnostic, Faults, Plan, Project, Scene};
use std::io::{self, Write};
use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

/// The graph of a command that is given none.
const DEFAULT_GRAPH: &str = "lightgraph:graphs/gi/final_gather.ron";

/// A data-driven render-graph framework: graphs in RON, shaders in WGSL.
#[derive(Debug, clap::Parser)]
#[command(name = "lightgraph", version, about)]
pub struct Cli {
    /// Let scenes, results, variants and graphs name files outside of their folder, by `..`, absolute paths or links
    #[arg(long, global = true)]
    pub allow_outside: bool,
    /// Give a device up that does not answer for so long; without this, for ten minutes
    #[arg(long, global = true, value_name = "SECONDS", value_parser = seconds)]
    pub timeout: Option<Duration>,
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// Render a graph without a window
    Render(render::RenderArgs),
    /// Open a window on a graph, with live reload
    View(view::ViewArgs),
    /// Render again whenever the graph, its shaders or the scene change
    Watch(watch::WatchArgs),
    /// Report every fault of graphs and their shaders; needs no adapter
    Check(check::CheckArgs),
    /// Lay graph, scene and test files out in one way
    Fmt(fmt::FmtArgs),
    /// Serve editors over the standard streams: what `check` and `fmt` say, while you type
    Lsp(lsp::LspArgs),
    /// Print what a graph compiles to; needs no adapter
    Plan(plan::PlanArgs),
    /// Ask one invocation of a pass what it computes: inputs, uniforms, every `let`, outputs
    Probe(probe::ProbeArgs),
    /// Compare two images
    Compare(compare::CompareArgs),
    /// Run graph snapshot tests
    Test(test::TestArgs),
    /// Make a project of your own, with graphs and shaders to edit
    New(new::NewArgs),
    /// Write a graph and a scene as a page for a browser
    Export(export::ExportArgs),
    /// Serve the playground, or an exported page, to a browser on this machine
    Serve(serve::ServeArgs),
    /// Measure run time against error
    Bench(bench::BenchArgs),
    /// Choose the graph and the setting that suit a scene, a machine and a size
    Tune(tune::TuneArgs),
    /// Try every graph under what a scene or a parameter can do, against known answers
    Stress(stress::StressArgs),
}

/// Why a command did not do its work.
#[derive(Debug)]
pub enum Failure {
    /// Exit code 1.
    Faults(Faults),
    /// Exit code 2.
    Usage(Faults),
    /// Exit code 3.
    NoAdapter(Diagnostic),
}

impl From<Failure> for Faults {
    fn from(f: Failure) -> Faults {
        match f {
            Failure::Faults(f) | Failure::Usage(f) => f,
            Failure::NoAdapter(d) => d.into(),
        }
    }
}

impl From<Faults> for Failure {
    fn from(f: Faults) -> Failure {
        Failure::Faults(f)
    }
}

impl From<OpenError> for Failure {
    fn from(e: OpenError) -> Failure {
        match e {
            OpenError::NoAdapter(d) => Failure::NoAdapter(d),
            OpenError::Other(f) => Failure::Faults(f),
        }
    }
}

/// Runs a command. Returns the exit code.
///
/// # Errors
/// Why it did not do its work.
pub fn attempt(cli: &Cli) -> Result<u8, Failure> {
    if let Some(folder) = caches::folder() {
        shader::keep_joined_in(folder.join("shaders"));
    }
    if cli.allow_outside {
        files::allow_outside();
    }
    if let Some(timeout) = cli.timeout {
        gpu::set_patience(timeout);
    }
    match &cli.command {
        Command::Render(args) => render::run(args),
        Command::View(args) => view::run(args),
        Command::Watch(args) => watch::run(args),
        Command::Check(args) => check::run(args),
        Command::Fmt(args) => fmt::run(args),
        Command::Lsp(args) => lsp::run(args),
        Command::Plan(args) => plan::run(args),
        Command::Probe(args) => probe::run(args),
        Command::Compare(args) => compare::run(args).map_err(Failure::from),
        Command::Test(args) => test::run(args),
        Command::New(args) => new::run(args),
        Command::Export(args) => export::run(args),
        Command::Serve(args) => serve::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Tune(args) => tune::run(args),
        Command::Stress(args) => stress::run(args),
    }
}

/// Runs a command and says how it went. Returns the exit code.
pub fn run(cli: &Cli) -> u8 {
    let (faults, code) = match attempt(cli) {
        Ok(code) => (vec![], code),
        Err(Failure::Faults(f)) => (f.0, 1),
        Err(Failure::Usage(f)) => (f.0, 2),
        Err(Failure::NoAdapter(d)) => (vec![d], 3),
    };
    notices(&faults);
    match io::stdout().flush().err().map(lost).or_else(|| LOST.get().cloned()) {
        // A fault is told by its own code.
        Some(why) if code == 0 && !why.is_empty() => {
            notices(&[Diagnostic::error(format!("can't write the output: {why}"))]);
            1
        }
        _ => code,
    }
}

/// Why what was printed did not arrive; empty where its reader has gone away.
static LOST: OnceLock<String> = OnceLock::new();

fn lost(e: io::Error) -> String {
    let gone = e.kind() == io::ErrorKind::BrokenPipe;
    LOST.get_or_init(|| if gone { String::new() } else { e.to_string() }).clone()
}

/// Shows diagnostics on the error stream.
pub fn notices(diagnostics: &[Diagnostic]) {
    // A closed error stream leaves nobody to tell.
    let _ = io::stderr().write_all(show(diagnostics).as_bytes());
}

/// Prints text for people to the output stream, without what would steer a terminal.
pub fn print(text: &str) {
    print_data(&tame(text, usize::MAX));
}

/// Prints to the output stream. A reader that has gone away (`| head`) ends the output, not the program; where a disk
/// is full, the command fails at its end.
pub fn print_data(text: &str) {
    if LOST.get().is_none()
        && let Err(e) = io::stdout().write_all(text.as_bytes())
    {
        lost(e);
    }
}

/// The scene of a path, with what is added; without a path a stand-in, of which a graph may use nothing: see
/// [`needs_no_scene`].
fn scene_or_none(path: Option<&Path>, additions: &AdditionArgs) -> Result<Loaded, Failure> {
    path.map_or_else(|| Ok(Scene::stand_in()?), |path| additions.load(path))
}

/// # Errors
/// There is no scene, and the plan uses one.
fn needs_no_scene(path: Option<&Path>, project: &Project, plan: &Plan) -> Checked<()> {
    match scene_use(&project.graph, plan).filter(|_| path.is_none()) {
        Some(how) => {
            let d = Diagnostic::error(format!("the graph needs a scene: {how}"));
            Err(d.help("give one: `--scene FILE`").into())
        }
        None => Ok(()),
    }
}

/// `WIDTHxHEIGHT` in pixels.
fn size(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once(['x', 'X', '×']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    parts.filter(|[w, h]| *w > 0 && *h > 0).ok_or_else(|| "write it as WIDTHxHEIGHT, such as 640x480".into())
}

/// Seconds that a device may take.
fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|s| (0.1..=1e6).contains(s));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "write a number of seconds from 0.1 to 1000000".into())
}

/// Where a graph's shaders are looked for besides the usual places.
#[derive(Debug, Clone, clap::Args)]
pub struct ShaderFolders {
    /// A folder of shaders, looked into before `shaders`, `../shaders` and `../../shaders` beside the graph (may be
    /// repeated)
    #[arg(long = "shaders", value_name = "DIR")]
    pub folders: Vec<std::path::PathBuf>,
}
