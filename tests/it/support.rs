//! What several tests need: paths of the repository, plans without a device, files in a folder of their own.

use lightgraph::internals::plan::build::{Planned, faults, plan};
use lightgraph::internals::plan::fastest::{Choices, FIRST};
use lightgraph::internals::plan::request::{Request, sample_device, sample_facts};
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Diagnostic, Project};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

/// A path in the repository.
pub fn repository(path: &str) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap().join(path)
}

/// The `lightgraph` command, run in the repository.
pub fn command() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightgraph"));
    command.current_dir(repository(""));
    command
}

/// The files with one of these endings directly in a folder of the repository, by name.
pub fn files(folder: &str, endings: &[&str]) -> Vec<PathBuf> {
    let folder = repository(folder);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| endings.iter().any(|x| e == *x)));
    paths.sort();
    assert!(!paths.is_empty(), "{} has no files with {endings:?}", folder.display());
    paths
}

/// Plans for a scene that has everything (`full`) or nothing, with the least that every adapter allows.
pub fn plan_without_device(
    project: &Project,
    params: &Values,
    outputs: Option<&[String]>,
    full: bool,
) -> Checked<Planned> {
    with_request(project, (params, outputs, &FIRST), &sample_facts(full), plan)
}

/// As [`plan_without_device`], with these alternatives of groups.
pub fn plan_of_choices(project: &Project, params: &Values, choices: &Choices, facts: &Values) -> Checked<Planned> {
    with_request(project, (params, None, choices), facts, plan)
}

fn with_request<T>(
    project: &Project,
    (params, outputs, choices): (&Values, Option<&[String]>, &Choices),
    facts: &Values,
    then: impl FnOnce(&Request) -> T,
) -> T {
    let (limits, features) = sample_device();
    then(&Request {
        graph: &project.graph,
        texts: &project.texts,
        params,
        facts,
        screen: [640, 480],
        outputs,
        choices,
        levels: &[],
        limits: &limits,
        features,
    })
}

/// The faults of both plans, whichever alternatives run, none of them twice.
pub fn faults_of_both(project: &Project, params: &Values, outputs: Option<&[String]>) -> Vec<Diagnostic> {
    let mut all: Vec<Diagnostic> = vec![];
    for facts in [true, false].map(sample_facts) {
        for d in with_request(project, (params, outputs, &FIRST), &facts, faults) {
            if !all.contains(&d) {
                all.push(d);
            }
        }
    }
    all
}

/// A linear congruential generator (Knuth's MMIX constants): the same choices on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n.max(1)
    }
}

/// A folder of its own for one test, removed in the end.
pub struct Scratch(PathBuf);

impl Scratch {
    pub fn new(name: &str) -> Scratch {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        Scratch(folder)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // What is left behind lies in the build folder and harms nobody.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Waits for a process; `None` for one that had to be killed after all of `patience`.
pub fn ended(child: &mut Child, patience: Duration) -> Option<ExitStatus> {
    let start = Instant::now();
    while start.elapsed() < patience {
        if let Some(status) = child.try_wait().unwrap() {
            return Some(status);
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    None
}
