//! What a frame costs after each kind of edit, as a share of a frame in full: all figures in one run on one adapter.
//!
//! `cargo run --release --example edit_times` measures all of these, or those that are named after `--`:
//! - `host`: what frames take the host, on a device that computes nothing
//! - `motions` of camera and light at 640×480
//! - `updates` of the probes after a light or an object has moved
//! - `spread`: whose light an object that moves changes
//! - `edits` that follow a save
//!
//! `hall`, `art_gallery`, `4`, `8` (probes along an axis), `uniform_grid` and `fast_grid` keep to these alone.

use lightgraph::diag::{Checked, Diagnostic, Faults};
use lightgraph::gpu::{FrameReport, Gpu};
use lightgraph::plan::{Action, Step};
use lightgraph::scene::{self, Scene, Shift};
use lightgraph::session::{Project, Session, Settings};
use lightgraph::value::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Frames of which the median counts.
const REPEATS: u32 = 7;

fn main() {
    if let Err(faults) = run() {
        eprintln!("{faults}");
        std::process::exit(1);
    }
}

fn run() -> Checked<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let asked = |what: &str, group: &[&str]| {
        args.iter().any(|a| a == what) || !group.iter().any(|g| args.iter().any(|a| a == g))
    };
    let kinds = ["host", "motions", "updates", "spread", "edits"];
    if asked("host", &kinds) {
        host()?;
    }
    let gpu = Gpu::open().map_err(Faults::from)?;
    let software = if gpu.is_software() { " (software)" } else { "" };
    println!("{}, {}{software}", gpu.info.name, gpu.info.driver_info);
    let graphs = [BASE, "fast_grid"];
    for name in ["hall", "art_gallery"].into_iter().filter(|n| asked(n, &["hall", "art_gallery"])) {
        let scene = Arc::new(scene::load(&Path::new("scenes").join(name))?.scene);
        for grid in [4u32, 8].into_iter().filter(|g| asked(&g.to_string(), &["4", "8"])) {
            if asked("motions", &kinds) {
                motions(&gpu, &scene, grid)?;
            }
            if asked("updates", &kinds) {
                for graph in graphs.into_iter().filter(|g| asked(g, &graphs)) {
                    updates(&gpu, graph, &scene, grid)?;
                }
            }
            if asked("spread", &kinds) {
                for graph in graphs.into_iter().filter(|g| asked(g, &graphs)) {
                    spread(&gpu, graph, &scene, grid)?;
                }
            }
        }
    }
    if !asked("edits", &kinds) {
        return Ok(());
    }
    let scene = Arc::new(scene::load(Path::new("scenes/cornell"))?.scene);
    for graph in graphs.into_iter().filter(|g| asked(g, &graphs)) {
        edits(&gpu, &scene, graph)?;
    }
    Ok(())
}

/// The graph whose motions are measured; the others are variants of it.
const BASE: &str = "uniform_grid";

/// A session of a graph that has run one frame, and what that took.
fn begin(
    gpu: &Gpu,
    graph: &str,
    scene: &Arc<Scene>,
    grid: u32,
    (output, size): (&str, [u32; 2]),
    skip: bool,
) -> Checked<(Project, Session, f64)> {
    let graph = PathBuf::from("graphs").join(graph).with_extension("ron");
    begin_with(gpu, &graph, scene, grid, (output, size), skip)
}

/// The same of any graph.
fn begin_with(
    gpu: &Gpu,
    graph: &Path,
    scene: &Arc<Scene>,
    grid: u32,
    (output, size): (&str, [u32; 2]),
    skip: bool,
) -> Checked<(Project, Session, f64)> {
    let project = Project::open(graph, &[])?;
    let settings = Settings {
        // Two bounces, of which the published figures tell.
        params: [("grid".to_string(), Value::UVec3(glam::UVec3::splat(grid))), ("bounces".to_string(), Value::Uint(2))]
            .into(),
        size,
        outputs: Some(vec![output.into()]),
        skip,
        ..Settings::default()
    };
    let start = Instant::now();
    let mut session = Session::new(gpu, &project, scene.clone(), settings)?;
    session.frame(gpu, 0, 0.0)?;
    Ok((project, session, ms(start)))
}

fn motions(gpu: &Gpu, scene: &Arc<Scene>, grid: u32) -> Checked<()> {
    let (_, mut whole, cold) = begin(gpu, BASE, scene, grid, ("color", [640, 480]), false)?;
    let (_, mut session, warm) = begin(gpu, BASE, scene, grid, ("color", [640, 480]), true)?;
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

/// What an update of the probes costs after a light or an object has moved, beside one in full. No image is made of them.
fn updates(gpu: &Gpu, graph: &str, scene: &Arc<Scene>, grid: u32) -> Checked<()> {
    let mut all = vec![];
    let mut add = |name: String, of: Moved| {
        let (_, session, _) = begin(gpu, graph, scene, grid, ("sh", [16, 12]), of != Moved::All)?;
        all.push(Update { name, of, session, frames: 0, rounds: vec![], last: None });
        Checked::Ok(())
    };
    add("all probes".into(), Moved::All)?;
    add("light only".into(), Moved::Lights)?;
    for object in OBJECTS {
        if let Some(node) = named(scene, object) {
            add(format!("{} {}", object.0, object.1), Moved::Node(node))?;
        }
    }
    for _ in 0..ROUNDS {
        for update in &mut all {
            update.round(gpu)?;
        }
    }
    let time = if gpu.is_software() && busy().is_some() { "processor time" } else { "time" };
    println!("\n{graph}, {}, {grid}³ probes, {time}, and of the whole update of the same round:", scene.name);
    for update in &all {
        let ms = middle(update.rounds.clone());
        let share = middle(update.rounds.iter().zip(&all[0].rounds).map(|(a, b)| a / b).collect());
        let share = match update.of {
            Moved::All => String::new(),
            Moved::Lights => format!(", 1/{:.1}", 1.0 / share),
            Moved::Node(_) => format!(", {:.1} %", 100.0 * share),
        };
        let Some(report) = &update.last else { continue };
        println!("  {:<18} {ms:9.2} ms{share}; {}", update.name, shares(&update.session, report));
        if let Moved::Node(_) = update.of {
            println!("  {:<18} {}", "", extent(&update.session, report));
        }
    }
    Ok(())
}

/// Blocks of frames that what is compared takes turns in: a machine's speed changes from one second to the next.
const ROUNDS: u32 = 5;

/// Frames of a round; the first isn't counted, since what the others left in the caches is not its own.
const FRAMES: u32 = 5;

/// What moves before a frame.
#[derive(Clone, Copy, PartialEq)]
enum Moved {
    /// Nothing, but every step runs.
    All,
    Lights,
    Node(usize),
}

/// What is measured of it.
struct Update {
    name: String,
    of: Moved,
    session: Session,
    frames: u32,
    /// By round the median time.
    rounds: Vec<f64>,
    last: Option<FrameReport>,
}

impl Update {
    fn round(&mut self, gpu: &Gpu) -> Checked<()> {
        let mut times = vec![];
        for _ in 0..FRAMES {
            let by = glam::Vec3::X * 0.02 * (1 + self.frames % REPEATS) as f32;
            let shift = match self.of {
                Moved::All => Shift::default(),
                Moved::Lights => Shift { lights: by, ..Shift::default() },
                Moved::Node(node) => Shift { nodes: vec![(node, by)], ..Shift::default() },
            };
            let (ms, report) = worked(gpu, &mut self.session, self.frames, shift)?;
            self.frames += 1;
            times.push(ms);
            self.last = Some(report);
        }
        self.rounds.push(middle(times.split_off(1)));
        Ok(())
    }
}

/// What of a frame ran in part, and what ran in full.
fn extent(session: &Session, report: &FrameReport) -> String {
    let (mut parts, mut whole) = (vec![], vec![]);
    for time in &report.steps {
        let step = &session.plan.steps[time.step];
        match (time.instances, &step.only) {
            (Some(some), Some(only)) => parts.push(format!("{} {some} of {}", step.name, only.instances)),
            _ => whole.push(step.name.as_str()),
        }
    }
    format!("in part {}; whole {}", parts.join(", "), whole.join(", "))
}

/// What frames take the host, on a device that computes nothing: from what has moved to the commands handed over.
fn host() -> Checked<()> {
    let gpu = Gpu::noop(wgpu::Limits { max_storage_buffer_binding_size: 1 << 30, ..wgpu::Limits::default() })?;
    let scene = Arc::new(scene::load(Path::new("scenes/art_gallery"))?.scene);
    println!("\nfast_grid, {}, on a device that computes nothing: milliseconds of the host", scene.name);
    let object = named(&scene, ("sculpture", 0)).unwrap_or_default();
    let by = |i: u32| glam::Vec3::X * 0.01 * (1 + i % 100) as f32;
    type Moves<'a> = (&'a str, u32, &'a dyn Fn(u32) -> Shift);
    let moves: [Moves<'_>; 4] = [
        ("nothing moves, 8³ probes", 8, &|_| Shift::default()),
        ("the camera", 8, &|i| Shift { cameras: by(i), ..Shift::default() }),
        ("an object", 8, &|i| Shift { nodes: vec![(object, by(i))], ..Shift::default() }),
        ("the lights, 32³ probes", 32, &|i| Shift { lights: by(i), ..Shift::default() }),
    ];
    for (name, grid, shift) in moves {
        let (_, mut session, _) = begin(&gpu, "fast_grid", &scene, grid, ("color", [640, 480]), true)?;
        let mut times = vec![];
        for i in 0..200 {
            let start = Instant::now();
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            session.shift = shift(i);
            let mut recorded = session.record(&gpu, &mut encoder, i, 0.0)?;
            gpu.queue.submit([encoder.finish()]);
            times.push(ms(start));
            recorded.arrived(&gpu)?;
        }
        println!("  {name:<28} {:6.3}", middle(times));
    }
    Ok(())
}

/// The median.
fn middle(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(0.0)
}

/// Things in the scenes that are moved; of those of the same name the one of this number.
const OBJECTS: [(&str, usize); 9] = [
    ("corbel", 0),
    ("urn", 0),
    ("ball", 0),
    ("post", 0),
    ("bench", 0),
    ("sculpture", 0),
    // In the rooms beside, where no light falls.
    ("post", 5),
    ("bench", 3),
    ("sculpture", 6),
];

fn named(scene: &Scene, (name, number): (&str, usize)) -> Option<usize> {
    let mut all = scene.nodes.iter().enumerate().filter(|(_, n)| n.name == name);
    all.nth(number).map(|(i, _)| i)
}

/// How many probes hold another light, by one bit or more, after an object has moved: of one bounce and of two. No update that is
/// exact does less than light these again.
fn spread(gpu: &Gpu, graph: &str, scene: &Arc<Scene>, grid: u32) -> Checked<()> {
    println!("\n{graph}, {}, {grid}³ probes, of which another light is held after a move", scene.name);
    let project = Project::open(&PathBuf::from("graphs").join(graph).with_extension("ron"), &[])?;
    for object in OBJECTS {
        let Some(node) = named(scene, object) else { continue };
        let name = format!("{} {}", object.0, object.1);
        let mut line = format!("  {name:<18}");
        for bounces in [1, 2] {
            let grids = ("grid".to_string(), Value::UVec3(glam::UVec3::splat(grid)));
            let settings = Settings {
                params: [grids, ("bounces".to_string(), Value::Uint(bounces))].into(),
                size: [16, 12],
                outputs: Some(vec!["sh".into()]),
                skip: true,
                ..Settings::default()
            };
            let mut session = Session::new(gpu, &project, scene.clone(), settings)?;
            let mut light = |by: f32| {
                session.shift = Shift { nodes: vec![(node, glam::Vec3::X * by)], ..Shift::default() };
                session.frame(gpu, 0, 0.0)?;
                session.image(gpu, "sh")
            };
            let (before, after) = (light(0.0)?, light(0.02)?);
            let texels = |image: &lightgraph::image::Image| image.width as usize * image.height as usize;
            // A slab of slices a coefficient.
            let probes = texels(&before) * grid as usize;
            let channels = before.channels as usize;
            let mut other = vec![false; probes];
            let pairs = before.data.chunks(channels).zip(after.data.chunks(channels));
            for (i, (a, b)) in pairs.enumerate() {
                other[i % probes] |= a.iter().zip(b).any(|(a, b)| a.to_bits() != b.to_bits());
            }
            let count = other.iter().filter(|o| **o).count();
            line += &format!(" {count} of {probes} after {bounces}{}", if bounces == 1 { ";" } else { "" });
        }
        println!("{line}");
    }
    Ok(())
}

/// The passes that took most of a frame, each with its milliseconds.
fn shares(session: &Session, report: &FrameReport) -> String {
    let mut passes: std::collections::BTreeMap<&str, f64> = Default::default();
    for step in &report.steps {
        *passes.entry(session.plan.steps[step.step].pass.as_str()).or_default() += step.gpu_ms.unwrap_or(0.0);
    }
    let all: f64 = passes.values().sum();
    let mut passes: Vec<(&str, f64)> = passes.into_iter().filter(|(_, ms)| *ms > 0.02 * all).collect();
    passes.sort_by(|a, b| b.1.total_cmp(&a.1));
    passes.iter().map(|(name, ms)| format!("{name} {ms:.1}")).collect::<Vec<_>>().join(", ")
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

/// Every shader and every parameter of the graph edited in turn, in files of their own, as an editor saves them.
fn edits(gpu: &Gpu, scene: &Arc<Scene>, graph: &str) -> Checked<()> {
    let files = Files::copy(graph)?;
    let (_, session, cold) = begin_with(gpu, &files.graph(), scene, 4, ("color", [256, 256]), true)?;
    println!("\n{graph}, {}, 4³ probes, 256×256: from files to the first image {cold:.0} ms", scene.name);
    println!("  {:<38}   in all = read + plan + pipelines + frame, ms; steps", "edit");
    let mut live = Live { gpu, scene: scene.clone(), files: &files, settings: session.settings.clone(), session };
    live.settings.params.clear();
    live.again()?;
    live.row("saved again, nothing changed", &mut |_| Ok(()))?;

    let of_step = |step: &Step| match &step.action {
        Action::Draw(draw) => Some(draw.shader),
        Action::Compute { shader, .. } => Some(*shader),
        Action::Copy { .. } | Action::Clear { .. } => None,
    };
    let plan = &live.session.plan;
    let mut shaders: Vec<String> =
        plan.steps.iter().filter_map(of_step).map(|i| plan.shaders[i].path.clone()).collect();
    shaders.sort();
    shaders.dedup();
    // A program of the framework's own is no file.
    shaders.retain(|path| files.shader(path).is_file());
    let mut all = vec![];
    for path in &shaders {
        let text = read(&files.shader(path))?;
        let edit = &mut |i| write(&files.shader(path), &edited(path, &text, i)?);
        all.push(live.row(&format!("shader {path}"), edit)?);
        write(&files.shader(path), &text)?;
        live.again()?;
    }
    summary("shader", all);

    let params: Vec<String> = live.session.plan.params.clone();
    let mut all = vec![];
    for name in &params {
        let (file, text) = files.declares(name)?;
        let edit = &mut |i| write(&file, &default_edited(&text, name, i)?);
        all.push(live.row(&format!("default of `{name}`"), edit)?);
        write(&file, &text)?;
        live.again()?;
    }
    summary("parameter", all);
    live.row("lib/surface.wgsl, which six import", &mut |i| {
        let text = read(Path::new("shaders/lib/surface.wgsl"))?;
        write(&files.shader("lib/surface.wgsl"), &edited("lib/surface.wgsl", &text, i)?)
    })?;
    Ok(())
}

/// The median over all shaders or parameters, and of those times the share without the frame.
fn summary(of: &str, mut all: Vec<Times>) {
    let mut middle = |of: fn(&Times) -> f64| {
        all.sort_by(|a, b| of(a).total_cmp(&of(b)));
        of(&all[all.len() / 2])
    };
    let (whole, before) = (middle(Times::all), middle(|t| t.all() - t.frame));
    println!("  median over every {of}: {whole:.1} ms; up to the frame {before:.1} ms\n");
}

/// Milliseconds of one reload.
struct Times {
    read: f64,
    plan: f64,
    pipelines: f64,
    frame: f64,
}

impl Times {
    fn all(&self) -> f64 {
        self.read + self.plan + self.pipelines + self.frame
    }
}

/// A graph that is loaded again after each edit.
struct Live<'a> {
    gpu: &'a Gpu,
    scene: Arc<Scene>,
    files: &'a Files,
    settings: Settings,
    session: Session,
}

impl Live<'_> {
    /// As after a save: everything is read again.
    fn again(&mut self) -> Checked<(Times, FrameReport)> {
        let start = Instant::now();
        let project = Project::open(&self.files.graph(), &[])?;
        let read = ms(start);
        let start = Instant::now();
        let before = Some(&self.session);
        self.session = Session::after(self.gpu, &project, self.scene.clone(), self.settings.clone(), before)?;
        let made = ms(start);
        let plan = self.session.plan_ms;
        let start = Instant::now();
        let report = self.session.frame(self.gpu, 0, 0.0)?;
        Ok((Times { read, plan, pipelines: made - plan, frame: ms(start) }, report))
    }

    /// The median of some reloads, each after an edit, printed.
    fn row(&mut self, what: &str, edit: &mut dyn FnMut(u32) -> Checked<()>) -> Checked<Times> {
        let (_, (t, ran)) = median(|i| {
            edit(i)?;
            let (times, report) = self.again()?;
            Ok((times.all(), (times, report.steps.len())))
        })?;
        println!(
            "  {what:<38} {:7.1} = {:.1} + {:.1} + {:.1} + {:.1}; {ran} of {}",
            t.all(),
            t.read,
            t.plan,
            t.pipelines,
            t.frame,
            self.session.plan.steps.len()
        );
        Ok(t)
    }
}

/// A copy of the graphs and the shaders; gone when dropped.
struct Files {
    folder: PathBuf,
    /// The graph that is edited, without extension.
    graph: String,
}

impl Files {
    fn copy(graph: &str) -> Checked<Files> {
        let folder = std::env::temp_dir().join(format!("lightgraph-edit-times-{}", std::process::id()));
        let files = Files { folder, graph: graph.to_string() };
        for from in ["graphs", "shaders", "shaders/lib"] {
            let to = files.folder.join(from);
            std::fs::create_dir_all(&to).map_err(|e| fault(&to, &e))?;
            for entry in std::fs::read_dir(from).map_err(|e| fault(Path::new(from), &e))?.flatten() {
                if entry.path().is_file() {
                    write(&to.join(entry.file_name()), &read(&entry.path())?)?;
                }
            }
        }
        Ok(files)
    }

    fn graph(&self) -> PathBuf {
        self.folder.join("graphs").join(&self.graph).with_extension("ron")
    }

    /// The file that gives a parameter its default, the graph's or its base's, and its text.
    fn declares(&self, name: &str) -> Checked<(PathBuf, String)> {
        for path in [self.graph(), self.folder.join("graphs").join(BASE).with_extension("ron")] {
            let text = read(&path)?;
            if declared(&text, name).is_some() {
                return Ok((path, text));
            }
        }
        Err(Diagnostic::error(format!("no default of `{name}` is found")).into())
    }

    fn shader(&self, path: &str) -> PathBuf {
        self.folder.join("shaders").join(path)
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        // What is left lies among temporary files.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

fn read(path: &Path) -> Checked<String> {
    std::fs::read_to_string(path).map_err(|e| fault(path, &e))
}

fn write(path: &Path, text: &str) -> Checked<()> {
    std::fs::write(path, text).map_err(|e| fault(path, &e))
}

fn fault(path: &Path, e: &std::io::Error) -> Faults {
    Diagnostic::error(format!("{}: {e}", path.display())).into()
}

/// The text of a shader with one number of its code changed in the third place: what it computes changes, and no driver
/// has seen it in an earlier run.
fn edited(path: &str, text: &str, i: u32) -> Checked<String> {
    // Shaders without such a number get one.
    let numberless = [("capture.wgsl", "r.normal);"), ("multiply.wgsl", "* share);")];
    let (at, old) = match numberless.iter().find(|(p, _)| *p == path) {
        Some((_, word)) => (text.find(word).map(|at| at + word.len() - 2), ""),
        None => (["1.0", "0.0"].iter().filter_map(|n| in_code(text, n)).max(), "x.x"),
    };
    let at = at.ok_or_else(|| Diagnostic::error(format!("{path} has no number to edit")))?;
    let now = std::time::UNIX_EPOCH.elapsed().map_or(0, |d| d.as_nanos() % 100_000);
    let new = if old.is_empty() { "* 1.0".to_string() } else { text[at..at + old.len()].to_string() };
    Ok(format!("{}{new}0{i}{now:05}{}", &text[..at], &text[at + old.len()..]))
}

/// The last place of a number in code; comments are none.
fn in_code(text: &str, number: &str) -> Option<usize> {
    let mut start = 0;
    let lines = text.split_inclusive('\n').map(|line| {
        let code = line.split("//").next().unwrap_or("");
        start += line.len();
        (start - line.len(), code)
    });
    // `11.0` and `1.05` are others.
    let whole = |code: &str, at: usize| {
        let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
        !digit(code[..at].chars().next_back()) && !digit(code[at + number.len()..].chars().next())
    };
    lines.filter_map(|(start, code)| code.rmatch_indices(number).find(|m| whole(code, m.0)).map(|m| start + m.0)).last()
}

/// Where a graph or a variant declares a parameter.
fn declared(text: &str, name: &str) -> Option<usize> {
    text.find(&format!("\"{name}\": "))
}

/// The text of a graph with another default for a parameter: close to the old one, and within its range.
fn default_edited(text: &str, name: &str, i: u32) -> Checked<String> {
    let missing = || Diagnostic::error(format!("no default of `{name}` is found"));
    let declared = declared(text, name).ok_or_else(missing)?;
    let at = declared + text[declared..].find("default: ").ok_or_else(missing)? + "default: ".len();
    let rest = &text[at..];
    let end = if rest.starts_with('(') { rest.find(')').map(|i| i + 1) } else { rest.find([',', ')']) };
    let old = &rest[..end.ok_or_else(missing)?];
    let near = 1.0 - 0.001 * f64::from(1 + i);
    let new = match old {
        "true" | "false" => (i % 2 == u32::from(old == "true")).to_string(),
        vector if vector.starts_with('(') => format!("({0}, {0}, {0})", 3 + i % 3),
        float if float.contains('.') => (float.parse().unwrap_or(1.0) * near).to_string(),
        whole => (whole.parse().unwrap_or(0) + (1 + i) % 2).to_string(),
    };
    Ok(format!("{}{new}{}", &text[..at], &rest[old.len()..]))
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
