//! A case on a graph: renders, judges, makes a row.

use super::case::{Case, Cases, Expect, settings};
use super::number::{CaseNames, Formula};
use super::report::{CaseRow, RowState, RunSelection};
use super::shape::SceneShape;
use lightgraph::internals::diag::{Severity, Source};
use lightgraph::internals::scene::Loaded;
use lightgraph::internals::shader::Library;
use lightgraph::internals::unused::prune;
use lightgraph::{Checked, Diagnostic, Gpu, Image, Project, Session, Settings};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A graph under its file's name.
pub struct StressGraph {
    pub name: String,
    pub path: PathBuf,
    pub project: Project,
}

impl StressGraph {
    /// # Errors
    /// Faults of the file and its shaders.
    pub fn open(path: &Path, shaders: &[PathBuf]) -> Checked<StressGraph> {
        let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        Ok(StressGraph { name, path: path.into(), project: Project::open(path, shaders)? })
    }

    /// A variant of a file that stands in no file of its own.
    ///
    /// # Errors
    /// As [`Graph::open`], and those of what is laid over it.
    pub(super) fn varied(base: &Path, name: &str, over: &str, shaders: &[PathBuf]) -> Checked<StressGraph> {
        let file = base.file_name().unwrap_or_default().to_string_lossy();
        let path = base.with_file_name(format!("{name}.ron"));
        let text = format!("Variant(base: \"{file}\", about: \"{name}\", {over})");
        let read = |p: &Path| match p == path {
            true => Ok(Source::new(path.display().to_string(), text.clone())),
            false => Source::read(p),
        };
        let mut graph = lightgraph::internals::graph::load(&path, &read)?;
        let texts = Library::load(shaders)?;
        prune(&mut graph, &texts);
        Ok(StressGraph { name: name.into(), path: path.clone(), project: Project { graph, texts } })
    }

    /// Whether it has a parameter.
    pub fn has(&self, name: &str) -> bool {
        self.project.graph.params.iter().any(|(n, _)| n.value == name)
    }

    /// Those of the settings that it has, as the command line writes them.
    pub fn texts(&self, settings: &BTreeMap<String, String>) -> Vec<String> {
        settings.iter().filter(|(n, _)| self.has(n)).map(|(n, v)| format!("{n}={v}")).collect()
    }

    fn has_output(&self, name: &str) -> bool {
        self.project.graph.outputs.iter().any(|o| o.0.value == name)
    }
}

/// What was rendered.
struct Shot {
    images: BTreeMap<String, Image>,
    notices: Vec<Diagnostic>,
    /// What steps left that should not be.
    broken: Vec<Diagnostic>,
}

/// Renders, one after the other, on one device.
pub(super) struct Runner<'a> {
    pub gpu: &'a Gpu,
    pub cases: &'a Cases,
    /// The last session: the next takes its pipelines over.
    last: Option<Session>,
}

/// What one image is made of.
struct Take<'a> {
    scene: &'a SceneShape,
    set: &'a BTreeMap<String, String>,
    camera: Option<&'a str>,
    outputs: &'a [&'a str],
}

impl<'a> Runner<'a> {
    pub fn new(gpu: &'a Gpu, cases: &'a Cases) -> Runner<'a> {
        Runner { gpu, cases, last: None }
    }

    /// The rows of a case on a graph, one a run, for those of its runs that are `wanted`, until `stop` says that time
    /// is up.
    pub fn case(
        &mut self,
        case: &Case,
        graph: &StressGraph,
        (runs, wanted): (&Range<usize>, RunSelection<'_>),
        stop: &mut dyn FnMut() -> bool,
    ) -> Vec<CaseRow> {
        let mut rows = vec![];
        for names in case.runs().into_iter().take(runs.end).skip(runs.start) {
            let setting: Vec<String> = names.iter().map(|(n, v)| format!("{n}={v}")).collect();
            let mut row = CaseRow::new("case", &case.name, &graph.name, &setting.join(" "));
            row.about.clone_from(&case.about);
            if !wanted.has(&row) {
                continue;
            }
            if stop() {
                rows.push(row.left());
                continue;
            }
            let start = Instant::now();
            if let Err(faults) = self.judge(case, graph, &names, &mut row) {
                row.fail(&faults.one_line());
            }
            row.seconds = start.elapsed().as_secs_f64();
            rows.push(row);
        }
        rows
    }

    fn judge(&mut self, case: &Case, graph: &StressGraph, names: &CaseNames, row: &mut CaseRow) -> Checked<()> {
        if let Expect::Refused { says } = &case.expect {
            match case.scene.load(names, &self.cases.folder) {
                Ok(_) => row.fail("the loader takes the scene"),
                Err(faults) => {
                    let text = faults.one_line();
                    row.judge_text(says, &text);
                }
            }
            return Ok(());
        }
        let instead = case.instead.get(&graph.name).cloned().unwrap_or_default();
        let expected = |value: &Formula| instead.value.as_ref().unwrap_or(value).value(names);
        let bound = instead.bound.as_ref().unwrap_or(&case.bound).value(names)?;
        let set = settings(&[&self.cases.settings, &case.set], names);
        let take = |outputs| Take { scene: &case.scene, set: &set, camera: case.camera.as_deref(), outputs };
        let mut notices = vec![];
        match &case.expect {
            Expect::Finite => {
                let outputs: Vec<&str> = graph.project.graph.outputs.iter().map(|o| o.0.value.as_str()).collect();
                notices = self.shoot(case, graph, names, &take(&outputs), row)?.notices;
            }
            Expect::Uniform { output, value } => {
                let shot = self.shoot(case, graph, names, &take(&[output]), row)?;
                let (expected, image) = (expected(value)?, image(&shot, output)?);
                let off = |x: &f32| relative(f64::from(*x), expected);
                let worst = colors(image).max_by(|a, b| off(a).total_cmp(&off(b))).copied().unwrap_or(f32::NAN);
                row.judge(Some(expected), Some(f64::from(worst)), off(&worst), bound);
                notices = shot.notices;
            }
            Expect::Mean { output, value } => {
                let shot = self.shoot(case, graph, names, &take(&[output]), row)?;
                let (expected, mean) = (expected(value)?, mean(image(&shot, output)?));
                row.judge(Some(expected), Some(mean), relative(mean, expected), bound);
                notices = shot.notices;
            }
            Expect::Like { output, scene, set: other, gain } => {
                let shot = self.shoot(case, graph, names, &take(&[output]), row)?;
                let other = settings(&[&set, other], names);
                let scene = scene.as_deref().unwrap_or(&case.scene);
                let outputs = [output.as_str()];
                let of = Take { scene, set: &other, camera: case.camera.as_deref(), outputs: &outputs };
                let reference = self.shoot(case, graph, names, &of, row)?;
                let gain = gain.as_ref().map_or(Ok(1.0), |g| g.value(names))?;
                let (a, b) = (image(&shot, output)?, image(&reference, output)?);
                row.judge(Some(mean(b) * gain), Some(mean(a)), difference(a, b, gain), bound);
                notices = shot.notices;
            }
            Expect::Dark { output, camera } => {
                let lit = self.shoot(case, graph, names, &take(&[output]), row)?;
                let outputs = [output.as_str()];
                let of = Take { scene: &case.scene, set: &set, camera: Some(camera), outputs: &outputs };
                let dark = self.shoot(case, graph, names, &of, row)?;
                let share = mean(image(&dark, output)?) / mean(image(&lit, output)?);
                row.judge(Some(0.0), Some(share), share, bound);
            }
            Expect::Total { output, value } => {
                let shot = self.shoot(case, graph, names, &take(&[output]), row)?;
                let image = image(&shot, output)?;
                let total: f64 = image.data.iter().step_by(image.channels as usize).map(|x| f64::from(*x)).sum();
                let expected = expected(value)?;
                row.judge(Some(expected), Some(total), relative(total, expected), bound);
            }
            Expect::SumOf { sum, terms } => {
                let shot = self.shoot(case, graph, names, &take(&[sum, terms]), row)?;
                let (sum, terms) = (image(&shot, sum)?, image(&shot, terms)?);
                let (expected, magnitude) = exact_sum(terms);
                let got = f64::from(sum.data.first().copied().unwrap_or(f32::NAN));
                row.judge(Some(expected), Some(got), (got - expected).abs() / magnitude, bound);
            }
            Expect::Negative { output } => {
                let shot = self.shoot(case, graph, names, &take(&[output]), row)?;
                let image = image(&shot, output)?;
                let magnitude: f64 = colors(image).map(|x| f64::from(x.abs())).sum();
                let negative: f64 = colors(image).map(|x| f64::from(-x).max(0.0)).sum();
                let share = if magnitude > 0.0 { negative / magnitude } else { 0.0 };
                row.judge(None, Some(share), share, bound);
            }
            Expect::Refused { .. } => {}
        }
        let text: Vec<&str> = notices.iter().map(|d| d.message.as_str()).collect();
        if let Some(says) = &case.says {
            row.judge_text(says, &text.join("; "));
        }
        if let (RowState::Passed, Some(limit)) = (row.state, case.limit_of(&graph.name)) {
            row.note(&format!("known limit: {limit}"));
        }
        let told = notices.iter().filter(|d| d.severity != Severity::Note);
        told.for_each(|d| row.note(&d.message));
        Ok(())
    }

    fn shoot(
        &mut self,
        case: &Case,
        graph: &StressGraph,
        names: &CaseNames,
        take: &Take<'_>,
        row: &mut CaseRow,
    ) -> Checked<Shot> {
        let loaded = take.scene.load(names, &self.cases.folder)?;
        if let Some(output) = take.outputs.iter().find(|o| !graph.has_output(o)) {
            return Err(Diagnostic::error(format!("the graph has no output `{output}`")).into());
        }
        let settings = Settings {
            params: graph.project.params(&graph.texts(take.set))?,
            size: [case.size.0, case.size.1],
            camera: take.camera.map(String::from),
            outputs: Some(take.outputs.iter().map(ToString::to_string).collect()),
            watch: true,
            ..Settings::default()
        };
        let frames = case.instead.get(&graph.name).and_then(|i| i.frames).unwrap_or(case.frames);
        let shot = self.render(graph, loaded, settings, frames)?;
        if let Some(first) = shot.broken.first() {
            row.fail(&format!("{} ({})", first.message, first.help.join("; ")));
        }
        Ok(shot)
    }

    fn render(&mut self, graph: &StressGraph, loaded: Loaded, settings: Settings, frames: u32) -> Checked<Shot> {
        // What a resource keeps from frame to frame belongs to the scene that it came from.
        let previous = self.last.take().filter(|s| s.plan.resources.iter().all(|r| !r.history));
        let mut session = Session::after(self.gpu, &graph.project, loaded.scene, settings, previous.as_ref())?;
        let mut shot = Shot { images: BTreeMap::new(), notices: loaded.notices, broken: vec![] };
        for index in 0..frames {
            let report = session.frame(self.gpu, index, 0.0)?;
            shot.notices.extend(report.warnings.iter().filter(|_| index + 1 == frames).cloned());
            if shot.broken.is_empty() {
                shot.broken = session.failed_checks(&report);
            }
        }
        let outputs: Vec<String> = session.plan.outputs.iter().map(|o| o.0.clone()).collect();
        for output in outputs {
            let image = session.image(self.gpu, &output)?;
            shot.images.insert(output, image);
        }
        self.last = Some(session);
        Ok(shot)
    }
}

fn image<'s>(shot: &'s Shot, output: &str) -> Checked<&'s Image> {
    shot.images.get(output).ok_or_else(|| Diagnostic::error(format!("there is no image of `{output}`")).into())
}

/// All values but the fourth channel.
fn colors(image: &Image) -> impl Iterator<Item = &f32> {
    image.data.chunks(image.channels.max(1) as usize).flat_map(|p| p.iter().take(3))
}

fn mean(image: &Image) -> f64 {
    let (sum, count) = colors(image).fold((0.0, 0u32), |(s, n), x| (s + f64::from(*x), n + 1));
    sum / f64::from(count.max(1))
}

/// The error over what was expected, or the error itself where nothing was.
fn relative(got: f64, expected: f64) -> f64 {
    let error = (got - expected).abs();
    let error = if expected == 0.0 { error } else { error / expected.abs() };
    if error.is_nan() { f64::INFINITY } else { error }
}

/// Root-mean-square difference from `gain` times another image, over its root-mean-square.
pub(super) fn difference(a: &Image, b: &Image, gain: f64) -> f64 {
    if a.data.len() != b.data.len() {
        return f64::INFINITY;
    }
    let square = |x: f64| x * x;
    let off: f64 = colors(a).zip(colors(b)).map(|(x, y)| square(f64::from(*x) - gain * f64::from(*y))).sum();
    let whole: f64 = colors(b).map(|y| square(gain * f64::from(*y))).sum();
    let share = (off / whole).sqrt();
    if off == 0.0 {
        0.0
    } else if share.is_nan() {
        f64::INFINITY
    } else {
        share
    }
}

/// Root-mean-square difference over the root-mean-square of `b`, without the share of pixels that differ most: on the
/// edges of surfaces, where a pixel's centre lies on an edge, drivers may show the one or the other.
pub(super) fn difference_but(a: &Image, b: &Image, share: f64) -> f64 {
    if a.data.len() != b.data.len() || b.data.is_empty() {
        return f64::INFINITY;
    }
    let pixels = |image: &Image| {
        let colors: Vec<f64> = colors(image).map(|x| f64::from(*x)).collect();
        colors.chunks(image.channels.clamp(1, 3) as usize).map(<[f64]>::to_vec).collect::<Vec<_>>()
    };
    let square = |p: &[f64]| p.iter().map(|x| x * x).sum::<f64>();
    let (a, b) = (pixels(a), pixels(b));
    let apart = |(a, b): (&Vec<f64>, &Vec<f64>)| square(&a.iter().zip(b).map(|(x, y)| x - y).collect::<Vec<_>>());
    let mut off: Vec<f64> = a.iter().zip(&b).map(apart).collect();
    off.sort_by(f64::total_cmp);
    let kept = off.len() - (share * off.len() as f64).floor() as usize;
    let whole: f64 = b.iter().map(|p| square(p)).sum::<f64>() * kept as f64 / off.len() as f64;
    let error: f64 = off.iter().take(kept).sum();
    let result = (error / whole).sqrt();
    if error == 0.0 {
        0.0
    } else if result.is_nan() {
        f64::INFINITY
    } else {
        result
    }
}

/// The sum of the first channel and of its magnitudes, in f64 with Neumaier's compensation.
fn exact_sum(image: &Image) -> (f64, f64) {
    let (mut sum, mut lost, mut magnitude) = (0.0_f64, 0.0, 0.0);
    for x in image.data.iter().step_by(image.channels as usize).map(|x| f64::from(*x)) {
        let next = sum + x;
        lost += if sum.abs() >= x.abs() { (sum - next) + x } else { (x - next) + sum };
        sum = next;
        magnitude += x.abs();
    }
    (sum + lost, magnitude)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_pixels_on_edges_are_left_out_and_a_difference_everywhere_is_not() {
        let image = |f: &dyn Fn(usize) -> f32| Image {
            width: 20,
            height: 10,
            layers: 1,
            channels: 3,
            data: (0..600).map(f).collect(),
        };
        let flat = image(&|_| 1.0);
        let edge = image(&|i| if i / 3 == 77 { 9.0 } else { 1.0 });
        assert!(difference(&edge, &flat, 1.0) > 0.5);
        assert_eq!(difference_but(&edge, &flat, 0.01), 0.0);
        assert!(difference_but(&edge, &flat, 0.0) > 0.5);
        let brighter = image(&|_| 1.02);
        assert!((difference_but(&brighter, &flat, 0.01) - 0.02).abs() < 1e-6);
        assert_eq!(difference_but(&image(&|i| if i == 4 { f32::NAN } else { 1.0 }), &flat, 0.0), f64::INFINITY);
    }
}
