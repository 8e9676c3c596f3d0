//! What a frame costs after each kind of edit, as a share of a frame in full: all figures in one run on one adapter.
//!
//! `cargo run --release --example edit_times`, with any of `motions updates edits hall art_gallery 4 8` for these alone:
//! `motions` of camera and light at 640×480, `updates` of the probes after a light or an object has moved, `edits` that
//! follow a save; in these scenes, with so many probes along an axis.

use lightgraph::diag::{Checked, Faults, Source};
use lightgraph::gpu::{FrameReport, Gpu};
use lightgraph::scene::{self, Scene, Shift};
use lightgraph::session::{Project, Session, Settings};
use lightgraph::value::Value;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Frames of which the median counts.
const REPEATS: u32 = 3;

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
    let args: Vec<String> = std::env::args().skip(1).collect();
    let asked = |what: &str, group: &[&str]| {
        args.iter().any(|a| a == what) || !group.iter().any(|g| args.iter().any(|a| a == g))
    };
    let kinds = ["motions", "updates", "edits"];
    for name in ["hall", "art_gallery"].into_iter().filter(|n| asked(n, &["hall", "art_gallery"])) {
        let scene = Arc::new(scene::load(&Path::new("scenes").join(name))?.scene);
        for grid in [4u32, 8].into_iter().filter(|g| asked(&g.to_string(), &["4", "8"])) {
            if asked("motions", &kinds) {
                motions(&gpu, &scene, grid)?;
            }
            if asked("updates", &kinds) {
                updates(&gpu, &scene, grid)?;
            }
        }
    }
    if !asked("edits", &kinds) {
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
    Ok(())
}

/// What an update of the probes costs after a light or an object has moved, beside one in full. The image is too small to count.
fn updates(gpu: &Gpu, scene: &Arc<Scene>, grid: u32) -> Checked<()> {
    let (_, mut whole, _) = begin(gpu, scene, grid, [16, 12], false)?;
    let (_, mut session, _) = begin(gpu, scene, grid, [16, 12], true)?;
    let (full, report) = median(|i| worked(gpu, &mut whole, i, Shift::default()))?;
    println!("\n{}, {grid}³ probes, {}:", scene.name, if busy().is_some() { "processor time" } else { "time" });
    println!("  all probes         {full:9.2} ms; {}", shares(&whole, &report));
    let by = |i: u32| glam::Vec3::X * 0.02 * (1 + i) as f32;
    let (light, report) = median(|i| worked(gpu, &mut session, i, Shift { lights: by(i), ..Shift::default() }))?;
    println!("  light only         {light:9.2} ms, 1/{:.1}; {}", full / light, shares(&session, &report));
    for name in ["corbel", "urn", "ball", "post", "bench", "sculpture"] {
        let Some(node) = scene.nodes.iter().position(|n| n.name == name) else { continue };
        let shift = |i| Shift { nodes: vec![(node, by(i))], ..Shift::default() };
        let (object, report) = median(|i| worked(gpu, &mut session, i, shift(i)))?;
        let capture = session.plan.steps.iter().position(|s| s.name == "capture");
        let why = capture.map(|i| session.why()[i].to_string()).unwrap_or_default();
        println!(
            "  {name:<18} {object:9.2} ms, {:.1} %; capture {why}; {}",
            100.0 * object / full,
            shares(&session, &report)
        );
    }
    Ok(())
}

/// The passes that took most of a frame.
fn shares(session: &Session, report: &FrameReport) -> String {
    let mut passes: std::collections::BTreeMap<&str, f64> = Default::default();
    for step in &report.steps {
        *passes.entry(session.plan.steps[step.step].pass.as_str()).or_default() += step.gpu_ms.unwrap_or(0.0);
    }
    let all: f64 = passes.values().sum();
    let mut passes: Vec<(&str, f64)> = passes.into_iter().filter(|(_, ms)| *ms > 0.02 * all).collect();
    passes.sort_by(|a, b| b.1.total_cmp(&a.1));
    passes.iter().map(|(name, ms)| format!("{name} {:.0} %", 100.0 * ms / all)).collect::<Vec<_>>().join(", ")
}

/// Milliseconds that the threads of this process have worked: to a software driver's figures other programs make no difference
/// then. `None` where the system doesn't tell.
fn busy() -> Option<f64> {
    let mut sum = 0.0;
    for task in std::fs::read_dir("/proc/self/task").ok()?.flatten() {
        let text = std::fs::read_to_string(task.path().join("schedstat")).unwrap_or_default();
        sum += text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) / 1e6;
    }
    Some(sum)
}

/// As [`timed`]; on a software driver the time that it worked.
fn worked(gpu: &Gpu, session: &mut Session, index: u32, shift: Shift) -> Checked<(f64, FrameReport)> {
    let before = busy();
    let (wall, report) = timed(gpu, session, index, shift)?;
    let worked = before.zip(busy()).filter(|_| gpu.is_software()).map(|(a, b)| b - a);
    Ok((worked.unwrap_or(wall), report))
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
