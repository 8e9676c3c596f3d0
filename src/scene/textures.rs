//! Images of any size, with their mips, on the pages of one texture array.
//!
//! A page has no wrapping and no filter of its own: `shaders/lib/textures.wgsl` reads texels by their places, which the
//! table `textures` gives.

use super::{
    basis,
    document::Document,
    glossiness::{ConvertedMap, GlossyMaterial, larger},
    mips::{self, TexelCoding},
    pages::{self, PagePlace},
};
use crate::caught::caught;
use crate::parallel;
use glam::{Vec2, Vec4};
use gltf::json::Image;
use std::{
    borrow::Cow,
    collections::BTreeMap,
    io::Cursor,
    path::PathBuf,
    sync::{Mutex, PoisonError},
};

/// Images on pages, RGBA with 8 bits each, as their files hold them: colours in sRGB, data and alpha linear.
#[derive(Debug, Clone, PartialEq)]
pub struct TextureArray {
    /// Of a page.
    pub width: u32,
    pub height: u32,
    /// How many pages there are.
    pub layers: u32,
    /// One alone: each page holds the mips of its images. All pages one after another, rows from the top, without
    /// padding.
    pub mips: Vec<Vec<u8>>,
}

/// How a material reads an image: a row of the table `textures`.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialTexture {
    /// Of the largest mip: its first texel, its page, its size.
    pub corner: [u32; 2],
    pub layer: u32,
    pub size: [u32; 2],
    /// Mips, the largest among them. The second stands right of the first, each of the others below the one before it.
    pub levels: u32,
    /// How coordinates beyond 0 to 1 are read, along x and y.
    pub wrap: [Wrap; 2],
    /// The nearest texel, where texels are larger than pixels, and where they are smaller.
    pub nearest: [bool; 2],
    pub between: Between,
    pub coding: TexelCoding,
    /// What coordinates are multiplied by, column by column, and what is added then.
    pub turn: Vec4,
    pub offset: Vec2,
    /// Which of a vertex's coordinates: 0 or 1.
    pub set: u32,
}

/// What lies beyond an image's edge. The numbers are those of the shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrap {
    Repeat = 0,
    Clamp = 1,
    Mirror = 2,
}

/// How mips are chosen. The numbers are those of the shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// The largest alone.
    None = 0,
    Nearest = 1,
    Linear = 2,
}

impl MaterialTexture {
    /// What the table's column `flags` holds: bits 0 and 1 how x is wrapped, 2 and 3 how y is, 4 and 5 what is nearest,
    /// 6 and 7 how mips are chosen, 8 whether it is a colour.
    pub fn flags(&self) -> u32 {
        let [x, y] = self.wrap;
        let [near, far] = self.nearest;
        let color = self.coding == TexelCoding::Color;
        x as u32
            | (y as u32) << 2
            | u32::from(near) << 4
            | u32::from(far) << 5
            | (self.between as u32) << 6
            | u32::from(color) << 8
    }
}

/// An image as its file has it, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TextureImage {
    pub width: u32,
    pub height: u32,
    pub texels: Vec<[u8; 4]>,
}

impl TextureImage {
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// What stands for a base colour that can't be had.
    fn checker() -> TextureImage {
        const EDGE: u32 = CHECKS;
        let texel = |i: u32| if (i % EDGE + i / EDGE).is_multiple_of(2) { [255, 0, 255, 255] } else { [0, 0, 0, 255] };
        TextureImage { width: EDGE, height: EDGE, texels: (0..EDGE * EDGE).map(texel).collect() }
    }
}

/// Texels along an edge of what stands for an image.
const CHECKS: u32 = 8;

/// Texels along an edge of an image on a page; larger ones are shrunk to it.
const MAX_EDGE: u32 = 4096;

/// Texels along an edge of a file. A small file can state any size, and memory is taken before it is decoded.
pub(super) const MAX_FILE_EDGE: u32 = 8192;

/// Texels of all images together; beyond, all that are larger than half the largest edge are shrunk to that.
const MAX_TEXELS: u64 = 1 << 30;

/// Texels that files may state before they are decoded; and so many for each of their bytes.
const MAX_TRUSTED: u64 = 1 << 26;
const TRUSTED_SHARE: u64 = 64;

/// An image to be read, and what its texels are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WantedImage {
    pub image: usize,
    pub coding: TexelCoding,
    /// What is made of it instead, and the image of the diffuse colour beside it.
    pub made: Option<(GlossyMaterial, ConvertedMap, Option<usize>)>,
}

impl WantedImage {
    /// The images that it is made of.
    fn sources(&self) -> impl Iterator<Item = usize> {
        let beside = self.made.and_then(|(_, _, diffuse)| diffuse);
        std::iter::once(self.image).chain(beside)
    }

    fn decoded<'b>(&self, bytes: impl Fn(usize) -> Result<&'b [u8], String>) -> Result<TextureImage, String> {
        let image = decode(bytes(self.image)?)?;
        let Some((glossy, made, diffuse)) = self.made else { return Ok(image) };
        let diffuse = diffuse.map(|diffuse| decode(bytes(diffuse)?)).transpose()?;
        Ok(glossy.image(made, &image, diffuse.as_ref()))
    }
}

/// Where an image stands, with its mips.
pub(super) struct ReadImage {
    pub place: PagePlace,
    pub size: [u32; 2],
    /// Mips, the largest among them.
    pub levels: u32,
    /// Whether any texel is less than opaque.
    pub clear: bool,
    /// Why a checker stands in its place.
    pub missing: Option<String>,
}

/// Images on pages, in the order in which they are wanted.
#[derive(Default)]
pub(super) struct ReadImages {
    pub pages: Option<TextureArray>,
    pub all: Vec<ReadImage>,
    /// What was shrunk.
    pub note: Option<String>,
}

/// Reads and decodes images, on all cores, each straight to its place: the files say how large they are. Those of one
/// index are fetched once, and decoded once for each coding.
pub(super) fn read(document: &Document<'_>, wanted: &[WantedImage], files: &mut Vec<PathBuf>) -> ReadImages {
    let mut fetched = BTreeMap::new();
    for image in wanted.iter().flat_map(WantedImage::sources) {
        fetched.entry(image).or_insert_with(|| bytes(document, &document.root.images[image], files));
    }
    let bytes = |image: usize| match &fetched[&image] {
        Ok(bytes) => Ok(&**bytes),
        Err(why) => Err(why.clone()),
    };
    let stated = |w: &WantedImage| {
        let mut sizes = w.sources().map(|image| bytes(image).ok().and_then(stated_size));
        let first = sizes.next().flatten();
        let size = first.map(|size| larger(size, sizes.next().flatten()));
        // What states none, or too large a one, can't be decoded.
        size.filter(|size| size.iter().all(|edge| (1..=MAX_FILE_EDGE).contains(edge)))
    };
    let stated: Vec<Option<[u32; 2]>> = wanted.iter().map(stated).collect();
    let most = largest_edge(&stated.iter().map(|size| size.unwrap_or_default()).collect::<Vec<_>>());
    let decoded = |i: usize| {
        let image = wanted[i].decoded(bytes)?;
        match stated[i] == Some(image.size()) {
            true => Ok(image),
            false => Err(format!("it is {} × {} texels large, not as it states", image.width, image.height)),
        }
    };
    let texels: u64 = stated.iter().flatten().map(|size| size.map(u64::from).iter().product::<u64>()).sum();
    let held: usize = fetched.values().flatten().map(|bytes| bytes.len()).sum();
    // Few bytes may state any size: nothing is made as large before it is known to be true.
    let doubtful = texels > MAX_TRUSTED.max(TRUSTED_SHARE * held as u64);
    let checked = |i: usize| if doubtful { decoded(i).err() } else { None };
    let mut missing: Vec<Option<String>> = parallel::each(0..wanted.len(), checked);
    let (pages, all) = loop {
        let size = |i: usize| stated[i].filter(|_| missing[i].is_none());
        let sizes: Vec<[u32; 2]> =
            (0..wanted.len()).map(|i| mips::shrunk(size(i).unwrap_or([CHECKS; 2]), most)).collect();
        match placed(wanted, &sizes, most, &missing, &decoded) {
            Ok(read) => break read,
            // Now they are known, and take the place of a checker.
            Err(found) => found.into_iter().for_each(|(i, why)| missing[i] = Some(why)),
        }
    };
    let shrunk = stated.iter().flatten().filter(|size| size.iter().any(|edge| *edge > most)).count();
    let note = (shrunk > 0).then(|| match most {
        MAX_EDGE => format!("{shrunk} images are wider than {MAX_EDGE} texels; they are shrunk to that"),
        _ => format!("{shrunk} images are wider than {most} texels; they are shrunk to that, for all to fit"),
    });
    ReadImages { pages, all, note }
}

/// The numbers of images that can't be read, and why.
type UnreadImages = Vec<(usize, String)>;

/// Images decoded to pages, in places of these sizes; those that are known to be missing get a checker. Where others
/// are: which, and why.
fn placed(
    wanted: &[WantedImage],
    sizes: &[[u32; 2]],
    most: u32,
    missing: &[Option<String>],
    decoded: &(impl Fn(usize) -> Result<TextureImage, String> + Sync),
) -> Result<(Option<TextureArray>, Vec<ReadImage>), UnreadImages> {
    let blocks: Vec<[u32; 2]> = sizes.iter().map(|size| mips::block(*size)).collect();
    let Some((mut pages, places)) = pages::pages(&blocks) else { return Ok((None, vec![])) };
    let rows = pages::rows(&mut pages, &places, &blocks).into_iter();
    let rows: Vec<_> = rows.map(|rows| Mutex::new(Some(rows))).collect();
    let done = parallel::each(0..wanted.len(), |i| {
        let missing = missing[i].clone();
        let (image, coding) = match missing {
            Some(_) => (TextureImage::checker(), TexelCoding::Color),
            None => (decoded(i).map_err(|why| (i, why))?, wanted[i].coding),
        };
        let clear = image.texels.iter().any(|t| t[3] < 255);
        let rows = rows[i].lock().unwrap_or_else(PoisonError::into_inner).take();
        let mut rows = rows.unwrap_or_default();
        let chain = mips::levels(image, coding, most);
        chain.each_row(|[x, y], texels| rows[y as usize][4 * x as usize..][..texels.len()].copy_from_slice(texels));
        let (place, size, levels) = (places[i], sizes[i], mips::count(sizes[i]));
        Ok(ReadImage { place, size, levels, clear, missing })
    });
    drop(rows);
    let (read, failed): (Vec<_>, Vec<_>) = done.into_iter().partition(Result::is_ok);
    match failed.is_empty() {
        true => Ok((Some(pages), read.into_iter().flatten().collect())),
        false => Err(failed.into_iter().filter_map(Result::err).collect()),
    }
}

/// The edge that all images must be shrunk to for their texels to fit.
fn largest_edge(sizes: &[[u32; 2]]) -> u32 {
    let mut edge = MAX_EDGE;
    let texels =
        |edge: u32| sizes.iter().map(|s| s.iter().map(|e| u64::from((*e).min(edge))).product::<u64>()).sum::<u64>();
    while edge > 1 && texels(edge) > MAX_TEXELS {
        edge /= 2;
    }
    edge
}

/// The bytes of an image's file.
fn bytes<'d>(document: &'d Document<'_>, image: &Image, files: &mut Vec<PathBuf>) -> Result<Cow<'d, [u8]>, String> {
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => document.fetch(uri, files).map(Cow::Owned),
        (None, Some(view)) => document.view(view.value()).map(Cow::Borrowed),
        (None, None) => Err("neither a URI nor a buffer view".into()),
    }
}

fn reader(bytes: &[u8]) -> Result<image::ImageReader<Cursor<&[u8]>>, String> {
    let mut reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_FILE_EDGE);
    limits.max_image_height = Some(MAX_FILE_EDGE);
    reader.limits(limits);
    Ok(reader)
}

fn stated_size(bytes: &[u8]) -> Option<[u32; 2]> {
    if basis::is_basis(bytes) {
        return basis::stated_size(bytes);
    }
    caught(|| reader(bytes).ok()?.into_dimensions().ok()).flatten().map(|(width, height)| [width, height])
}

fn decode(bytes: &[u8]) -> Result<TextureImage, String> {
    if basis::is_basis(bytes) {
        return basis::decode(bytes).map_err(|why| format!("KTX2: {why}"));
    }
    let why = |why: String| format!("it is no readable PNG, JPEG, WebP or KTX2: {why}");
    // The decoders may panic on damaged files.
    let read = || reader(bytes).and_then(|r| r.decode().map_err(|e| e.to_string()));
    let decoded = caught(read).unwrap_or_else(|| Err("it is damaged".into())).map_err(why)?.into_rgba8();
    let (width, height) = decoded.dimensions();
    if width == 0 || height == 0 {
        return Err("it has no texels".into());
    }
    // The same memory, but where it was taken for more than there is.
    let texels = bytemuck::allocation::try_cast_vec(decoded.into_raw());
    let texels = texels.unwrap_or_else(|(_, bytes): (_, Vec<u8>)| bytes.as_chunks::<4>().0.to_vec());
    Ok(TextureImage { width, height, texels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_shrunk_alike() {
        assert_eq!(largest_edge(&[[8192, 16]]), 4096);
        assert_eq!(largest_edge(&[[2048, 2048]; 256]), 4096);
        assert_eq!(largest_edge(&[[4096, 4096]; 256]), 2048);
    }

    /// zune-jpeg 0.5.15 goes beyond its one row.
    #[test]
    fn a_file_that_its_decoder_panics_of_is_damaged() {
        let head = b"\xff\xd8\xff\xdb\0\x43\0".iter().chain(&[1; 64]);
        let frame = b"\xff\xc2\0\x0b\x08\0\x10\0\x10\x01\x01\x11\0\xff\xee\0\x0eAdobe\0\x64\0\0\0\0\x02";
        let scan = b"\xff\xda\0\x08\x01\x01".iter().chain(&[0; 44]).chain(b"\xff\xd9");
        let bytes: Vec<u8> = head.chain(frame).chain(scan).copied().collect();
        assert!(decode(&bytes).unwrap_err().contains("it is damaged"));
    }

    #[test]
    fn png_jpeg_and_webp_are_told_apart_by_their_bytes() {
        let image = image::RgbImage::from_pixel(8, 4, image::Rgb([200, 100, 50]));
        for format in [image::ImageFormat::Png, image::ImageFormat::Jpeg, image::ImageFormat::WebP] {
            let mut bytes = Cursor::new(vec![]);
            image.write_to(&mut bytes, format).unwrap();
            let bytes = bytes.into_inner();
            let picture = decode(&bytes).unwrap();
            assert_eq!((picture.width, picture.height), (8, 4));
            let [r, g, b, a] = picture.texels[17];
            assert!(r.abs_diff(200) < 4 && g.abs_diff(100) < 4 && b.abs_diff(50) < 4 && a == 255, "{format:?}");
            for length in 0..bytes.len() {
                // A JPEG may decode in part; none may panic.
                let _ = decode(&bytes[..length]);
            }
        }
    }
}
