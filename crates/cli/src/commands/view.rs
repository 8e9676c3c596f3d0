//! `lightgraph view`: a graph in a window, with live reload.

use super::{Failure, ShaderFolders, additions::AdditionArgs, size};
use lightgraph::internals::fastest::Policy;
use std::net::SocketAddr;
use std::path::PathBuf;

/// Opens a window on a graph.
#[derive(Debug, Clone, clap::Args)]
pub struct ViewArgs {
    /// The graph file, or a glTF or GLB for its scene [default: final_gather]
    #[arg(value_name = "GRAPH")]
    pub graph: Option<PathBuf>,
    /// The scene: a glTF, GLB or scene RON; without it, the first of `scenes`
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// The camera, by name
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    #[command(flatten)]
    pub additions: AdditionArgs,
    /// Size of the window in pixels
    #[arg(long, value_name = "WxH", default_value = "1440x900", value_parser = size)]
    pub size: [u32; 2],
    /// Pixels of the image: WxH, or a share of those of the window; on a software driver 0.5 if not given
    #[arg(long, value_name = "WxH|SHARE")]
    pub pixels: Option<String>,
    /// Set a parameter of the graph (may be repeated)
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Hold the image against this graph or EXR file
    #[arg(long, value_name = "GRAPH|FILE.exr")]
    pub against: Option<PathBuf>,
    /// Open what the window saved with "all"; the other arguments come on top
    #[arg(long, value_name = "FILE.ron")]
    pub restore: Option<PathBuf>,
    /// Check what every step leaves: NaN, infinite numbers, and those outside of the ranges that the graph states
    #[arg(long)]
    pub watch_numerics: bool,
    /// Where the window writes pictures
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub folder: PathBuf,
    /// Play these events, then go on; for tests
    #[arg(long, value_name = "FILE.ron", hide = true)]
    pub script: Option<PathBuf>,
    /// Which of a graph's alternatives run
    #[arg(long, value_enum, default_value_t = Policy::Measure)]
    pub fastest: Policy,
    /// Show the scene of a program that connects, as the add-on for Blender does; prints the link to give it. Without
    /// an address, this machine alone is listened to, at a port that is free
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = "127.0.0.1:0")]
    pub link: Option<SocketAddr>,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// Opens the window; ends when it is closed.
///
/// # Errors
/// Wrong usage, no display or adapter. Faults of files are shown in the window, and waited out.
#[cfg(feature = "window")]
pub fn run(args: &ViewArgs) -> Result<u8, Failure> {
    use crate::view::{ComparedTo, Ended, LINKED, Link, Script, ViewChoice, WindowStart};
    use lightgraph::Project;

    let (graph, scene) = given(args);
    let linked = PathBuf::from(LINKED);
    let scene = scene.or(args.link.filter(|_| args.restore.is_none()).map(|_| &linked));
    let mut choice = match &args.restore {
        Some(path) => ViewChoice::load(path)?,
        None => ViewChoice::new(first(graph.as_ref(), "graphs", "GRAPH")?, first(scene, "scenes", "--scene")?),
    };
    if let Some(graph) = graph {
        choice.graph = graph;
    }
    if let Some(scene) = scene {
        choice.set_scene(scene.clone());
    }
    if let Some(camera) = &args.camera {
        (choice.camera, choice.view) = (Some(camera.clone()), None);
    }
    if args.additions.camera_at.is_some() {
        choice.view = None;
    }
    if !args.set.is_empty() {
        choice
            .params
            .extend(Project::open(&choice.graph, &args.shaders.folders)?.params(&args.set).map_err(Failure::Usage)?);
    }
    if let Some(path) = &args.against {
        let exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        choice.compare.against = if exr { ComparedTo::Image(path.clone()) } else { ComparedTo::Graph(path.clone()) };
    }
    if let Some(text) = &args.pixels {
        choice.resolution = resolution(text)?;
    }
    let link = args.link.map(Link::bind).transpose()?;
    if let Some(link) = &link {
        super::print(&format!("{}\n", link.text()));
    }
    let start = WindowStart {
        choice,
        shaders: args.shaders.folders.clone(),
        additions: args.additions.additions()?,
        fastest: args.fastest,
        watch: args.watch_numerics,
        size: args.size,
        folder: args.folder.clone(),
        script: args.script.as_deref().map(Script::load).transpose()?,
        link,
        usual_resolution: args.pixels.is_none() && args.restore.is_none(),
    };
    match crate::view::run(start) {
        Ok(log) => {
            log.iter().for_each(|line| super::print(&format!("{line}\n")));
            Ok(0)
        }
        Err(Ended::NoDisplay(d) | Ended::NoAdapter(d)) => Err(Failure::NoAdapter(d)),
        Err(Ended::Faults(f)) => Err(f.into()),
    }
}

/// Says how to get a window.
///
/// # Errors
/// Always: this program has none.
#[cfg(not(feature = "window"))]
pub fn run(_: &ViewArgs) -> Result<u8, Failure> {
    let d = lightgraph::Diagnostic::error("this lightgraph was built without its window");
    Err(Failure::Usage(d.help("build it with `--features window`, or use `lightgraph watch`").into()))
}

/// The graph and the scene that the arguments name: a glTF in the graph's place is a scene. Without a graph it is the
/// one that `render` takes, too.
#[cfg(feature = "window")]
fn given(args: &ViewArgs) -> (Option<PathBuf>, Option<&PathBuf>) {
    let is_scene = |path: &&PathBuf| path.extension().is_some_and(|e| e == "glb" || e == "gltf");
    let scene = args.scene.as_ref().or(args.graph.as_ref().filter(is_scene));
    let graph = args.graph.as_ref().filter(|path| !is_scene(path)).cloned();
    let usual = || Some(PathBuf::from(super::DEFAULT_GRAPH)).filter(|_| args.restore.is_none());
    (graph.or_else(usual), scene)
}

/// The path given, or the first of a folder.
#[cfg(feature = "window")]
fn first(given: Option<&PathBuf>, folder: &str, argument: &str) -> Result<PathBuf, Failure> {
    use lightgraph::Diagnostic;
    let found = || {
        let folder = std::path::Path::new(folder);
        let all = if folder.ends_with("scenes") { crate::view::scenes(folder) } else { crate::view::graphs(folder) };
        all.into_iter().next()
    };
    given.cloned().or_else(found).ok_or_else(|| {
        let d = Diagnostic::error(format!("no {argument} is given, and there is none in `{folder}`"));
        Failure::Usage(d.help("`lightgraph new DIR` makes a folder with graphs; scenes are glTF files").into())
    })
}

#[cfg(feature = "window")]
fn resolution(text: &str) -> Result<crate::view::Resolution, Failure> {
    use crate::view::Resolution;
    let share = text.parse().ok().filter(|s: &f32| *s > 0.0 && *s <= 4.0).map(Resolution::Window);
    share.or_else(|| size(text).ok().map(Resolution::Fixed)).ok_or_else(|| {
        let d = lightgraph::Diagnostic::error(format!("--pixels `{text}` is neither WIDTHxHEIGHT nor a share up to 4"));
        Failure::Usage(d.help("write 640x480, or 0.5 for half of the window's pixels along each axis").into())
    })
}
