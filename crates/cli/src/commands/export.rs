//! `lightgraph export web`: a graph and a scene as a folder of static files, which any server can serve.

use super::additions::AdditionArgs;
use super::{Failure, ShaderFolders, notices, print, scene_or_none, size};
use crate::web;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::internals::image::png::{ToneMap, write_png};
use lightgraph::internals::{builtin, files};
use lightgraph::{Checked, Diagnostic, Faults, Gpu, Graph, Project, Session, Settings};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Writes a graph for others to look at.
#[derive(Debug, Clone, clap::Args)]
pub struct ExportArgs {
    #[command(subcommand)]
    pub to: To,
}

/// What for.
#[derive(Debug, Clone, clap::Subcommand)]
pub enum To {
    /// A folder of static files, which a browser with WebGPU renders by itself
    Web(WebArgs),
}

/// A page of a graph and a scene.
#[derive(Debug, Clone, clap::Args)]
pub struct WebArgs {
    /// The graph file
    #[arg(value_name = "GRAPH")]
    pub graph: PathBuf,
    /// The scene: a glTF, GLB or scene RON
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// The folder to write; it is not there yet, or empty
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The camera, by name
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Size of the image in pixels
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = size)]
    pub size: [u32; 2],
    /// Set a parameter of the graph (may be repeated)
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// The page that `make web` has made, where it lies elsewhere
    #[arg(long, value_name = "DIR")]
    pub page: Option<PathBuf>,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// What the page is told of what it shows.
#[derive(Debug, serde::Serialize)]
struct PageData<'a> {
    graph: &'a str,
    scene: &'a str,
    camera: Option<&'a str>,
    params: BTreeMap<&'a str, &'a str>,
    size: [u32; 2],
    files: Vec<&'a String>,
}

/// Writes the folder, with a picture for browsers that can't render.
///
/// # Errors
/// Faults of files, graph, scene and device; a folder that holds something; no page; no adapter.
pub fn run(args: &ExportArgs) -> Result<u8, Failure> {
    let To::Web(args) = &args.to;
    let taken = std::fs::read_dir(&args.out).map_or(args.out.exists(), |mut entries| entries.next().is_some());
    if taken {
        let d = Diagnostic::error(format!("{} is there already, and not an empty folder", args.out.display()));
        return Err(Failure::Usage(d.help("name a folder that is not there yet").into()));
    }
    let page = web::page(args.page.as_deref())?;
    let project = Project::open(&args.graph, &args.shaders.folders)?;
    let params = project.params(&args.set).map_err(Failure::Usage)?;
    let loaded = scene_or_none(Some(&args.scene), &AdditionArgs::default())?;
    notices(&loaded.notices);
    let gpu = Gpu::open()?;
    let settings = Settings { params, size: args.size, camera: args.camera.clone(), ..Settings::default() };
    let mut session = Session::new(&gpu, &project, loaded.scene, settings)?;
    notices(&session.notices);
    session.frame(&gpu, 0, 0.0)?;
    let output = project.main_output().unwrap_or("color");
    let poster = session.image(&gpu, output)?;

    let mut all = project_files(&project)?;
    let graph = name_in("graphs", project.graph.files.first().map_or(&args.graph, |f| f), args.graph.parent());
    let folder = loaded.files.first().and_then(|f| f.parent());
    for path in &loaded.files {
        all.insert(name_in("scenes", path, folder), read(path)?);
    }
    let scene = loaded.files.first().map(|f| name_in("scenes", f, folder)).unwrap_or_default();
    let told = PageData {
        graph: &graph,
        scene: &scene,
        camera: args.camera.as_deref(),
        params: args.set.iter().filter_map(|s| s.split_once('=')).map(|(n, v)| (n.trim(), v.trim())).collect(),
        size: args.size,
        files: all.keys().collect(),
    };
    let json = serde_json::to_string_pretty(&told).map_err(|e| Diagnostic::error(e.to_string()));
    let json = json.map_err(Faults::from)?;
    for (name, bytes) in &all {
        write_atomically(&args.out.join(name), bytes)?;
    }
    for name in ["engine.js", "engine_bg.wasm", "start.js", "page.js", "worker.js", "offline.js", "style.css"] {
        write_atomically(&args.out.join(name), &read(&page.join(name))?)?;
    }
    let index =
        files::read_text(&page.join("index.html"), files::TEXT).map_err(|e| unread(&page.join("index.html"), &e))?;
    write_atomically(&args.out.join("index.html"), index.replace("<body>", "<body class=\"viewer\">").as_bytes())?;
    write_atomically(&args.out.join("scenes.json"), b"{}\n")?;
    write_atomically(&args.out.join("project.json"), json.as_bytes())?;
    write_png(&args.out.join("poster.png"), &poster, ToneMap::default(), 0.0, &BTreeMap::new())?;
    print(&format!("wrote {0}; look at it with\n  lightgraph serve {0}\n", args.out.display()));
    Ok(0)
}

/// Graphs with their images, and shaders, by their path on the page.
fn project_files(project: &Project) -> Checked<BTreeMap<String, Vec<u8>>> {
    let mut all = BTreeMap::new();
    let Graph { files, images, .. } = &project.graph;
    let folder = files.first().and_then(|f| f.parent());
    for path in files.iter().chain(images).filter(|f| !builtin::is_builtin(f)) {
        all.insert(name_in("graphs", path, folder), read(path)?);
    }
    for (path, source) in &project.texts.files {
        if !source.path.starts_with(builtin::PREFIX) {
            all.insert(format!("shaders/{path}"), source.text.clone().into_bytes());
        }
    }
    Ok(all)
}

/// What a file is called on the page: its path below `from`, in `folder`.
fn name_in(folder: &str, path: &Path, from: Option<&Path>) -> String {
    if let Some(built_in) = path.to_str().and_then(|p| p.strip_prefix(builtin::PREFIX)) {
        return built_in.to_string();
    }
    let below = from.and_then(|from| path.strip_prefix(from).ok());
    let below = below.or(path.file_name().map(Path::new)).unwrap_or(path);
    let parts: Vec<String> = below.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    format!("{folder}/{}", parts.join("/"))
}

fn read(path: &Path) -> Checked<Vec<u8>> {
    files::read(path, files::GEOMETRY).map_err(|e| unread(path, &e))
}

fn unread(path: &Path, e: &std::io::Error) -> Faults {
    Diagnostic::error(format!("can't read {}: {e}", path.display())).into()
}
