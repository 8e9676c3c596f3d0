//! From what the page wishes to frames on its canvas. Nothing waits: a session that is made is shown once the device
//! has found no fault with it, and until then the one before goes on.

mod measure;
mod turn;

use crate::link;
use crate::looks::{ImageScore, Inspect, Inspected};
use crate::made::{ComparedImage, PageRequest, PageSession};
use crate::tell;
use glam::{Vec2, Vec3};
use lightgraph::internals::fastest::Measuring;
use lightgraph::internals::gpu::{Arrangement, Display, PendingImage};
use lightgraph::internals::scene::{self, navigate};
use lightgraph::internals::session::Pointer;
use lightgraph::internals::{builtin, files};
use lightgraph::{Checked, Diagnostic, Faults, Frame, Gpu, Scene, View};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use wasm_bindgen::prelude::wasm_bindgen;
use web_time::Instant;

/// What the engine said last before it stopped.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Why the engine stopped; empty where that is unknown.
#[wasm_bindgen]
pub fn last_panic() -> String {
    PANIC.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// What is shown or is to be: a graph's image, and what it is held against.
struct ShownPair {
    first: PageSession,
    second: Option<ComparedImage>,
    /// What both were made from.
    wish: PageRequest,
    /// When it was made, or shown.
    since: Instant,
    /// The alternatives of the first are timed, or have been.
    measured: bool,
}

struct LoadedFiles {
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
    scene: Option<LoadedFiles>,
    shown: Option<ShownPair>,
    /// What the device has not answered for yet.
    next: Option<ShownPair>,
    /// Takes the place of the scene's camera.
    view: Option<View>,
    exposure: f32,
    pointer: Pointer,
    /// Those of each of the pair that are under way.
    frames: [VecDeque<Frame>; 2],
    arrangement: Arrangement,
    score: ImageScore,
    inspected: Inspected,
    image: Option<PendingImage>,
    image_wanted: bool,
    /// The first image of the next session is wanted.
    first_wanted: bool,
    /// The number of the next frame of each of the pair.
    index: [u32; 2],
    /// Counts calls of [`Engine::advance`].
    turn: u32,
    /// The last frame that arrived ran no step, and nothing has changed since; of each of the pair.
    rest: [bool; 2],
    /// Alternatives of what is shown that are timed.
    measuring: Option<Measuring>,
    /// A frame has been drawn since the last run of an alternative.
    drawn: bool,
    /// The session that is shown can't be rendered.
    failed: bool,
    /// Grows when files change; that of scenes, and of graphs and shaders.
    revisions: [u64; 2],
}

#[wasm_bindgen]
impl Engine {
    /// Opens the browser's device and draws to `canvas` from then on. What times are kept for is this adapter in this
    /// browser.
    ///
    /// # Errors
    /// The browser gives no device; the text says why.
    pub async fn open(
        canvas: web_sys::OffscreenCanvas,
        adapter_name: String,
        browser: String,
    ) -> Result<Engine, String> {
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
        let mut gpu = Gpu::request(adapter).await.map_err(|faults| faults.to_string())?;
        (gpu.info.name, gpu.info.driver_info) = (adapter_name, browser);
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
            frames: Default::default(),
            arrangement: Arrangement::First,
            score: ImageScore::default(),
            inspected: Inspected::default(),
            image: None,
            image_wanted: false,
            first_wanted: false,
            index: [0; 2],
            turn: 0,
            rest: [false; 2],
            measuring: None,
            drawn: false,
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

    /// The path of what was measured, a text that [`Engine::hold`] takes in another run.
    pub fn times(&self) -> String {
        measure::TIMES.into()
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
                self.frames = Default::default();
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
        self.rest = [false; 2];
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
        self.rest = [false; 2];
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
        self.rest = [false; 2];
    }

    /// How the image and what it is held against are seen: `first`, `split` at a share of the width, `difference` in
    /// full colour at so much light, `second`.
    pub fn set_arrangement(&mut self, kind: &str, at: f32) {
        self.arrangement = match kind {
            "split" => Arrangement::Split(at),
            "difference" => Arrangement::Difference(at),
            "second" => Arrangement::Second,
            _ => Arrangement::First,
        };
        self.rest = [false; 2];
    }

    /// Looks into a resource, as JSON says; at none where it is empty.
    ///
    /// # Errors
    /// The JSON is none of that.
    pub fn inspect(&mut self, json: &str) -> Result<(), String> {
        let wanted: Option<Inspect> = match json {
            "" => None,
            json => Some(serde_json::from_str(json).map_err(|e| e.to_string())?),
        };
        self.inspected.want(wanted);
        self.rest = [false; 2];
        Ok(())
    }

    /// The plane of the resource that [`Engine::advance`] told of, as red, green, blue and alpha; once.
    pub fn take_plane(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.inspected.pixels)
    }

    /// The values of a texel of that plane.
    pub fn texel(&self, x: u32, y: u32) -> Vec<f32> {
        self.inspected.texel(x, y)
    }

    /// Where the pointer is, in pixels of the image, and its buttons.
    pub fn set_pointer(&mut self, x: f32, y: f32, buttons: u32) {
        self.pointer = Pointer { at: Vec2::new(x, y), buttons };
    }

    /// Asks for the image of the next frame, or of the first one of what was wished for last, in linear light.
    pub fn want_image(&mut self, first: bool) {
        self.first_wanted = first;
        self.image_wanted = !first;
        self.rest = [false; 2];
    }

    /// Width, height and channels of the image asked for, and its numbers; empty until it has come.
    pub fn take_image(&mut self) -> Vec<f32> {
        let Some(image) = self.image.as_mut().and_then(|i| i.arrived(&self.gpu).ok().flatten()) else { return vec![] };
        self.image = None;
        [image.width as f32, image.height as f32, image.channels as f32].into_iter().chain(image.data).collect()
    }

    /// What the graph that is shown compiles to.
    pub fn plan(&self) -> String {
        self.shown.as_ref().map(|s| s.first.session.plan.to_string()).unwrap_or_default()
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
        let session = &self.shown.as_ref()?.first.session;
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
            self.scene = Some(LoadedFiles { path: path.into(), scene: Arc::new(scene), notices, revision });
        }
        Ok(())
    }

    fn make(&mut self, wish: &PageRequest) -> Checked<Value> {
        let start = Instant::now();
        self.next = None;
        if self.measuring.take().is_some_and(|measuring| measuring.is_under_way()) {
            self.gpu.forget_answers();
        }
        self.scene(&wish.scene)?;
        let Some(LoadedFiles { scene, notices, .. }) = &self.scene else { return Ok(json!({})) };
        let (gpu, revision, shown) = (&self.gpu, self.revisions[1], self.shown.as_ref());
        let first = PageSession::new(gpu, &wish.graph, wish, scene, revision, shown.map(|s| &s.first))?;
        let before = shown.and_then(|s| s.second.as_ref());
        let second = ComparedImage::new(gpu, wish, scene, revision, (&first, before))?;
        let notices: Vec<Diagnostic> = notices.iter().chain(&first.session.notices).cloned().collect();
        let mut told = first.told();
        told["notices"] = tell::diagnostics(&notices);
        told["make_ms"] = json!(start.elapsed().as_secs_f64() * 1e3);
        self.next = Some(ShownPair { first, second, wish: wish.clone(), since: start, measured: false });
        Ok(told)
    }
}
