//! A graph with the shaders it may use, and what it takes from a caller: parameters and outputs. No device.

use crate::builtin;
use crate::diag::{Checked, Diagnostic, Faults, Source};
use crate::files;
use crate::files::ReadFile;
use crate::graph::ast::{Name, set_of};
use crate::graph::{self, Graph};
use crate::plan::build::faults;
use crate::plan::fastest::FIRST;
use crate::plan::request::{self, Request};
use crate::scene::{KeyedParam, Scene};
use crate::shader::Library;
use crate::unused;
use crate::value::Values;
use std::path::{Component, Path, PathBuf};

/// A graph and the shaders it may use.
///
/// ```
/// use lightgraph::{Project, Scene};
/// use std::path::Path;
///
/// let project = Project::open(Path::new("lightgraph:graphs/gi/uniform_grid.ron"), &[])?;
/// assert_eq!(project.main_output(), Some("color"));
/// let params = project.params(&["bounces=2".into()])?;
/// let scene = Scene::load(Path::new("scenes/cornell.glb"))?.scene;
/// assert_eq!(project.faults(&params, &[scene.facts()]), []);
/// # lightgraph::Checked::Ok(())
/// ```
#[derive(Debug, Clone)]
pub struct Project {
    pub graph: Graph,
    pub texts: Library,
}

impl Project {
    /// Reads a graph file and the shader folders: those given, then `shaders` beside the graph, then up to three
    /// folders up; where the graph or a base is one of the binary's, then the binary's.
    ///
    /// # Errors
    /// Every fault of the graph file and its bases, and shader files that can't be read.
    pub fn open(path: &Path, shaders: &[PathBuf]) -> Checked<Project> {
        Project::open_with(path, shaders, &Source::read, &Library::default())
    }

    /// As [`Project::open`], with the texts of graphs and shaders from anywhere else. Nothing is made again that an
    /// earlier library made of the same texts.
    ///
    /// # Errors
    /// As [`Project::open`].
    pub fn open_with(path: &Path, shaders: &[PathBuf], read: ReadFile, earlier: &Library) -> Checked<Project> {
        let mut graph = graph::load(path, read)?;
        let usual = shader_folders(path);
        let mut folders: Vec<PathBuf> = shaders.to_vec();
        folders.extend(usual.into_iter().filter(|f| files::is_folder(f)));
        let mut texts = Library::load_with(&folders, read)?;
        if graph.files.iter().any(|f| builtin::is_builtin(f)) {
            for (name, source) in builtin::shaders() {
                texts.files.entry(name.into()).or_insert(source);
            }
        }
        let texts = texts.after(earlier);
        unused::prune(&mut graph, &texts);
        Ok(Project { graph, texts })
    }

    /// Makes a resource, or a member of a set of them (`name[i]`), an output of the graph, unless it is one.
    ///
    /// # Errors
    /// The graph has neither an output nor a resource of that name.
    pub fn expose(&mut self, name: &str) -> Checked<()> {
        let graph = &mut self.graph;
        if graph.outputs.iter().any(|o| o.0.value == name) {
            return Ok(());
        }
        if let Some((declared, _)) = graph.resources.iter().find(|(n, _)| n.value == set_of(name)) {
            let name = Name { value: name.into(), span: declared.span.clone() };
            graph.outputs.push((name.clone(), name));
            return Ok(());
        }
        let names: Vec<&str> = graph.outputs.iter().map(|o| o.0.value.as_str()).collect();
        let known = graph.resources.iter().map(|(n, _)| n.value.as_str());
        let d = Diagnostic::error(format!("the graph has no output `{name}`"));
        Err(d.nearest(name, names.iter().copied().chain(known)).help(format!("outputs: {}", names.join(", "))).into())
    }

    /// The output that is meant where none is named: `color`, or the graph's first.
    pub fn main_output(&self) -> Option<&str> {
        let mut names = self.graph.outputs.iter().map(|o| o.0.value.as_str());
        let first = names.clone().next();
        names.find(|n| *n == "color").or(first)
    }

    /// The faults and warnings of the graph for each of these scenes' facts ([`request::all_sample_facts`] for any
    /// scene), whichever alternatives run; none of them twice. Needs no device.
    pub fn faults(&self, params: &Values, facts: &[Values]) -> Vec<Diagnostic> {
        let (limits, features) = request::sample_device();
        let mut all: Vec<Diagnostic> = vec![];
        for facts in facts {
            let found = faults(&Request {
                graph: &self.graph,
                texts: &self.texts,
                params,
                facts,
                screen: [640, 480],
                outputs: None,
                choices: &FIRST,
                levels: &[],
                limits: &limits,
                features,
            });
            let new: Vec<Diagnostic> = found.into_iter().filter(|d| !all.contains(d)).collect();
            all.extend(new);
        }
        all
    }

    /// Parameters from `NAME=VALUE` texts.
    ///
    /// # Errors
    /// Unknown names, values of the wrong type or out of range; all at once.
    pub fn params(&self, settings: &[String]) -> Checked<Values> {
        let mut values = Values::new();
        let mut faults = vec![];
        for text in settings {
            let Some((name, value)) = text.split_once('=') else {
                faults.push(Diagnostic::error(format!("`{text}` is not NAME=VALUE")));
                continue;
            };
            let (name, value) = (name.trim(), value.trim());
            let Some((_, param)) = self.graph.params.iter().find(|(n, _)| n.value == name) else {
                let d = Diagnostic::error(format!("the graph has no parameter `{name}`"));
                faults.push(d.nearest(name, self.graph.params.iter().map(|(n, _)| n.value.as_str())));
                continue;
            };
            match param.of(name, value) {
                Ok(v) => drop(values.insert(name.to_string(), v)),
                Err(why) => faults.push(Diagnostic::error(why).at(&param.span, "declared here")),
            }
        }
        Faults::check(faults, values)
    }

    /// The parameters at a time in seconds: those given, and of the others those with keyframes in the scene file.
    ///
    /// # Errors
    /// Values in keyframes that a parameter does not take.
    pub fn params_at(&self, given: &Values, scene: &Scene, time: f32) -> Checked<Values> {
        let (mut values, mut faults) = (given.clone(), vec![]);
        for keyed in scene.params.iter().filter(|keyed| !given.contains_key(&keyed.name)) {
            let Some((_, param)) = self.graph.params.iter().find(|(n, _)| n.value == keyed.name) else { continue };
            match param.at(keyed, time) {
                Ok(value) => drop(values.insert(keyed.name.clone(), value)),
                Err(found) => faults.extend(found.0),
            }
        }
        Faults::check(faults, values)
    }

    /// Notices of keyframes in the scene file for parameters that the graph has not: they may be another graph's.
    pub fn params_of_others(&self, scene: &Scene) -> Vec<Diagnostic> {
        let known = || self.graph.params.iter().map(|(n, _)| n.value.as_str());
        let others = scene.params.iter().filter(|keyed| known().all(|name| name != keyed.name));
        let note = |keyed: &KeyedParam| {
            let d = Diagnostic::note(format!("the graph has no parameter `{}`: its keyframes do nothing", keyed.name));
            d.at(&keyed.span, "").nearest(&keyed.name, known())
        };
        others.map(note).collect()
    }
}

/// Where the shaders of a graph are looked for: beside it, and up to three folders up.
pub fn shader_folders(graph: &Path) -> [PathBuf; 4] {
    let beside = graph.parent().unwrap_or(Path::new(""));
    let up = |folder: &Path| match folder.components().next_back() {
        Some(Component::Normal(_)) => folder.parent().unwrap_or(Path::new("")).to_path_buf(),
        Some(_) => folder.join(".."),
        None => PathBuf::from(".."),
    };
    let (once, twice) = (up(beside), up(&up(beside)));
    [beside.to_path_buf(), once, twice.clone(), up(&twice)].map(|folder| folder.join("shaders"))
}
