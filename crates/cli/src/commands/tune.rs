//! `lightgraph tune`: the graph and the setting that suit a scene, a machine and a size.

use super::additions::AdditionArgs;
use super::{Failure, ShaderFolders, notices, print, print_data, size};
use crate::bench::measure::{Effort, Target, measure};
use crate::bench::references::{LoadedReference, ReferenceSet};
use crate::bench::results::{Entry, Phase};
use crate::bench::score::change;
use crate::bench::sweep::Sweep;
use crate::bench::tune::{Candidate, TuneGoal, choose, unbeaten, variant};
use crate::paths::{is_whole, ron_files};
use lightgraph::internals::builtin;
use lightgraph::internals::fastest::Policy;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Checked, Diagnostic, Faults, Gpu, Project, Scene, Session, Settings};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Measures graphs and settings on a scene against a path tracer's image, and writes the one that serves best as a
/// variant.
#[derive(Debug, Clone, clap::Args)]
pub struct TuneArgs {
    /// The scene: a glTF, GLB or scene RON; its ending may be left out
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// The camera, by name
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    #[command(flatten)]
    pub additions: AdditionArgs,
    /// Size of the image in pixels
    #[arg(long, value_name = "WxH", default_value = "640x360", value_parser = size)]
    pub size: [u32; 2],
    /// Choose the least error of what renders a frame within this time; without it and --error the least product of
    /// both
    #[arg(long, value_name = "MS", value_parser = budget, conflicts_with = "error")]
    pub budget: Option<f64>,
    /// Choose the fastest of what errs no more than this
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    pub error: Option<f64>,
    /// Graph files, or folders that hold some, separated by commas [default: half a dozen of those that come with
    /// lightgraph]
    #[arg(long, value_name = "FILES", value_delimiter = ',')]
    pub graphs: Vec<PathBuf>,
    /// Settings to try besides each graph's own; each graph takes the parameters it has
    #[arg(long, value_name = "NAME=VALUE,…;…", default_value = "rays=1,2,8,16,32;directions=2,8;grid=6,8")]
    pub sweep: String,
    /// The path tracer ends after this time
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = seconds)]
    pub reference_seconds: f64,
    /// Where the variant goes
    #[arg(long, value_name = "FILE.ron", default_value = "tuned.ron")]
    pub out: PathBuf,
    /// Print all that was measured as JSON, in place of the table
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub shaders: ShaderFolders,
}

/// What makes the image that all are held against.
const TRUTH: &str = "lightgraph:graphs/gi/pathtrace.ron";

/// What is tried where nothing is asked for.
const USUAL: [&str; 6] =
    ["final_gather", "first_bounce", "facing_probes", "fast_grid", "fast_grid_visible", "inset_grid"];

/// The output that is compared.
const COMPARED: &str = "color";

/// Standard error of the path tracer's image that is enough, in percent.
const ENOUGH: f64 = 0.5;

/// Frames of the path tracer at least and at most.
const FEWEST: u32 = 4;
const MOST: u32 = 1 << 15;

/// Settings that have as much or more of everything than one that took so many budgets are left out.
const PATIENCE: f64 = 4.0;

/// Renders the reference, measures all candidates, prints the curve, writes the variant.
///
/// # Errors
/// Faults of files, graphs, scene and device; no adapter; nothing serves the wish.
pub fn run(args: &TuneArgs) -> Result<u8, Failure> {
    let wish = match (args.budget, args.error) {
        (Some(ms), _) => TuneGoal::Budget(ms),
        (_, Some(percent)) => TuneGoal::Error(percent),
        _ => TuneGoal::Balance,
    };
    let sweep = Sweep::parse(&args.sweep).map_err(Failure::Usage)?;
    let graphs = graphs(args)?;
    let loaded = args.additions.load(&args.scene)?;
    notices(&loaded.notices);
    let scene = Arc::new(loaded.scene);
    let gpu = Gpu::open()?;
    let truth = truth(args, &gpu, &scene)?;
    let Truth { frames, seconds, stderr, .. } = truth;
    let say = |text: &str| {
        if !args.json {
            print(text)
        }
    };
    say(&format!("reference: {frames} frames of {TRUTH} in {seconds:.1} s, {stderr:.2} % standard error\n"));
    let tuner = Tuner { args, gpu: &gpu, scene: &scene, references: truth.references };

    let all_settings: usize = graphs.iter().map(|g| settings(&g.1, &sweep).len()).sum();
    let progress = progress(all_settings);
    let mut all: Vec<Candidate> = vec![];
    for (path, project) in &graphs {
        let mut slow: Option<Vec<(String, String)>> = None;
        for setting in settings(project, &sweep) {
            progress.set_message(path.display().to_string());
            progress.inc(1);
            if slow.as_ref().is_some_and(|s| sweep.is_more(&setting, s)) {
                continue;
            }
            let Some(found) = tuner.measured(path, project, &setting)? else { continue };
            if matches!(wish, TuneGoal::Budget(ms) if found.ms > PATIENCE * ms) && !setting.is_empty() {
                slow = Some(setting);
            }
            all.push(found);
        }
    }
    progress.finish_and_clear();
    say(&table(&all));
    let Some(chosen) = choose(&all, wish) else { return Err(unserved(&all, wish).into()) };
    let best = &all[chosen];
    let [width, height] = args.size;
    let about = format!(
        "Chosen for {} at {width}×{height} on {}: {:.3} ms, {:.1} % off a path tracer",
        scene.name, gpu.info.name, best.ms, best.rmse
    );
    let best = &Candidate { graph: based(&best.graph, &args.out), ..best.clone() };
    write_atomically(&args.out, variant(best, &about).as_bytes())?;
    say(&format!("wrote {} ({}) to {}\n", best.graph, best.setting_text(), args.out.display()));
    if args.json {
        let front = unbeaten(&all);
        let listed: Vec<Value> = all.iter().enumerate().map(|(i, c)| c.json(front.contains(&i))).collect();
        let reference = json!({"frames": frames, "seconds": seconds, "stderr_percent": stderr});
        let all = json!({"reference": reference, "candidates": listed, "chosen": chosen, "variant": args.out});
        print_data(&format!("{all:#}\n"));
    }
    Ok(0)
}

/// What a variant calls a graph file: bases are looked for beside it.
fn based(graph: &str, variant: &Path) -> String {
    let folder = variant.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (Ok(folder), Ok(graph_path)) = (folder.canonicalize(), Path::new(graph).canonicalize()) else {
        return graph.to_string();
    };
    let shared = folder.components().zip(graph_path.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    let way: PathBuf = up.chain(graph_path.components().skip(shared)).collect();
    // Graphs name files with `/` on every system.
    way.to_string_lossy().replace('\\', "/")
}

fn graphs(args: &TuneArgs) -> Checked<Vec<(PathBuf, Project)>> {
    let usual = || USUAL.map(|name| PathBuf::from(format!("{}graphs/gi/{name}.ron", builtin::PREFIX))).to_vec();
    let paths = if args.graphs.is_empty() { usual() } else { ron_files(&args.graphs)? };
    let (mut graphs, mut faults) = (vec![], vec![]);
    for path in paths {
        match Project::open(&path, &args.shaders.folders) {
            Ok(project) if project.graph.outputs.iter().any(|o| o.0.value == COMPARED) => graphs.push((path, project)),
            Ok(project) if !is_whole(&args.graphs, &path, &project.graph) => {}
            Ok(_) => faults.push(Diagnostic::error(format!("{} has no output `{COMPARED}`", path.display()))),
            Err(Faults(more)) => faults.extend(more),
        }
    }
    Faults::check(faults, graphs)
}

/// A graph's own, then what the sweep sets of it.
fn settings(project: &Project, sweep: &Sweep) -> Vec<Vec<(String, String)>> {
    let mut all = sweep.settings(|name| project.graph.params.iter().any(|(n, _)| n.value == name));
    if all.first().is_some_and(|s| !s.is_empty()) {
        all.insert(0, vec![]);
    }
    all
}

/// What all are held against, and how good it is.
struct Truth {
    references: ReferenceSet,
    frames: u32,
    seconds: f64,
    /// In percent of the mean.
    stderr: f64,
}

/// The path tracer's image, until it is good enough or time is up.
fn truth(args: &TuneArgs, gpu: &Gpu, scene: &Arc<Scene>) -> Checked<Truth> {
    let project = Project::open(Path::new(TRUTH), &[])?;
    let outputs = Some(vec![COMPARED.to_string()]);
    let settings = Settings { size: args.size, camera: args.camera.clone(), outputs, ..Settings::default() };
    let mut session = Session::new(gpu, &project, scene.clone(), settings)?;
    let start = Instant::now();
    session.frame(gpu, 0, 0.0)?;
    let (mut frames, mut image, mut stderr) = (1, session.image(gpu, COMPARED)?, f64::INFINITY);
    // The next mean takes as long as all before it.
    let in_time = |frames| frames < FEWEST || 2.0 * start.elapsed().as_secs_f64() <= args.reference_seconds;
    while frames < MOST && stderr > ENOUGH && in_time(frames) {
        for frame in frames..2 * frames {
            session.frame(gpu, frame, 0.0)?;
        }
        frames *= 2;
        let now = session.image(gpu, COMPARED)?;
        // Both halves err alike: the mean of them differs from one by as much as it errs.
        stderr = change(&image, &now)?;
        image = now;
    }
    let seconds = start.elapsed().as_secs_f64();
    let reference = LoadedReference {
        output: COMPARED.into(),
        only_when: vec![],
        image,
        origin: "path tracer".into(),
        stderr_percent: Some(stderr),
    };
    let references = ReferenceSet { all: vec![reference], ..ReferenceSet::default() };
    Ok(Truth { references, frames, seconds, stderr })
}

/// What all candidates share.
struct Tuner<'a> {
    args: &'a TuneArgs,
    gpu: &'a Gpu,
    scene: &'a Arc<Scene>,
    references: ReferenceSet,
}

impl Tuner<'_> {
    /// `None`: the graph can't; a warning says why.
    fn measured(&self, path: &Path, project: &Project, setting: &[(String, String)]) -> Checked<Option<Candidate>> {
        let graph = path.display().to_string();
        let target = Target {
            graph: &graph,
            project,
            scene: self.scene,
            camera: self.args.camera.as_deref(),
            size: self.args.size,
            setting,
            references: &self.references,
            start_up_ms: &BTreeMap::new(),
            inputs: "",
            fastest: Policy::Measure,
        };
        let mut measured = measure(self.gpu, &target, Effort { repeat: 1, seconds: 0.0, phases: &[] })?;
        if let Some(subject) = &mut measured.subject {
            // By then the driver has compiled everything.
            subject.again(&mut measured.entry);
        }
        let texts: Vec<String> = setting.iter().map(|(n, v)| format!("{n}={v}")).collect();
        let setting = project.params(&texts)?.into_iter().collect();
        let found = candidate(graph.clone(), setting, &measured.entry);
        if found.is_none() {
            let why =
                measured.entry.fault.unwrap_or_else(|| "its image can't be compared: the reference is black".into());
            notices(&[Diagnostic::warning(format!("{} {}: {why}", target.graph, texts.join(" ")))]);
        }
        Ok(found)
    }
}

fn candidate(
    graph: String,
    setting: Vec<(String, lightgraph::internals::value::Value)>,
    entry: &Entry,
) -> Option<Candidate> {
    let first = entry.times(Phase::First).filter(|_| entry.fault.is_none())?;
    let score = entry.scores.first()?;
    // What the reference errs by itself adds in squares.
    let own = score.stderr_percent.unwrap_or(0.0);
    let without = |found: f64, own: f64| (found * found - own * own).max(0.0).sqrt();
    Some(Candidate {
        graph,
        setting,
        ms: first.frames_ms.iter().copied().fold(f64::INFINITY, f64::min),
        rmse: without(score.metrics.rmse_percent, own),
        block: without(score.metrics.block_rmse_percent, own / 8.0),
        bias: score.metrics.bias_percent,
    })
}

/// Every candidate by time; a star where nothing beats it.
fn table(all: &[Candidate]) -> String {
    let best = unbeaten(all);
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|a, b| all[*a].ms.total_cmp(&all[*b].ms));
    let mut text = String::from("          ms    rmse %    8×8 %    bias %\n");
    for i in order {
        let c = &all[i];
        let star = if best.contains(&i) { '*' } else { ' ' };
        let Candidate { ms, rmse, block, bias, graph, .. } = c;
        text += &format!("{star} {ms:>10.2} {rmse:>9.2} {block:>8.2} {bias:>+9.2}  {graph}  {}\n", c.setting_text());
    }
    text
}

fn unserved(all: &[Candidate], wish: TuneGoal) -> Faults {
    let curve = unbeaten(all);
    let (Some(quickest), Some(closest)) = (curve.first(), curve.last()) else {
        return Diagnostic::error("no graph could be measured on this scene").into();
    };
    let d = match wish {
        TuneGoal::Error(percent) => {
            let c = &all[*closest];
            let text = format!("nothing measured errs by {percent} % or less: the best is {:.1} %", c.rmse);
            Diagnostic::error(text).help(format!("{} at {}; --sweep tries more settings", c.graph, c.setting_text()))
        }
        TuneGoal::Budget(_) | TuneGoal::Balance => {
            let c = &all[*quickest];
            let text = format!("nothing measured renders a frame in time: the fastest takes {:.1} ms", c.ms);
            let help = "ask for a smaller --size, or give --sweep cheaper settings";
            Diagnostic::error(text).help(format!("{} at {}; {help}", c.graph, c.setting_text()))
        }
    };
    d.into()
}

/// A bar on a terminal.
fn progress(settings: usize) -> indicatif::ProgressBar {
    if !std::io::stderr().is_terminal() {
        return indicatif::ProgressBar::hidden();
    }
    let bar = indicatif::ProgressBar::new(settings as u64);
    let style = indicatif::ProgressStyle::with_template("{wide_bar} {pos}/{len} {msg}");
    style.map_or(bar.clone(), |style| bar.with_style(style))
}

/// `30ms`, `0.5s` or milliseconds as a number.
fn budget(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (number, scale) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(ms), _) => (ms, 1.0),
        (None, Some(s)) => (s, 1e3),
        _ => (text, 1.0),
    };
    positive(number).map(|n| n * scale).ok_or_else(|| "write it as 30ms or 0.5s".into())
}

/// `5%`, or the number alone.
fn percent(text: &str) -> Result<f64, String> {
    positive(text.trim().trim_end_matches('%')).ok_or_else(|| "write it as 5%".into())
}

fn seconds(text: &str) -> Result<f64, String> {
    positive(text).ok_or_else(|| "it isn't a number above 0".into())
}

fn positive(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0)
}

#[cfg(test)]
mod tests {
    use super::{budget, percent};

    #[test]
    fn wishes_are_read_with_and_without_units() {
        assert_eq!([budget("30ms"), budget("0.5s"), budget("12")], [Ok(30.0), Ok(500.0), Ok(12.0)]);
        assert_eq!([percent("5%"), percent("2.5")], [Ok(5.0), Ok(2.5)]);
        for bad in ["", "fast", "-3ms", "0", "NaN", "inf"] {
            assert!(budget(bad).is_err() && percent(bad).is_err(), "{bad}");
        }
    }
}
