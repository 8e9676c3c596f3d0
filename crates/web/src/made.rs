//! From a wish to sessions: the one that is shown, and what it is held against.

use crate::tell;
use lightgraph::internals::fastest::Policy;
use lightgraph::internals::gpu::{Timing, upload_shown};
use lightgraph::internals::image::exr::read_exr;
use lightgraph::internals::plan::fastest::still;
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, Gpu, Image, Memory, Project, Scene, Session, Settings};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Pixels of an image's side at most.
const MOST_SIDE: u32 = 4096;

/// What is to be shown.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PageRequest {
    pub graph: PathBuf,
    pub scene: PathBuf,
    /// In pixels.
    pub size: [u32; 2],
    /// Those of other graphs are left out.
    pub params: BTreeMap<String, String>,
    /// `None`: the scene's default.
    pub camera: Option<String>,
    /// `None`: `color`, or the graph's first.
    pub output: Option<String>,
    /// Each step is timed, which takes time.
    pub timed: bool,
    /// Every resource is kept and can be looked into, which takes memory.
    pub inspect: bool,
    /// What the image is held against.
    pub against: Option<ComparedWith>,
    pub fastest: Policy,
}

/// What an image is held against.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ComparedWith {
    /// The image of another graph of the same scene, view and parameters, as far as it has them.
    Graph(PathBuf),
    /// An OpenEXR file.
    Image(PathBuf),
}

/// A session and what it was made for.
pub struct PageSession {
    pub project: Project,
    pub session: Session,
    pub output: String,
    params: Values,
    /// Number of the files that it was made from.
    revision: u64,
}

impl PageSession {
    /// # Errors
    /// Faults of the graph, its parameters and the device.
    pub fn new(
        gpu: &Gpu,
        graph: &Path,
        wish: &PageRequest,
        scene: &Arc<Scene>,
        revision: u64,
        before: Option<&PageSession>,
    ) -> Checked<PageSession> {
        let project = match before {
            Some(made) if made.revision == revision && made.is_of(graph) => made.project.clone(),
            Some(made) => {
                let project = Project::open(graph, &[])?;
                Project { texts: project.texts.after(&made.project.texts), ..project }
            }
            None => Project::open(graph, &[])?,
        };
        let known = |name: &str| project.graph.params.iter().any(|(n, _)| n.value == name);
        let set = wish.params.iter().filter(|(name, _)| known(name)).map(|(name, value)| format!("{name}={value}"));
        let params = project.params(&set.collect::<Vec<_>>())?;
        let wanted = wish.output.as_deref().filter(|o| project.graph.outputs.iter().any(|(n, _)| n.value == **o));
        let output = wanted.or(project.main_output()).ok_or_else(|| Diagnostic::error("the graph has no outputs"))?;
        let output = output.to_string();
        let most = MOST_SIDE.min(gpu.limits.max_texture_dimension_2d);
        let decided = before.filter(|_| wish.fastest == Policy::Measure);
        let settings = Settings {
            params: params.clone(),
            size: wish.size.map(|side| side.clamp(1, most)),
            outputs: Some(vec![output.clone()]),
            camera: wish.camera.clone(),
            skip: true,
            timing: if wish.timed { Timing::Steps } else { Timing::Frame },
            inspect: wish.inspect,
            // What is once decided stays: an edit is to be seen at once.
            choices: decided.map(|made| still(&project.graph, &made.session.settings.choices)).unwrap_or_default(),
            ..Settings::default()
        };
        let session = Session::after(gpu, &project, scene.clone(), settings, before.map(|made| &made.session))?;
        let Memory::Texture(texture) = session.memory(session.output(&output)?)? else {
            return Err(Diagnostic::error(format!("`{output}` is no image, and can't be shown")).into());
        };
        showable(gpu, texture, &output)?;
        Ok(PageSession { project, session, output, params, revision })
    }

    pub fn is_of(&self, graph: &Path) -> bool {
        self.project.graph.files.first().is_some_and(|file| file == graph)
    }

    /// # Errors
    /// None: the session has this output.
    pub fn image(&self) -> Checked<&wgpu::Texture> {
        match self.session.memory(self.session.output(&self.output)?)? {
            Memory::Texture(texture) => Ok(texture),
            Memory::Buffer(_) => Err(Diagnostic::error(format!("`{}` is no image", self.output)).into()),
        }
    }

    /// What is to be known of it, besides notices.
    pub fn told(&self) -> Value {
        let graph = &self.project.graph;
        let paths = self.session.plan.shaders.iter().filter_map(|s| self.project.texts.files.get(&s.path));
        let shaders: BTreeSet<&str> = paths.map(|source| source.path.as_str()).collect();
        json!({
            "params": tell::params(graph, &self.params),
            "outputs": graph.outputs.iter().map(|o| &o.0.value).collect::<Vec<_>>(),
            "output": self.output,
            "about": graph.about,
            "files": graph.files,
            "shaders": shaders,
            "size": self.session.settings.size,
            "resources": tell::resources(&self.session.plan),
        })
    }
}

/// # Errors
/// The texture holds no colours.
fn showable(gpu: &Gpu, texture: &wgpu::Texture, name: &str) -> Checked<()> {
    let sampled = texture.format().sample_type(None, Some(gpu.features));
    let color = matches!(sampled, Some(wgpu::TextureSampleType::Float { .. }));
    if color && texture.dimension() == wgpu::TextureDimension::D2 {
        return Ok(());
    }
    let d = Diagnostic::error(format!("`{name}` holds no image of colours, and can't be shown"));
    Err(d.help("choose another output").into())
}

/// What the image is held against, ready to be drawn.
pub enum ComparedImage {
    Graph(Box<PageSession>),
    Image { path: PathBuf, texture: wgpu::Texture, image: Arc<Image>, revision: u64 },
}

impl ComparedImage {
    /// # Errors
    /// Faults of the graph, or of the file.
    pub fn new(
        gpu: &Gpu,
        wish: &PageRequest,
        scene: &Arc<Scene>,
        revision: u64,
        (shown, before): (&PageSession, Option<&ComparedImage>),
    ) -> Checked<Option<ComparedImage>> {
        match &wish.against {
            None => Ok(None),
            Some(ComparedWith::Graph(path)) => {
                let before = match before {
                    Some(ComparedImage::Graph(made)) if made.is_of(path) => made,
                    // Their shaders have most in common.
                    _ => shown,
                };
                // Its own output of this name.
                let wish = PageRequest { output: Some(shown.output.clone()), inspect: false, ..wish.clone() };
                let made = PageSession::new(gpu, path, &wish, scene, revision, Some(before))?;
                Ok(Some(ComparedImage::Graph(Box::new(made))))
            }
            Some(ComparedWith::Image(wanted)) => {
                if let Some(ComparedImage::Image { path, texture, image, revision: of }) = before
                    && (path, *of) == (wanted, revision)
                {
                    let (path, texture, image) = (path.clone(), texture.clone(), image.clone());
                    return Ok(Some(ComparedImage::Image { path, texture, image, revision }));
                }
                let path = wanted;
                let image = Arc::new(read_exr(path)?);
                let texture = upload_shown(gpu, &image, &path.display().to_string())?;
                Ok(Some(ComparedImage::Image { path: path.clone(), texture, image, revision }))
            }
        }
    }

    /// # Errors
    /// As [`PageSession::image`].
    pub fn image(&self) -> Checked<&wgpu::Texture> {
        match self {
            ComparedImage::Graph(made) => made.image(),
            ComparedImage::Image { texture, .. } => Ok(texture),
        }
    }

    /// Whether the other one is of the same graph or file.
    pub fn is_like(&self, other: &ComparedImage) -> bool {
        match (self, other) {
            (ComparedImage::Graph(a), ComparedImage::Graph(b)) => {
                a.project.graph.files.first() == b.project.graph.files.first()
            }
            (ComparedImage::Image { path: a, .. }, ComparedImage::Image { path: b, .. }) => a == b,
            _ => false,
        }
    }
}
