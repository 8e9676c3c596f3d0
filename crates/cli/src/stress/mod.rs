//! Numerical stability: every graph under what a scene or a parameter can do, against answers that are known.
//!
//! - `case` reads the file of cases; `shape`, `build` and `number` make their scenes; `run` renders and judges
//! - `random` draws parameters, `fly` changes everything over thousands of frames, `adapters` renders elsewhere
//! - `lanes` takes turns side by side; `report` holds the rows
//!
//! What is checked after every step of every frame: see [`lightgraph::internals::gpu::Numerics`].

mod adapters;
mod build;
mod case;
mod dice;
mod fly;
mod lanes;
mod number;
mod random;
mod report;
mod run;
mod shape;

pub use case::Cases;
pub use report::{CaseRow, RowState, StressReport};
pub use run::StressGraph;

use case::Case;
use lightgraph::{Checked, Faults, Gpu};
use report::{CaseRows, RunSelection, caught_up};
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

/// How much is run.
#[derive(Debug, Clone)]
pub struct StressOptions {
    /// Time to spend; `None`: all cases, and random parameters once.
    pub seconds: Option<f64>,
    /// Of everything random.
    pub seed: u64,
    /// Only the cases marked `quick`, a short flight, one vector of random parameters a graph.
    pub quick: bool,
    /// Only cases whose names hold this.
    pub filter: Option<String>,
    /// The file of cases.
    pub cases: PathBuf,
    /// Where scenes and images go that other processes read.
    pub folder: PathBuf,
    /// The `lightgraph` command, for what has to be a process of its own.
    pub program: PathBuf,
    /// Folders of shaders that it is told of.
    pub shaders: Vec<PathBuf>,
}

/// Shares of the time, at whose end each part stops: cases and random parameters of every graph, other adapters,
/// flights; more random parameters take the rest.
const SHARES: [f64; 3] = [0.65, 0.72, 0.97];
/// Of a quick run.
const QUICK_FRAMES: u32 = 300;

/// Runs everything; `told` hears of each row when it is known.
///
/// # Errors
/// Scenes that can't be made or written, a lost device. What goes wrong in a case is its row's.
pub fn run(
    gpu: &Gpu,
    cases: &Cases,
    graphs: &[StressGraph],
    options: &StressOptions,
    told: &mut dyn FnMut(&CaseRow),
) -> Checked<StressReport> {
    // What an adapter is known to draw wrongly says nothing of the graph.
    let unfit = |g: &StressGraph| cases.unfit.iter().find(|u| u.graph == g.name && gpu.info.name.contains(&u.adapter));
    let run = StressRun {
        gpu,
        cases,
        graphs: graphs.iter().filter(|g| unfit(g).is_none()).collect(),
        options,
        start: Instant::now(),
    };
    let mut rows = CaseRows::new(told);
    for unfit in graphs.iter().filter_map(unfit) {
        let mut row = CaseRow::new("case", "all", &unfit.graph, "");
        row.state = RowState::Absent;
        row.note(&unfit.why);
        rows.keep(vec![row]);
    }
    run.own_graphs(&mut rows)?;
    run.graph_by_graph(&mut rows)?;
    if run.chosen("adapters") {
        let taken: Vec<&StressGraph> = run.graphs.iter().copied().filter(|g| run.takes_cases(g)).collect();
        let mut stop = run.after(SHARES[1]);
        rows.keep(adapters::rows(gpu, cases, &taken, options, &mut stop)?);
    }
    if run.chosen("flight") {
        run.flights(&mut rows)?;
    }
    if run.chosen("random") && !options.quick {
        run.more_draws(&mut rows)?;
    }
    let info = &gpu.info;
    Ok(StressReport {
        version: env!("CARGO_PKG_VERSION").into(),
        adapter: format!("{}, {}", info.name, info.driver_info),
        software: gpu.is_software(),
        seed: options.seed,
        seconds: run.start.elapsed().as_secs_f64(),
        rows: rows.all,
    })
}

/// Runs another process until it ends with one of these codes; else why it did not, in a line.
fn finish(command: &mut Command, codes: &[i32]) -> Result<(), String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let done = command.output().map_err(|e| format!("can't run {program}: {e}"))?;
    if done.status.code().is_some_and(|code| codes.contains(&code)) {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&done.stderr);
    Err(said.lines().next().unwrap_or("it ended without a word").to_string())
}

/// A run under way.
struct StressRun<'a> {
    gpu: &'a Gpu,
    cases: &'a Cases,
    graphs: Vec<&'a StressGraph>,
    options: &'a StressOptions,
    start: Instant,
}

impl StressRun<'_> {
    /// Whether a share of the time is over, whenever it is asked.
    fn after(&self, share: f64) -> impl FnMut() -> bool + use<> {
        let (start, seconds) = (self.start, self.options.seconds);
        move || seconds.is_some_and(|s| start.elapsed() > Duration::from_secs_f64(s * share))
    }

    /// A part of the time from now to where a share of it ends: the share at which that part ends.
    fn part(&self, part: f64, end: f64) -> f64 {
        let now = self.options.seconds.map_or(0.0, |s| self.start.elapsed().as_secs_f64() / s);
        now + (end - now).max(0.0) * part
    }

    fn chosen(&self, name: &str) -> bool {
        self.options.filter.as_deref().is_none_or(|f| name.contains(f))
    }

    fn takes_cases(&self, graph: &StressGraph) -> bool {
        !self.options.quick || self.cases.quick.contains(&graph.name)
    }

    /// The cases with graphs of their own, and those of the loader.
    fn own_graphs(&self, rows: &mut CaseRows<'_>) -> Checked<()> {
        let shaders: Vec<PathBuf> = self.cases.shaders.iter().map(|p| self.cases.folder.join(p)).collect();
        for case in self.cases.cases.iter().filter(|c| self.chosen(&c.name)) {
            let path = case.graph.as_ref().map(|p| self.cases.folder.join(p));
            let own = match (&path, &case.variant) {
                (Some(path), Some(over)) => Some(StressGraph::varied(path, &case.name, over, &shaders)?),
                (Some(path), None) => Some(StressGraph::open(path, &shaders)?),
                (None, _) => None,
            };
            let any = self.graphs.first().copied().filter(|_| case.is_of_the_loader());
            if let Some(graph) = own.as_ref().or(any) {
                let runs = if self.options.quick { 0..usize::from(case.quick) } else { 0..usize::MAX };
                let mut stop = self.after(SHARES[0]);
                rows.keep(run::Runner::new(self.gpu, self.cases).case(
                    case,
                    graph,
                    (&runs, RunSelection::All),
                    &mut stop,
                ));
            }
        }
        Ok(())
    }

    /// All graphs get an equal part of the time. What is left out for it has another turn, as long as others leave some
    /// of theirs.
    fn graph_by_graph(&self, rows: &mut CaseRows<'_>) -> Checked<()> {
        let all: Vec<usize> = (0..self.graphs.len()).collect();
        let mut found = self.turns(&all, RunSelection::All, rows)?;
        let mut over = self.after(SHARES[0]);
        while !over() {
            let has_left = |i: &usize| {
                let of = |row: &&CaseRow| row.graph == self.graphs[*i].name;
                found.iter().filter(of).any(|row| row.state == RowState::Left)
            };
            let again: Vec<usize> = all.iter().copied().filter(has_left).collect();
            if again.is_empty() {
                break;
            }
            let more = self.turns(&again, RunSelection::Left(&found), rows)?;
            caught_up(&mut found, more);
        }
        rows.all.extend(found);
        Ok(())
    }

    /// The cases and random parameters of some graphs, one graph after the other, so that a case takes over what the
    /// one before built.
    fn turns(&self, graphs: &[usize], wanted: RunSelection<'_>, rows: &mut CaseRows<'_>) -> Checked<Vec<CaseRow>> {
        lanes::turns(self.gpu, graphs.len(), rows, &|gpu, turn, part, give| {
            let i = graphs[turn];
            let graph = self.graphs[i];
            let mut stop = self.after(self.part(part, SHARES[0]));
            let mut runner = run::Runner::new(gpu, self.cases);
            let mut cases: Vec<&Case> = self.cases.cases.iter().filter(|c| self.chosen(&c.name)).collect();
            cases.retain(|c| c.graph.is_none() && !c.is_of_the_loader() && c.is_for(&graph.name, |n| graph.has(n)));
            cases.retain(|_| self.takes_cases(graph));
            // The first runs of the quick cases before all others.
            for case in cases.iter().filter(|c| c.quick) {
                give(runner.case(case, graph, (&(0..1), wanted), &mut stop));
            }
            for case in cases.iter().filter(|_| !self.options.quick) {
                give(runner.case(case, graph, (&(usize::from(case.quick)..usize::MAX), wanted), &mut stop));
            }
            if self.chosen("random") {
                let StressOptions { seed, folder, .. } = self.options;
                let mut drawer = random::Drawer::new(gpu, self.cases, graph, *seed, folder)?;
                if !self.options.quick {
                    give(drawer.ends(&self.graphs[..i], wanted, &mut stop));
                }
                give(drawer.draw(wanted, &mut stop).into_iter().collect());
            }
            Ok(())
        })
    }

    /// All at once, where there are several, so that what ends early leaves the others its cores; each in a process of
    /// its own, whose memory is nobody else's.
    fn flights(&self, rows: &mut CaseRows<'_>) -> Checked<()> {
        let flying: Vec<&StressGraph> =
            self.graphs.iter().copied().filter(|g| self.cases.fly.graphs.contains(&g.name)).collect();
        let failed = |graph: &StressGraph, faults: &Faults| {
            let mut row = CaseRow::new("fly-through", "flight", &graph.name, "");
            row.fail(&faults.one_line());
            vec![row]
        };
        if let [graph] = flying.as_slice() {
            let flown = self.flight(graph);
            rows.keep(flown.unwrap_or_else(|faults| failed(graph, &faults)));
            return Ok(());
        }
        let seconds = self.seconds_until(SHARES[2]);
        std::thread::scope(|scope| {
            let started: Vec<_> = flying
                .iter()
                .copied()
                .map(|graph| (graph, scope.spawn(move || fly::elsewhere(graph, self.options, seconds))))
                .collect();
            for (graph, flight) in started {
                let flown = flight.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
                rows.keep(flown.unwrap_or_else(|faults| failed(graph, &faults)));
            }
        });
        Ok(())
    }

    /// In this process.
    fn flight(&self, graph: &StressGraph) -> Checked<Vec<CaseRow>> {
        let mut half = self.after(self.part(0.5, SHARES[2]));
        let mut stop = self.after(SHARES[2]);
        let instance = Gpu::instance();
        let gpu = Gpu::open_for(&instance, Some(&self.gpu.info.name), None).map_err(Faults::from)?;
        let frames = if self.options.quick { QUICK_FRAMES } else { self.cases.fly.frames };
        let (cases, seed) = (self.cases, self.options.seed);
        fly::FlightRun { instance: &instance, gpu: &gpu, cases, graph, seed, frames }.rows(&mut half, &mut stop)
    }

    /// From now to a share of the time; `None` without an end.
    fn seconds_until(&self, share: f64) -> Option<f64> {
        self.options.seconds.map(|all| (all * share - self.start.elapsed().as_secs_f64()).max(1.0))
    }

    /// Random parameters from the seeds after this one, until the time is over.
    fn more_draws(&self, rows: &mut CaseRows<'_>) -> Checked<()> {
        if self.options.seconds.is_none() {
            return Ok(());
        }
        for seed in self.options.seed.saturating_add(1).. {
            if self.after(1.0)() {
                break;
            }
            let found = lanes::turns(self.gpu, self.graphs.len(), rows, &|gpu, i, _, give| {
                let mut stop = self.after(1.0);
                if !stop() {
                    let folder = &self.options.folder;
                    let mut drawer = random::Drawer::new(gpu, self.cases, self.graphs[i], seed, folder)?;
                    give(drawer.draw(RunSelection::All, &mut stop).into_iter().collect());
                }
                Ok(())
            })?;
            rows.all.extend(found);
        }
        Ok(())
    }
}
