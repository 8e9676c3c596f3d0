//! The event loop: winit's events in, panels and frames out.

use super::canvas::TexturePainter;
use super::choice::{ComparedTo, ViewChoice};
use super::engine::StageThread;
use super::feed::{Feed, PassTimes, ShownFrame, ViewState};
use super::link::{self, Link};
use super::panels::{self, PanelContext};
use super::save::{Saved, nothing};
use super::script::{Act, Moment, Script};
use super::stage::{FrameRequest, ViewStage};
use super::state::PanelState;
use super::surface::{Paint, Screen, fitting};
use super::variants;
use lightgraph::internals::diag::render;
use lightgraph::internals::fastest::Policy;
use lightgraph::internals::gpu::{OpenError, wanted_adapter};
use lightgraph::internals::scene::Additions;
use lightgraph::{Diagnostic, Faults, Gpu};
use lightgraph_lsp::status::{PassStatus, Status};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

/// What the window opens with.
#[derive(Debug)]
pub struct WindowStart {
    pub choice: ViewChoice,
    /// Folders of shaders besides the usual ones.
    pub shaders: Vec<PathBuf>,
    /// What scenes get besides their files.
    pub additions: Additions,
    /// Which of a graph's alternatives run.
    pub fastest: Policy,
    /// Check the numbers that every step leaves.
    pub watch: bool,
    /// Of the window, in pixels.
    pub size: [u32; 2],
    /// Where pictures and states are written.
    pub folder: PathBuf,
    pub script: Option<Script>,
    /// By which another program shows its scene.
    pub link: Option<Link>,
    /// Whether the share of pixels was left to the adapter.
    pub usual_resolution: bool,
}

/// Why the window closed by itself, or did not open.
#[derive(Debug)]
pub enum Ended {
    /// No display, or none that can be drawn to.
    NoDisplay(Diagnostic),
    NoAdapter(Diagnostic),
    Faults(Faults),
}

/// Opens the window and runs until it is closed. Returns what a script had to say.
///
/// # Errors
/// No display, no adapter for it, a script that does not come about.
pub fn run(start: WindowStart) -> Result<Vec<String>, Ended> {
    let event_loop = EventLoop::<Wake>::with_user_event().build().map_err(|e| Ended::NoDisplay(no_display(&e)))?;
    let proxy = event_loop.create_proxy();
    if let Some(link) = &start.link {
        let proxy = proxy.clone();
        let wake = move || {
            // The window is gone only when the program ends.
            let _ = proxy.send_event(Wake);
        };
        link.start(wake).map_err(Ended::Faults)?;
    }
    let (tell, hear) = channel();
    let mut app = App {
        state: PanelState::new(start.choice.clone()),
        feed: Feed::default(),
        scenes: scenes_beside(&start),
        start,
        window: None,
        context: context(),
        proxy,
        tell,
        hear,
        wish: None,
        serial: 0,
        clock: None,
        repaint: None,
        noted: None,
        reopened: 0,
        ended: None,
    };
    let looped = event_loop.run_app(&mut app);
    // Frames under way end before the window does.
    app.window = None;
    match (app.ended, looped) {
        (Some(ended), _) => Err(ended),
        (None, Err(e)) => Err(Ended::NoDisplay(no_display(&e))),
        (None, Ok(())) => Ok(app.start.script.map_or(vec![], |s| s.log)),
    }
}

/// What the panels are drawn with: the least text can be read.
fn context() -> egui::Context {
    let context = egui::Context::default();
    context.all_styles_mut(|style| {
        style.text_styles.insert(egui::TextStyle::Small, egui::FontId::proportional(11.0));
        style.visuals.weak_text_alpha = 0.8;
    });
    context
}

/// The engine has something to tell.
#[derive(Debug, Clone, Copy)]
struct Wake;

struct App {
    start: WindowStart,
    state: PanelState,
    feed: Feed,
    scenes: Vec<PathBuf>,
    window: Option<OpenWindow>,
    context: egui::Context,
    proxy: EventLoopProxy<Wake>,
    tell: Sender<ViewState>,
    hear: Receiver<ViewState>,
    /// The last wish that the engine got.
    wish: Option<FrameRequest>,
    serial: u64,
    /// Since when time runs, and what it was then.
    clock: Option<(Instant, f32)>,
    /// When to paint again, if nothing happens.
    repaint: Option<Instant>,
    /// The last frame that editors were told of, and when.
    noted: Option<(Instant, Arc<ShownFrame>)>,
    /// How often a lost device was replaced.
    reopened: u32,
    ended: Option<Ended>,
}

/// An open window with all that belongs to its device.
struct OpenWindow {
    // In this order they are dropped: the engine uses the device, the screen the window.
    engine: StageThread,
    canvas: TexturePainter,
    screen: Screen,
    input: egui_winit::State,
    gpu: Arc<Gpu>,
    window: Arc<Window>,
    adapter: String,
}

impl ApplicationHandler<Wake> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_none() {
            match self.open(event_loop) {
                Ok(window) => {
                    window.window.request_redraw();
                    self.window = Some(window);
                }
                Err(ended) => self.end(event_loop, Some(ended)),
            }
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, _: Wake) {
        if let Some(window) = &self.window {
            window.window.request_redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.window else { return };
        match event {
            WindowEvent::CloseRequested => self.end(event_loop, None),
            WindowEvent::RedrawRequested => self.redraw(event_loop),
            WindowEvent::DroppedFile(path) => {
                self.state.edit("against", |c| c.compare.against = ComparedTo::Image(path));
                open.window.request_redraw();
            }
            event => {
                if let WindowEvent::Resized(size) = &event {
                    open.screen.resize(size.width, size.height);
                }
                if open.input.on_window_event(&open.window, &event).repaint {
                    open.window.request_redraw();
                }
            }
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(open) = &self.window else { return };
        let scripted = self.start.script.as_ref().is_some_and(|s| !s.is_done());
        // Between the frames of a script the engine gets its share of the processor.
        let next = if scripted { Some(Instant::now() + Duration::from_millis(8)) } else { self.repaint };
        match next {
            Some(at) if at <= Instant::now() => open.window.request_redraw(),
            Some(at) => event_loop.set_control_flow(ControlFlow::WaitUntil(at)),
            None => event_loop.set_control_flow(ControlFlow::Wait),
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: winit::event::StartCause) {
        if let (winit::event::StartCause::ResumeTimeReached { .. }, Some(open)) = (cause, &self.window) {
            open.window.request_redraw();
        }
    }
}

impl App {
    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<OpenWindow, Ended> {
        let display = event_loop.primary_monitor().or_else(|| event_loop.available_monitors().next());
        // A script says the size that its pictures have.
        let display = display.filter(|_| self.start.script.is_none()).map(|d| d.size().into());
        let [width, height] = fitting(self.start.size, display);
        let attributes = Window::default_attributes()
            .with_title("lightgraph")
            .with_inner_size(PhysicalSize::new(width, height))
            .with_min_inner_size(PhysicalSize::new(1, 1));
        let window = event_loop.create_window(attributes).map_err(|e| Ended::NoDisplay(no_display(&e)))?;
        self.open_on(Arc::new(window))
    }

    /// Opens a device for a window, and all that runs on it.
    fn open_on(&mut self, window: Arc<Window>) -> Result<OpenWindow, Ended> {
        let instance = Gpu::instance();
        let surface = instance.create_surface(window.clone()).map_err(|e| {
            let d = Diagnostic::error(format!("can't draw to the window: {e}"));
            Ended::NoDisplay(d.help("`lightgraph watch` and `lightgraph render` need no display"))
        })?;
        let wanted = wanted_adapter();
        let gpu = Gpu::open_for(&instance, wanted.as_deref(), Some(&surface)).map_err(|e| match e {
            OpenError::NoAdapter(d) => Ended::NoAdapter(d),
            OpenError::Other(f) => Ended::Faults(f),
        })?;
        let gpu = Arc::new(gpu);
        let screen = Screen::new(gpu.clone(), surface, &window).map_err(Ended::Faults)?;
        if self.start.usual_resolution && gpu.is_software() && self.wish.is_none() {
            // A software driver takes four times as long for every pixel of the window.
            let mut choice = self.state.now().clone();
            choice.resolution = super::choice::Resolution::Window(0.5);
            self.state.choice = super::undo::Undo::new(choice);
        }
        let (tell, proxy) = (self.tell.clone(), self.proxy.clone());
        let told = move |told| {
            // The window is gone only when the program ends.
            let _ = tell.send(told);
            let _ = proxy.send_event(Wake);
        };
        let WindowStart { shaders, additions, fastest, watch, .. } = &self.start;
        let stage = ViewStage::new(gpu.clone(), shaders.clone(), additions.clone(), *fastest, *watch);
        let engine = StageThread::start(stage, told).map_err(Ended::Faults)?;
        let most = gpu.limits.max_texture_dimension_2d as usize;
        let id = egui::ViewportId::ROOT;
        let input = egui_winit::State::new(self.context.clone(), id, &window, None, None, Some(most));
        let software = if gpu.is_software() { " (software)" } else { "" };
        let adapter = format!("{}{software}", gpu.info.name);
        Ok(OpenWindow { engine, canvas: TexturePainter::new(&gpu), screen, input, gpu, window, adapter })
    }

    fn end(&mut self, event_loop: &ActiveEventLoop, why: Option<Ended>) {
        self.ended = why;
        event_loop.exit();
    }

    /// One frame of the window.
    fn redraw(&mut self, event_loop: &ActiveEventLoop) {
        while let Ok(told) = self.hear.try_recv() {
            self.feed.take(told);
        }
        if self.feed.told.lost {
            return self.reopen(event_loop);
        }
        self.follow();
        self.note();
        let time = self.time();
        let Some(open) = &mut self.window else { return };
        let mut act = Act::Nothing;
        let mut input = open.input.take_egui_input(&open.window);
        if let Some(script) = &mut self.start.script {
            let size = open.window.inner_size();
            let moment = Moment {
                state: &self.state,
                told: &self.feed.told,
                rest: self.feed.told.rest && self.feed.told.serial == self.serial && self.serial > 0,
                size: [size.width, size.height],
            };
            match script.play(&moment) {
                Ok((events, next)) => {
                    input.events.extend(events);
                    act = next;
                }
                Err(f) => return self.end(event_loop, Some(Ended::Faults(f))),
            }
        }
        let (told, choice) = (&self.feed.told, self.state.now());
        let link = self.start.link.as_ref().map(Link::text);
        let image = open.canvas.main(&open.gpu, &mut open.screen.renderer, told, choice);
        let previews = open.canvas.previews(&open.gpu, &mut open.screen.renderer, told, choice);
        let seen = PanelContext {
            feed: &self.feed,
            image,
            previews: &previews,
            scenes: &self.scenes,
            time,
            adapter: &open.adapter,
            link,
        };
        self.state.marks.clear();
        let state = &mut self.state;
        let output = self.context.run_ui(input, |ui| panels::show(ui, state, &seen));
        open.input.handle_platform_output(&open.window, output.platform_output.clone());
        let delay = output.viewport_output.values().map(|v| v.repaint_delay).min();
        self.repaint = delay.filter(|d| *d < Duration::from_secs(3600)).map(|d| Instant::now() + d);
        let shot = if let Act::Shot(path) = &act { Some(path.as_path()) } else { None };
        let before = open.canvas.recorded();
        match open.screen.paint(Paint { context: &self.context, output, before, shot }) {
            Ok(true) => {}
            Ok(false) => self.repaint = Some(Instant::now() + Duration::from_millis(20)),
            Err(f) => self.state.message = Some((false, first(&f))),
        }
        if self.state.playing {
            self.repaint = Some(Instant::now());
        }
        self.title();
        self.send(event_loop);
        self.requests();
        match act {
            Act::Nothing | Act::Shot(_) => {}
            Act::Size(width, height) => {
                if let Some(open) = &mut self.window
                    && let Some(size) = open.window.request_inner_size(PhysicalSize::new(width, height))
                {
                    open.screen.resize(size.width, size.height);
                }
            }
            Act::LoseDevice => {
                if let Some(open) = &self.window {
                    open.gpu.device.destroy();
                    self.wish = None;
                }
            }
            Act::Close => self.end(event_loop, None),
        }
    }

    /// Takes what has come over the link.
    fn follow(&mut self) {
        let now = self.start.link.as_ref().map(Link::now);
        if let Some(now) = now.filter(|now| !Arc::ptr_eq(now, &self.state.linked)) {
            self.state.follow(now);
        }
    }

    /// Leaves for editors what the passes took and why they ran, seldom while frames follow each other.
    fn note(&mut self) {
        const SELDOM: Duration = Duration::from_secs(1);
        let (Some(frame), Some(subject)) = (&self.feed.told.frame, &self.feed.told.subject) else { return };
        let due = |at: &Instant| self.feed.told.rest || at.elapsed() > SELDOM;
        let new = self.noted.as_ref().is_none_or(|(at, last)| !Arc::ptr_eq(last, frame) && due(at));
        if new {
            let status =
                |p: &PassTimes| PassStatus { name: p.name.clone(), ms: p.gpu_ms, ran: p.ran > 0, why: p.why.clone() };
            // Without a cache nobody is told, and nothing is amiss.
            let _ = Status::new(&subject.path, self.feed.passes.iter().map(status)).write();
            self.noted = Some((Instant::now(), frame.clone()));
        }
    }

    /// Tells the engine what the panels made of the choice.
    fn send(&mut self, event_loop: &ActiveEventLoop) {
        let time = self.time();
        let Some(open) = &self.window else { return };
        let most = open.gpu.limits.max_texture_dimension_2d;
        let mut wish = self.state.wish(self.serial, time, most);
        if let Some(last) = &self.wish
            && last.asks_the_same(&wish)
        {
            return;
        }
        self.serial += 1;
        wish.serial = self.serial;
        if !open.engine.wish(wish.clone()) {
            let d = Diagnostic::error("the thread that renders has ended by itself");
            return self.end(event_loop, Some(Ended::Faults(d.into())));
        }
        self.wish = Some(wish);
        // What is seen may be drawn anew at once: exposure, for one, needs no engine.
        self.repaint = Some(Instant::now());
    }

    /// Seconds, for scenes that move.
    fn time(&mut self) -> f32 {
        let still = self.state.now().time;
        match (self.state.playing, self.clock) {
            (true, Some((since, from))) => from + since.elapsed().as_secs_f32(),
            (true, None) => {
                self.clock = Some((Instant::now(), still));
                still
            }
            (false, Some((since, from))) => {
                let stopped = from + since.elapsed().as_secs_f32();
                self.clock = None;
                self.state.edit("time", |c| c.time = stopped);
                self.state.choice.rest();
                self.state.now().time
            }
            (false, None) => still,
        }
    }

    /// Another device in place of a lost one; the choice stays.
    fn reopen(&mut self, event_loop: &ActiveEventLoop) {
        const OFTEN: u32 = 3;
        let faults = Faults(self.feed.told.faults.to_vec());
        let Some(open) = self.window.take() else { return };
        let window = open.window.clone();
        drop(open);
        self.feed = Feed::default();
        while self.hear.try_recv().is_ok() {}
        self.reopened += 1;
        if self.reopened > OFTEN {
            return self.end(event_loop, Some(Ended::Faults(faults)));
        }
        (self.wish, self.context) = (None, egui::Context::default());
        self.state.message = Some((false, format!("{}; opened anew", first(&faults))));
        match self.open_on(window) {
            Ok(open) => {
                open.window.request_redraw();
                self.window = Some(open);
            }
            Err(ended) => self.end(event_loop, Some(ended)),
        }
    }

    fn title(&self) {
        if let (Some(open), Some(subject)) = (&self.window, &self.feed.told.subject) {
            let title = format!("{} · {} · lightgraph", subject.path.display(), subject.scene.name);
            if open.window.title() != title {
                open.window.set_title(&title);
            }
        }
    }

    fn requests(&mut self) {
        for request in std::mem::take(&mut self.state.requests) {
            let done = self.window.as_ref().ok_or_else(nothing).and_then(|open| {
                Saved {
                    gpu: &open.gpu,
                    adapter: &open.adapter,
                    choice: self.state.now(),
                    told: &self.feed.told,
                    folder: &self.start.folder,
                }
                .write(request)
            });
            self.state.message = Some(match done {
                Ok(path) => (true, format!("wrote {}", path.display())),
                Err(f) => (false, first(&f)),
            });
            if let Some(open) = &self.window {
                open.window.request_redraw();
            }
        }
    }
}

fn first(faults: &Faults) -> String {
    faults.0.first().map_or_else(|| render(&faults.0), |d| d.message.clone())
}

/// The scenes to choose from.
fn scenes_beside(start: &WindowStart) -> Vec<PathBuf> {
    let folder = start.choice.scene.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let linked = start.link.is_some().then(|| PathBuf::from(link::NAME));
    variants::scenes(folder).into_iter().chain(linked).collect()
}

fn no_display(e: &dyn std::fmt::Display) -> Diagnostic {
    let set = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    let d = if set("DISPLAY") || set("WAYLAND_DISPLAY") {
        Diagnostic::error(format!("no window can be opened: {e}"))
    } else {
        Diagnostic::error("no window can be opened: neither DISPLAY nor WAYLAND_DISPLAY is set")
            .help("log in with a display, or set DISPLAY (with ssh: `ssh -X`)")
    };
    d.help("`lightgraph watch` renders again on every change, without a window")
}
