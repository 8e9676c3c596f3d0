//! Graph snapshot tests: small RON files that say what a graph renders and what must hold. `lightgraph test` runs
//! them; [`run_dir`] does so inside `cargo test`.
//!
//! ```ron
//! Test(
//!     about: "One sentence.",
//!     graph: "../../graphs/gi/uniform_grid.ron",   // paths begin at this file
//!     scene: "../../scenes/cornell.glb",        // left out for a graph that uses none
//!     camera: "front",                          // without it, the scene's own
//!     size: (48, 48),
//!     params: {"grid": (3, 3, 3), "bounces": 2},
//!     light: 1.0,                               // what lights and emission are multiplied by
//!     time_limit: 60,                           // seconds until it fails as hung; without it, 300
//!     steps: [                                  // without them, one frame at 0 s
//!         Frames(count: 2, step: 0.5),          // the clock goes on by `step` seconds after each frame
//!         Move(lights: (0, -0.1, 0)),           // or `camera: …`, or `node: "ball", by: …`; metres, world space
//!         Set(params: {"bounces": 3}), Swap(graph: "other.ron"), Resize(size: (32, 24)),
//!         Edit(shader: "composite.wgsl", from: "1.0", to: "2.0"), Restore(shader: "composite.wgsl"),
//!         Frames(),
//!     ],
//!     checks: [                                 // what must hold after the last frame
//!         Plan(),                               // the plan's text, beside this file as NAME.plan.txt
//!         Bytes(at_most: 2000000, reason: "…"),
//!         Image(output: "color", rmse: 2, reason: "…"),      // beside this file as NAME.color.exr
//!         Steps(ran: ["composite"], skipped: ["capture"]),   // passes of the last frame
//!         Iterations(of: "bounce", min: 3, max: 3, reason: "…"),
//!         Mean(output: "color", value: 0.5, tolerance: 0.01, reason: "…"),
//!         Constant(output: "color", value: 2, tolerance: 0.002, reason: "…"),
//!         Symmetric(output: "color", axis: LeftRight, rmse: 1, reason: "…"),
//!         NotBrighter(output: "indirect", than: Run(graph: "…"), slack: 0.01, reason: "…"),
//!         Times(output: "color", factor: 0.5, of: Run(light: 2), rmse: 0.1, reason: "…"),
//!         Incremental(),                        // every frame equals one that runs all steps, bit for bit
//!     ],
//! )
//! ```
//!
//! Images are compared in linear light; limits are `rmse` (percent of the reference's mean), `max` and `p95` (in the
//! image's unit) and `flip` (mean HDR-FLIP). `Run` plays the same script from another `graph`, `scene`, `camera`,
//! `params` or `light`. `Plan` and `Bytes` need no adapter. `per_adapter: true` on an `Image` keeps one reference for
//! each adapter.
//!
//! `file` reads a test, `play` plays it, `check` judges, `judge` brings these together, `run` gives each a device and a
//! time limit, `reference` keeps and blesses what is expected, `select` finds the tests, `report` and `junit` tell
//! others.

pub mod check;
pub mod file;
mod judge;
pub mod junit;
pub mod play;
mod reference;
pub mod report;
mod run;
mod select;

pub use reference::{Bless, TestPicture};
pub use run::{OpenDevice, run, run_on};
pub use select::find;

use lightgraph::{Checked, Diagnostic, Faults};
use std::fmt;
use std::path::{Path, PathBuf};

/// How tests are run.
#[derive(Debug, Clone)]
pub struct TestOptions {
    pub bless: Bless,
    /// Where a failed test leaves images and texts, in a folder of its own.
    pub failures: PathBuf,
    /// A frame that leaves numbers which should not be fails its test; see [`lightgraph::internals::gpu::Numerics`].
    pub watch: bool,
    /// How many tests run at a time, each with a device of its own; at least 1.
    pub jobs: usize,
    /// A test ends at its first check that does not hold.
    pub fail_fast: bool,
}

/// One test at a time, nothing blessed, failures in `out/test`.
impl Default for TestOptions {
    fn default() -> TestOptions {
        TestOptions { bless: Bless::None, failures: "out/test".into(), jobs: 1, fail_fast: false, watch: false }
    }
}

/// A test that was run.
#[derive(Debug, Clone)]
pub struct TestOutcome {
    /// Its path below the folder it was found in, without the ending.
    pub name: String,
    pub path: PathBuf,
    pub about: String,
    pub seconds: f64,
    /// Titles of the checks that hold.
    pub held: Vec<String>,
    pub failures: Vec<FailedCheck>,
    /// What was blessed: what changed of which reference.
    pub blessed: Vec<String>,
    /// Titles of the checks that an adapter would be needed for.
    pub not_run: Vec<String>,
}

/// A check that does not hold.
#[derive(Debug, Clone)]
pub struct FailedCheck {
    pub title: String,
    /// By how much, or what is wrong.
    pub why: String,
    /// The reason that the test gives for its numbers.
    pub reason: String,
    /// What to look at.
    pub pictures: Vec<TestPicture>,
    /// Whether blessing would make it hold.
    pub blessable: bool,
}

/// All tests of a run.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    pub outcomes: Vec<TestOutcome>,
    /// Name and driver of the adapter.
    pub adapter: Option<String>,
    /// Why checks were not run.
    pub no_adapter: Option<Diagnostic>,
}

/// Whether a test holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TestState {
    Passed,
    Failed,
    /// Nothing failed, but not everything could be run.
    NotRun,
}

/// Runs every test of a folder.
///
/// # Errors
/// The folder can't be read, or holds no test.
pub fn run_dir(folder: &Path, options: &TestOptions) -> Checked<Summary> {
    Ok(run(&find(&[folder.to_path_buf()])?, options, &mut |_| ()))
}

impl TestOutcome {
    fn new(name: &str, path: &Path) -> TestOutcome {
        TestOutcome {
            name: name.into(),
            path: path.into(),
            about: String::new(),
            seconds: 0.0,
            held: vec![],
            failures: vec![],
            blessed: vec![],
            not_run: vec![],
        }
    }

    /// Whether it holds.
    pub fn state(&self) -> TestState {
        match (self.failures.is_empty(), self.not_run.is_empty()) {
            (false, _) => TestState::Failed,
            (true, false) => TestState::NotRun,
            (true, true) => TestState::Passed,
        }
    }

    fn fail(&mut self, title: &str, faults: &Faults) {
        self.failures.push(FailedCheck {
            title: title.into(),
            why: faults.to_string().trim_end().into(),
            reason: String::new(),
            pictures: vec![],
            blessable: false,
        });
    }
}

impl Summary {
    /// How many tests are in a state.
    pub fn count(&self, state: TestState) -> usize {
        self.outcomes.iter().filter(|o| o.state() == state).count()
    }

    /// Whether every check of every test was run and holds.
    pub fn passed(&self) -> bool {
        !self.outcomes.is_empty() && self.count(TestState::Passed) == self.outcomes.len()
    }
}

/// One line, and what is wrong below it.
impl fmt::Display for TestOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = match (self.state(), self.blessed.is_empty()) {
            (TestState::Passed, true) => "ok",
            (TestState::Passed, false) => "blessed",
            (TestState::Failed, _) => "FAILED",
            (TestState::NotRun, _) => "not run",
        };
        writeln!(
            f,
            "{word:<8} {} ({} checks, {:.1} s)",
            self.name,
            self.held.len() + self.blessed.len(),
            self.seconds
        )?;
        for text in &self.blessed {
            writeln!(f, "    blessed {text}")?;
        }
        for failure in &self.failures {
            let mut lines = failure.why.lines();
            writeln!(f, "    {}: {}", failure.title, lines.next().unwrap_or_default())?;
            for line in lines {
                writeln!(f, "      {line}")?;
            }
            if !failure.reason.is_empty() {
                writeln!(f, "      the limit's reason: {}", failure.reason)?;
            }
            for picture in &failure.pictures {
                writeln!(f, "      {}: {}", picture.name, picture.png.display())?;
            }
        }
        if !self.not_run.is_empty() {
            writeln!(f, "    no adapter for: {}", self.not_run.join(", "))?;
        }
        if self.failures.iter().any(|x| x.blessable) {
            writeln!(f, "    where the change is meant: lightgraph test {} --bless", quoted(&self.path))?;
        }
        Ok(())
    }
}

/// A path as a shell takes it for one word.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/._-+,:@%=".contains(c);
    let dashed = if text.starts_with('-') { format!("./{text}") } else { text };
    match dashed.chars().all(plain) && !dashed.is_empty() {
        true => dashed,
        false => format!("'{}'", dashed.replace('\'', "'\\''")),
    }
}

/// All that did not pass, and the counts.
impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for outcome in self.outcomes.iter().filter(|o| o.state() != TestState::Passed) {
            write!(f, "{outcome}")?;
        }
        write!(f, "{} passed, {} failed", self.count(TestState::Passed), self.count(TestState::Failed))?;
        match self.count(TestState::NotRun) {
            0 => writeln!(f),
            n => writeln!(f, ", {n} not run in full"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_one_word_of_a_shell() {
        let quoted = |path: &str| super::quoted(Path::new(path));
        assert_eq!(quoted("tests/graphs/a-1.ron"), "tests/graphs/a-1.ron");
        assert_eq!(quoted("a b.ron"), "'a b.ron'");
        assert_eq!(quoted("a;rm -rf '$HOME'.ron"), r"'a;rm -rf '\''$HOME'\''.ron'");
        assert_eq!(quoted("-rf"), "./-rf");
    }
}
