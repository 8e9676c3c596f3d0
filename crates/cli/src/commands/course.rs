//! What a bench does one after the other: rounds over scenes, graphs and settings, and what comes of them.

use super::bench::BenchArgs;
use super::notices;
use crate::bench::host::Host;
use crate::bench::jobs::{Done, Job, Setting, Work};
use crate::bench::journal::Journal;
use crate::bench::measure::{Effort, Measured, MeasuredSetting, Target, measure, planned};
use crate::bench::peers;
use crate::bench::references::{Manifest, ReferenceSet};
use crate::bench::report;
use crate::bench::results::{Entry, Phase, Results, hash};
use crate::bench::sweep::Sweep;
use crate::shard::Shard;
use lightgraph::internals::{builtin, files};
use lightgraph::{Checked, Diagnostic, Gpu, Project, Scene};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A graph under its name.
pub(super) struct NamedGraph {
    pub name: String,
    pub project: Project,
    /// Milliseconds to read it.
    pub ms: f64,
}

impl NamedGraph {
    /// Its own defaults, then what a sweep sets of it.
    pub fn settings(&self, sweep: &Sweep) -> Vec<Setting> {
        let mut all = vec![vec![]];
        let swept = sweep.settings(|name| self.project.graph.params.iter().any(|(n, _)| n.value == name));
        all.extend(swept.into_iter().filter(|setting| !setting.is_empty()));
        all
    }
}

/// A scene file and the camera it is seen by.
pub(super) struct CameraView {
    pub path: PathBuf,
    pub camera: Option<String>,
}

/// What a bench goes over, and the jobs that name it by index.
#[derive(Clone, Copy)]
pub(super) struct Lists<'a> {
    pub views: &'a [CameraView],
    pub graphs: &'a [NamedGraph],
    pub peers: &'a [peers::Peer],
    pub jobs: &'a [Job],
}

/// What is asked for, all of it read.
pub(super) struct Asked<'a> {
    pub args: &'a BenchArgs,
    pub gpu: &'a Gpu,
    /// Milliseconds it took to open.
    pub device_ms: f64,
    pub manifest: &'a Manifest,
    pub lists: Lists<'a>,
    pub sweep: &'a Sweep,
}

impl<'a> Asked<'a> {
    /// The jobs that are done here.
    fn jobs(&self) -> impl Iterator<Item = &'a Job> {
        let shard = self.args.shard.unwrap_or(Shard::WHOLE);
        self.lists.jobs.iter().filter(move |job| shard.has(job.number))
    }
}

/// Runs all of it. `results` has no entries yet.
///
/// # Errors
/// Scenes and references that can't be read; files that can't be written. What a single setting does wrong is kept in
/// its entry.
pub(super) fn course(asked: &Asked<'_>, results: Results) -> Checked<Results> {
    let mut notes = vec![];
    let (journal, kept) = Journal::open(&asked.args.out, asked.args.resume, &mut notes)?;
    notices(&notes);
    let pieces = |job: &Job| match &job.work {
        Work::Graph { settings, .. } => settings.len(),
        Work::Peer(_) => 1,
    };
    let progress = progress(asked.jobs().map(pieces).sum());
    let mut course = Course { asked, results, kept, journal, progress };
    (0..asked.lists.views.len()).try_for_each(|view| course.view(view))?;
    let Course { mut results, kept, journal, progress, .. } = course;
    progress.finish_and_clear();
    for entry in kept {
        if results.entries.iter().all(|e| e.key() != entry.key()) {
            results.entries.push(entry);
        }
    }
    results.write(&asked.args.out)?;
    journal.close()?;
    Ok(results)
}

/// The work and what came of it so far.
struct Course<'a> {
    asked: &'a Asked<'a>,
    results: Results,
    /// Of an earlier run.
    kept: Vec<Entry>,
    journal: Journal,
    progress: indicatif::ProgressBar,
}

/// A loaded view.
struct LoadedView<'a> {
    view: &'a CameraView,
    scene: &'a Arc<Scene>,
    references: &'a ReferenceSet,
}

/// A setting that takes part in further rounds.
struct Contender<'a> {
    /// The index of its entry.
    entry: usize,
    subject: MeasuredSetting<'a>,
}

/// Bytes that held settings take on the device at most. When they have more, their rounds come at once.
const MOST_HELD: u64 = 4 << 30;

/// A setting that was beyond the user's patience.
struct Slow {
    setting: Setting,
    seconds: f64,
}

impl<'a> Course<'a> {
    fn view(&mut self, at: usize) -> Checked<()> {
        let jobs: Vec<&Job> = self.asked.jobs().filter(|job| job.view == at).collect();
        if jobs.is_empty() {
            return Ok(());
        }
        let Asked { args, manifest, lists, device_ms, .. } = *self.asked;
        let view = &lists.views[at];
        let start = Instant::now();
        let loaded = Scene::load(&view.path)?;
        let scene_ms = start.elapsed().as_secs_f64() * 1e3;
        let mut notes = vec![];
        let references = manifest.load(&loaded.scene.name, view.camera.as_deref(), args.size, &mut notes)?;
        let scene = Arc::new(loaded.scene);
        let place = LoadedView { view, scene: &scene, references: &references };
        notices(&notes);
        self.reference_pictures(&place)?;
        let (mut held, mut slow) = (vec![], BTreeMap::new());
        for job in &jobs {
            let Work::Graph { graph: index, settings } = &job.work else { continue };
            let graph = &lists.graphs[*index];
            let inputs = inputs(graph, &loaded.files, self.results.commit.as_deref())?;
            let ms = [("device", device_ms), ("graph", graph.ms), ("scene", scene_ms)];
            let start_up_ms: BTreeMap<String, f64> = ms.map(|(n, ms)| (n.to_string(), ms)).into();
            let before = self.results.entries.len();
            for setting in settings {
                let target = Target {
                    graph: &graph.name,
                    project: &graph.project,
                    scene: place.scene,
                    camera: view.camera.as_deref(),
                    size: args.size,
                    setting,
                    references: &references,
                    start_up_ms: &start_up_ms,
                    inputs: &inputs,
                    fastest: args.fastest,
                };
                self.setting(&target, &place, slow.entry(*index).or_default(), &mut held)?;
            }
            self.done(job, before);
        }
        self.rounds(held)?;
        for job in &jobs {
            let Work::Peer(index) = &job.work else { continue };
            let before = self.results.entries.len();
            self.peer(&lists.peers[*index], &place)?;
            self.done(job, before);
        }
        Ok(())
    }

    /// Keeps how many entries came of a job.
    fn done(&mut self, job: &Job, before: usize) {
        let entries = self.results.entries.len() - before;
        if let Some(part) = &mut self.results.part {
            part.done.push(Done { job: job.number, entries });
        }
    }

    /// Measures a setting or, where it would take even longer than one that was too slow, leaves it out.
    fn setting(
        &mut self,
        target: &Target<'_>,
        place: &LoadedView<'_>,
        slow: &mut Option<Slow>,
        held: &mut Vec<Contender<'a>>,
    ) -> Checked<()> {
        let Asked { args, sweep, .. } = *self.asked;
        self.progress.set_message(format!("{} on {}", target.graph, target.scene.name));
        if let Some(slow) = slow.as_ref().filter(|s| sweep.is_more(target.setting, &s.setting)) {
            self.leave_out(target, slow)?;
        } else {
            let (seconds, subject) = self.one(target, place)?;
            // A graph's own defaults stand for themselves: nothing of a sweep is more than they are.
            if args.patience.is_some_and(|most| seconds > most) && !target.setting.is_empty() {
                *slow = Some(Slow { setting: target.setting.to_vec(), seconds });
            }
            let entry = self.results.entries.len() - 1;
            held.extend(subject.map(|subject| Contender { entry, subject }));
            if held.iter().map(|h| self.results.entries[h.entry].bytes).sum::<u64>() > MOST_HELD {
                self.rounds(std::mem::take(held))?;
            }
        }
        self.progress.inc(1);
        Ok(())
    }

    /// The further rounds of some settings, in turn: what slows the machine down for a while then slows all of them.
    fn rounds(&mut self, mut held: Vec<Contender<'a>>) -> Checked<()> {
        let more = self.asked.args.rounds - 1;
        self.progress.inc_length(u64::from(more) * held.len() as u64);
        for _ in 0..more {
            held.retain_mut(|h| {
                self.progress.inc(1);
                let entry = &mut self.results.entries[h.entry];
                self.progress.set_message(format!("{} on {}, again", entry.graph, entry.scene));
                h.subject.again(entry)
            });
        }
        held.iter().try_for_each(|h| self.journal.add(&self.results.entries[h.entry]))
    }

    /// Measures a setting, if no earlier run did, and adds its entry. How slow its slowest phase is; what takes part
    /// in further rounds.
    fn one(&mut self, target: &Target<'_>, place: &LoadedView<'_>) -> Checked<(f64, Option<MeasuredSetting<'a>>)> {
        let plan = planned(target)?;
        let BenchArgs { rounds, brief, .. } = *self.asked.args;
        let same = |e: &Entry| e.key() == plan.key() && e.inputs == plan.inputs && e.fault.is_none();
        let done = |e: &Entry| same(e) && (e.rounds >= rounds || e.round_seconds() > brief);
        if let Some(at) = self.kept.iter().position(done) {
            let entry = self.kept.swap_remove(at);
            let seconds = entry.slowest_seconds();
            self.results.entries.push(entry);
            return Ok((seconds, None));
        }
        let mut measured = measure(self.asked.gpu, target, effort(self.asked))?;
        if let Some(fault) = &measured.entry.fault {
            let text = format!("{} on {}, {}: {fault}", target.graph, target.scene.name, measured.entry.setting);
            self.progress.suspend(|| notices(&[Diagnostic::warning(text)]));
        }
        let seconds = measured.entry.slowest_seconds();
        let subject = measured.subject.take().filter(|_| rounds > 1 && measured.entry.round_seconds() <= brief);
        self.add(measured, place)?;
        Ok((seconds, subject))
    }

    /// For a setting that would take even longer.
    fn leave_out(&mut self, target: &Target<'_>, slow: &Slow) -> Checked<()> {
        let set: Vec<String> = slow.setting.iter().map(|(n, v)| format!("{n}={v}")).collect();
        let why = format!("left out: a frame with {} takes {:.0} s", set.join(" "), slow.seconds);
        let entry = Entry { fault: Some(why), ..planned(target)? };
        self.journal.add(&entry)?;
        self.results.entries.push(entry);
        Ok(())
    }

    fn add(&mut self, measured: Measured<'_>, place: &LoadedView<'_>) -> Checked<()> {
        let Measured { mut entry, images, subject: _ } = measured;
        entry.host = Some(Host::now(&self.results.machine));
        entry.picture = report::pictures(&self.asked.args.out, &entry, &images, place.references)?;
        self.journal.add(&entry)?;
        self.results.entries.push(entry);
        Ok(())
    }

    fn peer(&mut self, peer: &peers::Peer, place: &LoadedView<'_>) -> Checked<()> {
        self.progress.set_message(format!("{} on {}", peer.name, place.scene.name));
        let origin = format!("peer {}", peer.name);
        let camera = place.view.camera.as_deref();
        let mine = |e: &Entry| {
            let here = e.scene == place.scene.name && e.camera.as_deref() == camera && e.size == self.asked.args.size;
            here && e.inputs == origin
        };
        let (found, rest): (Vec<Entry>, Vec<Entry>) = std::mem::take(&mut self.kept).into_iter().partition(mine);
        self.kept = rest;
        if !found.is_empty() {
            self.results.entries.extend(found);
        } else {
            let folder =
                self.asked.args.out.join("peers").join(format!("{} {}", place.scene.name, camera.unwrap_or("")).trim());
            let job = peers::PeerJob {
                scene_file: &place.view.path,
                scene: &place.scene.name,
                camera,
                size: self.asked.args.size,
                references: place.references,
                folder: &folder,
                settings: &[],
            };
            match peers::run(peer, job) {
                Ok(entries) => {
                    for (mut entry, images) in entries {
                        entry.inputs.clone_from(&origin);
                        self.add(Measured { entry, images, subject: None }, place)?;
                    }
                }
                Err(absent) if self.results.absent.contains(&absent) => {}
                Err(absent) => {
                    let text = format!("{} is absent: {}", absent.name, absent.why);
                    self.progress.suspend(|| notices(&[Diagnostic::warning(text)]));
                    self.results.absent.push(absent);
                }
            }
        }
        self.progress.inc(1);
        Ok(())
    }

    fn reference_pictures(&self, place: &LoadedView<'_>) -> Checked<()> {
        report::reference_pictures(
            &self.asked.args.out,
            &place.scene.name,
            place.view.camera.as_deref(),
            place.references,
        )
    }
}

fn effort<'a>(asked: &Asked<'a>) -> Effort<'a> {
    let BenchArgs { phases, repeat, seconds, .. } = asked.args;
    Effort { repeat: *repeat, seconds: *seconds, phases: if phases.is_empty() { &Phase::ALL } else { phases } }
}

/// A hash of all that an entry is made from.
fn inputs(graph: &NamedGraph, scene_files: &[PathBuf], commit: Option<&str>) -> Checked<String> {
    let mut parts: Vec<Vec<u8>> = vec![env!("CARGO_PKG_VERSION").into(), commit.unwrap_or("").into()];
    // What comes with the binary is that of its version.
    let graph_files = graph.project.graph.files.iter().filter(|f| !builtin::is_builtin(f));
    for path in graph_files.chain(scene_files) {
        let bytes = files::read(path, files::GEOMETRY)
            .map_err(|e| Diagnostic::error(format!("can't read {}: {e}", path.display())))?;
        parts.push(bytes);
    }
    parts.extend(graph.project.texts.files.values().map(|s| s.text.clone().into_bytes()));
    Ok(hash(parts.iter().map(Vec::as_slice)))
}

/// A bar with the time left, on a terminal.
fn progress(length: usize) -> indicatif::ProgressBar {
    if !std::io::stderr().is_terminal() {
        return indicatif::ProgressBar::hidden();
    }
    let bar = indicatif::ProgressBar::new(length as u64);
    if let Ok(style) = indicatif::ProgressStyle::with_template("{bar:30} {pos}/{len}, {eta} left: {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}
