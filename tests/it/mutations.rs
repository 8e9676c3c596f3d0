//! The edits of `tests/mutations.txt`: each must make a test of `tests/graphs` fail, or say why none does.

use crate::device;
use crate::support::{Scratch, repository};
use lightgraph::Project;
use lightgraph_cli::snapshot::check::CheckKind;
use lightgraph_cli::snapshot::file::{self, ScriptStep, Setup};
use lightgraph_cli::snapshot::play::plan_in_the_end;
use lightgraph_cli::snapshot::{TestOptions, find, run};
use std::collections::BTreeSet;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

struct Edit {
    file: String,
    from: String,
    to: String,
    survives: Option<String>,
}

fn edits() -> Vec<Edit> {
    let text = fs::read_to_string(repository("tests/mutations.txt")).unwrap();
    let lines = |block: &str| block.lines().filter(|l| !l.starts_with('#')).map(String::from).collect::<Vec<_>>();
    let blocks = text.split("\n\n").map(lines).filter(|lines| !lines.is_empty());
    blocks
        .map(|lines| {
            let part = |start: &str| lines.iter().find_map(|l| l.strip_prefix(start)).map(String::from);
            let file = lines[0].clone();
            let (from, to) = (part("- "), part("+ "));
            Edit { from: from.unwrap(), to: to.unwrap(), survives: part("survives: "), file }
        })
        .collect()
}

#[test]
fn every_edit_of_the_list_can_be_made() {
    let edits = edits();
    assert!(edits.len() >= 40, "{} edits", edits.len());
    for e in edits {
        let text = fs::read_to_string(repository(&e.file)).unwrap();
        assert!(text.contains(&e.from), "{} doesn't hold `{}`", e.file, e.from);
        assert!(e.from != e.to);
    }
}

#[test]
#[ignore = "takes minutes on two cores: cargo test mutations -- --ignored --nocapture"]
fn tests_notice_what_is_edited() {
    let _alone = device::gpu();
    let scratch = Scratch::new("mutations");
    for folder in ["graphs", "shaders", "scenes", "tests/graphs"] {
        copy(&repository(folder), &scratch.path().join(folder));
    }
    let tests = find(&[scratch.path().join("tests/graphs")]).unwrap_or_else(|f| panic!("{f}"));
    let mut tests: Vec<Reading> = tests.into_iter().map(Reading::of).collect();
    // The one that looks at most goes first.
    tests.sort_by_key(|t| t.test.0 != "grid_cornell");
    let options = TestOptions { failures: scratch.path().join("out"), fail_fast: true, ..TestOptions::default() };
    let (mut wrong, all) = (vec![], edits());
    let (start, mut runs) = (Instant::now(), 0);
    // Verdicts on these very files by this very program are kept, so that a run that was cut short goes on.
    let kept =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("mutations-{:016x}.txt", everything(scratch.path())));
    let known = fs::read_to_string(&kept).unwrap_or_default();
    let mut keep = fs::OpenOptions::new().create(true).append(true).open(&kept).unwrap();
    for e in &all {
        let title = format!("{} | {}", e.file, e.to);
        if let Some(line) = known.lines().find(|l| l.strip_prefix(&title).is_some_and(|rest| rest.starts_with(" | "))) {
            println!("   kept | {line}");
            continue;
        }
        let path = scratch.path().join(&e.file);
        let before = fs::read_to_string(&path).unwrap();
        fs::write(&path, before.replacen(&e.from, &e.to, 1)).unwrap();
        // A test that does not read the file can't notice; the one that noticed the last edit goes first.
        let mut noticed = None;
        let file = fs::canonicalize(&path).unwrap();
        for at in (0..tests.len()).filter(|i| tests[*i].files.contains(&file)) {
            let test = &tests[at];
            runs += 1;
            let summary = run(std::slice::from_ref(&test.test), &options, &mut |_| ());
            let Some(failure) = summary.outcomes.first().and_then(|o| o.failures.first()) else { continue };
            assert!(failure.title != "time limit", "{title}: {}: {}", test.test.0, failure.why);
            // An edit that can't even be compiled shows nothing of what the tests notice.
            let broken = failure.why.starts_with("error:");
            let first_line = failure.why.lines().next().unwrap_or_default();
            noticed = Some((broken, format!("{}: {}: {first_line}", test.test.0, failure.title)));
            let test = tests.remove(at);
            tests.insert(0, test);
            break;
        }
        fs::write(&path, before).unwrap();
        let (ok, said) = match (&noticed, &e.survives) {
            (Some((true, said)), _) => (false, format!("no sound edit: {said}")),
            (Some((false, said)), None) => (true, said.clone()),
            (Some((false, said)), Some(_)) => (false, format!("does not survive any more: {said}")),
            (None, Some(why)) => (true, format!("survives: {why}")),
            (None, None) => (false, "no test notices".into()),
        };
        println!("{:5.0} s | {title} | {said}", start.elapsed().as_secs_f64());
        if ok {
            writeln!(keep, "{title} | {said}").unwrap();
        } else {
            wrong.push(format!("{title}: {said}"));
        }
    }
    let survivors = all.iter().filter(|e| e.survives.is_some()).count();
    println!(
        "{} edits, {survivors} said to survive, {} wrong, {runs} runs of tests, {:.0} s",
        all.len(),
        wrong.len(),
        start.elapsed().as_secs_f64()
    );
    assert!(wrong.is_empty(), "{} of {} edits:\n{}", wrong.len(), all.len(), wrong.join("\n"));
}

/// A hash of all files of a folder and of this program.
fn everything(folder: &Path) -> u64 {
    let mut hasher = DefaultHasher::new();
    fs::read(std::env::current_exe().unwrap()).unwrap().hash(&mut hasher);
    let mut open = vec![folder.to_path_buf()];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            let mut inside: Vec<PathBuf> = fs::read_dir(&path).unwrap().map(|e| e.unwrap().path()).collect();
            inside.sort();
            open.extend(inside);
        } else {
            fs::read(&path).unwrap().hash(&mut hasher);
        }
    }
    hasher.finish()
}

/// A test, and the graphs and shaders that it reads.
struct Reading {
    test: (String, PathBuf),
    files: BTreeSet<PathBuf>,
}

impl Reading {
    fn of(test: (String, PathBuf)) -> Reading {
        let read = file::load(&test.1).unwrap_or_else(|f| panic!("{f}"));
        let start = &read.start;
        let mut setups = vec![start.clone()];
        setups.extend(read.steps.iter().filter_map(|s| match s {
            ScriptStep::Swap(graph) => Some(Setup { graph: graph.clone(), ..start.clone() }),
            _ => None,
        }));
        setups.extend(read.checks.iter().filter_map(|c| match &c.kind {
            CheckKind::NotBrighter { than: run, .. } | CheckKind::Times { of: run, .. } => Some(run.of(start)),
            _ => None,
        }));
        let files = setups.iter().flat_map(|setup| {
            let project = Project::open(&setup.graph.path, &[]).unwrap_or_else(|f| panic!("{f}"));
            let plan = plan_in_the_end(setup, &[]).unwrap_or_else(|f| panic!("{f}"));
            let shaders = plan.shaders.iter().flat_map(|s| s.sources.clone());
            let shaders = shaders.filter_map(|s| Some(PathBuf::from(&project.texts.files.get(&s)?.path)));
            shaders.chain(project.graph.files.clone()).collect::<Vec<_>>()
        });
        // What the program itself brings is no file.
        Reading { files: files.filter_map(|f| fs::canonicalize(&f).ok()).collect(), test }
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path: PathBuf = entry.unwrap().path();
        let to = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &to);
        } else {
            fs::copy(&path, to).unwrap();
        }
    }
}
