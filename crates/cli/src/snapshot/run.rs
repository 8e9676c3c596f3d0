//! Runs tests, on threads with a device each. None takes longer than its limit: a thread that gives no answer in time
//! is left to itself with its device, and another takes its place.

use super::file::{self, Test};
use super::{Summary, TestOptions, TestOutcome, judge};
use lightgraph::internals::gpu::OpenError;
use lightgraph::{Diagnostic, Faults, Gpu};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Opens a device for a thread.
pub type OpenDevice = Arc<dyn Fn() -> Result<Gpu, OpenError> + Send + Sync>;

/// Runs tests, as [`super::find`] gives them, on the best adapter; `told` hears of each when it is over, in their
/// order. What goes wrong in one test, a device that is lost or hangs too, fails that test only.
pub fn run(tests: &[(String, PathBuf)], options: &TestOptions, told: &mut dyn FnMut(&TestOutcome)) -> Summary {
    let open: OpenDevice = Arc::new(Gpu::open);
    run_on(tests, options, &open, told)
}

/// As [`run`], on devices that `open` gives.
pub fn run_on(
    tests: &[(String, PathBuf)],
    options: &TestOptions,
    open: &OpenDevice,
    told: &mut dyn FnMut(&TestOutcome),
) -> Summary {
    let mut summary = Summary::default();
    let next = AtomicUsize::new(0);
    let (send, receive) = channel();
    thread::scope(|scope| {
        for _ in 0..options.jobs.clamp(1, tests.len().max(1)) {
            let (next, send) = (&next, send.clone());
            scope.spawn(move || {
                let mut worker = None;
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some((name, path)) = tests.get(index) else { break };
                    // The receiver outlives this scope.
                    let _ = send.send((index, one(&mut worker, name, path, options, open)));
                }
                worker.map(Worker::end)
            });
        }
        drop(send);
        let mut early: BTreeMap<usize, TestAnswer> = BTreeMap::new();
        for (index, answer) in receive {
            early.insert(index, answer);
            while let Some(answer) = early.remove(&summary.outcomes.len()) {
                told(&answer.outcome);
                summary.outcomes.push(answer.outcome);
                summary.adapter = summary.adapter.take().or(answer.adapter);
                summary.no_adapter = summary.no_adapter.take().or(answer.no_adapter);
            }
        }
    });
    summary
}

/// What a test came to, and where.
struct TestAnswer {
    outcome: TestOutcome,
    adapter: Option<String>,
    no_adapter: Option<Diagnostic>,
}

/// Runs one test with a thread that may be there already.
fn one(slot: &mut Option<Worker>, name: &str, path: &Path, options: &TestOptions, open: &OpenDevice) -> TestAnswer {
    let start = Instant::now();
    let mut outcome = TestOutcome::new(name, path);
    let mut answer = match file::load(path) {
        Err(faults) => {
            outcome.fail("file", &faults);
            TestAnswer { outcome, adapter: None, no_adapter: None }
        }
        Ok(mut test) => {
            test.start.watch = options.watch;
            outcome.about.clone_from(&test.about);
            let limit = test.time_limit;
            let worker = slot.get_or_insert_with(|| Worker::start(options.clone(), open.clone()));
            worker.judge(test, outcome.clone(), limit).unwrap_or_else(|why| {
                outcome.fail("time limit", &why.into());
                if let Some(worker) = slot.take() {
                    worker.late.store(true, Ordering::Relaxed);
                }
                TestAnswer { outcome, adapter: None, no_adapter: None }
            })
        }
    };
    answer.outcome.seconds = start.elapsed().as_secs_f64();
    answer
}

/// A thread with a device of its own, opened when a test renders.
struct Worker {
    ask: Sender<(Test, TestOutcome)>,
    answers: Receiver<TestAnswer>,
    /// Nobody waits any more: nothing is to be written.
    late: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Worker {
    fn start(options: TestOptions, open: OpenDevice) -> Worker {
        let (ask, asked) = channel::<(Test, TestOutcome)>();
        let (answer, answers) = channel();
        let late = Arc::new(AtomicBool::new(false));
        let stop = late.clone();
        let thread = thread::spawn(move || {
            let mut device = TestDevice::default();
            for (test, outcome) in asked {
                let given = device.judge(&test, outcome, &options, &open, &stop);
                if answer.send(given).is_err() {
                    break;
                }
            }
        });
        Worker { ask, answers, late, thread }
    }

    /// # Errors
    /// No answer within the limit.
    fn judge(&self, test: Test, outcome: TestOutcome, limit: Duration) -> Result<TestAnswer, Diagnostic> {
        // A thread that is gone shows when the answer is asked for.
        let _ = self.ask.send((test, outcome));
        self.answers.recv_timeout(limit).map_err(|e| match e {
            RecvTimeoutError::Timeout => {
                let text = format!("it is not over after {} s: the device hangs, or is too slow", limit.as_secs_f64());
                Diagnostic::error(text).help("lower sizes or counts, or raise the test's `time_limit` (seconds)")
            }
            RecvTimeoutError::Disconnected => Diagnostic::error("the thread that ran it broke off")
                .help("this is a fault of lightgraph itself: please report it with the test"),
        })
    }

    /// Waits until its device is closed.
    fn end(self) {
        drop(self.ask);
        // It broke off in a test, which has failed by that.
        let _ = self.thread.join();
    }
}

#[derive(Default)]
struct TestDevice {
    gpu: Option<Gpu>,
    none: Option<Diagnostic>,
}

impl TestDevice {
    fn judge(
        &mut self,
        test: &Test,
        mut outcome: TestOutcome,
        options: &TestOptions,
        open: &OpenDevice,
        late: &AtomicBool,
    ) -> TestAnswer {
        if test.checks.iter().any(|c| c.kind.renders()) && self.gpu.is_none() && self.none.is_none() {
            match open() {
                Ok(gpu) => self.gpu = Some(gpu),
                Err(OpenError::NoAdapter(d)) => self.none = Some(d),
                Err(OpenError::Other(faults)) => return self.answer(failed(outcome, &faults)),
            }
        }
        judge::judge(test, self.gpu.as_ref(), options, late, &mut outcome);
        let answer = self.answer(outcome);
        // A lost device is of no use to the tests that follow.
        self.gpu = self.gpu.take().filter(|gpu| gpu.check().is_ok());
        answer
    }

    fn answer(&self, outcome: TestOutcome) -> TestAnswer {
        let adapter = self.gpu.as_ref().map(|gpu| format!("{}, {}", gpu.info.name, gpu.info.driver_info));
        TestAnswer { outcome, adapter, no_adapter: self.none.clone() }
    }
}

fn failed(mut outcome: TestOutcome, faults: &Faults) -> TestOutcome {
    outcome.fail("device", faults);
    outcome
}
