//! `lightgraph probe`: what one invocation of a pass computes.

use super::additions::AdditionArgs;
use super::{Failure, ShaderFolders, needs_no_scene, notices, print, scene_or_none, size};
use lightgraph::internals::session::Probing;
use lightgraph::internals::shader::Stage;
use lightgraph::internals::shader::probe::{Invocation, Probe, RUNS, Reading, Role, Site};
use lightgraph::{Diagnostic, Faults, Gpu, Project, Session, Settings};

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;

/// Asks one invocation of a pass what it computes.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// The graph file
    #[arg(value_name = "GRAPH", default_value = super::DEFAULT_GRAPH)]
    pub graph: PathBuf,
    /// The scene: a glTF, GLB or scene RON; its ending may be left out, and all of it for a graph that uses none
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// The pass, or one of its steps as `lightgraph plan` lists them: Screen, Draw or Compute
    #[arg(long, value_name = "NAME")]
    pub pass: String,
    /// The pixel of a Screen or Draw pass, or the global invocation of a Compute pass
    #[arg(long, value_name = "X,Y[,Z]", value_parser = place)]
    pub at: [u32; 3],
    /// Of `let`s, `var`s and what is read show this one alone (may be repeated)
    #[arg(long = "value", value_name = "NAME")]
    pub values: Vec<String>,
    /// Ask in the last of so many frames
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
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
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// Renders, and prints what the invocation computed.
///
/// # Errors
/// Faults of files, graph, scene and device; a pass that can't be probed; a place where nothing ran; no adapter.
pub fn run(args: &Args) -> Result<u8, Failure> {
    let project = Project::open(&args.graph, &args.shaders.folders)?;
    let params = project.params(&args.set).map_err(Failure::Usage)?;
    let loaded = scene_or_none(args.scene.as_deref(), &args.additions)?;
    notices(&loaded.notices);
    let gpu = Gpu::open()?;
    let probe = Some(Probing { pass: args.pass.clone(), values: args.values.clone() });
    let settings = Settings { params, size: args.size, camera: args.camera.clone(), probe, ..Settings::default() };
    let mut session = Session::new(&gpu, &project, Arc::new(loaded.scene), settings)?;
    needs_no_scene(args.scene.as_deref(), &project, &session.plan)?;
    for frame in 0..args.frames {
        if frame + 1 == args.frames {
            session.probe(&gpu, args.at)?;
        }
        session.frame(&gpu, frame, frame as f32 / 60.0)?;
    }
    let (count, invocations) = session.probed(&gpu)?;
    let (step, probe) = session.probe_sites()?;
    let name = &session.plan.steps[step.0].name;
    let [x, y, z] = args.at;
    if invocations.is_empty() {
        let d = Diagnostic::error(format!("no invocation of `{name}` ran at {x},{y},{z}"));
        return Err(Faults::from(
            d.help("nothing is drawn or dispatched there; `--output NAME=FILE` of `render` shows what is"),
        )
        .into());
    }
    print(&format!("`{name}`, {}, at {x},{y},{z}\n", probe.shader.path));
    if count > RUNS {
        print(&format!("{count} invocations; the last {RUNS}:\n"));
    }
    for (i, invocation) in invocations.iter().enumerate() {
        if invocations.len() > 1 {
            let number = count as usize - invocations.len() + i + 1;
            print(&format!("\ninvocation {number} of {count}\n"));
        }
        print(&shown(probe, invocation));
    }
    if probe.left_out > 0 {
        let left = probe.left_out;
        print(&format!("{left} values found no room; choose with `--value NAME`\n"));
    }
    Ok(0)
}

/// What an invocation did, section by section.
fn shown(probe: &Probe, invocation: &Invocation) -> String {
    let mut out = String::new();
    let read: Vec<(&Site, &Reading)> = invocation.readings.iter().map(|r| (&probe.sites[r.site], r)).collect();
    let of = |role: Role| read.iter().copied().filter(move |(site, _)| site.role == role).collect::<Vec<_>>();
    section(&mut out, "inputs", &of(Role::Argument));
    section(&mut out, "uniforms", &of(Role::Uniform));
    section(&mut out, "reads", &of(Role::Read));
    let mut functions: Vec<&str> = vec![];
    let values: Vec<(&Site, &Reading)> =
        read.iter().copied().filter(|(site, _)| matches!(site.role, Role::Let | Role::Var)).collect();
    for (site, _) in &values {
        if !functions.contains(&site.function.as_str()) {
            functions.push(&site.function);
        }
    }
    for function in functions {
        let own: Vec<(&Site, &Reading)> =
            values.iter().copied().filter(|(site, _)| site.function == function).collect();
        section(&mut out, &format!("values of `{function}`"), &own);
    }
    section(&mut out, "writes", &of(Role::Write));
    let returned = of(Role::Return);
    section(&mut out, "output", &returned);
    let returns = probe.sites.iter().any(|s| s.role == Role::Return);
    if probe.stage == Stage::Fragment && returns && returned.is_empty() {
        out.push_str("output\n  none: the fragment was discarded\n");
    }
    out
}

fn section(out: &mut String, title: &str, readings: &[(&Site, &Reading)]) {
    if readings.is_empty() {
        return;
    }
    let mut lines: Vec<(String, String)> = vec![];
    for (site, reading) in readings {
        let mut shown: Vec<(String, String)> = reading.words.iter().map(|words| site.show(words)).collect();
        let Some((path, value)) = shown.pop() else { continue };
        let often = if reading.count > 1 { format!("   the last of {}", reading.count) } else { String::new() };
        for (before, value) in shown {
            lines.push((before, value));
        }
        lines.push((path, format!("{value}{often}")));
    }
    let width = lines.iter().map(|l| l.0.chars().count()).max().unwrap_or(0).min(40);
    // Writing to a string can't fail.
    let _ = writeln!(out, "{title}");
    for (name, value) in lines {
        let _ = writeln!(out, "  {name:width$}  {value}");
    }
}

/// `X,Y` or `X,Y,Z`, whole numbers from 0.
fn place(text: &str) -> Result<[u32; 3], String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([x, y]) => Ok([*x, *y, 0]),
        Some([x, y, z]) => Ok([*x, *y, *z]),
        _ => Err("write it as X,Y or X,Y,Z: whole numbers, counted from 0".into()),
    }
}
