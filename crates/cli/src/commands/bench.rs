//! `lightgraph bench`: run time against error, for graphs, scenes and settings.

use super::course::{Asked, CameraView, Lists, NamedGraph, course};
use super::page::publish;
use super::{Failure, ShaderFolders, shards, size};
use crate::bench::host::Machine;
use crate::bench::jobs::{Part, jobs};
use crate::bench::peers;
use crate::bench::references::Manifest;
use crate::bench::results::{Phase, Results};
use crate::bench::sweep::Sweep;
use crate::paths::{is_whole, ron_files};
use crate::shard::Shard;
use lightgraph::internals::fastest::Policy;
use lightgraph::{Checked, Diagnostic, Faults, Gpu, Project};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Times every graph on every scene at many settings, compares the images with references and writes a report.
#[derive(Debug, Clone, clap::Args)]
pub struct BenchArgs {
    /// Graph files, or folders that hold some, separated by commas
    #[arg(long, value_name = "FILES", value_delimiter = ',', default_value = "graphs/gi")]
    pub graphs: Vec<PathBuf>,
    /// Scenes, as FILE or FILE:CAMERA, separated by commas [default: all that have references; without any, those in
    /// `scenes`]
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
    /// How often to go over the settings of a scene, all of them in turn, so that what slows the machine down for a
    /// while slows none alone. From the second time on a frame of each phase is added, and slow settings are left out:
    /// see --brief
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    /// Settings of which a frame of each phase takes no longer than this together take part in all rounds
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = seconds)]
    pub brief: f64,
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
    /// Go on with the results in the output folder: what is there and was made from the same files is not run again,
    /// and what was not asked for this time stays
    #[arg(long)]
    pub resume: bool,
    /// List what became slower or less accurate since then, and say how much came out again; exit code 1 if anything
    /// became worse
    #[arg(long, value_name = "results.json[.gz]")]
    pub against: Option<PathBuf>,
    /// Measure nothing: write report.html anew from kept results, of whatever commit and machine
    #[arg(long, value_name = "results.json[.gz]", conflicts_with_all = MEASURING)]
    pub page: Option<PathBuf>,
    /// Measure nothing: list the jobs, a line each; with --shard those of it. Needs no adapter
    #[arg(long, conflicts_with_all = ["resume", "against", "speed"])]
    pub jobs: bool,
    /// Measure one part of several, such as 2/8; every machine with the same files parts the work alike
    #[arg(long, value_name = "K/N", conflicts_with_all = ["against", "speed"])]
    pub shard: Option<Shard>,
    /// Measure nothing: join the parts in these folders, each job once
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = MEASURING)]
    #[arg(conflicts_with_all = ["jobs", "shard", "slurm", "page"])]
    pub merge: Vec<PathBuf>,
    /// Measure nothing: print an array script for Slurm, which measures so many parts under the output folder
    #[arg(long, value_name = "N", conflicts_with_all = ["jobs", "shard", "against", "speed", "resume"])]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub slurm: Option<u32>,
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

/// What has no meaning where nothing is measured.
const MEASURING: [&str; 14] = [
    "graphs",
    "scenes",
    "sweep",
    "repeat",
    "seconds",
    "patience",
    "phases",
    "size",
    "references",
    "resume",
    "peers",
    "speed",
    "fastest",
    "folders",
];

/// Twelve settings of a grid of probes, four of a sampler.
const USUAL: &str = "grid=2,4,6;face=8,16;bounces=1,4;samples=1,4,16,64";

/// Measures, writes as it goes, says which settings nothing beats.
///
/// # Errors
/// Faults of files, graphs, scenes and settings before anything runs; no adapter. What a single setting does wrong is
/// kept in its results.
pub fn run(args: &BenchArgs) -> Result<u8, Failure> {
    if let Some(list) = &args.speed {
        return super::speed::run(args, list);
    }
    if let Some(kept) = &args.page {
        return super::page::run(args, kept);
    }
    if !args.merge.is_empty() {
        return shards::merge_parts(args);
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
    let settings: Vec<_> = graphs.iter().map(|g| g.settings(&sweep)).collect();
    let all = jobs(views.len(), &settings, peers.len());
    let lists = Lists { views: &views, graphs: &graphs, peers: &peers, jobs: &all };
    if args.jobs {
        shards::list(&lists, args.shard.unwrap_or(Shard::WHOLE));
        return Ok(0);
    }
    if let Some(parts) = args.slurm {
        shards::slurm(args, parts);
        return Ok(0);
    }

    let start = Instant::now();
    let gpu = Gpu::open()?;
    let device_ms = start.elapsed().as_secs_f64() * 1e3;
    let commit = commit();
    let results = Results {
        version: env!("CARGO_PKG_VERSION").to_string(),
        commit: commit.clone(),
        machine: Machine::of(&gpu),
        repeat: args.repeat,
        size: args.size,
        main_output: manifest.comparison.main.clone(),
        published: manifest.comparison.published.clone(),
        entries: vec![],
        absent: vec![],
        part: args.shard.map(|shard| Part::new(shard, &all, &shards::made_of(args, &lists, commit))),
    };
    let asked = Asked { args, gpu: &gpu, device_ms, manifest: &manifest, lists, sweep: &sweep };
    let results = course(&asked, results)?;
    publish(args, &results, &args.out, old.as_ref())
}

fn graphs(args: &BenchArgs) -> Checked<Vec<NamedGraph>> {
    let paths = ron_files(&args.graphs)?;
    let (mut graphs, mut faults): (Vec<NamedGraph>, Vec<Diagnostic>) = (vec![], vec![]);
    for path in &paths {
        let start = Instant::now();
        let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        match Project::open(path, &args.shaders.folders) {
            Ok(project) if !is_whole(&args.graphs, path, &project.graph) => {}
            Ok(mut project) => {
                if graphs.iter().any(|g| g.name == name) {
                    let d = Diagnostic::error(format!("two graphs are called `{name}`"));
                    faults.push(d.help("rename one of the files"));
                }
                // What graphs share of their shaders is composed once.
                if let Some(first) = graphs.first() {
                    project.texts = project.texts.after(&first.project.texts);
                }
                graphs.push(NamedGraph { name, project, ms: start.elapsed().as_secs_f64() * 1e3 });
            }
            Err(Faults(more)) => faults.extend(more),
        }
    }
    Faults::check(faults, graphs)
}

/// An axis that no graph has is a slip.
fn check_axes(sweep: &Sweep, graphs: &[NamedGraph]) -> Checked<()> {
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

fn views(args: &BenchArgs, manifest: &Manifest) -> Result<Vec<CameraView>, Failure> {
    let named = args.scenes.iter().map(|text| match text.split_once(':') {
        Some((scene, camera)) => (scene.to_string(), Some(camera.to_string())),
        None => {
            let stem = Path::new(text).file_stem().map(|s| s.to_string_lossy().into_owned());
            let listed = manifest.views().into_iter().find(|(scene, _)| Some(scene) == stem.as_ref());
            (text.clone(), listed.and_then(|(_, camera)| camera))
        }
    });
    let mut all: Vec<_> = if args.scenes.is_empty() { manifest.views() } else { named.collect() };
    if all.is_empty() {
        // A project without references has times to measure all the same.
        all.extend(scenes_of(Path::new("scenes")).into_iter().map(|scene| (scene, None)));
    }
    if all.is_empty() {
        let d = Diagnostic::error(format!("{} lists no scenes", args.references.display()));
        return Err(Failure::Usage(d.help("give --scenes, or put some into `scenes`").into()));
    }
    let path = |scene: &str| match scene.contains('/') {
        true => PathBuf::from(scene),
        false => Path::new("scenes").join(scene),
    };
    Ok(all.into_iter().map(|(scene, camera)| CameraView { path: path(&scene), camera }).collect())
}

/// The scenes of a folder, by their names without endings.
fn scenes_of(folder: &Path) -> BTreeSet<String> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let scenes =
        files.filter(|f| f.extension().is_some_and(|e| ["glb", "gltf", "ron"].iter().any(|known| e == *known)));
    scenes.filter_map(|f| Some(f.file_stem()?.to_string_lossy().into_owned())).collect()
}

/// The commit of the working tree; `None` without git.
pub(super) fn commit() -> Option<String> {
    let done = std::process::Command::new("git").args(["describe", "--always", "--dirty"]).output().ok()?;
    let text = String::from_utf8(done.stdout).ok().filter(|_| done.status.success())?;
    Some(text.trim().to_string()).filter(|t| !t.is_empty())
}

fn phase(text: &str) -> Result<Phase, String> {
    let found = Phase::ALL.into_iter().find(|p| p.word() == text && *p != Phase::Whole);
    found.ok_or_else(|| "it is none of first, still, camera, lights, object, everything".into())
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| *x >= 0.0).ok_or_else(|| "it isn't a number from 0 up".into())
}
