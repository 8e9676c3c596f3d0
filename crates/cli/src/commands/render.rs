//! `lightgraph render`: a graph to images, without a window.

use super::additions::AdditionArgs;
use super::fastest::FastestArgs;
use super::outputs::{OutputArgs, Written, is_numbered, number, output_names};
use super::stats::{FrameStats, Stats};
use super::{Failure, ShaderFolders, needs_no_scene, notices, print, scene_or_none, size, table};
use lightgraph::internals::gpu::Timing;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Diagnostic, Faults, Gpu, Project, Session, Settings};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Renders a graph without a window.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// The graph file
    #[arg(value_name = "GRAPH", default_value = super::DEFAULT_GRAPH)]
    pub graph: PathBuf,
    /// The scene: a glTF, GLB or scene RON; its ending may be left out, and all of it for a graph that uses none
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// The camera, by name
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    #[command(flatten)]
    pub additions: AdditionArgs,
    /// Size of the image in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: [u32; 2],
    /// Set a parameter of the graph (may be repeated)
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Render this many frames. The last is written; each, where a file is named with a place for its number:
    /// f_%04d.png
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    /// Frames in a second, for scenes that move
    #[arg(long, value_name = "F", default_value_t = 60.0, value_parser = rate)]
    pub fps: f32,
    #[command(flatten)]
    pub outputs: OutputArgs,
    /// Write what each frame and step took
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// Run every step of every frame, even where nothing changed
    #[arg(long)]
    pub no_skip: bool,
    /// Run the steps that are left out in memory of their own, and compare all contents bit for bit
    #[arg(long, conflicts_with = "no_skip")]
    pub verify_skips: bool,
    /// Check what every step leaves: NaN, infinite numbers, and those outside of the ranges that the graph states
    #[arg(long)]
    pub watch_numerics: bool,
    #[command(flatten)]
    pub fastest: FastestArgs,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// Renders, writes the files, prints the table of steps.
///
/// # Errors
/// Faults of files, graph, scene and device; wrong usage; no adapter.
pub fn run(args: &Args) -> Result<u8, Failure> {
    let mut clock = Clock::new();
    let mut project = Project::open(&args.graph, &args.shaders.folders)?;
    clock.lap("graph");
    let files = args.outputs.files(&mut project)?;
    let params = project.params(&args.set).map_err(Failure::Usage)?;
    let loaded = scene_or_none(args.scene.as_deref(), &args.additions)?;
    notices(&loaded.notices);
    clock.lap("scene");
    let gpu = Gpu::open()?;
    clock.lap("device");
    let mut settings = Settings {
        params,
        size: args.size,
        camera: args.camera.clone(),
        outputs: Some(output_names(&files)),
        skip: !args.no_skip,
        verify: args.verify_skips,
        watch: args.watch_numerics,
        timing: Timing::of_steps(&gpu),
        ..Settings::default()
    };
    let scene = Arc::new(loaded.scene);
    settings.choices = args.fastest.choices(&gpu, &project, &scene, &settings)?;
    clock.lap("alternatives");
    let mut session = Session::new(&gpu, &project, scene, settings)?;
    needs_no_scene(args.scene.as_deref(), &project, &session.plan)?;
    notices(&session.notices);
    clock.lap("prepare");

    let mut stats = Stats::new(&gpu, &session, clock.laps);
    let progress = progress(args.frames);
    let mut text = String::new();
    let (mut failed, mut wrong) = (vec![], vec![]);
    for frame in 0..args.frames {
        let report = session.frame(&gpu, frame, frame as f32 / args.fps)?;
        let triangles = if args.stats.is_some() { session.triangles(&gpu)? } else { BTreeMap::new() };
        stats.frames.push(FrameStats::new(&session.plan, &report, session.why(), &triangles));
        if failed.is_empty() {
            failed = session.failed_checks(&report);
        }
        let numbered = files.iter().filter(|f| is_numbered(&f.1));
        let now: Vec<(String, PathBuf)> = numbered.map(|(o, path)| (o.clone(), number(path, frame))).collect();
        wrong.extend(args.outputs.write(&gpu, &session, &now)?.wrong);
        progress.inc(1);
        if frame + 1 == args.frames {
            notices(&report.warnings);
            text = table::steps(&session.plan, &report);
        }
    }
    progress.finish_and_clear();
    let last: Vec<(String, PathBuf)> = files.iter().filter(|f| !is_numbered(&f.1)).cloned().collect();
    let Written { wrong: more, exposed } = args.outputs.write(&gpu, &session, &last)?;
    wrong.extend(more);
    if !args.outputs.strict {
        notices(&wrong);
    } else {
        failed.extend(wrong);
    }
    if let Some(path) = &args.stats {
        let json = serde_json::to_string_pretty(&stats)
            .map_err(|e| Faults::from(Diagnostic::error(format!("can't write the statistics: {e}"))))?;
        write_atomically(path, json.as_bytes())?;
    }
    if let [first, .., last] = stats.frames.as_slice() {
        let mean = stats.frames.iter().map(|f| f.wall_ms).sum::<f64>() / stats.frames.len() as f64;
        let of_all = format!("{} frames: the first {:.1} ms, the mean {mean:.1} ms", stats.frames.len(), first.wall_ms);
        text = format!("{of_all}; the last, {:.1} ms, by step:\n{text}", last.wall_ms);
    }
    let start: Vec<String> = stats.start_up_ms.iter().map(|(name, ms)| format!("{name} {ms:.0} ms")).collect();
    let software = if stats.adapter.software { " (software)" } else { "" };
    let (adapter, info) = (&stats.adapter.name, &stats.adapter.driver_info);
    print(&format!("{adapter}, {info}{software}\nstart-up: {}\n{text}", start.join(", ")));
    if stats.adapter.software {
        print(
            "on a software driver each step is waited for, so that its time is its own: a frame in one piece takes less\n",
        );
    }
    for ((output, path), exposed) in last.iter().zip(&exposed) {
        print(&format!("wrote {output} to {}{exposed}\n", path.display()));
    }
    for (output, path) in files.iter().filter(|f| is_numbered(&f.1)) {
        let end = number(path, args.frames - 1);
        print(&format!("wrote {output} to {} … {}\n", number(path, 0).display(), end.display()));
    }
    // The images are there to be looked at, but something is wrong in them.
    Faults::check(failed, 0).map_err(Failure::from)
}

/// A bar on a terminal, for more than one frame.
fn progress(frames: u32) -> indicatif::ProgressBar {
    if frames < 2 || !std::io::stderr().is_terminal() {
        return indicatif::ProgressBar::hidden();
    }
    indicatif::ProgressBar::new(frames.into())
}

fn rate(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|x: &f32| x.is_finite() && *x > 0.0).ok_or_else(|| "it isn't a number above 0".into())
}

/// Milliseconds from lap to lap.
struct Clock {
    last: Instant,
    laps: BTreeMap<&'static str, f64>,
}

impl Clock {
    fn new() -> Clock {
        Clock { last: Instant::now(), laps: BTreeMap::new() }
    }

    fn lap(&mut self, name: &'static str) {
        self.laps.insert(name, self.last.elapsed().as_secs_f64() * 1e3);
        self.last = Instant::now();
    }
}
