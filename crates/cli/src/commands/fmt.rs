//! `lightgraph fmt`: one layout for graphs, variants, scenes and tests. No device.

use super::{Failure, notices, print, print_data};
use crate::paths::ron_files;
use lightgraph::internals::diag::Source;
use lightgraph::internals::files;
use lightgraph::internals::graph::format::format;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Diagnostic, Faults};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Brings RON files into the one layout: comments, empty lines and what shares a line stay.
#[derive(Debug, Clone, clap::Args)]
pub struct FmtArgs {
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
pub fn run(args: &FmtArgs) -> Result<u8, Failure> {
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
        for file in ron_files(std::slice::from_ref(path))? {
            code = code.max(one(&file, args.check)?);
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
