//! Each step by itself, beside the time that its bytes and operations take at best on this adapter.

use super::list::{GraphRun, Rooflines};
use super::pairs::number;
use super::{Bench, Goal, SpeedRow};
use lightgraph::internals::gpu::{self, FrameInputs, Prepared, Timing};
use lightgraph::internals::plan::change::Selection;
use lightgraph::internals::plan::{Loop, OrderNode};
use lightgraph::internals::session::plan_for;
use lightgraph::internals::value::Value;
use lightgraph::{Checked, Diagnostic, Plan, Scene};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a step is run again and again, so that a GPU comes to its full clock.
const RAMP: Duration = Duration::from_millis(30);

/// A step, alone.
struct Alone {
    pass: String,
    /// Milliseconds, without what an empty frame takes.
    ms: f64,
    /// Of all that it may read and write.
    bytes: u64,
}

impl Bench<'_> {
    pub(super) fn bounds(&self, bounds: &Rooflines) -> Checked<Vec<SpeedRow>> {
        let section = "distance to the limit";
        let (copy, _) = self.alone(&bounds.copy.0)?;
        let copy = find(&copy, &bounds.copy.1)?;
        let rate = copy.bytes as f64 / copy.ms;
        let (fma, plan) = self.alone(&bounds.fma.0)?;
        let operations = number(&bounds.fma.2, &plan)? / find(&fma, &bounds.fma.1)?.ms;
        let mut rows = vec![
            SpeedRow::new(section, "a kernel that copies", rate * 1e-6, "GB/s"),
            SpeedRow::new(section, "a kernel that multiplies and adds", operations * 1e-6, "GFLOP/s"),
        ];
        for run in &bounds.runs {
            let (steps, plan) = self.alone(run)?;
            for step in &steps {
                let work = bounds.operations.get(&step.pass).map(|e| number(e, &plan)).transpose()?;
                let (by_bytes, by_work) = (step.bytes as f64 / rate, work.unwrap_or(0.0) / operations);
                let bound = by_bytes.max(by_work);
                let kind = if by_work > by_bytes { "operations" } else { "bytes" };
                // Below this a frame's own jitter is all that is seen.
                if bound <= 0.0 || step.ms < if self.by_device() { 0.02 } else { 0.2 } {
                    continue;
                }
                let name = format!("{} on {}, {}", run.graph, run.scene, step.pass);
                let note = format!("{:.3} ms; {kind}: {bound:.3} ms ({:.1} MB)", step.ms, step.bytes as f64 * 1e-6);
                let row = SpeedRow::new(section, name, step.ms / bound, "× its bound");
                rows.push(row.wanted(Goal::AtMost(bounds.most_ratio)).note(note));
            }
        }
        Ok(rows)
    }

    /// Whether the device's own clock counts: the host's time of a short step on a GPU is that of handing it over. A
    /// software driver's is not to be trusted.
    fn by_device(&self) -> bool {
        !self.gpu.is_software()
    }

    /// Times the steps of a plan one by one, a loop's once.
    fn alone(&self, run: &GraphRun) -> Checked<(Vec<Alone>, Plan)> {
        let project = self.project(&run.graph)?;
        let scene = Arc::new(Scene::load(&self.root.join(&run.scene))?.scene);
        let settings = self.chosen(run, &project, &scene)?;
        let mut plan = plan_for(&project, &scene, &settings, self.gpu)?.plan;
        plan.order = apart(&plan.order);
        let pose = scene.pose(0.0);
        let tables = scene.tables_named(&pose, |name| plan.tables.iter().any(|t| t.table == name));
        let mut prepared = gpu::prepare(self.gpu, &plan, &scene.assets(), &tables)?;
        let [width, height] = settings.size;
        let (mut values, _) = scene.camera_values(&pose, None, width, height)?;
        values.insert("frame".into(), Value::Uint(0));
        values.insert("first_frame".into(), Value::Bool(true));
        values.insert("time".into(), Value::Float(0.0));
        let frame = |prepared: &mut Prepared, which: &[bool]| -> Checked<f64> {
            let mut least = f64::INFINITY;
            let begin = Instant::now();
            let (mut runs, enough) = (0, if self.by_device() { RAMP } else { Duration::ZERO });
            while runs < self.repeat.max(2) || begin.elapsed() < enough {
                let (values, chosen) = (values.clone(), Selection::of(which));
                let frame =
                    FrameInputs { values, chosen: Some(&chosen), timing: Timing::Frame, ..FrameInputs::default() };
                let start = Instant::now();
                let report = gpu::execute(self.gpu, &plan, prepared, &frame)?;
                let wall = start.elapsed().as_secs_f64() * 1e3;
                least = least.min(report.device_ms.filter(|_| self.by_device()).unwrap_or(wall));
                runs += 1;
            }
            Ok(least)
        };
        let all = vec![true; plan.steps.len()];
        frame(&mut prepared, &all)?;
        let empty = frame(&mut prepared, &vec![false; plan.steps.len()])?;
        let mut found: Vec<Alone> = vec![];
        for (i, step) in plan.steps.iter().enumerate() {
            let mut which = vec![false; plan.steps.len()];
            which[i] = true;
            let ms = (frame(&mut prepared, &which)? - empty).max(0.0);
            let touched: BTreeSet<_> = step.reads.iter().chain(&step.writes).collect();
            let bytes = touched.iter().filter_map(|r| plan.resources.get(r.0)).map(|r| r.desc.bytes()).sum();
            match found.iter_mut().find(|a| a.pass == step.pass) {
                Some(same) => {
                    same.ms += ms;
                    same.bytes += bytes;
                }
                None => found.push(Alone { pass: step.pass.clone(), ms, bytes }),
            }
        }
        Ok((found, plan))
    }
}

/// The same order, each step in loops of its own that go round once.
fn apart(nodes: &[OrderNode]) -> Vec<OrderNode> {
    let mut out = vec![];
    for node in nodes {
        match node {
            OrderNode::Step(_) => out.push(node.clone()),
            OrderNode::Loop(l) => {
                for inner in apart(&l.body) {
                    out.push(OrderNode::Loop(Loop { name: l.name.clone(), count: 1, until: None, body: vec![inner] }));
                }
            }
        }
    }
    out
}

fn find<'a>(steps: &'a [Alone], pass: &str) -> Checked<&'a Alone> {
    let found = steps.iter().find(|s| s.pass == pass && s.ms > 0.0);
    found.ok_or_else(|| Diagnostic::error(format!("no pass `{pass}` that takes time is in the graph")).into())
}
