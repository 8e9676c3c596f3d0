//! Numerical stability: every graph under what a scene or a parameter can do, against answers that are known.
//!
//! - `case` reads the file of cases; `shape`, `build` and `number` make their scenes; `run` renders and judges
//! - `random` draws parameters, `fly` changes everything over thousands of frames, `adapters` renders elsewhere
//! - `report` holds the rows
//!
//! What is checked after every step of every frame: see [`crate::gpu::Numerics`].

mod adapters;
mod build;
mod case;
mod dice;
mod fly;
mod number;
mod random;
mod report;
mod run;
mod shape;

pub use case::Cases;
pub use report::{Report, Row, State};
pub use run::Graph;

use crate::diag::{Checked, Faults};
use crate::gpu::Gpu;
use case::Case;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How much is run.
#[derive(Debug, Clone)]
pub struct Options {
    /// Time to spend; `None`: all cases, and random parameters once.
    pub seconds: Option<f64>,
    /// Of everything random.
    pub seed: u64,
    /// Only the cases marked `quick`, a short flight, one vector of random parameters a graph.
    pub quick: bool,
    /// Only cases whose names hold this.
    pub filter: Option<String>,
    /// Where scenes and images go that other processes read.
    pub folder: PathBuf,
    /// The `lightgraph` command, to render on other adapters.
    pub program: PathBuf,
}

/// Shares of the time, at whose end each part stops: first runs of quick cases, all cases, other adapters, flights; random parameters
/// take the rest.
const SHARES: [f64; 4] = [0.35, 0.55, 0.65, 0.85];
/// Of a quick run.
const QUICK_FRAMES: u32 = 300;

/// Runs everything; `told` hears of each row when it is known.
///
/// # Errors
/// Scenes that can't be made or written, a lost device. What goes wrong in a case is its row's.
pub fn run(
    gpu: &Gpu,
    cases: &Cases,
    graphs: &[Graph],
    options: &Options,
    told: &mut dyn FnMut(&Row),
) -> Checked<Report> {
    let start = Instant::now();
    let over =
        |share: f64| move || options.seconds.is_some_and(|s| start.elapsed() > Duration::from_secs_f64(s * share));
    let mut rows: Vec<Row> = vec![];
    let mut keep = |new: Vec<Row>| {
        new.iter().for_each(&mut *told);
        rows.extend(new);
    };
    let chosen = |name: &str| options.filter.as_deref().is_none_or(|f| name.contains(f));
    let shaders: Vec<PathBuf> = cases.shaders.iter().map(|p| cases.folder.join(p)).collect();
    let mut own: BTreeMap<&str, Graph> = BTreeMap::new();
    for case in &cases.cases {
        let Some(path) = case.graph.as_ref().map(|p| cases.folder.join(p)) else { continue };
        let graph = match &case.edits {
            Some(edits) => Graph::edited(&path, &case.name, edits, &shaders)?,
            None => Graph::open(&path, &shaders)?,
        };
        own.insert(&case.name, graph);
    }
    let usual = |g: &&Graph| !options.quick || cases.quick.contains(&g.name);
    let taken: Vec<&Graph> = graphs.iter().filter(usual).collect();
    // Graph by graph, so that one takes over what the case before built, each with an equal part of the time that is left;
    // the first runs of the quick cases before all others.
    for (first, end) in [(true, SHARES[0]), (false, SHARES[1])] {
        if options.quick && !first {
            break;
        }
        let runs = |case: &Case| match (first, case.quick) {
            (true, true) => 0..1,
            (true, false) => 0..0,
            (false, quick) => usize::from(quick)..usize::MAX,
        };
        let turn = || cases.cases.iter().filter(|c| chosen(&c.name));
        for case in turn().filter(|c| c.graph.is_some() || c.is_of_the_loader()) {
            let graph = own.get(case.name.as_str()).or(graphs.first());
            let mut runner = run::Runner::new(gpu, cases);
            keep(graph.map_or(vec![], |g| runner.case(case, g, &runs(case), &mut over(end))));
        }
        for (i, graph) in taken.iter().enumerate() {
            let now = options.seconds.map_or(0.0, |s| start.elapsed().as_secs_f64() / s);
            let mut stop = over(now + (end - now).max(0.0) / (taken.len() - i) as f64);
            let mut runner = run::Runner::new(gpu, cases);
            for case in turn().filter(|c| c.graph.is_none() && !c.is_of_the_loader()) {
                if case.is_for(&graph.name, |n| graph.has(n)) {
                    keep(runner.case(case, graph, &runs(case), &mut stop));
                }
            }
            gpu.check()?;
        }
    }
    if chosen("adapters") {
        let mut stop = over(SHARES[2]);
        keep(adapters::rows(gpu, cases, &taken, &options.program, &options.folder, &mut stop)?);
    }
    if chosen("flight") {
        let flying: Vec<&Graph> = graphs.iter().filter(|g| cases.fly.graphs.contains(&g.name)).collect();
        let frames = if options.quick { QUICK_FRAMES } else { cases.fly.frames };
        for (i, graph) in flying.iter().enumerate() {
            let share = SHARES[2] + (SHARES[3] - SHARES[2]) * (i + 1) as f64 / flying.len() as f64;
            let instance = Gpu::instance();
            let own = Gpu::open_for(&instance, Some(&gpu.info.name), None).map_err(Faults::from)?;
            let flight = fly::Flight { instance: &instance, gpu: &own, cases, graph, seed: options.seed, frames };
            keep(flight.rows(&mut over(share)).unwrap_or_else(|faults| {
                let mut row = Row::new("fly-through", "flight", &graph.name, "");
                row.fail(&run::one_line(&faults));
                vec![row]
            }));
        }
    }
    if chosen("random") {
        let mut drawers = graphs
            .iter()
            .map(|g| random::Drawer::new(gpu, cases, g, options.seed, &options.folder))
            .collect::<Checked<Vec<_>>>()?;
        for drawer in drawers.iter_mut().filter(|_| !options.quick) {
            keep(drawer.ends(&mut over(1.0)));
        }
        let rounds = if options.seconds.is_some() && !options.quick { usize::MAX } else { 1 };
        for round in 0..rounds {
            if round > 0 && over(1.0)() {
                break;
            }
            for drawer in &mut drawers {
                keep(vec![drawer.draw(&mut over(1.0))]);
            }
        }
    }
    let info = &gpu.info;
    Ok(Report {
        version: env!("CARGO_PKG_VERSION").into(),
        adapter: format!("{}, {}", info.name, info.driver_info),
        software: gpu.is_software(),
        seed: options.seed,
        seconds: start.elapsed().as_secs_f64(),
        rows,
    })
}
