//! Each file of `tests/bad` is faulty and says at its head how:
//!
//! ```text
//! // error: unknown name `gird`
//! // at: 9:22                      line and column, of another file with its name before: shaders/a.wgsl:3:1
//! // help: did you mean `grid`?
//! // set: gain=2                   as on the command line
//! // outputs: color, direct        what is asked for; without it, everything
//! ```
//!
//! Warnings count as errors. Every error must stand there, with its first place and all its remedies. To add a test,
//! add a file; `LIGHTGRAPH_BLESS=1 cargo test` writes the head from what is reported now: read it before you keep it.

use crate::support::{faults_of_both, files, repository};
use lightgraph::internals::diag::Severity;
use lightgraph::internals::diag::strict;
use lightgraph::{Diagnostic, Faults, Project};
use std::path::Path;

#[test]
fn each_bad_file_gives_the_errors_it_states() {
    let mut failures = String::new();
    let bless = std::env::var_os("LIGHTGRAPH_BLESS").is_some();
    for path in files("tests/bad", &["ron"]) {
        let text = std::fs::read_to_string(&path).unwrap();
        let (head, body) = split(&text);
        let found = found(&path, &head);
        if found == expected(&head) {
            continue;
        }
        if bless {
            write_head(&path, &head, body);
        } else {
            let name = path.file_name().unwrap().to_string_lossy();
            let expected = expected(&head).join("\n  ");
            failures += &format!("{name} states\n  {expected}\nbut gives\n  {}\n\n", found.join("\n  "));
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn each_shader_beside_the_bad_files_is_used_by_one() {
    let mut texts = String::new();
    for path in files("tests/bad", &["ron"]).iter().chain(&files("tests/bad/bases", &["ron"])) {
        texts += &std::fs::read_to_string(path).unwrap();
    }
    for path in files("tests/bad/shaders", &["wgsl"]) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(texts.contains(&format!("\"{name}\"")), "nothing uses tests/bad/shaders/{name}");
    }
}

/// The comment lines at the start of a file, and the rest.
fn split(text: &str) -> (Vec<String>, &str) {
    let mut head = vec![];
    let mut rest = text;
    while let Some((line, after)) = rest.split_once('\n')
        && line.starts_with("// ")
    {
        head.push(line[3..].to_string());
        rest = after;
    }
    (head, rest)
}

fn values(head: &[String], key: &str) -> Vec<String> {
    head.iter().filter_map(|l| l.strip_prefix(key)?.strip_prefix(": ")).map(String::from).collect()
}

fn expected(head: &[String]) -> Vec<String> {
    let keys = ["error: ", "at: ", "help: "];
    head.iter().filter(|l| keys.iter().any(|k| l.starts_with(k))).cloned().collect()
}

/// What the check says, in the words of a head.
fn found(path: &Path, head: &[String]) -> Vec<String> {
    let outputs = values(head, "outputs").first().map(|l| l.split(", ").map(String::from).collect::<Vec<_>>());
    let checked = Project::open(path, &[]).and_then(|project| {
        let params = project.params(&values(head, "set"))?;
        Ok(faults_of_both(&project, &params, outputs.as_deref()))
    });
    let mut faults = checked.unwrap_or_else(|Faults(faults)| faults);
    strict(&mut faults);
    let errors = faults.iter().filter(|d| d.severity == Severity::Error);
    errors.flat_map(|d| describe(path, d)).collect()
}

fn describe(path: &Path, d: &Diagnostic) -> Vec<String> {
    let folder = format!("{}/", repository("tests/bad").display());
    let plain = |text: &str| text.replace(&folder, "");
    let mut lines = vec![format!("error: {}", plain(&d.message))];
    if let Some((span, _)) = d.labels.first() {
        let (line, column) = span.source.line_column(span.start);
        let file = if Path::new(&span.source.path) == path { String::new() } else { format!("{}:", span.source.path) };
        lines.push(format!("at: {}{line}:{column}", plain(&file)));
    }
    lines.extend(d.help.iter().map(|h| format!("help: {}", plain(h))));
    lines
}

/// Writes what is found over the head. Lines move when the head grows, so it is written twice.
fn write_head(path: &Path, head: &[String], body: &str) {
    let kept: Vec<String> = head.iter().filter(|l| expected(head).iter().all(|e| e != *l)).cloned().collect();
    for _ in 0..2 {
        let lines = kept.iter().cloned().chain(found(path, head)).map(|l| format!("// {l}\n"));
        std::fs::write(path, lines.collect::<String>() + body).unwrap();
    }
}
