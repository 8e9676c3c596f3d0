//! The edits of `tests/mutations.txt`: each must make a test of `tests/graphs` fail, or say why none does.

use crate::device;
use crate::support::{Scratch, repository};
use lightgraph::snapshot::{Bless, Options, find, run};
use std::fs;
use std::path::{Path, PathBuf};

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
#[ignore = "takes ten minutes and more: cargo test mutations -- --ignored --nocapture"]
fn tests_notice_what_is_edited() {
    let _alone = device::gpu();
    let scratch = Scratch::new("mutations");
    for folder in ["graphs", "shaders", "scenes", "tests/graphs"] {
        copy(&repository(folder), &scratch.path().join(folder));
    }
    let tests = find(&[scratch.path().join("tests/graphs")]).unwrap_or_else(|f| panic!("{f}"));
    let options = Options { bless: Bless::None, failures: scratch.path().join("out"), watch: false };
    let (mut wrong, all) = (vec![], edits());
    for e in &all {
        let path = scratch.path().join(&e.file);
        let before = fs::read_to_string(&path).unwrap();
        fs::write(&path, before.replacen(&e.from, &e.to, 1)).unwrap();
        let noticed = tests.iter().find_map(|t| {
            let summary = run(std::slice::from_ref(t), &options, &mut |_| ());
            let failure = summary.outcomes.first().and_then(|o| o.failures.first())?;
            // An edit that can't even be compiled shows nothing of what the tests notice.
            let broken = failure.why.starts_with("error:");
            Some((broken, format!("{}: {}: {}", t.0, failure.title, failure.why.lines().next().unwrap_or_default())))
        });
        fs::write(&path, before).unwrap();
        let (ok, said) = match (&noticed, &e.survives) {
            (Some((true, said)), _) => (false, format!("no sound edit: {said}")),
            (Some((false, said)), None) => (true, said.clone()),
            (Some((false, said)), Some(_)) => (false, format!("does not survive any more: {said}")),
            (None, Some(why)) => (true, format!("survives: {why}")),
            (None, None) => (false, "no test notices".into()),
        };
        println!("{} | {} | {said}", e.file, e.to);
        if !ok {
            wrong.push(format!("{}: `{}`: {said}", e.file, e.to));
        }
    }
    assert!(wrong.is_empty(), "{} of {} edits:\n{}", wrong.len(), all.len(), wrong.join("\n"));
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
