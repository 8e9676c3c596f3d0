//! `lightgraph export web`: a graph and a scene as a folder of static files, which any server can serve.

use super::additions::AdditionArgs;
use super::new::{make, vacant};
use super::{Failure, ShaderFolders, notices, print, scene_or_none, size};
use crate::web;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::internals::image::png::{ToneMap, write_png};
use lightgraph::internals::{builtin, files};
use lightgraph::{Checked, Diagnostic, Faults, Gpu, Graph, Project, Session, Settings};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

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
    vacant(&args.out)?;
    let page = page_files(&web::page(args.page.as_deref())?)?;
    let project = Project::open(&args.graph, &args.shaders.folders)?;
    let params = project.params(&args.set).map_err(Failure::Usage)?;
    let loaded = scene_or_none(Some(&args.scene), &AdditionArgs::default())?;
    notices(&loaded.notices);
    let mut all = project_files(&project)?;
    let graph = project.graph.files.first().unwrap_or(&args.graph);
    let graph = name_in("graphs", graph, graph.parent())?;
    let folder = loaded.files.first().and_then(|f| f.parent());
    for path in &loaded.files {
        all.insert(name_in("scenes", path, folder)?, read(path)?);
    }
    let scene = loaded.files.first().map(|f| name_in("scenes", f, folder)).transpose()?.unwrap_or_default();
    let gpu = Gpu::open()?;
    let settings = Settings { params, size: args.size, camera: args.camera.clone(), ..Settings::default() };
    let mut session = Session::new(&gpu, &project, loaded.scene, settings)?;
    notices(&session.notices);
    session.frame(&gpu, 0, 0.0)?;
    let output = project.main_output().unwrap_or("color");
    let poster = session.image(&gpu, output)?;

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
    all.extend(page);
    all.insert("project.json".into(), json.into_bytes());
    // Another may have filled it since, and what lies there is not ours to remove.
    vacant(&args.out)?;
    make(&args.out, || {
        all.iter().try_for_each(|(name, bytes)| write_atomically(&args.out.join(name), bytes))?;
        write_png(&args.out.join("poster.png"), &poster, ToneMap::default(), 0.0, &BTreeMap::new())
    })?;
    print(&format!("wrote {0}; look at it with\n  lightgraph serve {0}\n", args.out.display()));
    Ok(0)
}

/// The files of the page itself, which shows one project and no list of scenes.
fn page_files(page: &Path) -> Checked<BTreeMap<String, Vec<u8>>> {
    let mut all = BTreeMap::from([("scenes.json".to_string(), b"{}\n".to_vec())]);
    for name in ["engine.js", "engine_bg.wasm", "start.js", "page.js", "worker.js", "offline.js", "style.css"] {
        all.insert(name.into(), read(&page.join(name))?);
    }
    let index = page.join("index.html");
    let text = files::read_text(&index, files::TEXT).map_err(|e| unread(&index, &e))?;
    all.insert("index.html".into(), text.replace("<body>", "<body class=\"viewer\">").into_bytes());
    Ok(all)
}

/// Graphs with their images, and shaders, by their path on the page.
fn project_files(project: &Project) -> Checked<BTreeMap<String, Vec<u8>>> {
    let mut all = BTreeMap::new();
    let Graph { files, images, .. } = &project.graph;
    let folder = files.first().and_then(|f| f.parent());
    for path in files.iter().chain(images).filter(|f| !builtin::is_builtin(f)) {
        all.insert(name_in("graphs", path, folder)?, read(path)?);
    }
    for (path, source) in &project.texts.files {
        if !source.path.starts_with(builtin::PREFIX) {
            all.insert(format!("shaders/{path}"), source.text.clone().into_bytes());
        }
    }
    Ok(all)
}

/// What a file is called on the page: its path below `from`, in `folder`.
///
/// # Errors
/// A file that lies elsewhere: on the page no file names one outside of its folder.
fn name_in(folder: &str, path: &Path, from: Option<&Path>) -> Checked<String> {
    if let Some(built_in) = path.to_str().and_then(|p| p.strip_prefix(builtin::PREFIX)) {
        return Ok(built_in.to_string());
    }
    let part = |part: Component| match part {
        Component::CurDir => Some(String::new()),
        Component::Normal(part) => Some(format!("/{}", part.to_string_lossy())),
        Component::ParentDir | Component::RootDir | Component::Prefix(_) => None,
    };
    let below = from.and_then(|from| path.strip_prefix(from).ok());
    let below: Option<String> = below.and_then(|below| below.components().map(part).collect());
    below.map(|below| format!("{folder}{below}")).ok_or_else(|| {
        let d = Diagnostic::error(format!("can't export {}: it lies outside of the folder", path.display()));
        d.help("put it into the folder of the graph or scene that names it, or below").into()
    })
}

fn read(path: &Path) -> Checked<Vec<u8>> {
    files::read(path, files::GEOMETRY).map_err(|e| unread(path, &e))
}

fn unread(path: &Path, e: &std::io::Error) -> Faults {
    Diagnostic::error(format!("can't read {}: {e}", path.display())).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_named_by_its_path_below_the_folder() {
        let name = |path: &str, from: &str| name_in("graphs", Path::new(path), Some(Path::new(from)));
        assert_eq!(name("gi/a/b.ron", "gi").unwrap(), "graphs/a/b.ron");
        assert_eq!(name("./a.ron", "").unwrap(), "graphs/a.ron");
        assert_eq!(name("lightgraph:graphs/gi/a.ron", "").unwrap(), "graphs/gi/a.ron");
        for path in ["gi/../a/t.png", "gi/../../t.png", "/b/t.png", "other/t.png"] {
            let said = name(path, "gi").unwrap_err().to_string();
            assert!(said.contains(&format!("can't export {path}: it lies outside")), "{said}");
        }
    }

    #[test]
    fn a_page_that_lacks_a_file_is_a_fault() {
        let folder = tempfile::TempDir::new().unwrap();
        let said = page_files(folder.path()).unwrap_err().to_string();
        assert!(said.contains("can't read") && said.contains("engine.js"), "{said}");
    }
}
