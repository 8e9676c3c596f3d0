//! A long flight through a scene that changes all the time: cameras, lights and nodes move, parameters are set, the
//! window is resized, the graph is read again.

use super::case::Cases;
use super::dice::Dice;
use super::report::{CaseRow, RowState, StressReport};
use super::run::{StressGraph, difference};
use super::{StressOptions, finish};
use glam::Vec3;
use lightgraph::internals::scene::Shift;
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, Gpu, Image, Project, Scene, Session, Settings};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::ErrorKind;
use std::process::Command;
use std::time::Instant;

/// Frames between two looks at the image.
const STRIDE: u32 = 25;
/// Frames that history gets to settle when everything is as it was in the beginning.
const SETTLE: u32 = 24;
/// Relative difference from the first image that is left then.
const DRIFT: f64 = 5e-4;
/// How much more memory the process may hold after the second flight than after the first: 5 %, and the driver's own
/// buffers.
const MEMORY: f64 = 1.05;
const MEMORY_SLACK: f64 = 16.0 * 1024.0 * 1024.0;

/// The rows of a graph's flight in a process of its own.
///
/// # Errors
/// The process can't be started, or says what went wrong.
pub(super) fn elsewhere(graph: &StressGraph, options: &StressOptions, seconds: Option<f64>) -> Checked<Vec<CaseRow>> {
    let folder = options.folder.join(format!("flight of {}", graph.name));
    let mut command = Command::new(&options.program);
    command.args(["stress", "--filter", "flight", "--seed", &options.seed.to_string()]);
    command.arg("--graphs").arg(&graph.path).arg("--cases").arg(&options.cases).arg("--out").arg(&folder);
    for shaders in &options.shaders {
        command.arg("--shaders").arg(shaders);
    }
    if options.quick {
        command.arg("--quick");
    }
    if let Some(seconds) = seconds {
        command.args(["--seconds", &seconds.to_string()]);
    }
    let fault = |why: String| Diagnostic::error(format!("the flight of {}: {why}", graph.name));
    // What an earlier run left there says nothing of this one.
    match std::fs::remove_dir_all(&folder) {
        Err(e) if e.kind() != ErrorKind::NotFound => {
            return Err(fault(format!("can't empty {}: {e}", folder.display())).into());
        }
        _ => {}
    }
    // 1: something failed, as its rows say.
    finish(&mut command, &[0, 1]).map_err(fault)?;
    Ok(StressReport::read(&folder)?.rows)
}

/// One flight.
pub(super) struct FlightRun<'a> {
    /// Of this device alone, so that what it counts is this flight's.
    pub instance: &'a wgpu::Instance,
    pub gpu: &'a Gpu,
    pub cases: &'a Cases,
    pub graph: &'a StressGraph,
    pub seed: u64,
    pub frames: u32,
}

/// What a flight left behind.
#[derive(Debug, Default)]
struct FlightTrace {
    /// Of the images at every look.
    hashes: Vec<u64>,
    frames: u32,
    /// Bytes of the process, and objects of the device, in the beginning and with everything as it was then.
    begun: Option<(f64, usize)>,
    left: Option<(f64, usize)>,
    drift: f64,
    finite: bool,
}

impl FlightRun<'_> {
    /// Flies twice, and compares. The first flight ends early when `half` says so, the second when `stop` does.
    ///
    /// # Errors
    /// What the device or a reload reports.
    pub fn rows(&self, half: &mut dyn FnMut() -> bool, stop: &mut dyn FnMut() -> bool) -> Checked<Vec<CaseRow>> {
        let start = Instant::now();
        let first = self.fly(self.frames, half)?;
        let seconds = start.elapsed().as_secs_f64();
        if first.frames == 0 {
            return Ok(vec![CaseRow::new("fly-through", "flight", &self.graph.name, "").left()]);
        }
        let setting = format!("{} frames", first.frames);
        let row = |case: &str| {
            let mut row = CaseRow::new("fly-through", case, &self.graph.name, &setting);
            row.seconds = seconds;
            if first.frames < self.frames {
                row.note(&format!("{} were asked for; time ran out", self.frames));
            }
            row
        };
        let begin = Instant::now();
        let second = self.fly(first.frames, stop)?;
        let mut again = row("flight: second run");
        again.seconds = begin.elapsed().as_secs_f64();
        let mut finite = row("flight: numbers");
        if !(first.finite && second.finite) {
            finite.fail("an image holds what is no number");
        }
        let mut drift = row("flight: drift");
        let most = first.drift.max(second.drift);
        drift.judge(Some(0.0), Some(most), most, DRIFT);
        let mut memory = row("flight: memory, MiB");
        let mut objects = row("flight: device objects");
        match (first.begun, first.left, second.left) {
            (Some((_, count)), Some((bytes, count_after)), Some((bytes_after, _))) => {
                let (count, count_after) = (count as f64, count_after as f64);
                objects.judge(Some(count), Some(count_after), count_after, count);
                // The second flight does nothing that the first has not done, so the system has all pages that it
                // takes.
                let mib = 1024.0 * 1024.0;
                let most = (bytes * MEMORY).max(bytes + MEMORY_SLACK) / mib;
                memory.judge(Some(bytes / mib), Some(bytes_after / mib), bytes_after / mib, most);
                if second.frames == 0 {
                    memory.state = RowState::Left;
                    memory.note("no time was left for a second flight");
                }
            }
            _ => {
                for row in [&mut memory, &mut objects] {
                    row.state = RowState::Absent;
                    row.note("this system does not say");
                }
            }
        }
        let differs = first.hashes.iter().zip(&second.hashes).position(|(a, b)| a != b);
        match differs {
            Some(i) => again.fail(&format!("other bits at frame {}", (i as u32 + 1) * STRIDE)),
            None if second.hashes.is_empty() => again.state = RowState::Left,
            None => {
                again.note(&format!("the same bits at {} looks over {} frames", second.hashes.len(), second.frames))
            }
        }
        Ok(vec![finite, drift, memory, objects, again])
    }

    fn fly(&self, frames: u32, stop: &mut dyn FnMut() -> bool) -> Checked<FlightTrace> {
        let loaded = self.cases.fly.scene.load(&Default::default(), &self.cases.folder)?;
        let mut settings = self.cases.settings.clone();
        settings.extend(self.cases.fly.set.clone());
        let mut plane = Plane {
            flight: self,
            scene: loaded.scene,
            project: self.graph.project.clone(),
            start: self.graph.project.params(&self.graph.texts(&settings))?,
            session: None,
            dice: Dice::new(self.seed, &self.graph.name),
            frame: 0,
        };
        let mut trace = FlightTrace { finite: true, ..FlightTrace::default() };
        let first = plane.home()?;
        trace.begun = self.held();
        for i in 0..frames {
            if i % STRIDE == 0 && stop() {
                break;
            }
            plane.step()?;
            trace.frames += 1;
            if (i + 1) % STRIDE == 0 {
                let image = plane.image()?;
                trace.finite &= image.data.iter().all(|x| x.is_finite());
                let mut h = DefaultHasher::new();
                (image.width, image.height).hash(&mut h);
                image.data.iter().for_each(|x| x.to_bits().hash(&mut h));
                trace.hashes.push(h.finish());
            }
        }
        trace.drift = difference(&plane.home()?, &first, 1.0);
        trace.left = self.held();
        Ok(trace)
    }
}

/// A session in flight.
struct Plane<'a> {
    flight: &'a FlightRun<'a>,
    scene: Scene,
    project: Project,
    /// The parameters that it starts with.
    start: Values,
    session: Option<Session>,
    dice: Dice,
    frame: u32,
}

impl Plane<'_> {
    /// Everything as in the beginning, with nothing kept for plans that are gone, and what is seen once history has
    /// settled.
    fn home(&mut self) -> Checked<Image> {
        let size = self.flight.cases.fly.size;
        self.flight.gpu.forget();
        self.open(self.start.clone(), [size.0, size.1])?;
        if let Some(session) = &mut self.session {
            session.shift = Shift::default();
        }
        for _ in 0..SETTLE {
            self.render(0.0)?;
        }
        self.image()
    }

    /// Takes the place of the session, as an edit of the graph or of the window does.
    fn open(&mut self, params: Values, size: [u32; 2]) -> Checked<()> {
        let output = self.flight.cases.adapters.output.clone();
        let settings = Settings { params, size, outputs: Some(vec![output]), skip: true, ..Settings::default() };
        let previous = self.session.take();
        let shift = previous.as_ref().map_or(Shift::default(), |s| s.shift.clone());
        let mut session =
            Session::after(self.flight.gpu, &self.project, self.scene.clone(), settings, previous.as_ref())?;
        session.shift = shift;
        self.session = Some(session);
        Ok(())
    }

    fn render(&mut self, time: f32) -> Checked<()> {
        let session = self.session.as_mut().ok_or_else(|| Diagnostic::error("there is no session"))?;
        session.frame(self.flight.gpu, self.frame, time)?;
        self.frame += 1;
        Ok(())
    }

    fn image(&self) -> Checked<Image> {
        let session = self.session.as_ref().ok_or_else(|| Diagnostic::error("there is no session"))?;
        session.image(self.flight.gpu, &self.flight.cases.adapters.output)
    }

    /// A random edit, and a frame.
    fn step(&mut self) -> Checked<()> {
        let reach = self.scene.bounds.diagonal() * 0.1;
        let by = Vec3::from_array(std::array::from_fn(|_| self.dice.between(-1.0, 1.0) as f32)) * reach;
        let event = self.dice.below(100);
        let Some(session) = &mut self.session else { return Ok(()) };
        match event {
            0..55 => session.shift.cameras = by,
            55..70 => session.shift.lights = by,
            70..80 => {
                let node = self.dice.below(self.scene.nodes.len().max(1));
                session.shift.nodes = vec![(node, by * 0.3)];
            }
            80..90 => session.shift = Shift::default(),
            90..93 => {
                let sizes = [[8, 6], [1, 1], [13, 7], [6, 8]];
                let size = sizes[self.dice.below(sizes.len())];
                let params = session.settings.params.clone();
                self.open(params, size)?;
            }
            93..96 => {
                let params = super::random::near(&self.project, &self.start, &mut self.dice);
                let size = session.settings.size;
                self.open(params, size)?;
            }
            96..98 => {
                let (params, size) = (session.settings.params.clone(), session.settings.size);
                self.project = Project::open(&self.flight.graph.path, &[])?;
                self.open(params, size)?;
            }
            _ => {}
        }
        let time = self.frame as f32 / 60.0;
        self.render(time)
    }
}

impl FlightRun<'_> {
    /// Bytes that the process holds, and objects that the device does; `None` where nobody says.
    fn held(&self) -> Option<(f64, usize)> {
        // What was dropped goes when the device is asked next.
        self.gpu.wait().ok()?;
        let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
        let pages: f64 = statm.split_whitespace().nth(1)?.parse().ok()?;
        let report = self.instance.generate_report()?;
        let hub = report.hub_report();
        let counted = [
            &hub.buffers,
            &hub.textures,
            &hub.texture_views,
            &hub.bind_groups,
            &hub.bind_group_layouts,
            &hub.pipeline_layouts,
            &hub.compute_pipelines,
            &hub.render_pipelines,
            &hub.shader_modules,
            &hub.samplers,
            &hub.query_sets,
            &hub.command_buffers,
        ];
        // Pages are 4 KiB on every system that has this file, but for a few; there the ratio still holds.
        Some((pages * 4096.0, counted.iter().map(|r| r.num_kept_from_user).sum()))
    }
}
