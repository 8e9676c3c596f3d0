//! The images a command writes: which outputs, to which files, and what the files say of their making.

use super::Failure;
use super::film::is_film;
use super::npy;
use lightgraph::internals::image::NonFinite;
use lightgraph::internals::image::exposure::Exposure;
use lightgraph::internals::image::exr::{Precision, write_exr};
use lightgraph::internals::image::file::write_atomically;
use lightgraph::internals::image::png::{ToneMap, write_png};
use lightgraph::internals::plan::Desc;
use lightgraph::{Checked, Diagnostic, Gpu, Image, Project, Session};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Which outputs go to which files.
#[derive(Debug, Clone, clap::Args)]
pub struct OutputArgs {
    /// Write the output `color` (or the graph's first) to this file: .exr (linear f32), .npy or .png; with `render
    /// --frames`, .mp4, .webm or .mkv by ffmpeg
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Write an output, or any other resource of the graph, by name (may be repeated); buffers go to .npy or .txt
    #[arg(long = "output", value_name = "NAME=FILE")]
    pub output: Vec<String>,
    /// How PNG files map light to colours
    #[arg(long, value_enum, default_value_t = ToneMap::default())]
    pub tone_map: ToneMap,
    /// Exposure of PNG files, in stops; `auto` makes those brighter or darker that would hardly show anything
    #[arg(long, value_name = "auto|STOPS", default_value_t, allow_negative_numbers = true)]
    pub exposure: Exposure,
    /// Fail where an image that is written holds a NaN or an infinity; without it, warn
    #[arg(long)]
    pub strict: bool,
}

/// What there is to say of files that were written.
#[derive(Debug, Default)]
pub struct WrittenFiles {
    /// What is wrong in the images: warnings or, where the user is strict, errors. The files are there to be looked at.
    pub wrong: Vec<Diagnostic>,
    /// By file: what was done to show it, after its name; empty for nothing.
    pub exposed: Vec<String>,
}

/// The outputs that files need, each once.
pub fn output_names(files: &[(String, PathBuf)]) -> Vec<String> {
    let mut names: Vec<String> = files.iter().map(|f| f.0.clone()).collect();
    names.sort();
    names.dedup();
    names
}

impl OutputArgs {
    /// Outputs and the files they go to. A resource that is asked for becomes an output of the graph.
    ///
    /// # Errors
    /// Nothing to write, endings of files that nothing is written to, outputs that the graph lacks.
    pub fn files(&self, project: &mut Project) -> Result<Vec<(String, PathBuf)>, Failure> {
        let mut files = vec![];
        if let Some(path) = &self.out {
            files.extend(project.main_output().map(|n| (n.to_string(), path.clone())));
        }
        for text in &self.output {
            let Some((name, path)) = text.split_once('=') else {
                return Err(Failure::Usage(Diagnostic::error(format!("--output `{text}` is not NAME=FILE")).into()));
            };
            project.expose(name)?;
            files.push((name.to_string(), PathBuf::from(path)));
        }
        if files.is_empty() {
            let d = Diagnostic::error("nothing to write");
            return Err(Failure::Usage(d.help("give `--out FILE.png` or `--output NAME=FILE.exr`").into()));
        }
        for (_, path) in &files {
            if !matches!(extension(path).as_str(), "exr" | "png" | "npy" | "txt") && !is_film(path) {
                let what = "images are written as .exr, .png or .npy, buffers as .npy or .txt, frames as .mp4";
                return Err(Failure::Usage(Diagnostic::error(format!("{}: {what}", path.display())).into()));
            }
        }
        let mut taken: BTreeMap<PathBuf, &str> = BTreeMap::new();
        for (name, path) in &files {
            if let Some(other) = taken.insert(one_of_its_names(path), name) {
                let d = Diagnostic::error(format!("`{other}` and `{name}` both go to {}", path.display()));
                return Err(Failure::Usage(d.help("give each a file of its own").into()));
            }
        }
        Ok(files)
    }

    /// Reads the outputs back and writes the files, each whole or not at all.
    ///
    /// # Errors
    /// Outputs that hold no image, files that can't be written.
    pub fn write(&self, gpu: &Gpu, session: &Session, files: &[(String, PathBuf)]) -> Checked<WrittenFiles> {
        let metadata = metadata(gpu, session);
        let mut written = WrittenFiles::default();
        let mut images: BTreeMap<&str, Image> = BTreeMap::new();
        for (output, path) in files {
            let id = session.plan.outputs.iter().find(|o| o.0 == *output).map(|o| o.1);
            let buffer = id.filter(|id| matches!(session.plan.resources[id.0].desc, Desc::Buffer { .. }));
            if let (Some(id), "txt" | "npy") = (buffer, extension(path).as_str()) {
                let words = session.words(gpu, output)?;
                let text = extension(path) == "txt";
                let bytes = if text { lines(&words).into_bytes() } else { npy::of_buffer(&session.plan, id, &words) };
                write_atomically(path, &bytes)?;
                written.exposed.push(String::new());
                continue;
            }
            if !images.contains_key(output.as_str()) {
                let image = session.image(gpu, output)?;
                written.wrong.extend(self.wrong(output, &image));
                images.insert(output, image);
            }
            let Some(image) = images.get(output.as_str()) else { continue };
            let mut exposed = String::new();
            if extension(path) == "exr" {
                write_exr(path, &[("", image)], Precision::Float, &metadata)?;
            } else if extension(path) == "npy" {
                write_atomically(path, &npy::of_image(image))?;
            } else if extension(path) == "txt" {
                let d = Diagnostic::error(format!("`{output}` is a texture, and only buffers are written as text"));
                return Err(d.help("write it as .exr, .npy or .png").into());
            } else {
                let stops = self.exposure.stops(image);
                write_png(path, image, self.tone_map, stops, &metadata)?;
                if self.exposure == Exposure::Auto && stops != 0.0 {
                    exposed = format!(", exposed by {stops:+.1} stops (--exposure 0 leaves it as it is)");
                }
            }
            written.exposed.push(exposed);
        }
        Ok(written)
    }

    /// What is wrong in an image.
    pub fn wrong(&self, output: &str, image: &Image) -> Option<Diagnostic> {
        image.non_finite(None).map(|bad| self.not_finite(output, bad))
    }

    fn not_finite(&self, output: &str, bad: NonFinite) -> Diagnostic {
        let message = format!("`{output}` holds {bad}");
        let d = if self.strict { Diagnostic::error(message) } else { Diagnostic::warning(message) };
        d.help("`--watch-numerics` names the step that made it; look for a division by zero, or lights beyond what 32 bits hold")
    }
}

/// The same for all ways to write a path, as far as its folder is there.
fn one_of_its_names(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let whole = path.canonicalize().ok();
    let named = || Some(folder.canonicalize().ok()?.join(path.file_name()?));
    whole.or_else(named).unwrap_or_else(|| path.components().collect())
}

/// Whether a file has a place for the number of a frame in its name: `%d`, or `%04d`, with four digits or more.
pub fn is_numbered(path: &Path) -> bool {
    place(path).is_some()
}

/// The file of a frame.
pub fn number(path: &Path, frame: u32) -> PathBuf {
    match place(path) {
        Some((before, digits, after)) => path.with_file_name(format!("{before}{frame:0digits$}{after}")),
        None => path.to_path_buf(),
    }
}

/// What stands before the number, how many digits it has at least, and what stands behind it.
fn place(path: &Path) -> Option<(&str, usize, &str)> {
    let (before, rest) = path.file_name()?.to_str()?.split_once('%')?;
    let (digits, after) = rest.split_once('d')?;
    let digits = if digits.is_empty() { 1 } else { digits.parse().ok().filter(|n| (1..=9).contains(n))? };
    Some((before, digits, after))
}

/// A line for each word of a buffer: its place, and the word as an unsigned integer and as a float.
pub(super) fn lines(words: &[u32]) -> String {
    let line = |(i, word): (usize, &u32)| format!("{i}\t{word}\t{}\n", f32::from_bits(*word));
    words.iter().enumerate().map(line).collect()
}

fn extension(path: &Path) -> String {
    path.extension().map_or(String::new(), |e| e.to_string_lossy().to_lowercase())
}

/// What image files say of their making.
fn metadata(gpu: &Gpu, session: &Session) -> BTreeMap<String, String> {
    let plan = &session.plan;
    let parameter = |n: &String| plan.value(n).map(|v| format!("{n}={v}"));
    let parameters: Vec<String> = plan.params.iter().filter_map(parameter).collect();
    BTreeMap::from([
        ("graph".into(), plan.graph.clone()),
        ("scene".into(), session.scene.name.clone()),
        ("parameters".into(), parameters.join("; ")),
        ("adapter".into(), format!("{}, {}", gpu.info.name, gpu.info.driver_info)),
        ("version".into(), env!("CARGO_PKG_VERSION").to_string()),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_a_sequence_have_their_frame_in_their_name() {
        let named = |text: &str| number(Path::new(text), 7).display().to_string();
        assert_eq!(named("out/f_%04d.png"), "out/f_0007.png");
        assert_eq!(named("f%d.exr"), "f7.exr");
        for plain in ["f.png", "100%.png", "f_%xd.png", "f_%99d.png", "%04d/f.png"] {
            assert_eq!(named(plain), plain);
            assert!(!is_numbered(Path::new(plain)));
        }
    }
}
