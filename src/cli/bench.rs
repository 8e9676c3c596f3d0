//! `lightgraph bench`: run time against error, for graphs, scenes and settings.

use super::page::publish;
use super::{Failure, ShaderFolders, notices, size};
use crate::bench::measure::{Effort, Measured, Target, measure, planned};
use crate::bench::peers::{self, Job};
use crate::bench::references::{Manifest, References};
use crate::bench::report;
use crate::bench::results::{Entry, Journal, Machine, Phase, Results, hash};
use crate::bench::sweep::Sweep;
use crate::builtin;
use crate::diag::{Checked, Diagnostic, Faults};
use crate::fastest::Policy;
use crate::gpu::Gpu;
use crate::scene::{self, Scene};
use crate::session::Project;
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Times every graph on every scene at many settings, compares the images with references and writes a report.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Graph files, separated by commas [default: all of graphs/]
    #[arg(long, value_name = "FILES", value_delimiter = ',')]
    pub graphs: Vec<PathBuf>,
    /// Scenes, as FILE or FILE:CAMERA, separated by commas [default: all that have references]
    #[arg(long, value_name = "SCENES", value_delimiter = ',')]
    pub scenes: Vec<String>,
    /// Settings to try; each graph takes the parameters it has [default: a dozen of the usual ones]
    #[arg(long, value_name = "NAME=VALUE,…;…")]
    pub sweep: Option<String>,
    /// Timed frames in each phase at most
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeat: u32,
    /// A phase in which something moves ends after the frame that exceeds this
    #[arg(long, value_name = "SECONDS", default_value_t = 0.5, value_parser = seconds)]
    pub seconds: f64,
    /// Leaves out settings that have as much or more of everything than one whose frames took longer than this
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub patience: Option<f64>,
    /// What is measured besides the first frame: still, camera, lights, object, everything [default: all]
    #[arg(long, value_name = "PHASES", value_delimiter = ',', value_parser = phase)]
    pub phases: Vec<Phase>,
    /// Size of the images in pixels; references of another size are left out
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = size)]
    pub size: [u32; 2],
    /// The folder of references
    #[arg(long, value_name = "DIR", default_value = "tests/references")]
    pub references: PathBuf,
    /// Where results.json, results.csv, report.html and pictures go
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    pub out: PathBuf,
    /// Go on with the results in the output folder: what is there and was made from the same files is not run again, and
    /// what was not asked for this time stays
    #[arg(long)]
    pub resume: bool,
    /// List what became slower or less accurate since then, and say how much came out again; exit code 1 if anything
    /// became worse
    #[arg(long, value_name = "results.json[.gz]")]
    pub against: Option<PathBuf>,
    /// Measure nothing: write report.html anew from kept results, of whatever commit and machine
    #[arg(long, value_name = "results.json[.gz]", conflicts_with_all = ["graphs", "scenes", "sweep", "repeat", "seconds",
        "patience", "phases", "size", "references", "resume", "peers", "speed", "fastest", "folders"])]
    pub page: Option<PathBuf>,
    /// Run other renderers too, as the JSON files of a folder describe them
    #[arg(long, value_name = "DIR", num_args = 0..=1, default_missing_value = "peers")]
    pub peers: Option<PathBuf>,
    /// Measure how fast instead: what a list asks for, as ratios in one run, to speed.json and speed.html
    #[arg(long, value_name = "LIST", num_args = 0..=1, default_missing_value = "benches/speed.ron")]
    pub speed: Option<PathBuf>,
    /// Graphs whose images the report shows on each scene at most; 0 for a small file
    #[arg(long, value_name = "N", default_value_t = 12)]
    pub images: usize,
    /// Which of a graph's alternatives run
    #[arg(long, value_enum, default_value_t = Policy::Measure)]
    pub fastest: Policy,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// Twelve settings of a grid of probes, four of a sampler.
const USUAL: &str = "grid=2,4,6;face=8,16;bounces=1,4;samples=1,4,16,64";

/// Measures, writes as it goes, says which settings nothing beats.
///
/// # Errors
/// Faults of files, graphs, scenes and settings before anything runs; no adapter. What a single setting does wrong is
/// kept in its results.
pub fn run(args: &Args) -> Result<u8, Failure> {
    if let Some(list) = &args.speed {
        return super::speed::run(args, list);
    }
    if let Some(kept) = &args.page {
        return super::page::run(args, kept);
    }
    let old = args.against.as_deref().map(Results::read).transpose()?;
    let manifest = Manifest::read(&args.references)?;
    let graphs = graphs(args)?;
    let sweep = Sweep::parse(args.sweep.as_deref().unwrap_or(USUAL))?;
    if args.sweep.is_some() {
        check_axes(&sweep, &graphs)?;
    }
    let views = views(args, &manifest)?;
    let peers = args.peers.as_deref().map(peers::find).transpose()?.unwrap_or_default();

    let start = Instant::now();
    let gpu = Gpu::open()?;
    let device_ms = start.elapsed().as_secs_f64() * 1e3;
    let commit = commit();
    let (journal, kept) = Journal::open(&args.out, args.resume)?;
    let results = Results {
        version: env!("CARGO_PKG_VERSION").to_string(),
        commit,
        machine: machine(&gpu),
        repeat: args.repeat,
        size: args.size,
        main_output: manifest.comparison.main.clone(),
        published: manifest.comparison.published.clone(),
        entries: vec![],
        absent: vec![],
    };
    let settings: usize = graphs.iter().map(|g| g.settings(&sweep).len()).sum();
    let progress = progress(views.len() * (settings + peers.len()));
    let mut bench = Bench { args, results, kept, journal, progress };
    for view in &views {
        let start = Instant::now();
        let loaded = scene::load(&view.path)?;
        let scene_ms = start.elapsed().as_secs_f64() * 1e3;
        let mut notes = vec![];
        let references = manifest.load(&loaded.scene.name, view.camera.as_deref(), args.size, &mut notes)?;
        notices(&notes);
        let place = Place { view, scene: &loaded.scene, references: &references };
        bench.reference_pictures(&place)?;
        for graph in &graphs {
            let inputs = inputs(graph, &loaded.files, bench.results.commit.as_deref())?;
            let ms = [("device", device_ms), ("graph", graph.ms), ("scene", scene_ms)];
            let start_up_ms: BTreeMap<String, f64> = ms.map(|(n, ms)| (n.to_string(), ms)).into();
            let mut slow: Option<Slow> = None;
            for setting in graph.settings(&sweep) {
                let target = Target {
                    graph: &graph.name,
                    project: &graph.project,
                    scene: place.scene,
                    camera: view.camera.as_deref(),
                    size: args.size,
                    setting: &setting,
                    references: &references,
                    start_up_ms: &start_up_ms,
                    inputs: &inputs,
                    fastest: args.fastest,
                };
                if let Some(slow) = slow.as_ref().filter(|s| sweep.is_more(&setting, &s.setting)) {
                    bench.leave_out(&target, slow)?;
                    continue;
                }
                bench.one(&gpu, &target, &place)?;
                let seconds = bench.results.entries.last().map_or(0.0, longest);
                if args.patience.is_some_and(|most| seconds > most) {
                    slow = Some(Slow { setting, seconds });
                }
            }
        }
        for peer in &peers {
            bench.peer(peer, &place)?;
        }
    }
    bench.progress.finish_and_clear();
    let mut results = bench.results;
    for entry in bench.kept {
        if results.entries.iter().all(|e| e.key() != entry.key()) {
            results.entries.push(entry);
        }
    }
    results.write(&args.out)?;
    bench.journal.close()?;
    publish(args, &results, &args.out, old.as_ref())
}

/// A graph under its name.
struct Named {
    name: String,
    project: Project,
    /// To read it.
    ms: f64,
}

impl Named {
    fn settings(&self, sweep: &Sweep) -> Vec<Vec<(String, String)>> {
        sweep.settings(|name| self.project.graph.params.iter().any(|(n, _)| n.value == name))
    }
}

/// A scene file and the camera it is seen by.
struct View {
    path: PathBuf,
    camera: Option<String>,
}

/// A loaded view.
struct Place<'a> {
    view: &'a View,
    scene: &'a Scene,
    references: &'a References,
}

/// A setting that was beyond the user's patience.
struct Slow {
    setting: Vec<(String, String)>,
    seconds: f64,
}

/// The work and what came of it so far.
struct Bench<'a> {
    args: &'a Args,
    results: Results,
    /// Of an earlier run.
    kept: Vec<Entry>,
    journal: Journal,
    progress: indicatif::ProgressBar,
}

impl Bench<'_> {
    fn one(&mut self, gpu: &Gpu, target: &Target<'_>, place: &Place<'_>) -> Checked<()> {
        let plan = planned(target)?;
        self.progress.set_message(format!("{} on {}", target.graph, target.scene.name));
        let same = |e: &Entry| e.key() == plan.key() && e.inputs == plan.inputs && e.fault.is_none();
        if let Some(at) = self.kept.iter().position(same) {
            self.results.entries.push(self.kept.swap_remove(at));
            self.progress.inc(1);
            return Ok(());
        }
        let phases = if self.args.phases.is_empty() { &Phase::ALL } else { self.args.phases.as_slice() };
        let effort = Effort { repeat: self.args.repeat, seconds: self.args.seconds, phases };
        let measured = measure(gpu, target, effort)?;
        if let Some(fault) = &measured.entry.fault {
            let text = format!("{} on {}, {}: {fault}", target.graph, target.scene.name, measured.entry.setting);
            self.progress.suspend(|| notices(&[Diagnostic::warning(text)]));
        }
        self.add(measured, place)
    }

    /// For a setting that would take even longer.
    fn leave_out(&mut self, target: &Target<'_>, slow: &Slow) -> Checked<()> {
        let set: Vec<String> = slow.setting.iter().map(|(n, v)| format!("{n}={v}")).collect();
        let why = format!("left out: a frame with {} takes {:.0} s", set.join(" "), slow.seconds);
        let entry = Entry { fault: Some(why), ..planned(target)? };
        self.journal.add(&entry)?;
        self.results.entries.push(entry);
        self.progress.inc(1);
        Ok(())
    }

    fn add(&mut self, measured: Measured, place: &Place<'_>) -> Checked<()> {
        let Measured { mut entry, images } = measured;
        entry.picture = report::pictures(&self.args.out, &entry, &images, place.references)?;
        self.journal.add(&entry)?;
        self.results.entries.push(entry);
        self.progress.inc(1);
        Ok(())
    }

    fn peer(&mut self, peer: &peers::Peer, place: &Place<'_>) -> Checked<()> {
        self.progress.set_message(format!("{} on {}", peer.name, place.scene.name));
        let origin = format!("peer {}", peer.name);
        let camera = place.view.camera.as_deref();
        let mine = |e: &Entry| {
            let here = e.scene == place.scene.name && e.camera.as_deref() == camera && e.size == self.args.size;
            here && e.inputs == origin
        };
        let (found, rest): (Vec<Entry>, Vec<Entry>) = std::mem::take(&mut self.kept).into_iter().partition(mine);
        self.kept = rest;
        if !found.is_empty() {
            self.results.entries.extend(found);
        } else {
            let folder =
                self.args.out.join("peers").join(format!("{} {}", place.scene.name, camera.unwrap_or("")).trim());
            let job = Job {
                scene_file: &place.view.path,
                scene: &place.scene.name,
                camera,
                size: self.args.size,
                references: place.references,
                folder: &folder,
                settings: &[],
            };
            match peers::run(peer, job) {
                Ok(entries) => {
                    for (mut entry, images) in entries {
                        entry.inputs.clone_from(&origin);
                        self.add(Measured { entry, images }, place)?;
                        self.progress.dec(1);
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

    fn reference_pictures(&self, place: &Place<'_>) -> Checked<()> {
        report::reference_pictures(&self.args.out, &place.scene.name, place.view.camera.as_deref(), place.references)
    }
}

fn graphs(args: &Args) -> Checked<Vec<Named>> {
    let mut paths = args.graphs.clone();
    if paths.is_empty() {
        let folder = Path::new("graphs");
        let list = std::fs::read_dir(folder)
            .map_err(|e| Diagnostic::error(format!("can't read {}: {e}", folder.display())).help("give --graphs"))?;
        paths =
            list.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.extension().is_some_and(|e| e == "ron")).collect();
        paths.sort();
    }
    let (mut graphs, mut faults): (Vec<Named>, Vec<Diagnostic>) = (vec![], vec![]);
    for path in &paths {
        let start = Instant::now();
        let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        if graphs.iter().any(|g| g.name == name) {
            faults.push(Diagnostic::error(format!("two graphs are called `{name}`")).help("rename one of the files"));
        }
        match Project::open(path, &args.shaders.folders) {
            Ok(mut project) => {
                // What graphs share of their shaders is composed once.
                if let Some(first) = graphs.first() {
                    project.texts = project.texts.after(&first.project.texts);
                }
                graphs.push(Named { name, project, ms: start.elapsed().as_secs_f64() * 1e3 });
            }
            Err(Faults(more)) => faults.extend(more),
        }
    }
    Faults::check(faults, graphs)
}

/// An axis that no graph has is a slip.
fn check_axes(sweep: &Sweep, graphs: &[Named]) -> Checked<()> {
    let names: Vec<&str> =
        graphs.iter().flat_map(|g| g.project.graph.params.iter().map(|(n, _)| n.value.as_str())).collect();
    let unknown = sweep.axes.iter().filter(|a| !names.contains(&a.name.as_str()));
    let mut faults: Vec<Diagnostic> = unknown
        .map(|a| {
            let d = Diagnostic::error(format!("the sweep sets `{}`, which none of the graphs has", a.name));
            d.nearest(&a.name, names.iter().copied())
        })
        .collect();
    for graph in graphs {
        for axis in &sweep.axes {
            let declared = graph.project.graph.params.iter().any(|(n, _)| n.value == axis.name);
            for value in axis.values.iter().filter(|_| declared) {
                if let Err(Faults(more)) = graph.project.params(&[format!("{}={value}", axis.name)]) {
                    faults.extend(more);
                }
            }
        }
    }
    Faults::check(faults, ())
}

fn views(args: &Args, manifest: &Manifest) -> Result<Vec<View>, Failure> {
    let named = args.scenes.iter().map(|text| match text.split_once(':') {
        Some((scene, camera)) => (scene.to_string(), Some(camera.to_string())),
        None => {
            let stem = Path::new(text).file_stem().map(|s| s.to_string_lossy().into_owned());
            let listed = manifest.views().into_iter().find(|(scene, _)| Some(scene) == stem.as_ref());
            (text.clone(), listed.and_then(|(_, camera)| camera))
        }
    });
    let all: Vec<_> = if args.scenes.is_empty() { manifest.views() } else { named.collect() };
    if all.is_empty() {
        let d = Diagnostic::error(format!("{} lists no scenes", args.references.display()));
        return Err(Failure::Usage(d.help("give --scenes")));
    }
    let path = |scene: &str| match scene.contains('/') {
        true => PathBuf::from(scene),
        false => Path::new("scenes").join(scene),
    };
    Ok(all.into_iter().map(|(scene, camera)| View { path: path(&scene), camera }).collect())
}

/// Seconds of an entry's slowest frame.
fn longest(entry: &Entry) -> f64 {
    entry.phases.iter().map(|t| t.wall_ms.max / 1e3).fold(0.0, f64::max)
}

/// A hash of all that an entry is made from.
fn inputs(graph: &Named, scene_files: &[PathBuf], commit: Option<&str>) -> Checked<String> {
    let mut parts: Vec<Vec<u8>> = vec![env!("CARGO_PKG_VERSION").into(), commit.unwrap_or("").into()];
    // What comes with the binary is that of its version.
    let graph_files = graph.project.graph.files.iter().filter(|f| !builtin::is_builtin(f));
    for path in graph_files.chain(scene_files) {
        let bytes =
            std::fs::read(path).map_err(|e| Diagnostic::error(format!("can't read {}: {e}", path.display())))?;
        parts.push(bytes);
    }
    parts.extend(graph.project.texts.files.values().map(|s| s.text.clone().into_bytes()));
    Ok(hash(parts.iter().map(Vec::as_slice)))
}

pub(super) fn machine(gpu: &Gpu) -> Machine {
    let cpus = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpus.lines().find_map(|l| l.strip_prefix("model name")?.split_once(':'));
    Machine {
        adapter: gpu.info.name.clone(),
        driver: format!("{} {}", gpu.info.driver, gpu.info.driver_info),
        backend: format!("{:?}", gpu.info.backend),
        software: gpu.is_software(),
        cpu: model.map_or(std::env::consts::ARCH, |(_, m)| m.trim()).to_string(),
        cores: std::thread::available_parallelism().map_or(1, usize::from),
        os: std::env::consts::OS.to_string(),
    }
}

/// The commit of the working tree; `None` without git.
pub(super) fn commit() -> Option<String> {
    let done = std::process::Command::new("git").args(["describe", "--always", "--dirty"]).output().ok()?;
    let text = String::from_utf8(done.stdout).ok().filter(|_| done.status.success())?;
    Some(text.trim().to_string()).filter(|t| !t.is_empty())
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

fn phase(text: &str) -> Result<Phase, String> {
    let found = Phase::ALL.into_iter().find(|p| p.word() == text && *p != Phase::Whole);
    found.ok_or_else(|| "it is none of first, still, camera, lights, object, everything".into())
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| *x >= 0.0).ok_or_else(|| "it isn't a number from 0 up".into())
}
