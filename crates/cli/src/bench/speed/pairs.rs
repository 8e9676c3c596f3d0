//! Whole frames: two graphs in turn, growing settings, start-up, times that others published.

use super::list::{GraphPair, GraphRun, Moves, OtherTime, Scaling, StartUp, Time};
use super::{Bench, Goal, SpeedRow};
use crate::bench::references::Manifest;
use crate::bench::score::score;
use glam::Vec3;
use lightgraph::internals::diag::{Source, Span};
use lightgraph::internals::gpu::Timing;
use lightgraph::internals::graph::expr::{Expr, Val};
use lightgraph::internals::image::metrics::compare;
use lightgraph::internals::plan::Desc;
use lightgraph::internals::scene::Shift;
use lightgraph::{Checked, Diagnostic, Gpu, Plan, Project, Scene, Session, Settings};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A step of what moves, as a share of the diagonal of the scene's bounds.
const STEP: f32 = 0.0025;

/// A GPU that was idle takes its time to come to its full clock.
const AWAKE: Duration = Duration::from_millis(500);

/// A session that can be timed.
pub(super) struct TimedSession {
    pub session: Session,
    moves: Moves,
    frames: u32,
    /// What the last frame took on the device.
    device_ms: Option<f64>,
}

impl TimedSession {
    pub fn frame(&mut self, gpu: &Gpu) -> Checked<f64> {
        let step = self.session.scene.bounds.diagonal() * STEP * (1 + self.frames % 7) as f32;
        let shift = Vec3::X * step;
        self.session.shift = match self.moves {
            Moves::All => Shift::default(),
            Moves::Lights => Shift { lights: shift, ..Shift::default() },
            Moves::Camera => Shift { cameras: shift, ..Shift::default() },
        };
        let start = Instant::now();
        self.device_ms = self.session.frame(gpu, self.frames, 0.0)?.device_ms;
        self.frames += 1;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }
}

/// The least of some times, which is the one least disturbed by others on the machine.
pub(super) fn least(times: &[f64]) -> f64 {
    times.iter().copied().fold(f64::INFINITY, f64::min)
}

/// The one in the middle of an odd number; of an even number the larger of both.
pub(super) fn median(mut of: Vec<f64>) -> f64 {
    of.sort_by(f64::total_cmp);
    of.get(of.len() / 2).copied().unwrap_or(f64::NAN)
}

/// A value of an expression over what a plan knows.
pub(super) fn number(text: &str, plan: &Plan) -> Checked<f64> {
    let source = Source::new("an expression of the list", text);
    let value = Expr::parse(&Span::whole(&source), text)?.eval(&|n| plan.value(n).map(Val::from))?;
    match value {
        Val::Int(i) => Ok(i as f64),
        Val::Float(f) => Ok(f),
        other => Err(Diagnostic::error(format!("`{text}` is {other:?}, not a number")).into()),
    }
}

impl Bench<'_> {
    pub(super) fn settings(&self, run: &GraphRun, project: &Project) -> Checked<Settings> {
        Ok(Settings {
            params: project.params(&run.set)?,
            size: [run.size.0, run.size.1],
            outputs: Some(run.outputs.clone()).filter(|o| !o.is_empty()),
            ..Settings::default()
        })
    }

    /// As [`Bench::settings`], with the alternatives that are to run.
    pub(super) fn chosen(&self, run: &GraphRun, project: &Project, scene: &Arc<Scene>) -> Checked<Settings> {
        let settings = self.settings(run, project)?;
        Ok(Settings { choices: self.fastest.choices(self.gpu, project, scene, &settings)?, ..settings })
    }

    pub(super) fn session(&self, run: &GraphRun, graph: &str, moves: Moves) -> Checked<TimedSession> {
        let project = self.project(graph)?;
        let scene = Arc::new(Scene::load(&self.root.join(&run.scene))?.scene);
        let settings = self.chosen(run, &project, &scene)?;
        let settings = Settings { skip: moves != Moves::All, timing: Timing::Frame, ..settings };
        Ok(TimedSession {
            session: Session::new(self.gpu, &project, scene, settings)?,
            moves,
            frames: 0,
            device_ms: None,
        })
    }

    pub(super) fn pair(&self, pair: &GraphPair) -> Checked<Vec<SpeedRow>> {
        let mut sides = [&pair.fast.graph, &pair.slow].map(|g| self.session(&pair.fast, g, pair.moves));
        let mut timed = vec![];
        for side in &mut sides {
            let side = side.as_mut().map_err(|f| f.clone())?;
            side.frame(self.gpu)?;
            timed.push(vec![]);
        }
        // In turn, so that what else the machine does falls on both.
        for _ in 0..self.repeat {
            for (side, times) in sides.iter_mut().zip(&mut timed) {
                times.push(side.as_mut().map_err(|f| f.clone())?.frame(self.gpu)?);
            }
        }
        let [fast, slow] = [least(&timed[0]), least(&timed[1])];
        let note = format!("{slow:.1} ms of {}, {fast:.1} ms of {}", pair.slow, pair.fast.graph);
        let row = SpeedRow::new("against another graph", &pair.name, slow / fast, "× faster");
        let mut rows = vec![row.wanted(Goal::AtLeast(pair.at_least)).note(note)];
        if let Some((output, most)) = &pair.equal {
            let mut images = vec![];
            for graph in [&pair.fast.graph, &pair.slow] {
                let run = GraphRun { outputs: vec![output.clone()], ..pair.fast.clone() };
                let mut side = self.session(&run, graph, Moves::All)?;
                side.frame(self.gpu)?;
                images.push(side.session.image(self.gpu, output)?);
            }
            let difference = compare(&images[0], &images[1], None)?.rmse_percent;
            let row = SpeedRow::new(
                "against another graph",
                format!("{}, difference of {output}", pair.name),
                difference,
                "%",
            );
            rows.push(row.wanted(Goal::AtMost(*most)).note("rmse in percent of the mean"));
        }
        Ok(rows)
    }

    pub(super) fn published(&self, published: &OtherTime) -> Checked<Vec<SpeedRow>> {
        let OtherTime { name, origin, seconds, rmse_percent, run, output, at_least } = published;
        let manifest = Manifest::read(self.references)?;
        let mut timed = self.session(run, &run.graph, Moves::All)?;
        // Seen by the camera that the reference was seen by.
        let scene = timed.session.scene.name.clone();
        let camera = manifest.views().into_iter().find(|(s, _)| *s == scene).and_then(|(_, camera)| camera);
        timed.session.settings.camera.clone_from(&camera);
        timed.frame(self.gpu)?;
        let mut times = vec![];
        for _ in 0..self.repeat {
            times.push(timed.frame(self.gpu)?);
        }
        let ours = least(&times) / 1e3;
        let note = format!("{ours:.3} s here, {seconds} s by {origin}");
        let section = "against published times";
        let mut rows =
            vec![SpeedRow::new(section, name, seconds / ours, "× faster").wanted(Goal::AtLeast(*at_least)).note(note)];
        let references = manifest.load(&scene, camera.as_deref(), timed.session.settings.size, &mut vec![])?;
        let images = BTreeMap::from([(output.clone(), timed.session.image(self.gpu, output)?)]);
        let scores = score(&images, &references, &BTreeMap::new())?;
        let found = scores.iter().find(|s| s.only_when.is_empty()).ok_or_else(|| {
            let size = timed.session.settings.size;
            Diagnostic::error(format!("`{name}`: there is no reference of `{output}` of {scene} at {size:?}"))
        })?;
        let row = SpeedRow::new(section, format!("{name}, error of {output}"), found.metrics.rmse_percent, "%");
        rows.push(row.wanted(Goal::AtMost(*rmse_percent)).note("rmse in percent of the mean"));
        Ok(rows)
    }

    pub(super) fn scaling(&self, scaling: &Scaling) -> Checked<Vec<SpeedRow>> {
        let (mut rows, mut times, mut bytes) = (vec![], vec![], vec![]);
        for (step, run) in scaling.runs() {
            let mut timed = self.session(&run, &run.graph, scaling.moves)?;
            timed.frame(self.gpu)?;
            let start = Instant::now();
            let mut frames = vec![];
            while frames.is_empty() || frames.len() < self.repeat as usize && start.elapsed().as_secs_f64() < 2.0 {
                frames.push(timed.frame(self.gpu)?);
            }
            let plan = &timed.session.plan;
            let count = number(&scaling.per, plan)?.max(1.0);
            let counted = plan.resources.iter().filter(|r| {
                // What the image takes doesn't grow with this, and cached content isn't counted.
                let screen = matches!(&r.desc, Desc::Texture(t) if [t.width, t.height] == timed.session.settings.size);
                !screen && !scaling.without.contains(&r.name)
            });
            let slots: std::collections::BTreeSet<usize> = counted.map(|r| r.slot).collect();
            let held: u64 = slots.iter().filter_map(|s| plan.slots.get(*s)).map(|s| s.bytes).sum();
            times.push(least(&frames) * 1e3 / count);
            bytes.push(held as f64 / count);
            let note = format!("{count} of {}", scaling.per);
            rows.push(
                SpeedRow::new(
                    "scaling",
                    format!("{} {step}, time of one", scaling.name),
                    least(&frames) * 1e3 / count,
                    "µs",
                )
                .note(&note),
            );
            rows.push(
                SpeedRow::new("scaling", format!("{} {step}, bytes of one", scaling.name), held as f64 / count, "B")
                    .note(note),
            );
        }
        if let ([_, second, ..], Some(last), Some(bytes)) = (times.as_slice(), times.last(), bytes.last()) {
            let growth =
                SpeedRow::new("scaling", format!("{}, growth of the time of one", scaling.name), last / second, "×");
            rows.push(growth.wanted(Goal::AtMost(scaling.most_growth)).note("the last by the second"));
            let held = SpeedRow::new("scaling", format!("{}, bytes of one at the last", scaling.name), *bytes, "B");
            rows.push(
                held.wanted(Goal::AtMost(scaling.most_bytes)).note(format!("without {}", scaling.without.join(", "))),
            );
        }
        Ok(rows)
    }

    /// Milliseconds until the first pixel: files read, prepared, rendered and read back. The second time, when what
    /// drivers cache is there.
    pub(super) fn first_image(&self, run: &GraphRun) -> Checked<[f64; 3]> {
        let mut parts = [0.0; 3];
        for _ in 0..2 {
            let gpu = Gpu::open().map_err(lightgraph::Faults::from)?;
            let begin = Instant::now();
            let project = self.project(&run.graph)?;
            let scene = Arc::new(Scene::load(&self.root.join(&run.scene))?.scene);
            let read = begin.elapsed();
            let settings = self.chosen(run, &project, &scene)?;
            let mut session = Session::new(&gpu, &project, scene, settings)?;
            let prepared = begin.elapsed();
            session.frame(&gpu, 0, 0.0)?;
            let output = session.plan.outputs.first().map(|o| o.0.clone()).unwrap_or_default();
            session.image(&gpu, &output)?;
            let ms = |d: std::time::Duration| d.as_secs_f64() * 1e3;
            parts = [ms(read), ms(prepared - read), ms(begin.elapsed() - prepared)];
        }
        Ok(parts)
    }

    pub(super) fn start(&self, start: &StartUp) -> Checked<Vec<SpeedRow>> {
        let parts = self.first_image(&start.run)?;
        let note = format!("files {:.0} ms, preparation {:.0} ms, frame {:.0} ms", parts[0], parts[1], parts[2]);
        let row = SpeedRow::new("start", &start.name, parts.iter().sum(), "ms");
        Ok(vec![row.wanted(Goal::AtMost(start.most_ms)).note(note)])
    }

    /// Times that only hold on a GPU are told, not judged, on a software driver.
    pub(super) fn time(&self, time: &Time) -> Checked<Vec<SpeedRow>> {
        let row = |ms: f64| SpeedRow::new("on a GPU", &time.name, ms, "ms");
        if self.gpu.is_software() {
            let note =
                format!("not run: {} is a software driver; wanted ≤ {} ms on a GPU", self.gpu.info.name, time.most_ms);
            return Ok(vec![row(f64::NAN).note(note)]);
        }
        let mut timed = self.session(&time.run, &time.run.graph, time.moves)?;
        timed.frame(self.gpu)?;
        let (mut device, mut wall) = (vec![], vec![]);
        let begin = Instant::now();
        while wall.len() < self.repeat.max(10) as usize || begin.elapsed() < AWAKE {
            wall.push(timed.frame(self.gpu)?);
            device.extend(timed.device_ms);
        }
        let told = format!("the host waits {:.3} ms for it, median {:.3}", least(&wall), median(wall.clone()));
        if device.is_empty() {
            let note = format!("the adapter keeps no time: {told}");
            return Ok(vec![row(least(&wall)).wanted(Goal::AtMost(time.most_ms)).note(note)]);
        }
        let note = format!("median {:.3} ms; {told}", median(device.clone()));
        Ok(vec![row(least(&device)).wanted(Goal::AtMost(time.most_ms)).note(note)])
    }
}
