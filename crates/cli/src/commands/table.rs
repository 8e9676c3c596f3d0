//! The table of steps that `render` prints.

use lightgraph::{FrameReport, Plan};
use std::fmt::Write;

/// Pass by pass: runs, device and host time; then what was left out, loops and totals.
pub fn steps(plan: &Plan, report: &FrameReport) -> String {
    struct StepRow {
        name: String,
        runs: u32,
        gpu: Option<f64>,
        cpu: f64,
    }
    // Members of a set and stages of a reduction are summed under their pass.
    let mut rows: Vec<StepRow> = vec![];
    for t in &report.steps {
        let Some(step) = plan.steps.get(t.step) else { continue };
        let row = match rows.iter_mut().find(|r| r.name == step.pass) {
            Some(row) => row,
            None => {
                rows.push(StepRow { name: step.pass.clone(), runs: 0, gpu: Some(0.0), cpu: 0.0 });
                let last = rows.len() - 1;
                &mut rows[last]
            }
        };
        row.runs += t.runs;
        row.gpu = row.gpu.zip(t.gpu_ms).map(|(a, b)| a + b);
        row.cpu += t.cpu_ms;
    }
    let width =
        rows.iter().map(|r| r.name.len()).chain(plan.skipped.iter().map(|s| s.0.len())).max().unwrap_or(4).max(4);
    let mut out = String::new();
    // Writing to a string can't fail.
    let _ = writeln!(out, "{:width$}  {:>6}  {:>10}  {:>10}", "pass", "runs", "GPU ms", "CPU ms");
    for r in &rows {
        let gpu = r.gpu.map_or("–".to_string(), |g| format!("{g:.3}"));
        let _ = writeln!(out, "{:width$}  {:>6}  {gpu:>10}  {:>10.3}", r.name, r.runs, r.cpu);
    }
    for (name, why) in &plan.skipped {
        let _ = writeln!(out, "{name:width$}  {:>6}  skipped: {why}", "–");
    }
    for l in &report.loops {
        let last = l.last.map_or(String::new(), |x| format!(", the test's last value {x:.3e}"));
        let _ = writeln!(out, "loop {}: {} iterations{last}", l.name, l.iterations);
    }
    let gpu = rows.iter().filter_map(|r| r.gpu).fold(0.0, |a, b| a + b);
    let (shared, own) = plan.bytes();
    let mib = |b: u64| b as f64 / f64::from(1 << 20);
    let _ = writeln!(out, "frame: {:.1} ms, of them {gpu:.1} ms on the device", report.wall_ms);
    let saved = if own > 0 { 100.0 * (1.0 - shared as f64 / own as f64) } else { 0.0 };
    let _ = writeln!(out, "memory: {:.1} MiB; without sharing {:.1} MiB ({saved:.0} % saved)", mib(shared), mib(own));
    out
}
