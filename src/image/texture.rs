//! Images of files as the texture that a graph declares by `Image`.
//!
//! One file is a flat texture, a `.cube` table a solid one; six files, or a panorama and the edge of a face, are a
//! cube.

use super::decode::{Decoded, Numbers, decode};
use super::{Image, mips::halved, srgb, texel};
use crate::builtin;
use crate::content::hash;
use crate::diag::Diagnostic;
use crate::files;
use crate::math::cube::{FACES, direction, panorama_place};
use crate::parallel;
use half::f16;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use wgpu_types::TextureFormat as F;

/// Texels of all files and faces of one texture at most: 8192 × 4096. A small file can state any size.
pub const MOST_TEXELS: u64 = 1 << 25;

/// Formats that files can be read to.
pub const FORMATS: [F; 10] = [
    F::R8Unorm,
    F::Rg8Unorm,
    F::Rgba8Unorm,
    F::Rgba8UnormSrgb,
    F::R16Float,
    F::Rg16Float,
    F::Rgba16Float,
    F::R32Float,
    F::Rg32Float,
    F::Rgba32Float,
];

/// What a graph says of its files.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// One, or the six faces of a cube: +X −X +Y −Y +Z −Z.
    pub files: Vec<PathBuf>,
    /// What the numbers of the files are; `None`: colours in sRGB where they are integers, else linear.
    pub coding: Option<Coding>,
    /// `None`: as exact as the files, as far as every adapter can filter it.
    pub format: Option<F>,
    pub mips: bool,
    /// Texels along a face of the cube that a panorama becomes.
    pub face: Option<u32>,
}

/// What the numbers of a file are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Coding {
    Linear,
    Srgb,
}

/// Texels ready for the device.
pub struct Texture {
    pub shape: Shape,
    pub format: F,
    pub width: u32,
    pub height: u32,
    /// The depth of a solid, 6 of a cube, else 1.
    pub layers: u32,
    /// By level, the largest first: layers one after another, rows from the top, without padding.
    pub levels: Vec<Vec<u8>>,
    /// Of the files' bytes and of how they are read: the version of the content.
    pub hash: u128,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Flat,
    Cube,
    Solid,
}

/// Equal hashes stand for equal texels.
impl PartialEq for Texture {
    fn eq(&self, other: &Texture) -> bool {
        self.hash == other.hash
    }
}

impl std::fmt::Debug for Texture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Texture { shape, format, width, height, layers, hash, .. } = self;
        write!(f, "{shape:?} {format:?} {width}×{height}×{layers} {hash:x}")
    }
}

impl Texture {
    /// Bytes of all levels.
    pub fn bytes(&self) -> u64 {
        self.levels.iter().map(|l| l.len() as u64).sum()
    }
}

/// A fault, and which of the files it is about.
pub type Fault = (usize, Diagnostic);

/// Reads and decodes files. What someone still holds of the same bytes is not decoded again.
///
/// # Errors
/// A file that can't be read, is damaged or too large, files that make no cube, and what the wanted format can't hold.
pub fn read(wanted: &Wanted) -> Result<Arc<Texture>, Fault> {
    static HELD: Mutex<Vec<(u128, Weak<Texture>)>> = Mutex::new(vec![]);
    let bytes = wanted.files.iter().enumerate().map(|(i, path)| bytes(path).map_err(|d| (i, d)));
    let bytes = bytes.collect::<Result<Vec<Cow<'static, [u8]>>, Fault>>()?;
    let Wanted { files, coding, format, mips, face } = wanted;
    let endings: Vec<_> = files.iter().map(|f| f.extension()).collect();
    let content: Vec<u128> = bytes.iter().map(|b| hash(b.as_ref())).collect();
    let key = hash(&(content, endings, coding, format.map(|f| format!("{f:?}")), mips, face));
    let held = || HELD.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(there) = held().iter().find(|(k, _)| *k == key).and_then(|(_, t)| t.upgrade()) {
        return Ok(there);
    }
    let made = Arc::new(make(wanted, &bytes, key)?);
    let mut held = held();
    held.retain(|(_, texture)| texture.strong_count() > 0);
    held.push((key, Arc::downgrade(&made)));
    Ok(made)
}

fn bytes(path: &Path) -> Result<Cow<'static, [u8]>, Diagnostic> {
    let fault = |why: String| Diagnostic::error(format!("can't read the image {}: {why}", path.display()));
    if builtin::is_builtin(path) {
        return builtin::bytes(path).map(Cow::Borrowed).ok_or_else(|| fault("lightgraph comes without it".into()));
    }
    files::read(path, files::IMAGE).map(Cow::Owned).map_err(|e| fault(e.to_string()))
}

fn make(wanted: &Wanted, bytes: &[Cow<'static, [u8]>], hash: u128) -> Result<Texture, Fault> {
    let most = MOST_TEXELS / wanted.files.len().max(1) as u64;
    let decoded = parallel::each(0..bytes.len(), |i| decode(&wanted.files[i], &bytes[i], most).map_err(|d| (i, d)));
    let decoded = decoded.into_iter().collect::<Result<Vec<Decoded>, Fault>>()?;
    let numbers = decoded.iter().map(|d| d.numbers).max().unwrap_or(Numbers::Floats);
    let (shape, image) = join(wanted, decoded, numbers)?;
    let coding = coding(wanted.coding, numbers);
    let format = wanted.format.unwrap_or(match (numbers, coding) {
        (Numbers::Bytes, Coding::Srgb) => F::Rgba8UnormSrgb,
        (Numbers::Bytes, Coding::Linear) => F::Rgba8Unorm,
        (Numbers::Words | Numbers::Floats, _) => F::Rgba16Float,
    });
    if !FORMATS.contains(&format) {
        let known: Vec<String> = FORMATS.iter().map(|f| format!("{f:?}")).collect();
        let d = Diagnostic::error(format!("images can't be read to {format:?}"));
        return Err((0, d.help(format!("take one of {}", known.join(", ")))));
    }
    let (width, height, layers) = (image.width, image.height, image.layers);
    let mut levels = vec![packed(&image, format)];
    let mut last = image;
    while wanted.mips && last.width.max(last.height) > 1 {
        last = halved(&last);
        levels.push(packed(&last, format));
    }
    Ok(Texture { shape, format, width, height, layers, levels, hash })
}

/// What the numbers are where nobody says: colours where they are integers.
fn coding(said: Option<Coding>, numbers: Numbers) -> Coding {
    said.unwrap_or(if numbers == Numbers::Floats { Coding::Linear } else { Coding::Srgb })
}

/// One image of all files, in linear numbers.
fn join(wanted: &Wanted, decoded: Vec<Decoded>, numbers: Numbers) -> Result<(Shape, Image), Fault> {
    let shown = |i: usize| wanted.files[i].display();
    if numbers == Numbers::Floats && wanted.coding == Some(Coding::Srgb) {
        let d = Diagnostic::error(format!("{} holds floats, which are linear", shown(0)));
        return Err((0, d.help("leave out `color: Srgb`: it is for images of integers, as PNG and JPEG")));
    }
    let solid = decoded.iter().any(|d| d.image.layers > 1);
    if solid && (decoded.len() > 1 || wanted.mips || wanted.face.is_some()) {
        let d = Diagnostic::error(format!("{} is a table of colours: a 3D texture of one level", shown(0)));
        return Err((0, d.help("give it `file` and `format` alone")));
    }
    let mut images = decoded.into_iter().map(|d| {
        let mut image = d.image;
        let curved = coding(wanted.coding, d.numbers) == Coding::Srgb;
        linearize(&mut image, curved);
        image
    });
    let Some(first) = images.next() else { return Err((0, Diagnostic::error("an image needs a file"))) };
    match (wanted.files.len(), wanted.face) {
        (1, None) => Ok((if solid { Shape::Solid } else { Shape::Flat }, first)),
        (1, Some(edge)) => {
            if first.width != 2 * first.height {
                let d = Diagnostic::error(format!("{} has {}×{} pixels", shown(0), first.width, first.height));
                return Err((0, d.help("a panorama of all directions, which `face` is for, is twice as wide as high")));
            }
            if u64::from(FACES) * u64::from(edge) * u64::from(edge) > MOST_TEXELS || edge == 0 {
                let d = Diagnostic::error(format!("a cube of faces of {edge} texels"));
                return Err((0, d.help(format!("give `face` at least 1, and at most {}", (MOST_TEXELS / 6).isqrt()))));
            }
            Ok((Shape::Cube, cube(&first, edge)))
        }
        (6, None) => {
            let Image { width, height, channels, .. } = first;
            let mut data = first.data;
            for (i, image) in (1..).zip(images) {
                if (image.width, image.height) != (width, height) {
                    let text = format!("{} has {}×{} pixels", shown(i), image.width, image.height);
                    let d = Diagnostic::error(text);
                    return Err((i, d.help(format!("the first face has {width}×{height}: all six must be alike"))));
                }
                data.extend(like(&image, channels).data);
            }
            if width != height {
                let d = Diagnostic::error(format!("{} has {width}×{height} pixels", shown(0)));
                return Err((0, d.help("the faces of a cube are square")));
            }
            Ok((Shape::Cube, Image { width, height, layers: FACES, channels, data }))
        }
        (6, Some(_)) => {
            let d = Diagnostic::error("six files are the faces of a cube already");
            Err((0, d.help("leave out `face`: it is for a panorama")))
        }
        (n, _) => {
            let d = Diagnostic::error(format!("an image has one file, or six for the faces of a cube, not {n}"));
            Err((0, d.help("faces come in the order +X −X +Y −Y +Z −Z")))
        }
    }
}

/// The same with other channels, as [`color`] gives them.
fn like(image: &Image, channels: u32) -> Image {
    let own = image.channels.max(1) as usize;
    let data = image.data.chunks_exact(own).flat_map(|p| color(p).into_iter().take(channels as usize)).collect();
    Image { channels, data, ..*image }
}

/// Makes numbers finite, and linear where they follow the curve of sRGB. Alpha never does.
fn linearize(image: &mut Image, curved: bool) {
    let colors = if image.channels == 2 { 1 } else { image.channels.min(3) } as usize;
    for pixel in image.data.chunks_exact_mut(image.channels.max(1) as usize) {
        for (i, v) in pixel.iter_mut().enumerate() {
            *v = match *v {
                v if !v.is_finite() => 0.0,
                v if curved && i < colors => srgb::decode(v),
                v => v,
            };
        }
    }
}

/// The faces of the cube that a panorama shows.
fn cube(panorama: &Image, edge: u32) -> Image {
    // Enough directions a texel that no pixel is left out.
    let side = panorama.width.div_ceil(4 * edge).clamp(1, 6);
    let channels = panorama.channels as usize;
    let row = |n: usize| -> Vec<f32> {
        let (face, y) = (n as u32 / edge, n as u32 % edge);
        let mut out = vec![0.0; edge as usize * channels];
        for (x, to) in (0..edge).zip(out.chunks_exact_mut(channels)) {
            for i in 0..side * side {
                let at = [x * side + i % side, y * side + i / side];
                let d = direction(face, at, edge * side);
                between(panorama, panorama_place(d.as_vec3()), 1.0 / (side * side) as f32, to);
            }
        }
        out
    };
    let data = parallel::each(0..(FACES * edge) as usize, row).concat();
    Image { width: edge, height: edge, layers: FACES, channels: panorama.channels, data }
}

/// Adds a share of what lies between the centres of four pixels.
fn between(image: &Image, place: glam::Vec2, share: f32, to: &mut [f32]) {
    let at = place * glam::Vec2::new(image.width as f32, image.height as f32) - 0.5;
    let (low, part) = (at.floor(), at - at.floor());
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let weight = (if dx == 0 { 1.0 - part.x } else { part.x }) * (if dy == 0 { 1.0 - part.y } else { part.y });
        let x = (low.x as i32 + dx).rem_euclid(image.width as i32) as u32;
        let y = (low.y as i32 + dy).clamp(0, image.height as i32 - 1) as u32;
        for (to, from) in to.iter_mut().zip(image.pixel(0, x, y).unwrap_or(&[])) {
            *to += share * weight * from;
        }
    }
}

/// A pixel as red, green, blue and alpha: one channel is grey, two are grey and alpha.
fn color(pixel: &[f32]) -> [f32; 4] {
    match *pixel {
        [y] => [y, y, y, 1.0],
        [y, a] => [y, y, y, a],
        [r, g, b] => [r, g, b, 1.0],
        [r, g, b, a, ..] => [r, g, b, a],
        [] => [0.0; 4],
    }
}

/// The bytes of texels of a format. What it can't hold becomes the nearest that it can.
fn packed(image: &Image, format: F) -> Vec<u8> {
    let mut image = like(image, format.components().into());
    if matches!(format, F::R16Float | F::Rg16Float | F::Rgba16Float) {
        let most = f16::MAX.to_f32();
        image.data.iter_mut().for_each(|v| *v = v.clamp(-most, most));
    }
    texel::encode_rows(format, &image.data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::exr::{Precision, write_exr};
    use crate::image::file::tests::Folder;
    use std::collections::BTreeMap;

    fn wanted(files: &[PathBuf]) -> Wanted {
        Wanted { files: files.to_vec(), coding: None, format: None, mips: false, face: None }
    }

    fn png(path: &Path, width: u32, height: u32, bytes: Vec<u8>) {
        ::image::RgbaImage::from_raw(width, height, bytes).unwrap().save(path).unwrap();
    }

    fn message(wanted: &Wanted) -> String {
        let (_, d) = read(wanted).unwrap_err();
        format!("{} {}", d.message, d.help.join(" "))
    }

    #[test]
    fn codes_of_a_png_are_kept_and_mips_are_means_of_light() {
        let folder = Folder::new("texture-png");
        let path = folder.0.join("a.png");
        let all: Vec<u8> = (0..=255u8).flat_map(|c| [c, 255 - c, 7, c]).collect();
        png(&path, 16, 16, all.clone());
        let made = read(&wanted(std::slice::from_ref(&path))).unwrap();
        assert_eq!((made.format, &made.levels[0]), (F::Rgba8UnormSrgb, &all));
        let same = read(&wanted(std::slice::from_ref(&path))).unwrap();
        assert!(Arc::ptr_eq(&made, &same), "the same bytes are decoded once");
        let linear = read(&Wanted { coding: Some(Coding::Linear), ..wanted(std::slice::from_ref(&path)) }).unwrap();
        assert_eq!((linear.format, &linear.levels[0]), (F::Rgba8Unorm, &all));
        png(&path, 2, 1, vec![0, 0, 0, 255, 255, 255, 255, 255]);
        let mips = read(&Wanted { mips: true, ..wanted(std::slice::from_ref(&path)) }).unwrap();
        assert_ne!(mips.hash, made.hash);
        assert_eq!(mips.levels[1], [188, 188, 188, 255], "half the light of white");
    }

    #[test]
    fn a_panorama_s_middle_is_straight_ahead() {
        let folder = Folder::new("texture-panorama");
        let path = folder.0.join("a.exr");
        // Red tells the column, green the row.
        let data = (0..64 * 32).flat_map(|i| [(i % 64) as f32, (i / 64) as f32, 1e9]).collect();
        let image = Image::new(64, 32, 3, data).unwrap();
        write_exr(&path, &[("", &image)], Precision::Float, &BTreeMap::new()).unwrap();
        let made = read(&Wanted { face: Some(8), format: Some(F::Rgba32Float), ..wanted(std::slice::from_ref(&path)) })
            .unwrap();
        assert_eq!((made.shape, made.width, made.layers), (Shape::Cube, 8, 6));
        let numbers: Vec<f32> = made.levels[0].as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        let mean = |face: usize| {
            let texels = &numbers[face * 256..][..256];
            [0, 1].map(|c| texels.iter().skip(c).step_by(4).sum::<f32>() / 64.0)
        };
        // +X is right of the middle, −Z in it, +Y on top.
        let [x, z, up] = [mean(0), mean(5), mean(2)];
        assert!((x[0] - 47.5).abs() < 0.5 && (x[1] - 15.5).abs() < 0.5, "{x:?}");
        assert!((z[0] - 31.5).abs() < 0.5 && (z[1] - 15.5).abs() < 0.5, "{z:?}");
        assert!(up[1] < 6.0, "{up:?}");
        let half = read(&wanted(std::slice::from_ref(&path))).unwrap();
        assert_eq!(half.format, F::Rgba16Float);
        assert_eq!(half.levels[0][4..6], f16::MAX.to_le_bytes(), "the largest that it can hold");
    }

    #[test]
    fn a_panorama_of_one_colour_makes_a_cube_of_it() {
        // However many pixels of it a texel covers.
        let color = [0.25, 0.5, 4.0];
        let panorama = Image::filled(64, 32, &color).unwrap();
        for edge in [1, 3, 4, 5, 8, 64] {
            let cube = cube(&panorama, edge);
            assert_eq!(cube.data.len(), 6 * (edge * edge) as usize * 3);
            for texel in cube.data.as_chunks::<3>().0 {
                let near = texel.iter().zip(color).all(|(a, b)| (a / b - 1.0).abs() < 1e-4);
                assert!(near, "{texel:?} on a face of {edge}");
            }
        }
    }

    #[test]
    fn six_files_make_a_cube() {
        let folder = Folder::new("texture-six");
        let files: Vec<PathBuf> = (0..6).map(|i| folder.0.join(format!("{i}.png"))).collect();
        for (i, path) in files.iter().enumerate() {
            png(path, 2, 2, vec![i as u8 * 40; 16]);
        }
        let made = read(&wanted(&files)).unwrap();
        assert_eq!((made.shape, made.layers, made.levels[0].len()), (Shape::Cube, 6, 96));
        assert_eq!(made.levels[0][80], 200);
        assert!(message(&wanted(&files[..4])).contains("not 4"));
        png(&files[3], 1, 2, vec![0; 8]);
        assert!(message(&wanted(&files)).contains("3.png has 1×2 pixels"));
    }

    #[test]
    fn what_makes_no_texture_is_a_fault() {
        let folder = Folder::new("texture-faults");
        let path = |name: &str| folder.0.join(name);
        png(&path("a.png"), 3, 2, vec![9; 24]);
        let one = |name: &str| wanted(&[path(name)]);
        assert!(message(&one("none.png")).contains("can't read the image"));
        assert!(message(&Wanted { face: Some(4), ..one("a.png") }).contains("twice as wide as high"));
        assert!(message(&Wanted { format: Some(F::Rgba32Uint), ..one("a.png") }).contains("take one of"));
        let image = Image::filled(2, 1, &[0.5; 3]).unwrap();
        write_exr(&path("a.exr"), &[("", &image)], Precision::Float, &BTreeMap::new()).unwrap();
        assert!(message(&Wanted { coding: Some(Coding::Srgb), ..one("a.exr") }).contains("linear"));
        assert!(message(&Wanted { face: Some(100_000), ..one("a.exr") }).contains("at most 2364"));
    }
}
