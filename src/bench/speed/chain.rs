//! What the framework itself costs: a chain of passes, few and many, and the same without the framework.

use super::handwritten::Handwritten;
use super::list::{Chain, Run};
use super::{Bench, Row, Wanted};
use crate::diag::{Checked, Diagnostic};
use crate::scene;
use crate::session::{Session, plan_for};
use std::time::Instant;

impl Bench<'_> {
    pub(super) fn chain(&self, chain: &Chain) -> Checked<Vec<Row>> {
        let section = "the framework's own cost";
        let mut rows = vec![];
        let mut sums = vec![];
        for count in [chain.few, chain.many] {
            let (mut session, plan_ms) = self.chained(&chain.run, &[format!("{}={count}", chain.count)])?;
            let (mut encode, mut wall) = (f64::INFINITY, f64::INFINITY);
            for i in 0..self.repeat.max(3) {
                let start = Instant::now();
                let report = session.frame(self.gpu, i, 0.0)?;
                wall = wall.min(start.elapsed().as_secs_f64() * 1e3);
                let runs: u32 = report.steps.iter().map(|s| s.runs).sum();
                encode = encode.min(report.steps.iter().map(|s| s.cpu_ms).sum::<f64>() * 1e3 / f64::from(runs.max(1)));
            }
            let row =
                Row::new(section, format!("{}, {count} passes, CPU time to encode one", chain.name), encode, "µs");
            rows.push(row.wanted(Wanted::AtMost(chain.most_encode_us)));
            rows.push(Row::new(section, format!("{}, {count} passes, to plan", chain.name), plan_ms, "ms"));
            sums.push((plan_ms, wall));
        }
        if let [(few_plan, few_wall), (many_plan, many_wall)] = sums[..] {
            let more = f64::from(chain.many) / f64::from(chain.few);
            for (what, ratio) in [("plan", many_plan / few_plan / more), ("frame", many_wall / few_wall / more)] {
                let row =
                    Row::new(section, format!("{}, growth of a pass's share of the {what}", chain.name), ratio, "×");
                rows.push(row.wanted(Wanted::AtMost(1.25)).note(format!("{} passes by {}", chain.many, chain.few)));
            }
        }
        rows.push(self.by_hand(chain)?);
        Ok(rows)
    }

    /// A session over a chain, and the milliseconds that planning takes.
    fn chained(&self, run: &Run, set: &[String]) -> Checked<(Session, f64)> {
        let project = self.project(&run.graph)?;
        let scene = scene::load(&self.root.join(&run.scene))?.scene;
        let run = Run { set: [run.set.as_slice(), set].concat(), ..run.clone() };
        let settings = self.settings(&run, &project)?;
        let mut plan_ms = f64::INFINITY;
        for _ in 0..3 {
            let start = Instant::now();
            plan_for(&project, &scene, &settings, self.gpu)?;
            plan_ms = plan_ms.min(start.elapsed().as_secs_f64() * 1e3);
        }
        Ok((Session::new(self.gpu, &project, scene, settings)?, plan_ms))
    }

    fn by_hand(&self, chain: &Chain) -> Checked<Row> {
        let set = [format!("{}={}", chain.count, chain.few), chain.work.clone()];
        let (mut session, _) = self.chained(&chain.run, &set)?;
        let program = Handwritten::new(self.gpu, &session.plan).ok_or_else(|| {
            Diagnostic::error(format!("`{}` is not the chain that was written by hand", chain.run.graph))
        })?;
        session.frame(self.gpu, 0, 0.0)?;
        program.frame(self.gpu)?;
        let (mut ours, mut theirs) = (f64::INFINITY, f64::INFINITY);
        for i in 0..self.repeat.max(5) {
            let start = Instant::now();
            session.frame(self.gpu, i, 0.0)?;
            ours = ours.min(start.elapsed().as_secs_f64() * 1e3);
            let start = Instant::now();
            program.frame(self.gpu)?;
            theirs = theirs.min(start.elapsed().as_secs_f64() * 1e3);
        }
        let row = Row::new(
            "the framework's own cost",
            format!("{}, against a program written by hand", chain.name),
            ours / theirs,
            "×",
        );
        let note = format!("{ours:.2} ms, {theirs:.2} ms by hand; {} passes", chain.few);
        Ok(row.wanted(Wanted::AtMost(chain.most_ratio)).note(note))
    }
}
