//! `lightgraph watch`: live reload without a window.
//!
//! A reload is a transaction: graph, shaders, scene and pipelines are all made anew and swapped in together, or
//! the last good image stays and every fault is shown.

use super::outputs::output_names;
use super::render;
use super::{Failure, notices, print};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::gpu::Gpu;
use crate::scene;
use crate::session::{Project, Session, Settings};
use notify_debouncer_full::notify::RecursiveMode;
use notify_debouncer_full::{DebounceEventResult, new_debouncer};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Editors save in several steps (truncate and write, or write and rename); what happens within this time is one change.
const SETTLE: Duration = Duration::from_millis(30);

/// Renders again whenever a file changes.
#[derive(Debug, Clone, clap::Args)]
// `render`'s arguments form a group of the same name.
#[group(skip)]
pub struct Args {
    #[command(flatten)]
    pub render: render::Args,
    /// End after this many reloads, good or bad
    #[arg(long, value_name = "N")]
    pub reloads: Option<u32>,
}

/// Renders, then waits for changes. Ends only by `--reloads` or a signal.
///
/// # Errors
/// Wrong usage, no adapter, or file events that the system does not give. Faults of files are shown, and waited out.
pub fn run(args: &Args) -> Result<u8, Failure> {
    let gpu = Gpu::open()?;
    let (send, events) = mpsc::channel();
    let watcher = new_debouncer(SETTLE, None, move |event: DebounceEventResult| {
        // Nobody listens any more only when the program ends.
        let _ = send.send(event);
    });
    let mut watcher = watcher.map_err(|e| fault("can't watch files", &e))?;
    let mut watched: BTreeSet<PathBuf> = BTreeSet::new();
    let mut session: Option<Session> = None;
    let mut code = 0;
    for reload in 0.. {
        let start = Instant::now();
        let (folders, made) = make(args, &gpu, session.as_ref());
        for folder in folders.difference(&watched.clone()) {
            watcher.watch(folder, RecursiveMode::Recursive).map_err(|e| fault("can't watch files", &e))?;
            watched.insert(folder.clone());
        }
        match made {
            Ok((new, line)) => {
                session = Some(new);
                code = 0;
                print(&format!("{line}, in all {:.0} ms\n", ms(start)));
            }
            Err(faults) => {
                notices(&faults.0);
                code = 1;
                print("waiting for a change; the last good image stays\n");
            }
        }
        if args.reloads.is_some_and(|n| reload >= n) || !wait(&events, &watched) {
            break;
        }
    }
    Ok(code)
}

/// Waits for a change of a file that can matter. False when no more can come.
fn wait(events: &mpsc::Receiver<DebounceEventResult>, watched: &BTreeSet<PathBuf>) -> bool {
    loop {
        match events.recv() {
            Ok(Ok(batch)) => {
                let matters = |p: &PathBuf| {
                    let ending = p.extension().map(|e| e.to_string_lossy().to_lowercase());
                    ending.is_some_and(|e| ENDINGS.contains(&e.as_str())) && watched.iter().any(|w| p.starts_with(w))
                };
                let written = batch.iter().filter(|e| !e.kind.is_access());
                if written.flat_map(|e| &e.paths).any(matters) {
                    return true;
                }
            }
            // Events were lost: something may have changed.
            Ok(Err(_)) => return true,
            Err(_) => return false,
        }
    }
}

/// Endings of the files that graphs and scenes are made of.
const ENDINGS: [&str; 8] = ["ron", "wgsl", "gltf", "glb", "bin", "png", "jpg", "jpeg"];

/// Loads everything, renders one frame and writes the files. Also returns the folders to watch, good or bad.
fn make(args: &Args, gpu: &Gpu, previous: Option<&Session>) -> (BTreeSet<PathBuf>, Checked<(Session, String)>) {
    let args = &args.render;
    let parent = |p: &Path| {
        let folder = p.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        folder.canonicalize().ok()
    };
    let mut folders: BTreeSet<PathBuf> = [&args.graph, &args.scene].iter().filter_map(|p| parent(p)).collect();
    let graph_folder = args.graph.parent().unwrap_or(Path::new(""));
    let shaders = ["shaders", "../shaders"].map(|f| graph_folder.join(f));
    folders.extend(shaders.iter().chain(&args.shaders.folders).filter_map(|f| f.canonicalize().ok()));
    let made = (|| {
        let mut clock = Instant::now();
        let mut lap = || {
            let took = ms(clock);
            clock = Instant::now();
            took
        };
        let project = Project::open(&args.graph, &args.shaders.folders)?;
        let files = args.outputs.files(&project).map_err(Faults::from)?;
        let graph_ms = lap();
        let loaded = scene::load(&args.scene)?;
        folders.extend(loaded.files.iter().filter_map(|f| parent(f)));
        let scene_ms = lap();
        let settings = Settings {
            params: project.params(&args.set)?,
            size: args.size,
            camera: args.camera.clone(),
            outputs: Some(output_names(&files)),
            watch: args.watch_numerics,
            ..Settings::default()
        };
        let mut session = Session::after(gpu, &project, loaded.scene, settings, previous)?;
        let prepare_ms = lap();
        let report = session.frame(gpu, 0, 0.0)?;
        let frame_ms = lap();
        args.outputs.write(gpu, &session, &files)?;
        let names: Vec<String> = files.iter().map(|f| f.1.display().to_string()).collect();
        notices(&loaded.notices);
        notices(&session.notices);
        notices(&report.warnings);
        notices(&report.numerics.as_ref().map_or(vec![], |n| n.faults(&session.plan)));
        let line = format!(
            "{}: graph {graph_ms:.0} ms, scene {scene_ms:.0} ms, plan and pipelines {prepare_ms:.0} ms, frame {frame_ms:.0} ms, files {:.0} ms",
            names.join(", "),
            lap()
        );
        Ok((session, line))
    })();
    (folders, made)
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

fn fault(what: &str, e: &impl std::fmt::Display) -> Faults {
    Diagnostic::error(format!("{what}: {e}")).into()
}
