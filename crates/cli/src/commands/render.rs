//! `lightgraph render`: a graph to images, without a window.

use super::additions::AdditionArgs;
use super::capture::{self, Capture};
use super::fastest::FastestArgs;
use super::film::{Film, is_film};
use super::outputs::{OutputArgs, WrittenFiles, is_numbered, number, output_names};
use super::stats::{FrameStats, Stats};
use super::trace::Trace;
use super::{Failure, ShaderFolders, needs_no_scene, notices, print, scene_or_none, size, table};
use lightgraph::internals::gpu::Timing;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Checked, Diagnostic, Faults, Gpu, Project, Session, Settings};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;

/// Renders a graph without a window.
#[derive(Debug, Clone, clap::Args)]
pub struct RenderArgs {
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
    /// Write a trace of the run, of the host and of each step on the device: for ui.perfetto.dev or chrome://tracing
    #[arg(long, value_name = "FILE.json")]
    pub trace: Option<PathBuf>,
    /// Write what a pass of the last frame reads and writes, images as EXR, and its uniforms, into a folder
    #[arg(long, value_name = "PASS=DIR", conflicts_with_all = ["verify_skips", "watch_numerics"])]
    pub capture: Option<Capture>,
    #[command(flatten)]
    pub fastest: FastestArgs,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// Renders, writes the files, prints the table of steps.
///
/// # Errors
/// Faults of files, graph, scene and device; wrong usage; no adapter.
pub fn run(args: &RenderArgs) -> Result<u8, Failure> {
    let mut trace = Trace::new();
    let mut project = Project::open(&args.graph, &args.shaders.folders)?;
    trace.lap("graph");
    let files = args.outputs.files(&mut project)?;
    let params = project.params(&args.set).map_err(Failure::Usage)?;
    let loaded = scene_or_none(args.scene.as_deref(), &args.additions)?;
    notices(&loaded.notices);
    trace.lap("scene");
    let gpu = Gpu::open()?;
    trace.lap("device");
    let mut settings = Settings {
        params,
        size: args.size,
        camera: args.camera.clone(),
        outputs: Some(output_names(&files)),
        skip: !args.no_skip,
        inspect: args.capture.is_some(),
        verify: args.verify_skips,
        watch: args.watch_numerics,
        timing: Timing::of_steps(&gpu),
        ..Settings::default()
    };
    let scene = Arc::new(loaded.scene);
    settings.choices = args.fastest.choices(&gpu, &project, &scene, &settings)?;
    trace.lap("alternatives");
    let mut session = Session::new(&gpu, &project, scene, settings)?;
    needs_no_scene(args.scene.as_deref(), &project, &session.plan)?;
    notices(&session.notices);
    trace.prepared(&session);

    let mut stats = Stats::new(&gpu, &session, trace.laps());
    let progress = progress(args.frames);
    let mut text = String::new();
    let (films, files): (Vec<_>, Vec<_>) = files.into_iter().partition(|f| is_film(&f.1));
    let mut films = Films { of: films, open: vec![], fps: args.fps };
    let (mut failed, mut wrong) = (vec![], vec![]);
    for frame in 0..args.frames {
        let time = frame as f32 / args.fps;
        session.retime(&gpu, &project, time)?;
        let wanted = args.capture.as_ref().filter(|_| frame + 1 == args.frames);
        let report = capture::frame(&gpu, &mut session, (frame, time), wanted)?;
        trace.frame(frame, &session, &report);
        let triangles = if args.stats.is_some() { session.triangles(&gpu)? } else { BTreeMap::new() };
        stats.frames.push(FrameStats::new(&session.plan, &report, session.why(), &triangles));
        if failed.is_empty() {
            failed = session.failed_checks(&report);
        }
        let numbered = files.iter().filter(|f| is_numbered(&f.1));
        let now: Vec<(String, PathBuf)> = numbered.map(|(o, path)| (o.clone(), number(path, frame))).collect();
        wrong.extend(args.outputs.write(&gpu, &session, &now)?.wrong);
        wrong.extend(films.add(&gpu, &session, &args.outputs)?);
        progress.inc(1);
        if frame + 1 == args.frames {
            notices(&report.warnings);
            text = table::steps(&session.plan, &report);
        }
    }
    progress.finish_and_clear();
    let filmed = films.finish()?;
    let last: Vec<(String, PathBuf)> = files.iter().filter(|f| !is_numbered(&f.1)).cloned().collect();
    let WrittenFiles { wrong: more, exposed } = args.outputs.write(&gpu, &session, &last)?;
    wrong.extend(more);
    if !args.outputs.strict {
        notices(&wrong);
    } else {
        failed.extend(wrong);
    }
    trace.lap("files");
    if let Some(path) = &args.trace {
        trace.write(path)?;
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
    if let Some(capture) = &args.capture {
        print(&format!("wrote inputs, outputs and uniforms of {} to {}\n", capture.pass, capture.folder.display()));
    }
    for (output, path) in &filmed {
        print(&format!("wrote {output} to {}, {} frames\n", path.display(), args.frames));
    }
    // The images are there to be looked at, but something is wrong in them.
    Faults::check(failed, 0).map_err(Failure::from)
}

/// The outputs that become films, each frame as it comes.
struct Films {
    of: Vec<(String, PathBuf)>,
    open: Vec<Film>,
    fps: f32,
}

impl Films {
    /// Adds a frame to each. Returns what is wrong in the images.
    fn add(&mut self, gpu: &Gpu, session: &Session, how: &OutputArgs) -> Checked<Vec<Diagnostic>> {
        let mut wrong = vec![];
        for (i, (output, path)) in self.of.iter().enumerate() {
            let image = session.image(gpu, output)?;
            wrong.extend(how.wrong(output, &image));
            if self.open.len() == i {
                self.open.push(Film::new(path, [image.width, image.height], self.fps)?);
            }
            self.open[i].add(&image, how.tone_map, how.exposure.stops(&image))?;
        }
        Ok(wrong)
    }

    fn finish(self) -> Checked<Vec<(String, PathBuf)>> {
        self.open.into_iter().try_for_each(Film::finish)?;
        Ok(self.of)
    }
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
