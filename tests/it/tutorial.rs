//! Every step of docs/tutorial.md, in order: files are written, commands run, and what they print is held to what
//! stands there.

use crate::support::{Scratch, command, repository};
use std::path::Path;

/// A fenced block: the words after its fence, and its lines.
fn blocks(text: &str) -> Vec<(&str, &str)> {
    let fenced = text.split("\n```").skip(1).step_by(2);
    fenced.filter_map(|block| block.split_once('\n')).collect()
}

/// Runs a line of a block of commands; what both streams say.
fn run(line: &str, folder: &Path) -> String {
    let (words, comment) = line.split_once('#').unwrap_or((line, ""));
    let code = comment.trim().strip_prefix("exit code ").map_or(0, |n| n.parse().unwrap());
    let mut words = words.split_whitespace();
    assert_eq!(words.next(), Some("lightgraph"), "{line}");
    let output = command().current_dir(folder).args(words).output().unwrap();
    let said = [output.stdout, output.stderr].map(|s| String::from_utf8_lossy(&s).into_owned()).concat();
    assert_eq!(output.status.code(), Some(code), "{line}\n{said}");
    said
}

#[test]
fn every_step_of_the_tutorial_does_what_it_says() {
    let text = std::fs::read_to_string(repository("docs/tutorial.md")).unwrap();
    let scratch = Scratch::new("tutorial");
    let mut folder = scratch.path().to_path_buf();
    let (mut said, mut commands, mut told) = (String::new(), 0, 0);
    for (fence, block) in blocks(&text) {
        match fence.split_once(' ') {
            Some((_, file)) => std::fs::write(folder.join(file), block).unwrap(),
            None if fence == "sh" => {
                said.clear();
                for line in block.lines() {
                    match line.strip_prefix("cd ") {
                        Some(into) => folder.push(into),
                        None => said += &run(line, &folder),
                    }
                    commands += 1;
                }
            }
            None => {
                assert_eq!(fence, "text");
                for line in block.lines() {
                    assert!(said.contains(line), "`{line}` isn't said:\n{said}");
                    told += 1;
                }
            }
        }
    }
    assert!(commands >= 9 && told >= 5, "{commands} commands, {told} lines");
    for picture in ["first.png", "mine.png", "tests/graphs/mine.color.exr"] {
        assert!(folder.join(picture).is_file(), "{picture} is missing");
    }
}
