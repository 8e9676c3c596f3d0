//! The time of a run, lap by lap: for `--stats`, and as a trace for Perfetto or Chrome (`--trace`).

use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Checked, Diagnostic, Faults, FrameReport, Session};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// Tracks of the trace.
const HOST: u32 = 1;
const DEVICE: u32 = 2;

/// Frames of a trace at most, the first ones: a trace of a long run would be no use to anybody.
const MOST_FRAMES: usize = 1000;

/// What a run has done so far. Times are in milliseconds since it began.
pub struct Trace {
    start: Instant,
    /// The end of the last lap.
    last: f64,
    laps: BTreeMap<&'static str, f64>,
    events: Vec<Value>,
    frames: usize,
}

impl Trace {
    pub fn new() -> Trace {
        let name = |what: &str, tid: u32, name: &str| {
            let args = json!({ "name": name });
            json!({"ph": "M", "pid": 1, "tid": tid, "name": what, "args": args})
        };
        let events = vec![
            name("process_name", HOST, "lightgraph"),
            name("thread_name", HOST, "host"),
            name("thread_name", DEVICE, "device"),
        ];
        Trace { start: Instant::now(), last: 0.0, laps: BTreeMap::new(), events, frames: 0 }
    }

    /// Milliseconds of each lap by its name.
    pub fn laps(&self) -> BTreeMap<&'static str, f64> {
        self.laps.clone()
    }

    /// Ends a lap. Returns the milliseconds that it took.
    pub fn lap(&mut self, name: &'static str) -> f64 {
        let (begin, took) = self.next();
        self.laps.insert(name, took);
        self.events.push(span(HOST, name, begin, took, json!({})));
        took
    }

    /// Ends the lap in which a session was made: its shaders, its plan, and what the device holds for it.
    pub fn prepared(&mut self, session: &Session) -> f64 {
        let begin = self.last;
        let took = self.lap("prepare");
        let planned = session.plan_ms.min(took);
        let composed = session.compose_ms.min(planned);
        self.events.push(span(HOST, "plan", begin, planned, json!({"steps": session.plan.steps.len()})));
        let shaders = json!({"shaders": session.plan.shaders.len()});
        // Passes are wired once their shaders are known; what comes before takes no time to speak of.
        self.events.push(span(HOST, "compose", begin, composed, shaders));
        self.events.push(span(HOST, "pipelines and memory", begin + planned, took - planned, json!({})));
        took
    }

    /// Ends the lap of a frame: what the host did, and the steps on the device.
    pub fn frame(&mut self, index: u32, session: &Session, report: &FrameReport) -> f64 {
        let (begin, took) = self.next();
        self.frames += 1;
        if self.frames > MOST_FRAMES {
            return took;
        }
        self.events.push(span(HOST, &format!("frame {index}"), begin, took, json!({"steps": report.steps.len()})));
        let mut at = begin;
        let waited = (report.wall_ms - report.record_ms - report.submit_ms).max(0.0);
        for (name, ms) in [("record", report.record_ms), ("submit", report.submit_ms), ("wait", waited)] {
            let ms = ms.min(begin + took - at).max(0.0);
            self.events.push(span(HOST, name, at, ms, json!({})));
            at += ms;
        }
        // The device's clock has no zero in common with ours: its work ends when the wait for it does.
        let origin = begin + report.device_ms.map_or(0.0, |device| (report.wall_ms - device).max(0.0));
        for time in &report.steps {
            let (Some(step), Some(ms), Some(began)) = (session.plan.steps.get(time.step), time.gpu_ms, time.began_ms)
            else {
                continue;
            };
            let why = session.why().get(time.step).map(ToString::to_string);
            let args = json!({"pass": step.pass, "runs": time.runs, "why": why, "encode_ms": time.cpu_ms});
            let begin = origin + began;
            if time.runs == 1 {
                self.events.push(span(DEVICE, &step.name, begin, ms, args));
            } else {
                // Runs of the steps of a loop alternate; their sums would overlap on one track.
                let id = format!("{index}.{}", time.step);
                for (phase, at) in [("b", begin), ("e", begin + ms)] {
                    let at = micros(at);
                    self.events.push(json!({
                        "ph": phase, "cat": "loop", "id": id, "pid": 1, "tid": DEVICE, "name": step.name, "ts": at,
                        "args": args,
                    }));
                }
            }
        }
        took
    }

    /// Writes the trace.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn write(&self, path: &Path) -> Checked<()> {
        let trace = json!({"displayTimeUnit": "ms", "traceEvents": self.events});
        let text = serde_json::to_string(&trace)
            .map_err(|e| Faults::from(Diagnostic::error(format!("can't write the trace: {e}"))))?;
        write_atomically(path, text.as_bytes())
    }

    /// Where a lap began that ends now, and what it took.
    fn next(&mut self) -> (f64, f64) {
        let begin = self.last;
        self.last = self.start.elapsed().as_secs_f64() * 1e3;
        (begin, self.last - begin)
    }
}

fn span(track: u32, name: &str, begin: f64, ms: f64, args: Value) -> Value {
    let (at, lasts) = (micros(begin), micros(ms));
    json!({"ph": "X", "cat": "lightgraph", "pid": 1, "tid": track, "name": name, "ts": at, "dur": lasts, "args": args})
}

/// The trace counts in microseconds.
fn micros(ms: f64) -> f64 {
    (ms * 1e6).round() / 1e3
}
