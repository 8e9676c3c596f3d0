//! Images of any size, with their mips, on the pages of one texture array.
//!
//! A page has no wrapping and no filter of its own: `shaders/lib/textures.wgsl` reads texels by their places, which the
//! table `textures` gives.

use super::{
    basis,
    document::Document,
    mips::{self, MipChain, TexelCoding},
};
use crate::parallel;
use glam::{Vec2, Vec4};
use gltf::json::Image;
use std::{io::Cursor, path::PathBuf};

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
    /// What stands for a base colour that can't be had.
    pub fn checker() -> TextureImage {
        const EDGE: u32 = 8;
        let texel = |i: u32| if (i % EDGE + i / EDGE).is_multiple_of(2) { [255, 0, 255, 255] } else { [0, 0, 0, 255] };
        TextureImage { width: EDGE, height: EDGE, texels: (0..EDGE * EDGE).map(texel).collect() }
    }
}

/// Texels along an edge of an image on a page; larger ones are shrunk to it.
const MAX_EDGE: u32 = 4096;

/// Texels along an edge of a file. A small file can state any size, and memory is taken before it is decoded.
pub(super) const MAX_FILE_EDGE: u32 = 8192;

/// Texels along an edge of a page, at most: what every device has.
const MAX_PAGE: u32 = 8192;

/// Texels of all images together; beyond, all that are larger than half the largest edge are shrunk to that.
const MAX_TEXELS: u64 = 1 << 30;

/// An image to be read, and what its texels are.
pub(super) struct WantedImage {
    pub image: usize,
    pub coding: TexelCoding,
}

/// An image with its mips; why it could not be had.
pub(super) type Read = Result<MipChain, String>;

/// Reads and decodes images, on all cores. Those of one index are decoded once for each coding. Says what was shrunk.
pub(super) fn read(
    document: &Document<'_>,
    wanted: &[WantedImage],
    files: &mut Vec<PathBuf>,
) -> (Vec<Read>, Option<String>) {
    let images = &document.root.images;
    let fetched: Vec<Result<Vec<u8>, String>> = wanted
        .iter()
        .enumerate()
        .map(|(i, w)| match wanted[..i].iter().any(|before| before.image == w.image) {
            // Read once, whatever it is read as.
            true => Ok(vec![]),
            false => bytes(document, &images[w.image], files),
        })
        .collect();
    let source = |i: usize| {
        let first = wanted.iter().position(|w| w.image == wanted[i].image).unwrap_or(i);
        fetched[first].as_deref().map_err(Clone::clone)
    };
    let sizes: Vec<[u32; 2]> =
        (0..wanted.len()).map(|i| source(i).ok().and_then(stated_size).unwrap_or([0; 2])).collect();
    let most = largest_edge(&sizes);
    let pictures = parallel::each(0..wanted.len(), |i| {
        let picture = source(i).and_then(decode)?;
        Ok(mips::levels(picture, wanted[i].coding, most))
    });
    let shrunk = sizes.iter().filter(|size| size.iter().any(|edge| *edge > most)).count();
    let note = (shrunk > 0).then(|| match most {
        MAX_EDGE => format!("{shrunk} images are wider than {MAX_EDGE} texels; they are shrunk to that"),
        _ => format!("{shrunk} images are wider than {most} texels; they are shrunk to that, for all to fit"),
    });
    (pictures, note)
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
fn bytes(document: &Document<'_>, image: &Image, files: &mut Vec<PathBuf>) -> Result<Vec<u8>, String> {
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => document.fetch(uri, files),
        (None, Some(view)) => Ok(document.view(view.value())?.to_vec()),
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
    reader(bytes).ok()?.into_dimensions().ok().map(|(width, height)| [width, height])
}

fn decode(bytes: &[u8]) -> Result<TextureImage, String> {
    if basis::is_basis(bytes) {
        return basis::decode(bytes).map_err(|why| format!("KTX2: {why}"));
    }
    let why = |why: String| format!("it is no readable PNG, JPEG, WebP or KTX2: {why}");
    let decoded = reader(bytes).and_then(|r| r.decode().map_err(|e| e.to_string())).map_err(why)?.into_rgba8();
    let (width, height) = decoded.dimensions();
    if width == 0 || height == 0 {
        return Err("it has no texels".into());
    }
    let texels = decoded.into_raw().as_chunks::<4>().0.to_vec();
    Ok(TextureImage { width, height, texels })
}

/// Where an image stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PagePlace {
    pub corner: [u32; 2],
    pub layer: u32,
}

/// Images with their mips on pages, and where each stands. `None` without images.
pub(super) fn pages(images: &[MipChain]) -> Option<(TextureArray, Vec<PagePlace>)> {
    let blocks: Vec<[u32; 2]> = images.iter().map(MipChain::block).collect();
    let widest = blocks.iter().flatten().copied().max()?;
    let area: u64 = blocks.iter().map(|[w, h]| u64::from(*w) * u64::from(*h)).sum();
    // A power of two with some room for what shelves leave empty.
    let fit = ((area as f64 * 1.2).sqrt().ceil() as u32).max(widest).max(1);
    let edge = fit.checked_next_power_of_two().unwrap_or(MAX_PAGE).min(MAX_PAGE);
    let (places, layers, used) = shelves(&blocks, edge);
    // One page ends where its images do.
    let height = if layers == 1 { used } else { edge };
    let page = edge as usize * height as usize;
    let mut texels = vec![0u8; 4 * page * layers as usize];
    for (image, place) in images.iter().zip(&places) {
        image.each_row(|[x, y], row| {
            let [left, top] = place.corner;
            let first = place.layer as usize * page + (top + y) as usize * edge as usize + (left + x) as usize;
            texels[4 * first..][..row.len()].copy_from_slice(row);
        });
    }
    Some((TextureArray { width: edge, height, layers, mips: vec![texels] }, places))
}

/// Blocks in rows, the highest first; how many pages they take, and how high the last is filled.
fn shelves(blocks: &[[u32; 2]], edge: u32) -> (Vec<PagePlace>, u32, u32) {
    let mut order: Vec<usize> = (0..blocks.len()).collect();
    order.sort_by_key(|i| (std::cmp::Reverse(blocks[*i][1]), *i));
    let mut places = vec![PagePlace { corner: [0; 2], layer: 0 }; blocks.len()];
    let (mut x, mut y, mut shelf, mut layer) = (0, 0, 0, 0);
    for i in order {
        let [width, height] = blocks[i];
        if x + width > edge {
            (x, y, shelf) = (0, y + shelf, 0);
        }
        if y + height > edge {
            (x, y, shelf, layer) = (0, 0, 0, layer + 1);
        }
        places[i] = PagePlace { corner: [x, y], layer };
        x += width;
        shelf = shelf.max(height);
    }
    (places, layer + 1, y + shelf)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(width: u32, height: u32, texel: [u8; 4]) -> MipChain {
        let texels = vec![texel; (width * height) as usize];
        mips::levels(TextureImage { width, height, texels }, TexelCoding::Color, MAX_EDGE)
    }

    #[test]
    fn images_of_any_size_keep_their_texels_on_a_page() {
        let red = plain(1, 1, [200, 0, 0, 255]);
        let green = plain(3, 5, [0, 100, 0, 255]);
        let (array, places) = pages(&[red, green]).unwrap();
        assert_eq!((array.layers, array.mips.len()), (1, 1));
        let texel = |x: u32, y: u32| &array.mips[0][4 * (y * array.width + x) as usize..][..4];
        let [[a, b], [c, d]] = [places[0].corner, places[1].corner];
        assert_eq!(texel(a, b), [200, 0, 0, 255]);
        // The image, and right of it its mips: 1 × 2, then 1 × 1.
        for (x, y) in (0..15).map(|i| (i % 3, i / 3)).chain([(3, 0), (3, 1), (3, 2)]) {
            assert_eq!(texel(c + x, d + y), [0, 100, 0, 255], "{x}, {y}");
        }
    }

    #[test]
    fn more_images_than_a_page_holds_take_more_pages() {
        let blocks = [[6144, 4096]; 5];
        let (places, layers, used) = shelves(&blocks, MAX_PAGE);
        assert_eq!((layers, used), (3, 4096));
        assert_eq!(places[4], PagePlace { corner: [0, 0], layer: 2 });
        for (i, a) in places.iter().enumerate() {
            for b in &places[..i] {
                assert!(a.layer != b.layer || a.corner[1].abs_diff(b.corner[1]) >= 4096, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_shrunk_alike() {
        assert_eq!(largest_edge(&[[8192, 16]]), 4096);
        assert_eq!(largest_edge(&[[2048, 2048]; 256]), 4096);
        assert_eq!(largest_edge(&[[4096, 4096]; 256]), 2048);
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
