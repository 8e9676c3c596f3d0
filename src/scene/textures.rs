//! Base-colour images to one texture array with mips.

use super::document::Document;
use glam::Vec4;
use gltf::json::{Image, Root};
use std::{io::Cursor, path::PathBuf};

/// Images of one size as a 2D array, RGBA with 8 bits each, colour in sRGB, alpha linear.
#[derive(Debug, Clone, PartialEq)]
pub struct TextureArray {
    /// Of the largest mip; a power of two.
    pub width: u32,
    pub height: u32,
    pub layers: u32,
    /// From the largest to 1×1. Each holds all layers one after another, rows from the top, without padding.
    pub mips: Vec<Vec<u8>>,
}

/// An image in linear light, rows from the top.
pub(super) struct Picture {
    width: u32,
    height: u32,
    texels: Vec<Vec4>,
}

/// Texels along an edge of the array; larger images are shrunk to it.
const MAX_EDGE: u32 = 1024;

/// Texels along an edge of a file. A small file can state any size, and memory is taken before it is decoded.
const MAX_FILE_EDGE: u32 = 8192;

/// The image index behind a texture index.
pub(super) fn image_of(root: &Root, texture: usize) -> Result<usize, String> {
    let found = root.textures.get(texture).ok_or_else(|| format!("there is no texture {texture}"))?;
    let image = found.source.value();
    if image >= root.images.len() {
        return Err(format!("texture {texture}: there is no image {image}"));
    }
    Ok(image)
}

/// Reads and decodes one image.
pub(super) fn picture(document: &Document<'_>, image: &Image, files: &mut Vec<PathBuf>) -> Result<Picture, String> {
    let fetched;
    let (bytes, from) = match (&image.uri, image.buffer_view) {
        (Some(uri), _) => {
            fetched = document.fetch(uri, files)?;
            (fetched.as_slice(), if uri.starts_with("data:") { "its data URI" } else { uri.as_str() })
        }
        (None, Some(view)) => (document.view(view.value())?, "its buffer view"),
        (None, None) => return Err("neither a URI nor a buffer view".into()),
    };
    decode(bytes).map_err(|why| format!("{from} is no readable PNG or JPEG: {why}"))
}

/// All pictures in one array: the size is the largest width and height, rounded up to powers of two, at most 1024.
/// `None` without pictures.
pub(super) fn array(pictures: &[Picture]) -> Option<TextureArray> {
    let edge = |of: fn(&Picture) -> u32| pictures.iter().map(of).max().map(|e| e.min(MAX_EDGE).next_power_of_two());
    let (width, height) = edge(|p| p.width).zip(edge(|p| p.height))?;
    let mut level: Vec<Picture> = pictures.iter().map(|p| resized(p, width, height)).collect();
    let mut mips = vec![];
    loop {
        mips.push(level.iter().flat_map(|p| p.texels.iter().flat_map(|t| encoded(*t))).collect());
        if level.iter().all(|p| p.width == 1 && p.height == 1) {
            break;
        }
        level = level.iter().map(halved).collect();
    }
    Some(TextureArray { width, height, layers: u32::try_from(pictures.len()).ok()?, mips })
}

fn decode(bytes: &[u8]) -> Result<Picture, image::ImageError> {
    let mut reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_FILE_EDGE);
    limits.max_image_height = Some(MAX_FILE_EDGE);
    reader.limits(limits);
    let decoded = reader.decode()?.into_rgba8();
    let (width, height) = decoded.dimensions();
    let rows = decoded.rows().map(|row| row.map(|p| linear(p.0)).collect());
    // Shrunk at once and row by row: the floats of a large image are never held together.
    Ok(shrunk([width, height], rows, [width.min(MAX_EDGE), height.min(MAX_EDGE)]))
}

fn resized(picture: &Picture, width: u32, height: u32) -> Picture {
    let rows = picture.texels.chunks_exact(picture.width as usize).map(<[Vec4]>::to_vec);
    shrunk([picture.width, picture.height], rows, [width, height])
}

/// Triangle-filtered in linear light, one axis after the other.
fn shrunk(from: [u32; 2], rows: impl Iterator<Item = Vec<Vec4>>, [width, height]: [u32; 2]) -> Picture {
    let across = taps(from[0], width);
    let down = taps(from[1], height);
    let mut wide = Vec::with_capacity(width as usize * from[1] as usize);
    for row in rows {
        wide.extend(across.iter().map(|taps| taps.iter().map(|(i, w)| row[*i] * *w).sum::<Vec4>()));
    }
    let stride = width as usize;
    let mut texels = Vec::with_capacity(stride * height as usize);
    for taps in &down {
        texels.extend((0..stride).map(|x| taps.iter().map(|(y, w)| wide[y * stride + x] * *w).sum::<Vec4>()));
    }
    Picture { width, height, texels }
}

/// For each texel of an axis of `to`, the texels of the axis of `from` that make it, with weights that sum to 1.
/// A triangle filter, as wide as the coarser of the two; past the edge the last texel counts again.
fn taps(from: u32, to: u32) -> Vec<Vec<(usize, f32)>> {
    if from == to {
        return (0..to as usize).map(|i| vec![(i, 1.0)]).collect();
    }
    let scale = f64::from(from) / f64::from(to);
    let radius = scale.max(1.0);
    (0..to)
        .map(|i| {
            let center = (f64::from(i) + 0.5) * scale - 0.5;
            let (first, last) = ((center - radius).ceil() as i64, (center + radius).floor() as i64);
            let weights: Vec<(usize, f64)> = (first..=last)
                .map(|s| {
                    let weight = 1.0 - (s as f64 - center).abs() / radius;
                    (s.clamp(0, i64::from(from) - 1) as usize, weight.max(0.0))
                })
                .collect();
            let sum: f64 = weights.iter().map(|(_, w)| w).sum();
            weights.into_iter().map(|(s, w)| (s, (w / sum) as f32)).collect()
        })
        .collect()
}

/// The next mip: means of two by two texels (of two where one axis is already 1 wide). Edges are powers of two.
fn halved(picture: &Picture) -> Picture {
    let (width, height) = ((picture.width / 2).max(1), (picture.height / 2).max(1));
    let at = |x: u32, y: u32| {
        let (x, y) = (x.min(picture.width - 1), y.min(picture.height - 1));
        picture.texels[(y * picture.width + x) as usize]
    };
    let texels = (0..height)
        .flat_map(|y| (0..width).map(move |x| (2 * x, 2 * y)))
        .map(|(x, y)| (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) * 0.25)
        .collect();
    Picture { width, height, texels }
}

/// Source of the curve: IEC 61966-2-1 (sRGB).
fn linear(texel: [u8; 4]) -> Vec4 {
    let [r, g, b, a] = texel.map(|x| f32::from(x) / 255.0);
    let curve = |x: f32| if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
    Vec4::new(curve(r), curve(g), curve(b), a)
}

fn encoded(texel: Vec4) -> [u8; 4] {
    let curve = |x: f32| if x <= 0.003_130_8 { x * 12.92 } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    let [r, g, b, a] = texel.to_array();
    [curve(r), curve(g), curve(b), a].map(|x| (x.clamp(0.0, 1.0) * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(width: u32, height: u32, texels: &[[u8; 4]]) -> Picture {
        Picture { width, height, texels: texels.iter().map(|t| linear(*t)).collect() }
    }

    #[test]
    fn an_image_of_the_array_s_size_keeps_its_bytes() {
        let texels: Vec<[u8; 4]> = (0..=255).map(|i| [i, 255 - i, i / 2, i]).collect();
        let array = array(&[plain(16, 16, &texels)]).unwrap();
        assert_eq!((array.width, array.height, array.layers), (16, 16, 1));
        assert_eq!(array.mips[0], texels.concat());
        assert_eq!(array.mips.iter().map(Vec::len).collect::<Vec<_>>(), [1024, 256, 64, 16, 4]);
    }

    #[test]
    fn mips_are_means_of_light_not_of_codes() {
        let (black, white) = ([0, 0, 0, 255], [255; 4]);
        let array = array(&[plain(2, 1, &[black, white])]).unwrap();
        // Half the light of white is code 188 in sRGB; the mean of the codes would be 128.
        assert_eq!(array.mips[1], [188, 188, 188, 255]);
    }

    #[test]
    fn images_share_the_largest_size_as_a_power_of_two() {
        let red = plain(1, 1, &[[200, 0, 0, 255]]);
        let green = plain(3, 5, &[[0, 100, 0, 255]; 15]);
        let array = array(&[red, green]).unwrap();
        assert_eq!((array.width, array.height, array.layers, array.mips.len()), (4, 8, 2, 4));
        let (first, second) = array.mips[0].split_at(4 * 8 * 4);
        assert!(first.chunks_exact(4).all(|t| t == [200, 0, 0, 255]), "{first:?}");
        assert!(second.chunks_exact(4).all(|t| t == [0, 100, 0, 255]), "{second:?}");
    }

    #[test]
    fn images_past_the_limit_shrink() {
        let wide = Picture { width: 3000, height: 1, texels: vec![Vec4::new(0.5, 0.5, 0.5, 1.0); 3000] };
        let array = array(&[wide]).unwrap();
        assert_eq!((array.width, array.height, array.mips.len()), (1024, 1, 11));
        assert!(array.mips[0].chunks_exact(4).all(|t| t == [188, 188, 188, 255]));
    }

    #[test]
    fn png_and_jpeg_are_told_apart_by_their_bytes() {
        let image = image::RgbImage::from_pixel(8, 4, image::Rgb([200, 100, 50]));
        for format in [image::ImageFormat::Png, image::ImageFormat::Jpeg] {
            let mut bytes = Cursor::new(vec![]);
            image.write_to(&mut bytes, format).unwrap();
            let bytes = bytes.into_inner();
            let picture = decode(&bytes).unwrap();
            assert_eq!((picture.width, picture.height), (8, 4));
            let [r, g, b, a] = encoded(picture.texels[17]);
            assert!(r.abs_diff(200) < 4 && g.abs_diff(100) < 4 && b.abs_diff(50) < 4 && a == 255, "{format:?}");
            for length in 0..bytes.len() {
                // A JPEG may decode in part; none may panic.
                let _ = decode(&bytes[..length]);
            }
        }
    }

    #[test]
    fn weights_of_a_resize_sum_to_one() {
        for (from, to) in [(3, 8), (1000, 1024), (3000, 1024), (1, 4)] {
            for taps in taps(from, to) {
                let sum: f32 = taps.iter().map(|(_, w)| w).sum();
                assert!((sum - 1.0).abs() < 1e-5, "{from} to {to}: {sum}");
            }
        }
    }
}
