//! What a frame costs after each kind of edit, as a share of a frame in full: all figures in one run on one adapter.
//!
//! `cargo run --release --example edit_times`; with the argument `edits` only what follows a save, with `hall` or `art_gallery`
//! only what moves in that scene.

use lightgraph::diag::{Checked, Faults, Source};
use lightgraph::gpu::{FrameReport, Gpu};
use lightgraph::plan::Action;
use lightgraph::scene::{self, Scene, Shift};
use lightgraph::session::{Project, Session, Settings};
use lightgraph::value::Value;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Frames of which the median counts.
const REPEATS: u32 = 5;

fn main() {
    if let Err(faults) = run() {
        eprintln!("{faults}");
        std::process::exit(1);
    }
}

fn run() -> Checked<()> {
    let gpu = Gpu::open().map_err(Faults::from)?;
    let software = if gpu.is_software() { " (software)" } else { "" };
    println!("{}, {}{software}", gpu.info.name, gpu.info.driver_info);
    let asked = |what: &str| std::env::args().len() == 1 || std::env::args().any(|a| a == what);
    for name in ["hall", "art_gallery"].into_iter().filter(|n| asked(n)) {
        let scene = Arc::new(scene::load(&Path::new("scenes").join(name))?.scene);
        for grid in [4, 8] {
            motions(&gpu, &scene, grid)?;
        }
    }
    if !asked("edits") {
        return Ok(());
    }
    let scene = Arc::new(scene::load(Path::new("scenes/cornell"))?.scene);
    edits(&gpu, &scene)
}

/// A session of the base graph that has run one frame, and what that took.
fn begin(gpu: &Gpu, scene: &Arc<Scene>, grid: u32, size: [u32; 2], skip: bool) -> Checked<(Project, Session, f64)> {
    let project = Project::open(Path::new("graphs/uniform_grid.ron"), &[])?;
    let settings = Settings {
        params: [("grid".to_string(), Value::UVec3(glam::UVec3::splat(grid)))].into(),
        size,
        outputs: Some(vec!["color".into()]),
        skip,
        ..Settings::default()
    };
    let start = Instant::now();
    let mut session = Session::new(gpu, &project, scene.clone(), settings)?;
    session.frame(gpu, 0, 0.0)?;
    Ok((project, session, ms(start)))
}

fn motions(gpu: &Gpu, scene: &Arc<Scene>, grid: u32) -> Checked<()> {
    let (_, mut whole, cold) = begin(gpu, scene, grid, [640, 480], false)?;
    let (_, mut session, warm) = begin(gpu, scene, grid, [640, 480], true)?;
    let (full, all) = median(|i| timed(gpu, &mut whole, i, Shift::default()))?;
    let final_of = |session: &Session, report: &FrameReport| -> f64 {
        let ours = |s: usize| session.plan.steps[s].group.as_deref() == Some("final");
        report.steps.iter().filter(|s| ours(s.step)).filter_map(|s| s.gpu_ms).sum()
    };
    let probes = full - final_of(&whole, &all);
    println!("\n{}, {grid}³ probes, 640×480: first frame {cold:.0} ms, of a second session {warm:.0} ms", scene.name);
    println!("  in full            {full:9.2} ms, {} steps; without the final image {probes:.2} ms", all.steps.len());
    let (still, report) = median(|i| timed(gpu, &mut session, i, Shift::default()))?;
    println!(
        "  nothing changed    {still:9.2} ms, {} steps: {:.3} % of the full frame",
        report.steps.len(),
        100.0 * still / full
    );
    let by = |i: u32| glam::Vec3::X * 0.01 * (1 + i) as f32;
    let (camera, report) = median(|i| timed(gpu, &mut session, i, Shift { cameras: by(i), ..Shift::default() }))?;
    let rest = camera - final_of(&session, &report);
    let others = report.steps.iter().filter(|s| session.plan.steps[s.step].group.as_deref() != Some("final")).count();
    println!(
        "  camera only        {camera:9.2} ms, {others} steps besides the final image: {rest:.2} ms without it, 1/{:.0} of the full frame",
        full / rest
    );
    let (light, report) = median(|i| timed(gpu, &mut session, i, Shift { lights: by(i), ..Shift::default() }))?;
    let rest = light - final_of(&session, &report);
    println!(
        "  light only         {light:9.2} ms, without the final image {rest:.2} ms: 1/{:.1} of the full update",
        probes / rest
    );
    for name in ["corbel", "urn", "ball", "post", "bench", "sculpture"] {
        let Some(node) = scene.nodes.iter().position(|n| n.name == name) else { continue };
        object(gpu, &mut session, name, node, &final_of, probes)?;
    }
    Ok(())
}

/// What it costs that one node moves a little, and which members of draws show it.
fn object(
    gpu: &Gpu,
    session: &mut Session,
    name: &str,
    node: usize,
    final_of: &dyn Fn(&Session, &FrameReport) -> f64,
    probes: f64,
) -> Checked<()> {
    let (took, report) = median(|i| {
        let by = glam::vec3(0.02 * (1 + i) as f32, 0.0, 0.0);
        timed(gpu, session, i, Shift { nodes: vec![(node, by)], ..Shift::default() })
    })?;
    let rest = took - final_of(session, &report);
    let draws = |i: usize| {
        let step = &session.plan.steps[i];
        matches!(step.action, Action::Draw(_)) && step.group.as_deref() != Some("final")
    };
    let drawn: f64 = report.steps.iter().filter(|s| draws(s.step)).filter_map(|s| s.gpu_ms).sum();
    let capture = session.plan.steps.iter().position(|s| s.name == "capture").map(|i| session.why()[i].to_string());
    println!(
        "  object `{name}`: {rest:.2} ms without the final image, {:.1} % of the full update; its draws {:.1} %; capture: {}",
        100.0 * rest / probes,
        100.0 * drawn / probes,
        capture.unwrap_or_default()
    );
    Ok(())
}

fn edits(gpu: &Gpu, scene: &Arc<Scene>) -> Checked<()> {
    let (mut project, mut session, cold) = begin(gpu, scene, 4, [256, 256], true)?;
    println!("\n{}, 4³ probes, 256×256: from files to the first image {cold:.0} ms", scene.name);
    let mut again = |what: &str, edit: &mut dyn FnMut(u32, &mut Project, &mut Settings)| -> Checked<()> {
        let (took, counts) = median(|i| {
            let mut settings = session.settings.clone();
            edit(i, &mut project, &mut settings);
            let start = Instant::now();
            // As after a save: the texts are read again.
            let fresh = Project::open(Path::new("graphs/uniform_grid.ron"), &[])?;
            let read = ms(start);
            for (path, source) in &mut project.texts.files {
                if !source.text.starts_with(EDITED) {
                    source.clone_from(&fresh.texts.files[path]);
                }
            }
            let start = Instant::now();
            session = Session::after(gpu, &project, scene.clone(), settings, Some(&session))?;
            let planned = ms(start);
            let report = session.frame(gpu, 0, 0.0)?;
            let stages = format!(
                "read {read:.0}, plan and pipelines {planned:.0}, frame {:.0} ms; {} of {} steps",
                report.wall_ms,
                report.steps.len(),
                session.plan.steps.len()
            );
            Ok((read + ms(start), stages))
        })?;
        println!("  {what:<34} {took:7.1} ms: {counts}");
        Ok(())
    };
    again("planned again, nothing changed", &mut |_, _, _| {})?;
    again("parameter `behind_captured`", &mut |i, _, s| {
        s.params.insert("behind_captured".into(), Value::Float(0.5 + 0.01 * i as f32));
    })?;
    again("parameter `epsilon`", &mut |i, _, s| {
        s.params.insert("epsilon".into(), Value::Float(0.001 + 0.0001 * i as f32));
    })?;
    for path in ["composite.wgsl", "relight.wgsl", "capture.wgsl", "lib/surface.wgsl"] {
        again(&format!("shader {path}"), &mut |i, project, _| {
            let source = project.texts.files.get_mut(path).expect("a shader of the repository");
            let text = edited(&source.text, i);
            *source = Source::new(source.path.clone(), text);
        })?;
    }
    Ok(())
}

/// How an edited text begins.
const EDITED: &str = "// edited";

/// The text with its last number changed in the sixth place.
fn edited(text: &str, i: u32) -> String {
    let text = text.strip_prefix(EDITED).map_or(text, |t| t.trim_start_matches(|c: char| c != '\n'));
    let at = text.rfind("1.0").or(text.rfind("0.0")).expect("a number");
    format!(
        "{EDITED} {i}\n{}{}0000{}{}",
        &text[..at],
        &text[at..at + 3],
        i + 1,
        text[at + 3..].trim_start_matches(|c: char| c.is_ascii_digit())
    )
}

fn timed(gpu: &Gpu, session: &mut Session, index: u32, shift: Shift) -> Checked<(f64, FrameReport)> {
    session.shift = shift;
    let start = Instant::now();
    // The number of the frame stays: no step of this graph asks for it.
    let report = session.frame(gpu, index, 0.0)?;
    Ok((ms(start), report))
}

/// The median of some runs, with what else it gave.
fn median<T>(mut run: impl FnMut(u32) -> Checked<(f64, T)>) -> Checked<(f64, T)> {
    let mut all = (0..REPEATS).map(&mut run).collect::<Checked<Vec<_>>>()?;
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(all.swap_remove(all.len() / 2))
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
