//! The sessions of the graphs that are seen or were seen, and the frames they make. What can't be made leaves what is
//! there as it is.

mod kept;
mod looks;
mod probe;
mod scene;

use super::choice::{ComparedTo, SplitLayout, ViewChoice};
use super::feed::{Remade, ShownFrame, Subject, ViewState};
use super::link::Linked;
use super::shown::{ReferenceImage, reference};
use super::variants::{self, Variant};
use kept::{KeptSession, Key, output};
use lightgraph::internals::fastest::Policy;
use lightgraph::internals::gpu::Timing;
use lightgraph::internals::image::exposure::Exposure;
use lightgraph::internals::image::png::ToneMap;
use lightgraph::internals::plan::fastest::still;
use lightgraph::internals::plan::memory;
use lightgraph::internals::reload::{folder_of, folders};
use lightgraph::internals::scene::Additions;
use lightgraph::internals::session::Pointer;
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Faults, Gpu, Plan, Project, Session, Settings};
use looks::Looks;
use probe::LastAnswer;
pub use probe::{Ask, ProbedPlace};
use scene::LoadedScene;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Memory that sessions may hold which are not seen now, in bytes.
const MOST_KEPT: u64 = 1 << 30;

/// What is to be shown.
#[derive(Debug, Clone)]
pub struct FrameRequest {
    pub serial: u64,
    pub choice: ViewChoice,
    /// Width and height to render, in pixels.
    pub size: [u32; 2],
    /// Seconds, for scenes and shaders that move.
    pub time: f32,
    /// In pixels of the image, for shaders that read it.
    pub pointer: Pointer,
    /// The output to show; `None`: `color`, or else the graph's first.
    pub output: Option<String>,
    /// A resource to look into.
    pub inspect: Option<ResourcePart>,
    /// An invocation to ask what it computes.
    pub ask: Option<Ask>,
    /// Make all variants ready to be switched to.
    pub prepare: bool,
    /// What came over the link, where its scene is to be shown.
    pub linked: Option<Arc<Linked>>,
}

/// A part of a resource.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResourcePart {
    pub resource: String,
    pub mip: u32,
    /// A layer, a cube's face (6 for each cube) or a slice.
    pub layer: u32,
}

impl FrameRequest {
    /// Whether another one asks for the same.
    pub fn asks_the_same(&self, other: &FrameRequest) -> bool {
        let asked = |w: &FrameRequest| {
            let mut choice = w.choice.clone();
            // The window alone cares for these; what exposes by itself has to look at the image.
            if choice.exposure != Exposure::Auto {
                choice.exposure = Exposure::Stops(0.0);
            }
            choice.tone_map = ToneMap::None;
            choice.compare.layout = SplitLayout::default();
            let looks = (w.output.clone(), w.inspect.clone(), w.ask.clone());
            let linked = w.linked.as_ref().map(Arc::as_ptr);
            (choice, w.size, w.time.to_bits(), w.pointer, looks, w.prepare, linked)
        };
        asked(self) == asked(other)
    }
}

/// Everything between a wish and what is told.
pub struct ViewStage {
    gpu: Arc<Gpu>,
    shaders: Vec<PathBuf>,
    /// What scenes get besides their files.
    additions: Additions,
    /// Which alternatives of graphs run, and whether the numbers that steps leave are checked.
    fastest: Policy,
    watch: bool,
    scene: Option<LoadedScene>,
    kept: Vec<KeptSession>,
    /// What was tried in vain, so that it is not tried again before something changes.
    vain: Vec<(Key, Faults)>,
    reference: Option<(PathBuf, Checked<ReferenceImage>)>,
    variants: Arc<Vec<Variant>>,
    /// The graph that is shown; it stays when another can't be made.
    shown: Option<PathBuf>,
    images: u64,
    looks: Looks,
    answer: Option<LastAnswer>,
    remade: Option<Remade>,
    /// Grows when files change.
    revision: u64,
}

impl ViewStage {
    pub fn new(gpu: Arc<Gpu>, shaders: Vec<PathBuf>, additions: Additions, fastest: Policy, watch: bool) -> ViewStage {
        ViewStage {
            gpu,
            shaders,
            additions,
            fastest,
            watch,
            scene: None,
            kept: vec![],
            vain: vec![],
            reference: None,
            variants: Arc::default(),
            shown: None,
            images: 0,
            looks: Looks::default(),
            answer: None,
            remade: None,
            revision: 0,
        }
    }

    /// Files have changed; with none named, any may have.
    pub fn changed(&mut self, files: &BTreeSet<PathBuf>) {
        self.vain.clear();
        let text = |f: &Path| f.extension().is_some_and(|e| e == "ron" || e == "wgsl");
        // Graphs and shaders are texts; a picture beside them is no change.
        if files.is_empty() || files.iter().any(|f| text(f)) {
            self.revision += 1;
            self.variants = Arc::default();
            self.reference = None;
        }
        if let Some(scene) = &mut self.scene {
            let homes: BTreeSet<PathBuf> = scene.files.iter().filter_map(|f| folder_of(f)).collect();
            let shader = |f: &Path| f.extension().is_some_and(|e| e == "wgsl");
            let touches = |f: &PathBuf| !shader(f) && homes.iter().any(|h| f.starts_with(h));
            scene.stale |= files.is_empty() || files.iter().any(touches);
        }
    }

    /// The folders whose files matter for a choice.
    pub fn folders(&self, choice: &ViewChoice) -> BTreeSet<PathBuf> {
        let mut all = folders(&choice.graph, Some(&choice.scene), &self.shaders);
        all.extend(self.scene.iter().flat_map(|s| &s.files).filter_map(|f| folder_of(f)));
        if let ComparedTo::Graph(path) = &choice.compare.against {
            all.extend(folders(path, Some(&choice.scene), &self.shaders));
        }
        all
    }

    /// Goes one frame towards what is wished for. `early` is called with what can be shown before that.
    pub fn advance(&mut self, wish: &FrameRequest, early: &mut dyn FnMut(ViewState)) -> ViewState {
        let mut faults = vec![];
        let mut told = ViewState { serial: wish.serial, ..ViewState::default() };
        if self.variants.is_empty() {
            self.variants = Arc::new(variants::beside(&wish.choice.graph));
        }
        let mut remade = Remade::default();
        if let Err(f) = self.set_scene(wish, &mut remade) {
            faults.extend(f.0);
        }
        let graph = wish.choice.graph.clone();
        if self.shown.as_ref() != Some(&graph)
            && let Some(kept) = self.find(&graph)
        {
            early(self.tell(ViewState {
                subject: Some(kept.subject.clone()),
                image: kept.image.clone(),
                ..told.clone()
            }));
        }
        match self.make(&graph, wish, &mut remade) {
            Ok(()) => self.shown = Some(graph),
            Err(f) => faults.extend(f.0),
        }
        if let Some(shown) = self.shown.clone() {
            let start = Instant::now();
            match self.frame(&shown, wish) {
                Ok(frame) => told.frame = frame.map(Arc::new),
                Err(f) => faults.extend(f.0),
            }
            if remade.prepare_ms > 0.0 {
                remade.frame_ms = ms(start);
                self.remade = Some(remade);
            }
        }
        let other = match self.other(wish) {
            Ok(other) => other,
            Err(f) => {
                faults.extend(f.0);
                None
            }
        };
        let mut rest = self.both(wish).into_iter().all(|k| k.rest);
        if rest && wish.prepare {
            rest = !self.prepare_next(wish);
        }
        if let Some(kept) = self.shown.as_ref().and_then(|s| self.find(s)) {
            told.subject = Some(kept.subject.clone());
            told.image.clone_from(&kept.image);
            told.frames[0] = kept.frames;
            told.checks = kept.checks.clone();
            let mut notices = self.scene.as_ref().map_or(vec![], |s| s.notices.clone());
            notices.extend(kept.session.notices.iter().cloned());
            told.notices = Arc::new(notices);
        }
        if let ComparedTo::Graph(path) = &wish.choice.compare.against {
            told.frames[1] = self.find(path).map_or(0, |k| k.frames);
        }
        told.other = other;
        told.automatic = self.expose(wish, rest);
        told.score = self.score(wish, rest);
        told.inspected = self.inspect(wish, rest);
        let asked = self.probe(wish, rest);
        told.probed = self.answer.as_ref().map(|a| a.probed.clone());
        // A probe leaves what its frame made.
        told.rest = rest && !asked;
        self.forget(wish);
        if let Err(f) = self.gpu.check() {
            (faults, told.lost) = (f.0, true);
        }
        told.faults = Arc::new(faults);
        self.tell(told)
    }

    fn tell(&self, told: ViewState) -> ViewState {
        let ready = self.kept.iter().filter_map(|k| Some((k.key.graph.clone(), k.image.clone()?, k.images)));
        ViewState {
            images: self.images,
            variants: self.variants.clone(),
            ready: ready.collect(),
            remade: self.remade,
            ..told
        }
    }

    fn find(&self, graph: &Path) -> Option<&KeptSession> {
        self.kept.iter().find(|k| k.key.graph == graph)
    }

    /// The sessions that are seen.
    fn both(&self, wish: &FrameRequest) -> Vec<&KeptSession> {
        let other = match &wish.choice.compare.against {
            ComparedTo::Graph(path) => Some(path),
            ComparedTo::Nothing | ComparedTo::Image(_) => None,
        };
        self.shown.iter().chain(other).filter_map(|p| self.find(p)).collect()
    }

    /// Makes the session of a graph what the wish asks for.
    fn make(&mut self, graph: &Path, wish: &FrameRequest, remade: &mut Remade) -> Checked<()> {
        let Some(scene) = &self.scene else { return Ok(()) };
        let (scene, version) = (scene.scene.clone(), scene.version);
        let at = self.kept.iter().position(|k| k.key.graph == graph);
        let mut key = Key {
            graph: graph.into(),
            params: wish.choice.params.clone(),
            size: wish.size,
            scene: version,
            revision: self.revision,
        };
        if let Some(kept) = at.map(|i| &self.kept[i]) {
            key.params = accepted(&kept.project.graph, &wish.choice.params);
            if kept.key == key {
                return Ok(());
            }
        }
        self.vain(&key)?;
        let start = Instant::now();
        let project = match at {
            Some(i) if self.kept[i].key.revision == self.revision => self.kept[i].project.clone(),
            _ => {
                let project = Project::open(graph, &self.shaders).map_err(|f| self.note(key.clone(), f))?;
                match self.kept.last() {
                    // Variants have most of their shaders in common.
                    Some(other) => Project { texts: project.texts.after(&other.project.texts), ..project },
                    None => project,
                }
            }
        };
        key.params = accepted(&project.graph, &wish.choice.params);
        remade.graph_ms = ms(start);
        let start = Instant::now();
        // What is once decided stays: an edit is to be seen at once.
        let decided = at.map(|i| still(&project.graph, &self.kept[i].session.settings.choices));
        let mut settings = Settings {
            params: key.params.clone(),
            size: wish.size,
            camera: wish.choice.camera.clone(),
            skip: true,
            watch: self.watch,
            inspect: true,
            timing: Timing::of_steps(&self.gpu),
            choices: decided.unwrap_or_default(),
            ..Settings::default()
        };
        let choices = self.fastest.choices(&self.gpu, &project, &scene, &settings);
        settings.choices = choices.map_err(|f| self.note(key.clone(), f))?;
        // What came over would not be checked by this session.
        let before = at.filter(|_| !self.watch).map(|i| &self.kept[i].session);
        let session = Session::after(&self.gpu, &project, scene.clone(), settings, before)
            .map_err(|f| self.note(key.clone(), f))?;
        remade.prepare_ms = ms(start);
        let subject = Arc::new(Subject {
            graph: Arc::new(project.graph.clone()),
            path: graph.into(),
            params: key.params.clone(),
            shared: shared(&session.plan),
            plan: session.plan.clone(),
            points: ["pointer", "buttons"].iter().any(|name| session.reads(name)),
            moves: scene.duration() > 0.0 || ["time", "delta_time"].iter().any(|name| session.reads(name)),
            scene,
        });
        let (output, image) = (String::new(), None);
        let made = KeptSession {
            key,
            project,
            session,
            subject,
            output,
            image,
            images: 0,
            // History comes over, and what counts frames goes on.
            frames: at.map_or(0, |i| self.kept[i].frames),
            last: None,
            rest: false,
            fault: None,
            checks: Arc::default(),
            numerics: None,
        };
        if let Some(i) = at {
            self.kept.remove(i);
        }
        // The one used last is dropped last.
        self.kept.push(made);
        Ok(())
    }

    /// Renders a frame of a graph when there may be something new in it.
    fn frame(&mut self, graph: &Path, wish: &FrameRequest) -> Checked<Option<ShownFrame>> {
        let gpu = self.gpu.clone();
        let Some(at) = self.kept.iter().position(|k| k.key.graph == graph) else { return Ok(None) };
        let kept = &mut self.kept[at];
        let mut seen = wish.choice.clone();
        // How it is shown does not matter to what is rendered.
        (seen.exposure, seen.compare) = (Exposure::Auto, super::choice::Compare::default());
        let shift = seen.shift(wish.linked.as_deref());
        let same = kept.session.pointer == wish.pointer
            && kept.session.shift == shift
            && kept.last.as_ref().is_some_and(|l| l.0 == seen && l.1.to_bits() == wish.time.to_bits());
        let output = output(&kept.session, wish.output.as_deref())?;
        if same && kept.rest && kept.output == output {
            return kept.fault.clone().map_or(Ok(None), Err);
        }
        if kept.session.retime(&gpu, &kept.project, wish.time)? {
            let plan = kept.session.plan.clone();
            kept.subject = Arc::new(Subject { shared: shared(&plan), plan, ..Subject::clone(&kept.subject) });
        }
        kept.session.shift = shift;
        kept.session.settings.camera.clone_from(&seen.camera);
        kept.session.pointer = wish.pointer;
        kept.last = Some((seen, wish.time));
        kept.output.clone_from(&output);
        let rendered = kept.render(&gpu, wish.time);
        kept.fault = rendered.as_ref().err().cloned();
        kept.rest = rendered.as_ref().map_or(true, |r| r.report.steps.is_empty());
        self.images += u64::from(!kept.rest);
        rendered.map(Some)
    }

    /// The image to hold the shown one against.
    fn other(&mut self, wish: &FrameRequest) -> Checked<Option<wgpu::Texture>> {
        match &wish.choice.compare.against {
            ComparedTo::Nothing => Ok(None),
            ComparedTo::Graph(path) => {
                let made = self.make(path, wish, &mut Remade::default());
                let framed = made.and_then(|()| self.frame(path, wish));
                framed.map(|_| self.find(path).and_then(|k| k.image.clone()))
            }
            ComparedTo::Image(path) => {
                if self.reference.as_ref().is_none_or(|r| r.0 != *path) {
                    self.images += 1;
                    self.reference = Some((path.clone(), reference(&self.gpu, path)));
                }
                match &self.reference {
                    Some((_, Ok(r))) => Ok(Some(r.texture.clone())),
                    Some((_, Err(f))) => Err(f.clone()),
                    None => Ok(None),
                }
            }
        }
    }

    /// Makes the next variant ready that is not. False when none is left.
    fn prepare_next(&mut self, wish: &FrameRequest) -> bool {
        let held: u64 = self.kept.iter().map(|k| k.session.plan.bytes().0).sum();
        if held > MOST_KEPT {
            return false;
        }
        let variants = self.variants.clone();
        for variant in variants.iter().filter(|v| !v.broken) {
            if self.find(&variant.path).is_some() {
                continue;
            }
            let made = self.make(&variant.path, wish, &mut Remade::default());
            // Its faults are told when it is chosen.
            if made.and_then(|()| self.frame(&variant.path, wish)).is_ok_and(|f| f.is_some()) {
                return true;
            }
        }
        false
    }

    /// Drops sessions that are not seen, the oldest first, until what they hold is little enough.
    fn forget(&mut self, wish: &FrameRequest) {
        let mut held: u64 = self.kept.iter().map(|k| k.session.plan.bytes().0).sum();
        let mut at = 0;
        while held > MOST_KEPT && at < self.kept.len() {
            let path = &self.kept[at].key.graph;
            let seen = self.shown.as_ref() == Some(path)
                || wish.choice.compare.against == ComparedTo::Graph(path.clone())
                || wish.choice.graph == *path;
            if seen {
                at += 1;
            } else {
                held -= self.kept.remove(at).session.plan.bytes().0;
            }
        }
    }

    fn vain(&self, key: &Key) -> Checked<()> {
        match self.vain.iter().find(|v| v.0 == *key) {
            Some((_, faults)) => Err(faults.clone()),
            None => Ok(()),
        }
    }

    fn note(&mut self, key: Key, faults: Faults) -> Faults {
        // A drag of a slider over a broken graph tries many.
        if self.vain.len() > 64 {
            self.vain.clear();
        }
        self.vain.push((key, faults.clone()));
        faults
    }
}

/// The plan as `render` has it: here every resource has memory of its own, to be looked at.
fn shared(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    plan.slots.clear();
    memory::allocate(&mut plan, true);
    plan
}

/// What a graph takes of the parameters that were set.
pub fn accepted(graph: &lightgraph::Graph, params: &Values) -> Values {
    let takes =
        |name: &String, value| graph.params.iter().any(|(n, param)| n.value == *name && param.accepts(value).is_ok());
    params.iter().filter(|(name, value)| takes(name, value)).map(|(n, v)| (n.clone(), *v)).collect()
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests;
