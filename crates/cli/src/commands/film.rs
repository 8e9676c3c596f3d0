//! Films: frames that ffmpeg, where it is installed, makes one file of.

use lightgraph::internals::image::png::{ToneMap, to_bytes};
use lightgraph::{Checked, Diagnostic, Faults, Image};
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use tempfile::TempPath;

/// A film that is being written. Its file is there when it is whole; dropped before, it leaves none.
pub struct Film {
    path: PathBuf,
    size: [u32; 2],
    /// Ends before the file goes that it writes to.
    ffmpeg: Encoder,
    /// What ffmpeg says: a file takes all of it, where a pipe that nobody reads yet would stop ffmpeg.
    said: File,
    /// Beside the file whose name it takes.
    temporary: TempPath,
}

/// Killed when dropped.
struct Encoder(Child);

impl Drop for Encoder {
    fn drop(&mut self) {
        // One that has ended already needs neither.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Whether a file is a film.
pub fn is_film(path: &Path) -> bool {
    path.extension().is_some_and(|e| ["mp4", "webm", "mkv"].iter().any(|known| e.eq_ignore_ascii_case(known)))
}

impl Film {
    /// Begins a film of images of this size.
    ///
    /// # Errors
    /// There is no ffmpeg; a file can't be written there.
    pub fn new(path: &Path, size: [u32; 2], fps: f32) -> Checked<Film> {
        Film::by(Command::new("ffmpeg"), path, size, fps)
    }

    /// By ffmpeg, or what a test puts in its place.
    fn by(mut command: Command, path: &Path, size: [u32; 2], fps: f32) -> Checked<Film> {
        let [width, height] = size;
        let (temporary, said) =
            temporary(path).and_then(|t| Ok((t, tempfile::tempfile()?))).map_err(|e| fault(path, e))?;
        command.args(["-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
        command.args(["-s", &format!("{width}x{height}"), "-r", &fps.to_string(), "-i", "-"]);
        // Players want colours of two by two pixels, of which there are whole ones.
        command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]).arg(&temporary);
        let errors = said.try_clone().map_err(|e| fault(path, e))?;
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(errors);
        let ffmpeg = command.spawn().map_err(|e| {
            let d = Diagnostic::error(format!("can't write {}: no ffmpeg runs here: {e}", path.display()));
            d.help("install ffmpeg, or write the frames one by one: `--out f_%04d.png`")
        })?;
        Ok(Film { path: path.into(), size, ffmpeg: Encoder(ffmpeg), said, temporary })
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
        let input = self.ffmpeg.0.stdin.as_mut();
        match input.map(|input| input.write_all(&pixels)) {
            Some(Ok(())) => Ok(()),
            _ => Err(self.ended()),
        }
    }

    /// Waits for ffmpeg to end, and gives the film its name.
    ///
    /// # Errors
    /// What ffmpeg says is wrong; a file that can't be replaced.
    pub fn finish(mut self) -> Checked<()> {
        drop(self.ffmpeg.0.stdin.take());
        match self.ffmpeg.0.wait() {
            Ok(status) if status.success() => {}
            _ => return Err(self.ended()),
        }
        let Film { path, temporary, .. } = self;
        // The name must not reach the disk before the content.
        let kept = File::options().write(true).open(&temporary).and_then(|file| file.sync_all());
        kept.map_err(|e| fault(&path, e))?;
        temporary.persist(target(&path)).map_err(|e| fault(&path, e.error))
    }

    /// Why ffmpeg ended.
    fn ended(&mut self) -> Faults {
        drop(self.ffmpeg.0.stdin.take());
        let _ = self.ffmpeg.0.wait();
        let mut said = vec![];
        let _ = self.said.rewind().and_then(|()| self.said.read_to_end(&mut said));
        let said = String::from_utf8_lossy(&said);
        let why = said.lines().last().unwrap_or("it ended without a word");
        Diagnostic::error(format!("can't write {}: ffmpeg: {why}", self.path.display())).into()
    }
}

/// The file that a path names: a link stays a link, and what it names is replaced.
fn target(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.into())
}

/// A new file beside the one that a path names. By its ending, which is the same, ffmpeg chooses the format; its path
/// is absolute, and so never an option.
fn temporary(path: &Path) -> io::Result<TempPath> {
    let target = target(path);
    match fs::metadata(&target) {
        Ok(found) if !found.is_file() => return Err(io::Error::other("it is no regular file")),
        Ok(found) if found.permissions().readonly() => return Err(io::Error::other("it is read-only")),
        _ => {}
    }
    let [mut prefix, mut suffix] = [".", "."].map(OsString::from);
    prefix.push(target.file_stem().unwrap_or_default());
    prefix.push(".");
    suffix.push(target.extension().unwrap_or_default());
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(&suffix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any new file; by itself a temporary one is closed to others.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    Ok(builder.tempfile_in(target.parent().unwrap_or(Path::new("")))?.into_temp_path())
}

fn fault(path: &Path, e: io::Error) -> Faults {
    let d = Diagnostic::error(format!("can't write {}: {e}", path.display()));
    d.help("name a file in a folder that you may write to").into()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use tempfile::TempDir;

    /// Pixels of a side: a frame is more than a pipe holds, so that the script has begun when the frame is added.
    const SIDE: u32 = 256;

    /// Bytes of it.
    const FRAME: u64 = 3 * (SIDE as u64).pow(2);

    /// A film by a script in the place of ffmpeg, which names its file last.
    fn film(script: &str, path: &Path, size: u32) -> Film {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("for file; do :; done\n{script}"), "ffmpeg"]);
        Film::by(shell, path, [size, size], 30.0).unwrap()
    }

    fn add(film: &mut Film, size: u32) -> Checked<()> {
        film.add(&Image::filled(size, size, &[0.5]).unwrap(), ToneMap::default(), 0.0)
    }

    /// A folder that holds an earlier film.
    fn folder() -> (TempDir, PathBuf) {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("film.mp4");
        fs::write(&path, "earlier").unwrap();
        (folder, path)
    }

    fn names(folder: &TempDir) -> Vec<OsString> {
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name()).collect()
    }

    #[test]
    fn a_film_takes_its_name_when_it_is_whole() {
        let (folder, path) = folder();
        let mut half = film("exec cat > \"$file\"", &path, SIDE);
        add(&mut half, SIDE).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"earlier");
        drop(half);
        assert_eq!((fs::read(&path).unwrap(), names(&folder)), (b"earlier".to_vec(), vec!["film.mp4".into()]));

        let link = folder.path().join("link.mp4");
        std::os::unix::fs::symlink("film.mp4", &link).unwrap();
        let mut whole = film("exec cat > \"$file\"", &link, SIDE);
        add(&mut whole, SIDE).unwrap();
        whole.finish().unwrap();
        assert_eq!((fs::metadata(&path).unwrap().len(), names(&folder).len()), (FRAME, 2));
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }

    #[test]
    fn a_film_that_fails_leaves_the_earlier_one() {
        let (folder, path) = folder();
        let mut fails = film("head -c 48 > \"$file\"; echo first >&2; echo 'the disk is full' >&2; exit 1", &path, 4);
        add(&mut fails, 4).unwrap();
        let said = fails.finish().unwrap_err().to_string();
        assert!(said.contains("film.mp4: ffmpeg: the disk is full"), "{said}");
        assert_eq!((fs::read(&path).unwrap(), names(&folder)), (b"earlier".to_vec(), vec!["film.mp4".into()]));
    }

    /// More than a pipe holds, both ways.
    #[test]
    fn much_that_ffmpeg_says_holds_nothing_up() {
        let (_folder, path) = folder();
        let mut wordy = film("head -c 1000000 /dev/zero >&2; exec cat > \"$file\"", &path, SIDE);
        add(&mut wordy, SIDE).unwrap();
        wordy.finish().unwrap();
        assert_eq!(fs::metadata(&path).unwrap().len(), FRAME);
    }

    #[test]
    fn a_name_that_begins_as_an_option_is_none() {
        let shown = film("echo \"$file\" >&2; exit 1", Path::new("-film.mp4"), 4).finish().unwrap_err().to_string();
        let (_, named) = shown.split_once("ffmpeg: ").unwrap();
        let named = named.trim_end();
        assert!(named.starts_with('/') && named.contains("/.-film.") && named.ends_with(".mp4"), "{shown}");
    }

    #[test]
    fn what_is_no_file_is_not_replaced() {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("folder.mp4");
        fs::create_dir(&path).unwrap();
        let said = Film::new(&path, [4, 4], 30.0).err().unwrap().to_string();
        assert!(said.contains("folder.mp4: it is no regular file"), "{said}");
    }
}
