//! `lightgraph fmt`: one layout for graphs, variants, scenes and tests. No device.

use super::{Failure, notices, print, print_data};
use lightgraph::diag::{Checked, Diagnostic, Faults, Source};
use lightgraph::files;
use lightgraph::graph::format::format;
use lightgraph::image::file::write_atomically;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Brings RON files into the one layout: comments, empty lines and what shares a line stay.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Files, or folders of which every `.ron` file below is taken; `-` reads the input stream and prints
    #[arg(value_name = "PATH", required = true)]
    pub paths: Vec<PathBuf>,
    /// Write nothing; name the files that are laid out otherwise
    #[arg(long)]
    pub check: bool,
}

/// Formats each file. Returns 1 where a file can't be read as RON, or with `check` where one would change.
///
/// # Errors
/// Files that can't be read or written.
pub fn run(args: &Args) -> Result<u8, Failure> {
    let mut code = 0;
    for path in &args.paths {
        if path == Path::new("-") {
            let mut text = String::new();
            let read = std::io::stdin().take(files::TEXT).read_to_string(&mut text);
            read.map_err(|e| Faults::from(Diagnostic::error(format!("can't read the input stream: {e}"))))?;
            match format(&Source::new("-", text)) {
                Ok(found) => print_data(&found),
                Err(Faults(faults)) => {
                    notices(&faults);
                    code = 1;
                }
            }
            continue;
        }
        let mut found = vec![];
        gather(path, &mut found)?;
        for file in &found {
            code = code.max(one(file, args.check)?);
        }
    }
    Ok(code)
}

fn one(path: &Path, check: bool) -> Result<u8, Failure> {
    let text = files::read_text(path, files::TEXT);
    let text = text.map_err(|e| Faults::from(Diagnostic::error(format!("can't read {}: {e}", path.display()))))?;
    let source = Source::new(path.display().to_string(), text);
    match format(&source) {
        Ok(text) if text == *source.text => Ok(0),
        Ok(_) if check => {
            print(&format!("{} is laid out otherwise; `lightgraph fmt` writes it anew\n", path.display()));
            Ok(1)
        }
        Ok(text) => {
            write_atomically(path, text.as_bytes())?;
            print(&format!("{}\n", path.display()));
            Ok(0)
        }
        Err(Faults(faults)) => {
            notices(&faults);
            Ok(1)
        }
    }
}

/// A file, or every `.ron` file of a folder and below it, by name.
fn gather(path: &Path, found: &mut Vec<PathBuf>) -> Checked<()> {
    if !path.is_dir() {
        found.push(path.into());
        return Ok(());
    }
    let fault = |e| Diagnostic::error(format!("can't read {}: {e}", path.display()));
    let entries = std::fs::read_dir(path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let mut entries: Vec<PathBuf> = entries.map_err(fault)?.into_iter().map(|e| e.path()).collect();
    entries.sort();
    for entry in entries {
        // A link to a folder may lead back here.
        if entry.is_dir() && !entry.is_symlink() {
            gather(&entry, found)?;
        } else if entry.extension().is_some_and(|e| e == "ron") {
            found.push(entry);
        }
    }
    Ok(())
}
