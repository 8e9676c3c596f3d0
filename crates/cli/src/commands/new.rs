//! `lightgraph new`: a project of one's own, from what the binary carries.

use super::{Failure, print};
use lightgraph::internals::builtin::FILES;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Checked, Diagnostic};
use std::fs;
use std::path::{Path, PathBuf};

/// Makes a project: a graph to edit, the built-in graphs and shaders, a scene, a test, a workflow for CI,
/// settings for an editor.
#[derive(Debug, Clone, clap::Args)]
pub struct NewArgs {
    /// A folder that is empty or not there yet
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}

/// Writes the files and says what to do next.
///
/// # Errors
/// The folder holds something, or can't be written to.
pub fn run(args: &NewArgs) -> Result<u8, Failure> {
    let shown = args.folder.display();
    vacant(&args.folder)?;
    make(&args.folder, || write(&args.folder, FILES))?;
    print(&format!("made {shown} with {} files; next:\n  cd {shown}\n  lightgraph test\n", FILES.len()));
    Ok(0)
}

/// Whether a folder can be filled.
///
/// # Errors
/// It holds something, or is no folder.
pub fn vacant(folder: &Path) -> Result<(), Failure> {
    let taken = std::fs::read_dir(folder).map_or(folder.exists(), |mut entries| entries.next().is_some());
    if !taken {
        return Ok(());
    }
    let d = Diagnostic::error(format!("{} is there already, and not an empty folder", folder.display()));
    Err(Failure::Usage(d.help("name a folder that is not there yet").into()))
}

/// Fills a folder that is vacant, or leaves it as it was.
///
/// # Errors
/// Those of `fill`.
pub fn make(folder: &Path, fill: impl FnOnce() -> Checked<()>) -> Checked<()> {
    // The outermost folder that is not there yet.
    let made = folder.ancestors().take_while(|p| !p.as_os_str().is_empty() && !p.exists()).last();
    fill().inspect_err(|_| match made {
        Some(made) => drop(fs::remove_dir_all(made)),
        None => empty(folder),
    })
}

fn write(folder: &Path, files: &[(&str, &[u8])]) -> Checked<()> {
    files.iter().try_for_each(|(name, content)| write_atomically(&folder.join(name), content))
}

/// Removes what a folder holds, which was empty before. What can't be removed changes nothing about the fault.
fn empty(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let _ = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tempfile::TempDir;

    #[test]
    fn half_a_project_is_not_left() {
        let folder = TempDir::new().unwrap();
        let names =
            || -> Vec<_> { std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect() };
        let long = "n".repeat(300);
        let files: [(&str, &[u8]); 2] = [("graphs/a.ron", b"one"), (&long, b"two")];
        let make = |folder: &Path, files: &[(&str, &[u8])]| make(folder, || write(folder, files));
        assert!(make(&folder.path().join("deep/project"), &files).is_err());
        assert_eq!(names(), [""; 0]);
        assert!(make(folder.path(), &files).is_err());
        assert_eq!(names(), [""; 0], "an empty folder stays one");
        make(&folder.path().join("deep"), &files[..1]).unwrap();
        assert_eq!(fs::read(folder.path().join("deep/graphs/a.ron")).unwrap(), b"one");
    }
}
