//! Of a graph's alternatives the fastest on the adapter at hand: timed once, then known from a file.
//!
//! A plan knows of no device. So each alternative is planned, all of them are run in turn, and the fastest becomes a
//! choice, which is data for the plan that counts. Whoever wants equal bits on every machine leaves this stage out:
//! then the first of each group runs.

pub mod known;

use crate::content::hash;
use crate::diag::Checked;
use crate::gpu::{FrameReport, Gpu};
use crate::graph::ast::{Pass, PassKind, walk};
use crate::graph::expr::{Expr, Val};
use crate::plan::fastest::{Alternatives, Choice, Choices, groups, once};
use crate::plan::keys::work;
use crate::plan::{Plan, StepId};
use crate::project::Project;
use crate::scene::{FACTS, Scene};
use crate::session::{Session, Settings, plan_for, values_for};
use crate::value::{Type, Value, Values};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use web_time::Instant;

/// Timed runs of each alternative, after one that is not, at least and at most.
const RUNS: [u32; 2] = [1, 7];

/// No more runs begin after this time.
const ENOUGH: Duration = Duration::from_millis(300);

/// A side that takes so many times as long as another is not looked at more closely.
const HOPELESS: f64 = 8.0;

/// Of the time of the first alternative another may take at most: what is closer is noise, and tomorrow the other way
/// round.
const CLEARLY: f64 = 0.95;

/// How groups are decided whose choice nobody states.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Policy {
    /// The fastest on this adapter, timed once and remembered
    #[default]
    Measure,
    /// The first, which is the same on every machine
    First,
}

impl Policy {
    /// The choices in `settings`, and what this says of the other groups.
    ///
    /// # Errors
    /// As [`measured`].
    pub fn choices(self, gpu: &Gpu, project: &Project, scene: &Arc<Scene>, settings: &Settings) -> Checked<Choices> {
        match self {
            Policy::Measure => measured(gpu, project, scene, settings, known::usual().as_deref()),
            Policy::First => Ok(settings.choices.clone()),
        }
    }
}

/// The choices in `settings`, and for each other group of the graph that is needed the fastest of its alternatives.
/// Times come from `file`, where it has them for this adapter and this work, and go there.
///
/// # Errors
/// Faults of any alternative, as of a plan or of the device.
pub fn measured(
    gpu: &Gpu,
    project: &Project,
    scene: &Arc<Scene>,
    settings: &Settings,
    file: Option<&Path>,
) -> Checked<Choices> {
    let mut choices = settings.choices.clone();
    let groups = groups(&project.graph);
    if groups.iter().all(|(name, _)| choices.contains_key(*name)) {
        return Ok(choices);
    }
    let values = values_for(project, scene, settings, gpu)?;
    for &(name, of) in groups.iter().filter(|(name, _)| once(&project.graph, name)) {
        let known = known::find(file, &key_once(gpu, project, &values, (name, of))).filter(|ms| ms.len() == of.len());
        if let (Some(times), false) = (known, choices.contains_key(name)) {
            let index = fastest(&times);
            choices.insert(name.to_string(), Choice { index, why: why(&times, index, &gpu.info.name) });
        }
    }
    if groups.iter().all(|(name, _)| choices.contains_key(*name)) {
        return Ok(choices);
    }
    loop {
        let settings = Settings { choices: choices.clone(), ..settings.clone() };
        let plan = plan_for(project, scene, &settings, gpu)?.plan;
        let Some(group) = plan.alternatives.iter().find(|a| !choices.contains_key(&a.name)) else { break };
        let sides = sides(gpu, project, scene, &settings, group)?;
        let of = groups.iter().find(|(name, _)| *name == group.name).map(|(_, of)| *of);
        let key = match of.filter(|_| group.once) {
            Some(of) => key_once(gpu, project, &values, (&group.name, of)),
            None => key(gpu, scene, &sides),
        };
        let times = match known::find(file, &key).filter(|ms| ms.len() == sides.len()) {
            Some(times) => times,
            None => {
                let times = race(gpu, project, scene, &sides)?;
                let adapter = format!("{}, {}", gpu.info.name, gpu.info.driver_info);
                known::keep(file, known::KnownChoice { key, adapter, group: group.name.clone(), ms: times.clone() });
                times
            }
        };
        let best = fastest(&times);
        let index = group.ways.get(best).map_or(0, |way| way.index);
        choices.insert(group.name.clone(), Choice { index, why: why(&times, best, &gpu.info.name) });
    }
    Ok(choices)
}

/// One alternative: what to render with it, and the plan.
struct Side {
    settings: Settings,
    plan: Plan,
    /// The steps that some other alternative does without.
    own: BTreeSet<usize>,
}

fn sides(
    gpu: &Gpu,
    project: &Project,
    scene: &Arc<Scene>,
    settings: &Settings,
    group: &Alternatives,
) -> Checked<Vec<Side>> {
    let mut sides = vec![];
    for way in &group.ways {
        let mut choices = settings.choices.clone();
        choices.insert(group.name.clone(), Choice { index: way.index, why: "measured now".into() });
        let plain = Settings { choices, skip: false, verify: false, watch: false, inspect: false, ..settings.clone() };
        let plan = plan_for(project, scene, &plain, gpu)?.plan;
        sides.push(Side { settings: plain, plan, own: BTreeSet::new() });
    }
    let passes: Vec<BTreeSet<String>> =
        sides.iter().map(|s| s.plan.steps.iter().map(|step| step.pass.clone()).collect()).collect();
    for side in &mut sides {
        let everywhere = |pass: &String| passes.iter().all(|p| p.contains(pass));
        let steps = side.plan.steps.iter().enumerate();
        side.own = steps.filter(|(_, step)| !everywhere(&step.pass)).map(|(i, _)| i).collect();
    }
    Ok(sides)
}

/// The same for the same adapter.
fn adapter(gpu: &Gpu) -> u128 {
    let info = &gpu.info;
    hash(&(&info.name, info.vendor, info.device, &info.driver, &info.driver_info, format!("{:?}", info.backend)))
}

/// The same for the same passes on the same adapter, as long as the texts of their shaders, what they define themselves
/// and the order of magnitude of their dispatches are the same.
fn key_once(gpu: &Gpu, project: &Project, values: &Values, (group, of): (&str, &[Vec<Pass>])) -> String {
    let mut passes = vec![];
    for way in of {
        walk(way, &mut |pass| {
            let shader = pass.kind.shader().and_then(|path| project.texts.files.get(&path.value));
            let value = |e: &Expr| e.eval(&|n| values.get(n).map(|v| Val::from(*v))).ok();
            let define = |e: &Expr| value(e).map(|v| format!("{v:?}"));
            let defines: Vec<_> = pass.defines.iter().map(|(name, e)| (name.value.clone(), define(e))).collect();
            let text = shader.map(|source| hash(&source.text));
            passes.push((pass.name.value.clone(), text, defines, magnitude(pass, &value)));
        });
    }
    format!("{:032x}", hash(&(adapter(gpu), group, passes)))
}

/// How much a dispatch does, in powers of 64, as far as expressions say it: resources that it goes over have a size
/// that no more than a plan knows.
fn magnitude(pass: &Pass, value: &dyn Fn(&Expr) -> Option<Val>) -> u32 {
    let count = |e: &Expr| match value(e) {
        Some(Val::Int(i)) => i.max(1) as f64,
        Some(Val::Ints(all)) => all.iter().map(|i| (*i).max(1) as f64).product(),
        _ => 1.0,
    };
    let over = match &pass.kind {
        PassKind::Compute { over: Some(over), .. } => over.exprs().iter().map(count).product(),
        _ => 1.0,
    };
    ((pass.each.as_ref().map_or(1.0, count) * over).log2() / 6.0) as u32
}

/// The same for the same work on the same adapter.
fn key(gpu: &Gpu, scene: &Scene, sides: &[Side]) -> String {
    let facts = scene.facts();
    let counts = FACTS.iter().filter(|(_, ty)| *ty == Type::Uint);
    let counts: Vec<Option<&[u8]>> = counts.map(|(name, _)| facts.get(*name).map(Value::bytes)).collect();
    let work: Vec<Vec<u128>> =
        sides.iter().map(|s| s.own.iter().map(|i| work(&s.plan, StepId(*i))).collect()).collect();
    format!("{:032x}", hash(&(adapter(gpu), counts, work)))
}

/// Milliseconds of the own steps of each side, the least of several runs in turn, so that what else the machine does
/// falls on all. By the device's clock; where it has none, or is a software driver's that tells the time of one step
/// with the next, by the host's, of a frame of those steps alone.
fn race(gpu: &Gpu, project: &Project, scene: &Arc<Scene>, sides: &[Side]) -> Checked<Vec<f64>> {
    let mut sessions = vec![];
    for side in sides {
        sessions.push(Session::new(gpu, project, scene.clone(), side.settings.clone())?);
    }
    let by_device = !gpu.is_software() && gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY);
    // In its first run a driver may still compile.
    for (session, side) in sessions.iter_mut().zip(sides) {
        session.repeat(gpu, &upto(&session.plan, &side.own))?;
    }
    let (mut times, mut shortest) = (vec![f64::INFINITY; sides.len()], f64::INFINITY);
    let start = Instant::now();
    let [least, most] = RUNS;
    for run in 0..most {
        if run >= least && start.elapsed() > ENOUGH {
            break;
        }
        for ((session, side), time) in sessions.iter_mut().zip(sides).zip(&mut times) {
            if *time > HOPELESS * shortest && time.is_finite() {
                continue;
            }
            let led = session.repeat(gpu, &upto(&session.plan, &side.own))?;
            let taken = match by_device {
                true => taken(&led, &side.own),
                false if led.wall_ms > HOPELESS * shortest => led.wall_ms,
                false => session.repeat(gpu, &alone(&session.plan, &side.own))?.wall_ms,
            };
            *time = time.min(taken);
            shortest = shortest.min(led.wall_ms);
        }
    }
    Ok(times)
}

/// By step: whether it is one of these.
fn alone(plan: &Plan, wanted: &BTreeSet<usize>) -> Vec<bool> {
    (0..plan.steps.len()).map(|i| wanted.contains(&i)).collect()
}

/// By step: whether it is one of these or leads to one.
fn upto(plan: &Plan, wanted: &BTreeSet<usize>) -> Vec<bool> {
    let mut run = vec![false; plan.steps.len()];
    let mut open: Vec<usize> = wanted.iter().copied().collect();
    while let Some(i) = open.pop() {
        if let Some(known) = run.get_mut(i).filter(|known| !**known) {
            *known = true;
            open.extend(plan.steps[i].after.iter().map(|s| s.0));
        }
    }
    run
}

/// Milliseconds on the device of some steps; where it doesn't say, of the frame.
fn taken(report: &FrameReport, steps: &BTreeSet<usize>) -> f64 {
    let own = report.steps.iter().filter(|t| steps.contains(&t.step));
    own.map(|t| t.gpu_ms).sum::<Option<f64>>().unwrap_or(report.wall_ms)
}

/// The first, unless another is clearly faster.
fn fastest(times: &[f64]) -> usize {
    let first = times.first().copied().unwrap_or(0.0);
    let others = times.iter().copied().enumerate().filter(|(_, ms)| *ms < first * CLEARLY);
    others.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
}

fn why(times: &[f64], best: usize, adapter: &str) -> String {
    let shown = |ms: &f64| format!("{ms:.2} ms");
    let others: Vec<String> = times.iter().enumerate().filter(|(i, _)| *i != best).map(|(_, ms)| shown(ms)).collect();
    let own = times.get(best).map_or(String::new(), shown);
    format!("measured, {own} against {} on {adapter}", others.join(" and "))
}

#[cfg(test)]
mod tests;
