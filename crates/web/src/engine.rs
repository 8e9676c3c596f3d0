//! From what the page wishes to frames on its canvas. Nothing waits: a session that is made is shown once the device
//! has found no fault with it, and until then the one before goes on.

use crate::link;
use crate::tell;
use glam::{Vec2, Vec3};
use lightgraph::internals::gpu::{Arrangement, Display, Look, PendingImage, StepTime, Timing};
use lightgraph::internals::image::png::ToneMap;
use lightgraph::internals::scene::{self, navigate};
use lightgraph::internals::session::Pointer;
use lightgraph::internals::{builtin, files};
use lightgraph::{
    Checked, Diagnostic, Faults, Frame, FrameReport, Gpu, Memory, Project, Scene, Session, Settings, View,
};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use wasm_bindgen::prelude::wasm_bindgen;
use web_time::Instant;

/// Frames on their way at most: more would show later what happens now.
const UNDER_WAY: usize = 2;

/// Where a frame ran no step, so many turns pass before the next: only time goes on.
const SELDOM: u32 = 8;

/// Pixels of an image's side at most.
const MOST_SIDE: u32 = 4096;

/// What the engine said last before it stopped.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Why the engine stopped; empty where that is unknown.
#[wasm_bindgen]
pub fn last_panic() -> String {
    PANIC.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// What is to be shown.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Wish {
    graph: PathBuf,
    scene: PathBuf,
    /// In pixels.
    size: [u32; 2],
    /// Those of other graphs are left out.
    params: BTreeMap<String, String>,
    /// `None`: the scene's default.
    camera: Option<String>,
    /// `None`: `color`, or the graph's first.
    output: Option<String>,
    /// Each step is timed, which takes time.
    timed: bool,
}

/// A session and what it was made for.
struct Made {
    project: Project,
    session: Session,
    output: String,
    /// Number of the files that it was made from.
    revision: u64,
}

struct Loaded {
    path: PathBuf,
    scene: Arc<Scene>,
    notices: Vec<Diagnostic>,
    revision: u64,
}

/// The engine behind a page.
#[wasm_bindgen]
pub struct Engine {
    gpu: Gpu,
    surface: wgpu::Surface<'static>,
    format: wgpu::TextureFormat,
    display: Display,
    scene: Option<Loaded>,
    shown: Option<Made>,
    /// What the device has not answered for yet.
    next: Option<Made>,
    /// Takes the place of the scene's camera.
    view: Option<View>,
    exposure: f32,
    pointer: Pointer,
    frames: VecDeque<Frame>,
    image: Option<PendingImage>,
    image_wanted: bool,
    /// The first image of the next session is wanted.
    first_wanted: bool,
    index: u32,
    /// Counts calls of [`Engine::advance`].
    turn: u32,
    /// The last frame that arrived ran no step, and nothing has changed since.
    rest: bool,
    /// The session that is shown can't be rendered.
    failed: bool,
    /// Grows when files change; that of scenes, and of graphs and shaders.
    revisions: [u64; 2],
}

#[wasm_bindgen]
impl Engine {
    /// Opens the browser's device and draws to `canvas` from then on.
    ///
    /// # Errors
    /// The browser gives no device; the text says why.
    pub async fn open(canvas: web_sys::OffscreenCanvas) -> Result<Engine, String> {
        std::panic::set_hook(Box::new(|panic| {
            *PANIC.lock().unwrap_or_else(PoisonError::into_inner) = panic.to_string();
        }));
        for (path, content) in builtin::FILES {
            if path.starts_with("graphs/") || path.starts_with("shaders/") || path.starts_with("scenes/") {
                files::hold(*path, *content);
            }
        }
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::BROWSER_WEBGPU,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let surface =
            instance.create_surface(wgpu::SurfaceTarget::OffscreenCanvas(canvas)).map_err(|e| e.to_string())?;
        let wanted = wgpu::RequestAdapterOptions { compatible_surface: Some(&surface), ..Default::default() };
        let adapter = instance.request_adapter(&wanted).await.map_err(|e| format!("no WebGPU adapter: {e}"))?;
        let gpu = Gpu::request(adapter).await.map_err(|faults| faults.to_string())?;
        let formats = surface.get_capabilities(&gpu.adapter).formats;
        let plain = |f: &&wgpu::TextureFormat| !f.is_srgb();
        let format = *formats.iter().find(plain).ok_or("the canvas has no format to draw in")?;
        let display = Display::new(&gpu, format);
        Ok(Engine {
            gpu,
            surface,
            format,
            display,
            scene: None,
            shown: None,
            next: None,
            view: None,
            exposure: 0.0,
            pointer: Pointer::default(),
            frames: VecDeque::new(),
            image: None,
            image_wanted: false,
            first_wanted: false,
            index: 0,
            turn: 0,
            rest: false,
            failed: false,
            revisions: [0; 2],
        })
    }

    /// What the device is.
    pub fn device(&self) -> String {
        let info = &self.gpu.info;
        json!({ "name": info.name, "driver": info.driver, "software": self.gpu.is_software() }).to_string()
    }

    /// The files that the engine comes with: paths of graphs, shaders and scenes.
    pub fn files(&self) -> String {
        let held = ["graphs", "shaders", "scenes"].map(|folder| files::held_below(Path::new(folder)));
        let all: Vec<String> = held.into_iter().flatten().map(|p| p.display().to_string()).collect();
        json!(all).to_string()
    }

    /// The text of a file; `None` where there is none.
    pub fn text(&self, path: &str) -> Option<String> {
        files::read_text(Path::new(path), files::TEXT).ok()
    }

    /// Puts a file in its place: an edit, something fetched or dropped.
    pub fn hold(&mut self, path: &str, content: &[u8]) {
        files::hold(path, content);
        self.changed(path);
    }

    /// Puts back what the engine comes with, or nothing.
    pub fn release(&mut self, path: &str) {
        match builtin::FILES.iter().find(|f| f.0 == path) {
            Some((_, content)) => files::hold(path, *content),
            None => files::release(Path::new(path)),
        }
        self.changed(path);
    }

    /// Makes what is wished for. Returns faults, or what is to be known of what comes.
    pub fn wish(&mut self, json: &str) -> String {
        let wish = serde_json::from_str(json).map_err(|e| Faults::from(Diagnostic::error(format!("no wish: {e}"))));
        match wish.and_then(|wish| self.make(&wish)) {
            Ok(told) => told.to_string(),
            Err(faults) => json!({ "faults": tell::diagnostics(&faults.0) }).to_string(),
        }
    }

    /// Goes on by a frame at `time` (seconds), if there is anything to do. Returns what is new.
    pub fn advance(&mut self, time: f32) -> String {
        match self.step(time) {
            Ok(told) => told.to_string(),
            Err(faults) => {
                self.failed = true;
                self.frames.clear();
                json!({ "faults": tell::diagnostics(&faults.0), "lost": self.gpu.check().is_err() }).to_string()
            }
        }
    }

    /// Turns the view round the middle of the scene, slides it, or goes nearer; by parts of the image's height.
    pub fn drag(&mut self, kind: &str, x: f32, y: f32) {
        let Some((seen, pivot)) = self.seen() else { return };
        let by = Vec2::new(x, y);
        self.view = Some(match kind {
            "pan" => navigate::pan(seen, pivot, by),
            "zoom" => navigate::zoom(seen, pivot, y),
            _ => navigate::orbit(seen, pivot, by * std::f32::consts::PI),
        });
        self.rest = false;
    }

    /// Position, forward and up of the view, nine numbers; empty where the scene's own camera sees.
    pub fn place(&self) -> Vec<f32> {
        let numbers =
            |v: View| [v.place.position, v.place.forward, v.place.up].iter().flat_map(Vec3::to_array).collect();
        self.view.map(numbers).unwrap_or_default()
    }

    /// Sets what [`Engine::place`] gives.
    pub fn set_place(&mut self, numbers: &[f32]) {
        self.view = None;
        self.rest = false;
        let Some((seen, _)) = self.seen() else { return };
        let (parts, []) = numbers.as_chunks::<3>() else { return };
        let [position, forward, up] = parts else { return };
        let [position, forward, up] = [position, forward, up].map(|v| Vec3::from_array(*v));
        let right = forward.cross(up).normalize_or_zero();
        let Some(ahead) = forward.try_normalize().filter(|_| right != Vec3::ZERO) else { return };
        // What was a view is taken bit by bit, so that a link shows the very same image.
        let sound = (ahead - forward).length() < 1e-4 && (right.cross(ahead) - up).length() < 1e-4;
        let (forward, up) = if sound { (forward, up) } else { (ahead, right.cross(ahead)) };
        let place = scene::CameraPose { position, forward, up };
        self.view = Some(View { place, ..seen });
    }

    /// Stops by which the image is brightened on the canvas.
    pub fn set_exposure(&mut self, stops: f32) {
        self.exposure = stops.clamp(-20.0, 20.0);
        self.rest = false;
    }

    /// Where the pointer is, in pixels of the image, and its buttons.
    pub fn set_pointer(&mut self, x: f32, y: f32, buttons: u32) {
        self.pointer = Pointer { at: Vec2::new(x, y), buttons };
    }

    /// Asks for the image of the next frame, or of the first one of what was wished for last, in linear light.
    pub fn want_image(&mut self, first: bool) {
        self.first_wanted = first;
        self.image_wanted = !first;
        self.rest = false;
    }

    /// Width, height and channels of the image asked for, and its numbers; empty until it has come.
    pub fn take_image(&mut self) -> Vec<f32> {
        let Some(image) = self.image.as_mut().and_then(|i| i.arrived(&self.gpu).ok().flatten()) else { return vec![] };
        self.image = None;
        [image.width as f32, image.height as f32, image.channels as f32].into_iter().chain(image.data).collect()
    }

    /// What the graph that is shown compiles to.
    pub fn plan(&self) -> String {
        self.shown.as_ref().map(|s| s.session.plan.to_string()).unwrap_or_default()
    }

    /// The letters of a link for the JSON of what is shared.
    ///
    /// # Errors
    /// It is too much.
    pub fn encode_link(&self, json: &str) -> Result<String, String> {
        link::encode(json)
    }

    /// What a link holds, as JSON.
    ///
    /// # Errors
    /// Why it can't be followed.
    pub fn decode_link(&self, letters: &str) -> Result<String, String> {
        link::decode(letters)
    }
}

impl Engine {
    fn changed(&mut self, path: &str) {
        self.revisions[usize::from(!path.starts_with("scenes/"))] += 1;
    }

    /// The view that is seen, and the point that it turns about.
    fn seen(&self) -> Option<(View, Vec3)> {
        let session = &self.shown.as_ref()?.session;
        let [width, height] = session.settings.size;
        let (scene, pose) = (&session.scene, session.scene.pose(0.0));
        let seen = scene.view(&pose, session.settings.camera.as_deref(), width as f32 / height as f32).ok()?.0;
        let view = self.view.unwrap_or(seen);
        let depth = (scene.bounds.center() - view.place.position).dot(view.place.forward);
        let least = 0.1 * scene.bounds.diagonal();
        Some((view, view.place.position + depth.max(least) * view.place.forward))
    }

    fn scene(&mut self, path: &Path) -> Checked<()> {
        let revision = self.revisions[0];
        if self.scene.as_ref().is_none_or(|s| s.path != path || s.revision != revision) {
            let scene::Loaded { scene, notices, .. } = Scene::load(path)?;
            if self.scene.as_ref().is_some_and(|s| s.path != path) {
                self.view = None;
            }
            self.scene = Some(Loaded { path: path.into(), scene: Arc::new(scene), notices, revision });
        }
        Ok(())
    }

    fn make(&mut self, wish: &Wish) -> Checked<Value> {
        let start = Instant::now();
        self.next = None;
        self.scene(&wish.scene)?;
        let Some(Loaded { scene, notices, .. }) = &self.scene else { return Ok(json!({})) };
        let revision = self.revisions[1];
        let project = match &self.shown {
            Some(shown) if shown.revision == revision && shown.project.graph.files.first() == Some(&wish.graph) => {
                shown.project.clone()
            }
            Some(shown) => {
                let project = Project::open(&wish.graph, &[])?;
                Project { texts: project.texts.after(&shown.project.texts), ..project }
            }
            None => Project::open(&wish.graph, &[])?,
        };
        let known = |name: &str| project.graph.params.iter().any(|(n, _)| n.value == name);
        let set = wish.params.iter().filter(|(name, _)| known(name)).map(|(name, value)| format!("{name}={value}"));
        let params = project.params(&set.collect::<Vec<_>>())?;
        let wanted = wish.output.as_deref().filter(|o| project.graph.outputs.iter().any(|(n, _)| n.value == **o));
        let output = wanted.or(project.main_output()).ok_or_else(|| Diagnostic::error("the graph has no outputs"))?;
        let output = output.to_string();
        let most = MOST_SIDE.min(self.gpu.limits.max_texture_dimension_2d);
        let settings = Settings {
            params: params.clone(),
            size: wish.size.map(|side| side.clamp(1, most)),
            outputs: Some(vec![output.clone()]),
            camera: wish.camera.clone(),
            skip: true,
            timing: if wish.timed { Timing::Steps } else { Timing::Frame },
            ..Settings::default()
        };
        let previous = self.shown.as_ref().map(|s| &s.session);
        let session = Session::after(&self.gpu, &project, scene.clone(), settings, previous)?;
        let Memory::Texture(texture) = session.memory(session.output(&output)?)? else {
            return Err(Diagnostic::error(format!("`{output}` is no image, and can't be shown")).into());
        };
        showable(&self.gpu, texture, &output)?;
        let paths = session.plan.shaders.iter().filter_map(|s| project.texts.files.get(&s.path));
        let shaders: BTreeSet<&str> = paths.map(|source| source.path.as_str()).collect();
        let notices: Vec<Diagnostic> = notices.iter().chain(&session.notices).cloned().collect();
        let told = json!({
            "notices": tell::diagnostics(&notices),
            "params": tell::params(&project.graph, &params),
            "outputs": project.graph.outputs.iter().map(|o| &o.0.value).collect::<Vec<_>>(),
            "output": output,
            "about": project.graph.about,
            "files": project.graph.files,
            "shaders": shaders,
            "size": session.settings.size,
            "make_ms": start.elapsed().as_secs_f64() * 1e3,
        });
        self.next = Some(Made { project, session, output, revision });
        Ok(told)
    }

    /// Shows what was made, once the device has answered for all of it.
    fn swap(&mut self) -> Checked<bool> {
        let answered = self.gpu.answered().inspect_err(|_| self.next = None)?;
        if !answered || self.next.is_none() {
            return Ok(false);
        }
        let [width, height] = self.next.as_ref().map_or([1, 1], |n| n.session.settings.size);
        self.surface.configure(
            &self.gpu.device,
            &wgpu::SurfaceConfiguration {
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                format: self.format,
                color_space: Default::default(),
                width,
                height,
                present_mode: wgpu::PresentMode::Fifo,
                desired_maximum_frame_latency: 2,
                alpha_mode: wgpu::CompositeAlphaMode::Opaque,
                view_formats: vec![],
            },
        );
        let subject = |made: &Option<Made>| {
            made.as_ref().map(|m| (m.project.graph.files.first().cloned(), Arc::as_ptr(&m.session.scene)))
        };
        if subject(&self.shown) != subject(&self.next) {
            self.index = 0;
        }
        if std::mem::take(&mut self.first_wanted) {
            self.image_wanted = true;
        }
        self.shown = self.next.take();
        self.frames.clear();
        (self.rest, self.failed) = (false, false);
        Ok(true)
    }

    fn step(&mut self, time: f32) -> Checked<Value> {
        let swapped = match self.swap() {
            Ok(swapped) => swapped,
            // What was shown goes on; only what was to come is gone.
            Err(faults) if self.shown.is_some() && self.gpu.check().is_ok() => {
                return Ok(json!({ "faults": tell::diagnostics(&faults.0) }));
            }
            Err(faults) => return Err(faults),
        };
        let mut told = json!({ "swapped": swapped, "next": self.next.is_some() });
        if let Some(report) = self.arrived()? {
            self.rest = report.steps.is_empty() && !self.image_wanted;
            told["report"] = self.report(&report);
        }
        self.turn = self.turn.wrapping_add(1);
        let asleep = self.rest && self.turn % SELDOM != 0;
        let idle = asleep || self.failed || self.frames.len() >= UNDER_WAY;
        if let (Some(made), false) = (&mut self.shown, idle)
            && let wgpu::CurrentSurfaceTexture::Success(target) = self.surface.get_current_texture()
        {
            let start = Instant::now();
            made.session.shift.view = self.view;
            made.session.pointer = self.pointer;
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let recorded = made.session.record(&self.gpu, &mut encoder, self.index, time)?;
            if let Memory::Texture(texture) = made.session.memory(made.session.output(&made.output)?)? {
                let view = target.texture.create_view(&Default::default());
                let look = Look { stops: self.exposure, tone_map: ToneMap::Neutral, arrangement: Arrangement::First };
                self.display.draw(&self.gpu, &mut encoder, [texture; 2], look, &view);
                if self.image_wanted && self.image.is_none() {
                    self.image = Some(made.session.image_later(&self.gpu, &mut encoder, &made.output)?);
                    self.image_wanted = false;
                }
            }
            self.gpu.queue.submit([encoder.finish()]);
            self.gpu.queue.present(target);
            self.frames.push_back(recorded);
            self.index += 1;
            told["host_ms"] = json!(start.elapsed().as_secs_f64() * 1e3);
            told["index"] = json!(self.index);
        }
        told["idle"] = json!(idle);
        Ok(told)
    }

    /// The latest frame that has arrived.
    fn arrived(&mut self) -> Checked<Option<FrameReport>> {
        let mut latest = None;
        while let Some(first) = self.frames.front_mut() {
            let Some(report) = first.arrived(&self.gpu)? else { break };
            latest = Some(report);
            self.frames.pop_front();
        }
        Ok(latest)
    }

    fn report(&self, report: &FrameReport) -> Value {
        let Some(made) = &self.shown else { return Value::Null };
        let name = |step: usize| made.session.plan.steps.get(step).map_or("?", |s| s.name.as_str());
        let step =
            |s: &StepTime| json!({ "name": name(s.step), "runs": s.runs, "gpu_ms": s.gpu_ms, "cpu_ms": s.cpu_ms });
        let mut warnings: Vec<Diagnostic> = report.warnings.clone();
        warnings.extend(made.session.failed_checks(report));
        json!({
            "steps": report.steps.iter().map(step).collect::<Vec<_>>(),
            "wall_ms": report.wall_ms,
            "device_ms": report.device_ms,
            "checks": tell::diagnostics(&Faults(warnings).0),
        })
    }
}

/// # Errors
/// The texture holds no colours.
pub fn showable(gpu: &Gpu, texture: &wgpu::Texture, name: &str) -> Checked<()> {
    let sampled = texture.format().sample_type(None, Some(gpu.features));
    let color = matches!(sampled, Some(wgpu::TextureSampleType::Float { .. }));
    if color && texture.dimension() == wgpu::TextureDimension::D2 {
        return Ok(());
    }
    let d = Diagnostic::error(format!("`{name}` holds no image of colours, and can't be shown"));
    Err(d.help("choose another output").into())
}
