//! `lightgraph watch`: live reload without a window.
//!
//! A reload is a transaction: graph, shaders, scene and pipelines are all made anew and swapped in together, or
//! the last good image stays and every fault is shown.

use super::capture;
use super::film::is_film;
use super::outputs::{WrittenFiles, number, output_names};
use super::render;
use super::trace::Trace;
use super::{Failure, needs_no_scene, notices, print, scene_or_none};
use lightgraph::internals::plan::fastest::{Choices, still};
use lightgraph::internals::reload::{Watcher, folder_of, folders, settled};
use lightgraph::{Checked, Diagnostic, Faults, FrameReport, Gpu, Project, Session, Settings};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::time::Instant;

/// Renders again whenever a file changes.
#[derive(Debug, Clone, clap::Args)]
// `render`'s arguments form a group of the same name.
#[group(skip)]
pub struct WatchArgs {
    #[command(flatten)]
    pub render: render::RenderArgs,
    /// End after this many reloads, good or bad
    #[arg(long, value_name = "N")]
    pub reloads: Option<u32>,
}

/// Renders, then waits for changes. Ends only by `--reloads` or a signal.
///
/// # Errors
/// Wrong usage, no adapter, or file events that the system does not give. Faults of files are shown, and waited out.
pub fn run(args: &WatchArgs) -> Result<u8, Failure> {
    let gpu = Gpu::open()?;
    let (send, changes) = mpsc::channel();
    let mut watcher = Watcher::new(move |files| {
        // Nobody listens any more only when the program ends.
        let _ = send.send(files);
    })?;
    let mut ours: BTreeSet<PathBuf> = BTreeSet::new();
    let mut session: Option<Session> = None;
    let mut code = 0;
    for reload in 0.. {
        let start = Instant::now();
        let (folders, made) = make(args, &gpu, session.as_ref());
        let came = watcher.watch(&folders)?;
        match made {
            Ok(new) => {
                session = Some(new.session);
                ours.extend(new.files.iter().filter_map(|f| f.canonicalize().ok()));
                code = 0;
                print(&format!("{}, in all {:.0} ms\n", new.line, ms(start)));
            }
            Err(faults) => {
                notices(&faults.0);
                code = 1;
                print("waiting for a change; the last good image stays\n");
            }
        }
        // A folder that has come again is loaded once more at once.
        if args.reloads.is_some_and(|n| reload >= n) || !(came || settled(&changes, &ours)) {
            break;
        }
    }
    Ok(code)
}

/// What a reload made.
struct Reloaded {
    session: Session,
    /// What to print of it.
    line: String,
    /// The files that were written.
    files: Vec<PathBuf>,
}

/// Loads everything, renders one frame and writes the files. Also returns the folders to watch, good or bad.
fn make(args: &WatchArgs, gpu: &Gpu, previous: Option<&Session>) -> (BTreeSet<PathBuf>, Checked<Reloaded>) {
    let args = &args.render;
    let mut folders = folders(&args.graph, args.scene.as_deref(), &args.shaders.folders);
    let made = (|| {
        let mut trace = Trace::new();
        let mut project = Project::open(&args.graph, &args.shaders.folders)?;
        let files = args.outputs.files(&mut project).map_err(Faults::from)?;
        if let Some((_, film)) = files.iter().find(|f| is_film(&f.1)) {
            let d = Diagnostic::error(format!("{}: `watch` renders one frame after each save", film.display()));
            return Err(d.help("`lightgraph render --frames` makes films").into());
        }
        let graph_ms = trace.lap("graph");
        let loaded = scene_or_none(args.scene.as_deref(), &args.additions).map_err(Faults::from)?;
        folders.extend(loaded.files.iter().filter_map(|f| folder_of(f)));
        let scene_ms = trace.lap("scene");
        let mut settings = Settings {
            params: project.params(&args.set)?,
            size: args.size,
            camera: args.camera.clone(),
            outputs: Some(output_names(&files)),
            skip: !args.no_skip,
            inspect: args.capture.is_some(),
            verify: args.verify_skips,
            watch: args.watch_numerics,
            ..Settings::default()
        };
        let scene = Arc::new(loaded.scene);
        // What is once decided stays: a save is to be seen at once.
        settings.choices = previous.map_or(Choices::new(), |p| still(&project.graph, &p.settings.choices));
        settings.choices = args.fastest.choices(gpu, &project, &scene, &settings)?;
        let mut session = Session::after(gpu, &project, scene, settings, previous)?;
        needs_no_scene(args.scene.as_deref(), &project, &session.plan)?;
        let prepare_ms = trace.prepared(&session);
        let report = capture::frame(gpu, &mut session, (0, 0.0), args.capture.as_ref())?;
        let frame_ms = trace.frame(0, &session, &report);
        #[cfg(feature = "lsp")]
        note(&args.graph, &session, &report);
        let files: Vec<(String, PathBuf)> = files.into_iter().map(|(o, path)| (o, number(&path, 0))).collect();
        let WrittenFiles { wrong, exposed } = args.outputs.write(gpu, &session, &files)?;
        let named = |((_, path), exposed): (&(String, PathBuf), &String)| format!("{}{exposed}", path.display());
        let names: Vec<String> = files.iter().zip(&exposed).map(named).collect();
        let files_ms = trace.lap("files");
        if let Some(path) = &args.trace {
            trace.write(path)?;
        }
        notices(&loaded.notices);
        notices(&session.notices);
        notices(&report.warnings);
        notices(&session.failed_checks(&report));
        notices(&wrong);
        let line = format!(
            "{}: graph {graph_ms:.0} ms, scene {scene_ms:.0} ms, plan and pipelines {prepare_ms:.0} ms, frame {frame_ms:.0} ms ({}), files {:.0} ms",
            names.join(", "),
            ran(&session, &report),
            files_ms,
        );
        Ok(Reloaded { session, line, files: files.into_iter().map(|f| f.1).collect() })
    })();
    (folders, made)
}

/// Leaves for editors what the passes took and why they ran.
#[cfg(feature = "lsp")]
fn note(graph: &std::path::Path, session: &Session, report: &FrameReport) {
    use lightgraph_lsp::status::{PassStatus, Status};
    let status = |(i, step): (usize, &lightgraph::internals::plan::Step)| {
        let time = report.steps.iter().find(|t| t.step == i);
        let why = session.why().get(i).map_or(String::new(), ToString::to_string);
        PassStatus { name: step.pass.clone(), ms: time.and_then(|t| t.gpu_ms), ran: time.is_some(), why }
    };
    let left_out = |(name, why): &(String, String)| PassStatus {
        name: name.clone(),
        ms: None,
        ran: false,
        why: format!("left out: {why}"),
    };
    let steps = session.plan.steps.iter().enumerate().map(status);
    // Without a cache nobody is told, and nothing is amiss.
    let _ = Status::new(graph, steps.chain(session.plan.skipped.iter().map(left_out))).write();
}

/// How many steps ran, and what set them off.
fn ran(session: &Session, report: &FrameReport) -> String {
    let (ran, all, causes) = (report.steps.len(), session.plan.steps.len(), session.causes());
    let because = if causes.is_empty() { String::new() } else { format!(", changed: {}", causes.join(", ")) };
    format!("{ran} of {all} steps{because}")
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
