//! What the framework itself costs: a chain of passes, few and many, and the same without the framework.
//!
//! Every ratio is the median over rounds. In a round both sides do equal work one after the other, so that what else
//! the machine does falls on both, and a round in which it fell on one counts for nothing.

use super::handwritten::Handwritten;
use super::list::{Chain, GraphRun};
use super::pairs::median;
use super::{Bench, Goal, SpeedRow};
use lightgraph::internals::gpu::Timing;
use lightgraph::internals::session::plan_for;
use lightgraph::{Checked, Diagnostic, Project, Scene, Session, Settings};
use std::sync::Arc;
use std::time::Instant;

/// Rounds of a ratio at least.
const ROUNDS: u32 = 15;

/// A chain of so many passes.
struct Length {
    passes: u32,
    project: Project,
    scene: Arc<Scene>,
    session: Session,
}

impl Bench<'_> {
    pub(super) fn chain(&self, chain: &Chain) -> Checked<Vec<SpeedRow>> {
        let section = "the framework's own cost";
        let mut rows = vec![];
        let mut few = self.chained(&chain.run, chain, chain.few, &[])?;
        let mut many = self.chained(&chain.run, chain, chain.many, &[])?;
        for length in [&mut few, &mut many] {
            let (mut encode, mut plan) = (f64::INFINITY, f64::INFINITY);
            for i in 0..self.repeat.max(3) {
                plan = plan.min(self.plan_ms(length)?);
                let report = length.session.frame(self.gpu, i, 0.0)?;
                let runs: u32 = report.steps.iter().map(|s| s.runs).sum();
                encode = encode.min(report.steps.iter().map(|s| s.cpu_ms).sum::<f64>() * 1e3 / f64::from(runs.max(1)));
            }
            let name = format!("{}, {} passes", chain.name, length.passes);
            let row = SpeedRow::new(section, format!("{name}, CPU time to encode one"), encode, "µs");
            rows.push(row.wanted(Goal::AtMost(chain.most_encode_us)));
            rows.push(SpeedRow::new(section, format!("{name}, to plan"), plan, "ms"));
        }
        let (mut plans, mut frames) = (vec![], vec![]);
        // As many passes of one as of the other.
        let times = chain.many.div_ceil(chain.few.max(1));
        let more = f64::from(chain.many) / f64::from(chain.few);
        for i in 0..self.repeat.max(ROUNDS) {
            let share = |one: f64, all: f64| one * f64::from(times) / more / all;
            let (mut plan_few, mut frame_few) = (0.0, 0.0);
            for _ in 0..times {
                plan_few += self.plan_ms(&few)?;
            }
            plans.push(share(self.plan_ms(&many)?, plan_few));
            for _ in 0..times {
                frame_few += self.frame_ms(&mut few.session, i)?;
            }
            frames.push(share(self.frame_ms(&mut many.session, i)?, frame_few));
        }
        for (what, ratios) in [("plan", plans), ("frame", frames)] {
            let name = format!("{}, growth of a pass's share of the {what}", chain.name);
            let row = SpeedRow::new(section, name, median(ratios), "×").wanted(Goal::AtMost(1.25));
            rows.push(row.note(format!("{} passes by {}", chain.many, chain.few)));
        }
        rows.push(self.by_hand(chain)?);
        Ok(rows)
    }

    fn chained(&self, run: &GraphRun, chain: &Chain, passes: u32, set: &[String]) -> Checked<Length> {
        let project = self.project(&run.graph)?;
        let scene = Arc::new(Scene::load(&self.root.join(&run.scene))?.scene);
        let count = format!("{}={passes}", chain.count);
        let run = GraphRun { set: [run.set.as_slice(), &[count], set].concat(), ..run.clone() };
        let settings: Settings = self.settings(&run, &project)?;
        let mut session = Session::new(self.gpu, &project, scene.clone(), settings)?;
        // A driver may compile in the first.
        session.frame(self.gpu, 0, 0.0)?;
        Ok(Length { passes, project, scene, session })
    }

    fn plan_ms(&self, of: &Length) -> Checked<f64> {
        let start = Instant::now();
        plan_for(&of.project, &of.scene, &of.session.settings, self.gpu)?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    fn frame_ms(&self, session: &mut Session, index: u32) -> Checked<f64> {
        let start = Instant::now();
        session.frame(self.gpu, index, 0.0)?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    fn by_hand(&self, chain: &Chain) -> Checked<SpeedRow> {
        let mut session = self.chained(&chain.run, chain, chain.few, std::slice::from_ref(&chain.work))?.session;
        // The program takes no times of its passes either.
        session.settings.timing = Timing::Frame;
        let program = Handwritten::new(self.gpu, &session.plan).ok_or_else(|| {
            Diagnostic::error(format!("`{}` is not the chain that was written by hand", chain.run.graph))
        })?;
        program.frame(self.gpu)?;
        let by_hand = || -> Checked<f64> {
            let start = Instant::now();
            program.frame(self.gpu)?;
            Ok(start.elapsed().as_secs_f64() * 1e3)
        };
        let (mut ours, mut theirs, mut ratios) = (vec![], vec![], vec![]);
        for i in 0..self.repeat.max(ROUNDS) {
            // Each goes first as often as the other.
            let (one, other) = if i % 2 == 0 {
                let one = self.frame_ms(&mut session, i)?;
                (one, by_hand()?)
            } else {
                let other = by_hand()?;
                (self.frame_ms(&mut session, i)?, other)
            };
            ratios.push(one / other);
            ours.push(one);
            theirs.push(other);
        }
        let name = format!("{}, against a program written by hand", chain.name);
        let row = SpeedRow::new("the framework's own cost", name, median(ratios), "×");
        let note = format!("{:.2} ms, {:.2} ms by hand; {} passes", median(ours), median(theirs), chain.few);
        Ok(row.wanted(Goal::AtMost(chain.most_ratio)).note(note))
    }
}
