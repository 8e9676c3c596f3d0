//! Puts the graphs, the shaders, a scene and the parts of a new project into the binary, for `lightgraph new`.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let mut files: Vec<(String, PathBuf)> = vec![("scenes/cornell.glb".into(), root.join("scenes/cornell.glb"))];
    for (folder, below) in [("graphs", "graphs"), ("shaders", "shaders"), ("template", "")] {
        println!("cargo::rerun-if-changed={folder}");
        gather(&root.join(folder), Path::new(below), &mut files)?;
    }
    files.sort();
    let mut text = String::from("&[\n");
    for (name, path) in &files {
        // Writing to a string can't fail.
        let _ = writeln!(text, "    ({name:?}, include_bytes!({:?}).as_slice()),", path.display().to_string());
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
    fs::write(out.join("project_files.rs"), text + "]\n")
}

/// Every file of a folder and below it, by the name it has in a project.
fn gather(folder: &Path, below: &Path, files: &mut Vec<(String, PathBuf)>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let Some(name) = path.file_name() else { continue };
        let name = below.join(name);
        if path.is_dir() {
            gather(&path, &name, files)?;
        } else {
            files.push((name.to_string_lossy().replace('\\', "/"), path));
        }
    }
    Ok(())
}
