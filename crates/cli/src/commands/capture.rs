//! `--capture`: what one pass of one frame reads and writes, as files in a folder.

use super::outputs::lines;
use lightgraph::internals::gpu;
use lightgraph::internals::image::exr::{Precision, write_exr};
use lightgraph::internals::image::file::write_atomically;
use lightgraph::internals::plan::{ResourceId, StepId};
use lightgraph::{Checked, Diagnostic, FrameReport, Gpu, Memory, Session};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A pass, and the folder that its files go to.
#[derive(Debug, Clone)]
pub struct Capture {
    pub pass: String,
    pub folder: PathBuf,
}

impl std::str::FromStr for Capture {
    type Err = String;

    fn from_str(text: &str) -> Result<Capture, String> {
        match text.split_once('=') {
            Some((pass, folder)) if !pass.is_empty() && !folder.is_empty() => {
                Ok(Capture { pass: pass.into(), folder: folder.into() })
            }
            _ => Err("write it as PASS=FOLDER".into()),
        }
    }
}

impl Capture {
    /// Writes what the step reads, before it runs, or what it wrote, after that, and its uniforms.
    ///
    /// # Errors
    /// A resource that can't be read back, or a file that can't be written.
    pub fn write(&self, gpu: &Gpu, session: &Session, step: StepId, ran: bool) -> Checked<()> {
        let plan = &session.plan;
        let found = &plan.steps[step.0];
        let (part, resources) = if ran { ("outputs", &found.writes) } else { ("inputs", &found.reads) };
        let folder = self.folder.join(part);
        made(&folder)?;
        for id in resources {
            self::resource(gpu, session, *id, &folder)?;
        }
        if !ran {
            let uniforms = session.uniforms(step);
            let text: String = uniforms.iter().map(|(name, value)| format!("{name} = {value}\n")).collect();
            write_atomically(&self.folder.join("uniforms.txt"), text.as_bytes())?;
        }
        Ok(())
    }
}

/// Renders a frame, with what is to be captured of it.
///
/// # Errors
/// As [`Session::frame`], no such pass, or as [`Capture::write`].
pub fn frame(
    gpu: &Gpu,
    session: &mut Session,
    (index, time): (u32, f32),
    capture: Option<&Capture>,
) -> Checked<FrameReport> {
    let Some(capture) = capture else { return session.frame(gpu, index, time) };
    let step = session.step(&capture.pass)?;
    let mut look = |s: &Session, ran: bool| capture.write(gpu, s, step, ran);
    session.frame_around(gpu, (index, time), step, &mut look)
}

/// A file for a buffer; for a texture one of each layer.
fn resource(gpu: &Gpu, session: &Session, id: ResourceId, folder: &Path) -> Checked<()> {
    let name = &session.plan.resources[id.0].name;
    match session.memory(id)? {
        Memory::Buffer(buffer) => {
            let bytes = gpu::read_bytes(gpu, buffer, name)?;
            let words: Vec<u32> = bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
            write_atomically(&folder.join(format!("{name}.txt")), lines(&words).as_bytes())
        }
        Memory::Texture(texture) => {
            let layers = texture.depth_or_array_layers();
            for layer in 0..layers {
                let file = if layers == 1 { format!("{name}.exr") } else { format!("{name}.{layer}.exr") };
                let image = gpu::read_plane(gpu, texture, name, 0, layer)?;
                write_exr(&folder.join(file), &[("", &image)], Precision::Float, &BTreeMap::new())?;
            }
            Ok(())
        }
    }
}

fn made(folder: &Path) -> Checked<()> {
    let fault = |e: std::io::Error| Diagnostic::error(format!("can't make the folder {}: {e}", folder.display()));
    std::fs::create_dir_all(folder).map_err(|e| fault(e).into())
}
