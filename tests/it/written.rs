//! What `render` writes besides images: arrays for NumPy, and films.

use crate::command::lightgraph_with;
use crate::support::Scratch;
use std::path::Path;

const PARTICLES: [&str; 6] = ["render", "graphs/play/particles.ron", "--size", "8x6", "--set", "sparks=64"];

fn render(folder: &Path, more: &[&str]) -> (bool, String) {
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
    let output = lightgraph_with(&[&PARTICLES[..], more].concat(), &[("PATH", Path::new(&path))]);
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    (output.status.success(), text)
}

#[test]
fn buffers_and_images_become_arrays() {
    let folder = Scratch::new("arrays");
    let file = |name: &str| folder.path().join(name);
    let output = |name: &str, to: &str| format!("{name}={}", file(to).display());
    let (particles, color) = (output("particles", "p.npy"), output("color", "c.npy"));
    let (done, text) = render(folder.path(), &["--output", &particles, "--output", &color]);
    assert!(done, "{text}");
    let header = |name: &str| {
        let bytes = std::fs::read(file(name)).unwrap();
        assert_eq!(bytes[..8], *b"\x93NUMPY\x01\x00");
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        (String::from_utf8_lossy(&bytes[10..10 + length]).trim_end().to_string(), bytes.len() - 10 - length)
    };
    let (text, bytes) = header("p.npy");
    let fields = "('position', '<f4', (2,)), ('velocity', '<f4', (2,)), ('color', '<f4', (3,)), ('life', '<f4')";
    assert_eq!(text, format!("{{'descr': [{fields}], 'fortran_order': False, 'shape': (64,), }}"));
    assert_eq!(bytes, 64 * 32);
    let (text, bytes) = header("c.npy");
    assert!(text.contains("'descr': '<f4'") && text.contains("'shape': (6, 8, 4)"), "{text}");
    assert_eq!(bytes, 6 * 8 * 4 * 4);
    let (done, text) = render(folder.path(), &["--output", &output("color", "c.txt")]);
    assert!(!done && text.contains("only buffers are written as text"), "{text}");
}

#[test]
#[cfg(unix)]
fn frames_become_a_film_where_ffmpeg_is() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Scratch::new("film");
    let program = folder.path().join("ffmpeg");
    // In the place of ffmpeg: the frames as they come, to the file named last.
    let film = folder.path().join("film.mp4");
    let args = ["--frames", "3", "--out", film.to_str().unwrap()];
    let put = |script: &str| {
        std::fs::write(&program, script).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    };
    put("#!/bin/sh\nfor last; do :; done\nexec cat > \"$last\"\n");
    let (done, text) = render(folder.path(), &args);
    assert!(done && text.contains("film.mp4, 3 frames"), "{text}");
    assert_eq!(std::fs::metadata(&film).unwrap().len(), 3 * 8 * 6 * 3);
    put("#!/bin/sh\necho 'no such codec' >&2\nexit 1\n");
    let (done, text) = render(folder.path(), &args);
    assert!(!done && text.contains("ffmpeg: no such codec"), "{text}");
    let nowhere = folder.path().join("nowhere");
    let output = lightgraph_with(&[&PARTICLES[..], &args].concat(), &[("PATH", &nowhere)]);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && text.contains("no ffmpeg runs here"), "{text}");
}
