//! Of a graph's alternatives the fastest on the adapter at hand: timed once, then known from a file.
//!
//! A plan knows of no device. So each alternative is planned, all of them are run in turn, and the fastest becomes a
//! choice, which is data for the plan that counts. Whoever wants equal bits on every machine leaves this stage out:
//! then the first of each group runs.

pub mod known;
mod race;

use crate::content::hash;
use crate::diag::{Checked, Diagnostic};
use crate::gpu::Gpu;
use crate::graph::ast::{Pass, PassKind, walk};
use crate::graph::expr::{Expr, Val};
use crate::plan::StepId;
use crate::plan::fastest::{Alternatives, Choice, Choices, groups, once};
use crate::plan::keys::work;
use crate::project::Project;
use crate::scene::{FACTS, Scene};
use crate::session::{Settings, plan_for, values_for};
use crate::value::{Type, Value, Values};
use race::{Race, Side};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Of the time of the first alternative another may take at most: what is closer is noise, and tomorrow the other way
/// round.
const CLEARLY: f64 = 0.95;

/// How groups are decided whose choice nobody states.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
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
/// An alternative that the device refuses is left out, and the choice says so.
///
/// # Errors
/// Faults of the plan with any alternative, or of running every one; a lost device.
pub fn measured(
    gpu: &Gpu,
    project: &Project,
    scene: &Arc<Scene>,
    settings: &Settings,
    file: Option<&Path>,
) -> Checked<Choices> {
    let mut measuring = Measuring::new(gpu, project, scene, settings, file)?;
    loop {
        if let Some(choices) = measuring.advance(gpu)? {
            return Ok(choices);
        }
        gpu.wait()?;
    }
}

/// As [`measured`], for whoever can't wait.
pub struct Measuring {
    project: Project,
    scene: Arc<Scene>,
    /// With the choices so far.
    settings: Settings,
    file: Option<PathBuf>,
    values: Values,
    race: Option<Contest>,
    /// Of alternatives that the device refuses: why. What is known from the file tells nothing.
    pub refused: Vec<Diagnostic>,
}

/// A group whose alternatives are timed.
struct Contest {
    group: Alternatives,
    key: String,
    race: Race,
}

impl Measuring {
    /// # Errors
    /// As [`measured`].
    pub fn new(
        gpu: &Gpu,
        project: &Project,
        scene: &Arc<Scene>,
        settings: &Settings,
        file: Option<&Path>,
    ) -> Checked<Measuring> {
        let (project, scene, mut settings) = (project.clone(), scene.clone(), settings.clone());
        let values = match decided(&project, &settings.choices) {
            true => Values::new(),
            false => values_for(&project, &scene, &settings, gpu)?,
        };
        for &(name, of) in groups(&project.graph).iter().filter(|(name, _)| once(&project.graph, name)) {
            if settings.choices.contains_key(name) {
                continue;
            }
            let key = key_once(gpu, &project, &values, (name, of));
            if let Some(times) = known::find(file, &key).filter(|ms| ms.len() == of.len()) {
                let (index, times) = (fastest(&times), times.into_iter().map(Ok).collect::<Vec<_>>());
                settings.choices.insert(name.to_string(), Choice { index, why: why(&times, index, &gpu.info.name) });
            }
        }
        Ok(Measuring {
            project,
            scene,
            settings,
            file: file.map(Path::to_path_buf),
            values,
            race: None,
            refused: vec![],
        })
    }

    /// Whether the device is at a run of an alternative: what [`Gpu::answered`] tells meanwhile is of it.
    pub fn is_under_way(&self) -> bool {
        self.race.as_ref().is_some_and(|contest| contest.race.is_under_way())
    }

    /// The choices, once all are made; until then begins a run or ends one, without waiting.
    ///
    /// # Errors
    /// As [`measured`].
    pub fn advance(&mut self, gpu: &Gpu) -> Checked<Option<Choices>> {
        if let Some(contest) = &mut self.race {
            let Some(found) = contest.race.advance(gpu)? else { return Ok(None) };
            if let Some(Contest { group, key, .. }) = self.race.take() {
                self.end(gpu, &group, key, found)?;
            }
        }
        while !decided(&self.project, &self.settings.choices) {
            let plan = plan_for(&self.project, &self.scene, &self.settings, gpu)?.plan;
            let open = |group: &&Alternatives| !self.settings.choices.contains_key(&group.name);
            let Some(group) = plan.alternatives.iter().find(open) else { break };
            let sides = race::sides(gpu, &self.project, &self.scene, &self.settings, group)?;
            let groups = groups(&self.project.graph);
            let of = groups.iter().find(|(name, _)| *name == group.name).map(|(_, of)| *of);
            let key = match of.filter(|_| group.once) {
                Some(of) => key_once(gpu, &self.project, &self.values, (&group.name, of)),
                None => key(gpu, &self.scene, &sides),
            };
            match known::find(self.file.as_deref(), &key).filter(|ms| ms.len() == sides.len()) {
                Some(times) => self.decide(gpu, group, &times.into_iter().map(Ok).collect::<Vec<_>>()),
                None => {
                    let race = Race::new(gpu, &self.project, &self.scene, sides);
                    self.race = Some(Contest { group: group.clone(), key, race });
                    return Ok(None);
                }
            }
        }
        Ok(Some(self.settings.choices.clone()))
    }

    /// Ends a race whose sides took so many milliseconds, or are refused.
    fn end(&mut self, gpu: &Gpu, group: &Alternatives, key: String, found: Vec<Checked<f64>>) -> Checked<()> {
        if found.iter().all(Result::is_err) {
            return found.into_iter().find_map(Result::err).map_or(Ok(()), Err);
        }
        for (way, faults) in group.ways.iter().zip(&found).filter_map(|(way, side)| Some((way, side.as_ref().err()?))) {
            let what = way.passes.first().map_or("?", String::as_str);
            let why = faults.0.first().map_or("", |d| &d.message);
            let text = format!("`{}` goes without `{what}`, which this device refuses: {why}", group.name);
            self.refused.push(Diagnostic::note(text));
        }
        // A refusal may be for want of memory, which another day has.
        if let Ok(ms) = found.iter().cloned().collect() {
            let adapter = format!("{}, {}", gpu.info.name, gpu.info.driver_info);
            let entry = known::KnownChoice { key, adapter, group: group.name.clone(), ms };
            known::keep(self.file.as_deref(), entry);
        }
        self.decide(gpu, group, &found);
        Ok(())
    }

    fn decide(&mut self, gpu: &Gpu, group: &Alternatives, found: &[Checked<f64>]) {
        let times: Vec<f64> = found.iter().map(|ms| *ms.as_ref().unwrap_or(&f64::INFINITY)).collect();
        let best = fastest(&times);
        let index = group.ways.get(best).map_or(0, |way| way.index);
        let choice = Choice { index, why: why(found, best, &gpu.info.name) };
        self.settings.choices.insert(group.name.clone(), choice);
    }
}

/// Whether every group has its choice.
fn decided(project: &Project, choices: &Choices) -> bool {
    groups(&project.graph).iter().all(|(name, _)| choices.contains_key(*name))
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

/// The first, unless another is clearly faster.
fn fastest(times: &[f64]) -> usize {
    let first = times.first().copied().unwrap_or(0.0);
    let others = times.iter().copied().enumerate().filter(|(_, ms)| *ms < first * CLEARLY);
    others.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
}

fn why(found: &[Checked<f64>], best: usize, adapter: &str) -> String {
    let shown = |side: &Checked<f64>| match side {
        Ok(ms) => format!("{ms:.2} ms"),
        Err(_) => "a refusal".into(),
    };
    let others = found.iter().enumerate().filter(|(i, _)| *i != best).map(|(_, side)| shown(side));
    let own = found.get(best).map_or(String::new(), shown);
    format!("measured, {own} against {} on {adapter}", others.collect::<Vec<_>>().join(" and "))
}

#[cfg(test)]
mod tests;
