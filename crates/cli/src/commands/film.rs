//! Films: frames that ffmpeg, where it is installed, makes one file of.

use lightgraph::internals::image::png::{ToneMap, to_bytes};
use lightgraph::{Checked, Diagnostic, Image};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// A film that is being written.
pub struct Film {
    path: PathBuf,
    size: [u32; 2],
    ffmpeg: Child,
}

/// Whether a file is a film.
pub fn is_film(path: &Path) -> bool {
    path.extension().is_some_and(|e| ["mp4", "webm", "mkv"].iter().any(|known| e.eq_ignore_ascii_case(known)))
}

impl Film {
    /// Begins a film of images of this size.
    ///
    /// # Errors
    /// There is no ffmpeg.
    pub fn new(path: &Path, size: [u32; 2], fps: f32) -> Checked<Film> {
        let [width, height] = size;
        let mut command = Command::new("ffmpeg");
        command.args(["-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
        command.args(["-s", &format!("{width}x{height}"), "-r", &fps.to_string(), "-i", "-"]);
        // Players want colours of two by two pixels, of which there are whole ones.
        command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]).arg(path);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let ffmpeg = command.spawn().map_err(|e| {
            let d = Diagnostic::error(format!("can't write {}: no ffmpeg runs here: {e}", path.display()));
            d.help("install ffmpeg, or write the frames one by one: `--out f_%04d.png`")
        })?;
        Ok(Film { path: path.into(), size, ffmpeg })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// Another size than that of the first; ffmpeg ended.
    pub fn add(&mut self, image: &Image, tone_map: ToneMap, stops: f32) -> Checked<()> {
        let size = [image.width, image.height];
        if size != self.size {
            let [w, h] = self.size;
            let text = format!("a frame of {}×{} in a film of {w}×{h}", image.width, image.height);
            return Err(Diagnostic::error(text).into());
        }
        let pixels: Vec<u8> = image.rgb().flat_map(|p| to_bytes(p, tone_map, stops)).collect();
        let input = self.ffmpeg.stdin.as_mut();
        match input.map(|input| input.write_all(&pixels)) {
            Some(Ok(())) => Ok(()),
            _ => Err(self.ended()),
        }
    }

    /// Waits for ffmpeg to end.
    ///
    /// # Errors
    /// What ffmpeg says is wrong.
    pub fn finish(mut self) -> Checked<()> {
        drop(self.ffmpeg.stdin.take());
        match self.ffmpeg.wait() {
            Ok(status) if status.success() => Ok(()),
            _ => Err(self.ended()),
        }
    }

    /// Why ffmpeg ended.
    fn ended(&mut self) -> lightgraph::Faults {
        drop(self.ffmpeg.stdin.take());
        let mut said = String::new();
        if let Some(mut errors) = self.ffmpeg.stderr.take() {
            let _ = std::io::Read::read_to_string(&mut errors, &mut said);
        }
        let _ = self.ffmpeg.wait();
        let why = said.lines().last().unwrap_or("it ended without a word").to_string();
        Diagnostic::error(format!("can't write {}: ffmpeg: {why}", self.path.display())).into()
    }
}
