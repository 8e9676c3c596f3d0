//! `lightgraph new`: a project of one's own, from what the binary carries.

use super::{Failure, print};
use crate::builtin::FILES;
use crate::diag::Diagnostic;
use crate::image::file::write_atomically;
use std::path::PathBuf;

/// Makes a project: a graph to edit, the built-in graphs and shaders, a scene, a test, a workflow for CI,
/// settings for an editor.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// A folder that is empty or not there yet
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}

/// Writes the files and says what to do next.
///
/// # Errors
/// The folder holds something, or can't be written to.
pub fn run(args: &Args) -> Result<u8, Failure> {
    let shown = args.folder.display();
    let taken = match std::fs::read_dir(&args.folder) {
        Ok(mut entries) => entries.next().is_some(),
        Err(_) => args.folder.exists(),
    };
    if taken {
        let d = Diagnostic::error(format!("{shown} is there already, and not an empty folder"));
        return Err(Failure::Usage(d.help("name a folder that is not there yet")));
    }
    for (name, content) in FILES {
        write_atomically(&args.folder.join(name), content)?;
    }
    print(&format!("made {shown} with {} files; next:\n  cd {shown}\n  lightgraph test\n", FILES.len()));
    Ok(0)
}
