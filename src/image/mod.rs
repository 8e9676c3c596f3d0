//! Linear images on the CPU: EXR and PNG files, error metrics, texels as colours, and files as textures of graphs.

pub mod decode;
pub mod difference;
pub mod exposure;
pub mod exr;
pub mod file;
pub mod flip;
mod lut;
pub mod mask;
pub mod metrics;
pub mod mips;
pub mod paint;
pub mod png;
pub mod srgb;
pub mod texel;
pub mod texture;

use crate::diag::{Checked, Diagnostic};
use std::{collections::BTreeMap, fmt, path::Path};

/// An image of 32-bit floats in linear light; row 0 is on top.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    pub width: u32,
    pub height: u32,
    /// Array layers; 1 for a plain image.
    pub layers: u32,
    /// Values a pixel: 1 to 4.
    pub channels: u32,
    /// `layers × height × width × channels` values.
    pub data: Vec<f32>,
}

impl Image {
    /// An image of one layer.
    ///
    /// # Errors
    /// A fault when a size is zero, `channels` isn't 1 to 4, or `data` isn't `height × width × channels` long.
    pub fn new(width: u32, height: u32, channels: u32, data: Vec<f32>) -> Checked<Image> {
        Image::array(width, height, 1, channels, data)
    }

    /// An image of `layers` layers, one after the other in `data`.
    ///
    /// # Errors
    /// As [`Image::new`].
    pub fn array(width: u32, height: u32, layers: u32, channels: u32, data: Vec<f32>) -> Checked<Image> {
        let image = Image { width, height, layers, channels, data };
        image.check("the image")?;
        Ok(image)
    }

    /// An image of one layer whose pixels all hold `pixel`; its channels are those of `pixel`.
    ///
    /// # Errors
    /// A fault when a size is zero or too large for this machine, or `pixel` doesn't hold 1 to 4 values.
    pub fn filled(width: u32, height: u32, pixel: &[f32]) -> Checked<Image> {
        let channels = u32::try_from(pixel.len()).unwrap_or(u32::MAX);
        let length = length(width, height, 1, channels).ok_or_else(|| bad_size(width, height, 1, channels))?;
        Image::new(width, height, channels, pixel.iter().copied().cycle().take(length).collect())
    }

    /// Writes the image to a file, whole or not at all: linear 32-bit floats where the name ends in `.exr`, otherwise an
    /// 8-bit sRGB PNG, with what is brighter than white brought into its range.
    ///
    /// ```no_run
    /// use lightgraph::{Checked, Gpu, Session};
    /// use std::path::Path;
    ///
    /// fn save(session: &Session, gpu: &Gpu) -> Checked<()> {
    ///     session.image(gpu, "color")?.save(Path::new("color.exr"))
    /// }
    /// ```
    ///
    /// # Errors
    /// The image contradicts itself, or the file can't be written.
    pub fn save(&self, path: &Path) -> Checked<()> {
        match path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
            true => exr::write_exr(path, &[("", self)], exr::Precision::Float, &BTreeMap::new()),
            false => png::write_png(path, self, png::ToneMap::default(), 0.0, &BTreeMap::new()),
        }
    }

    /// How many pixels there are: `layers × height × width`.
    pub fn pixel_count(&self) -> usize {
        self.data.len() / self.channels.max(1) as usize
    }

    /// The values of a pixel, or nothing outside the image. `y` counts from the top.
    pub fn pixel(&self, layer: u32, x: u32, y: u32) -> Option<&[f32]> {
        let start = self.start(layer, x, y)?;
        self.data.get(start..start + self.channels as usize)
    }

    /// As [`Image::pixel`], to write to.
    pub fn pixel_mut(&mut self, layer: u32, x: u32, y: u32) -> Option<&mut [f32]> {
        let start = self.start(layer, x, y)?;
        self.data.get_mut(start..start + self.channels as usize)
    }

    /// One array layer as a plain image, or nothing past the last.
    pub fn layer(&self, layer: u32) -> Option<Image> {
        let length = length(self.width, self.height, 1, self.channels)?;
        let start = (layer < self.layers).then(|| length.checked_mul(layer as usize)).flatten()?;
        let data = self.data.get(start..start.checked_add(length)?)?.to_vec();
        Some(Image { layers: 1, data, ..*self })
    }

    /// Every pixel as red, green and blue, in the order of `data`: one channel is widened to grey,
    /// the blue of two channels is 0, alpha is left out.
    pub fn rgb(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.data.chunks_exact(self.channels.max(1) as usize).map(|p| match *p {
            [y] => [y; 3],
            [r, g] => [r, g, 0.0],
            [r, g, b, ..] => [r, g, b],
            [] => [0.0; 3],
        })
    }

    /// Which pixels hold a NaN or an infinity in red, green or blue; with a mask, among those that it keeps.
    pub fn non_finite(&self, mask: Option<&[bool]>) -> Option<NonFinite> {
        let kept = |i: usize| mask.is_none_or(|m| m.get(i) == Some(&true));
        let bad = |(i, p): (usize, [f32; 3])| (!p.iter().all(|v| v.is_finite()) && kept(i)).then_some(i);
        let mut bad = self.rgb().enumerate().filter_map(bad);
        let first = bad.next()?;
        let (width, height) = (self.width.max(1) as usize, self.height.max(1) as usize);
        let [x, y, layer] =
            [first % width, first / width % height, first / width / height].map(|v| u32::try_from(v).unwrap_or(0));
        Some(NonFinite { pixels: bad.count() + 1, layer, x, y })
    }

    /// Whether the sizes and the data agree; the fields are public, so every reader asks first.
    ///
    /// # Errors
    /// As [`Image::new`]; `what` names the image in the fault ("the reference").
    pub fn check(&self, what: &str) -> Checked<()> {
        let Image { width, height, layers, channels, .. } = *self;
        let needed =
            length(width, height, layers, channels).ok_or_else(|| bad_size(width, height, layers, channels))?;
        if self.data.len() == needed {
            return Ok(());
        }
        let message = format!(
            "{what} holds {} values, but {width} × {height} pixels in {layers} layer(s) of {channels} channel(s) need {needed}",
            self.data.len(),
        );
        Err(Diagnostic::error(message).into())
    }

    fn start(&self, layer: u32, x: u32, y: u32) -> Option<usize> {
        if x >= self.width || y >= self.height || layer >= self.layers {
            return None;
        }
        let row = (layer as usize).checked_mul(self.height as usize)?.checked_add(y as usize)?;
        row.checked_mul(self.width as usize)?.checked_add(x as usize)?.checked_mul(self.channels as usize)
    }
}

/// Pixels that hold a NaN or an infinity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NonFinite {
    /// How many.
    pub pixels: usize,
    /// Where the first one lies.
    pub layer: u32,
    pub x: u32,
    pub y: u32,
}

impl fmt::Display for NonFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let NonFinite { pixels, layer, x, y } = self;
        write!(f, "{pixels} pixel(s) with a NaN or an infinity, the first at ({x}, {y})")?;
        if *layer > 0 { write!(f, " of layer {layer}") } else { Ok(()) }
    }
}

/// Checks that two images have the same width, height and number of layers; channels may differ.
///
/// # Errors
/// A fault that names both images and their sizes, or one about an image that contradicts itself.
pub(crate) fn check_same_size(a: (&str, &Image), b: (&str, &Image)) -> Checked<()> {
    for (name, image) in [a, b] {
        image.check(name)?;
    }
    let size = |i: &Image| (i.width, i.height, i.layers);
    if size(a.1) == size(b.1) {
        return Ok(());
    }
    let shown = |i: &Image| match i.layers {
        1 => format!("{} × {}", i.width, i.height),
        n => format!("{} × {} in {n} layers", i.width, i.height),
    };
    let message = format!("{} is {}, but {} is {}", a.0, shown(a.1), b.0, shown(b.1));
    Err(Diagnostic::error(message).help("render both at the same size").into())
}

/// The number of values, when the sizes make an image.
fn length(width: u32, height: u32, layers: u32, channels: u32) -> Option<usize> {
    if !(1..=4).contains(&channels) {
        return None;
    }
    let length = [height, layers, channels].iter().try_fold(width as usize, |n, v| n.checked_mul(*v as usize))?;
    // A vector can't hold more than isize::MAX bytes.
    (length > 0 && length <= isize::MAX as usize / size_of::<f32>()).then_some(length)
}

fn bad_size(width: u32, height: u32, layers: u32, channels: u32) -> Diagnostic {
    Diagnostic::error(format!("{width} × {height} pixels in {layers} layer(s) of {channels} channel(s) make no image"))
        .help("give at least one pixel and one layer, 1 to 4 channels, and no more than memory holds")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_checked() {
        assert!(Image::new(2, 1, 3, vec![0.0; 6]).is_ok());
        for (w, h, c, n) in [(0, 1, 3, 0), (1, 1, 0, 0), (1, 1, 5, 5), (2, 1, 3, 5), (u32::MAX, u32::MAX, 4, 0)] {
            assert!(Image::new(w, h, c, vec![0.0; n]).is_err(), "{w} × {h} × {c}");
        }
        assert!(Image::filled(u32::MAX, u32::MAX, &[0.0; 4]).is_err());
        assert!(Image::filled(1, 1, &[]).is_err());
    }

    #[test]
    fn pixels_and_layers_are_where_they_should_be() {
        let mut image = Image::array(2, 3, 2, 2, (0..24).map(|v| v as f32).collect()).unwrap();
        assert_eq!(image.pixel(1, 1, 2), Some(&[22.0, 23.0][..]));
        assert_eq!(image.pixel(2, 0, 0), None);
        assert_eq!(image.pixel(0, 2, 0), None);
        image.pixel_mut(0, 0, 1).unwrap()[1] = -1.0;
        assert_eq!(image.data[5], -1.0);
        let layer = image.layer(1).unwrap();
        assert_eq!((layer.layers, layer.data[0]), (1, 12.0));
        assert_eq!(image.layer(2), None);
    }

    #[test]
    fn pixels_that_are_not_finite_are_found() {
        let mut image = Image::filled(3, 2, &[1.0, 1.0, 1.0, f32::NAN]).unwrap();
        assert_eq!(image.non_finite(None), None, "alpha doesn't count");
        image.pixel_mut(0, 2, 1).unwrap()[0] = f32::NAN;
        image.pixel_mut(0, 1, 1).unwrap()[2] = f32::INFINITY;
        assert_eq!(image.non_finite(None), Some(NonFinite { pixels: 2, layer: 0, x: 1, y: 1 }));
        let mask = [true, true, true, true, false, true];
        assert_eq!(image.non_finite(Some(&mask)), Some(NonFinite { pixels: 1, layer: 0, x: 2, y: 1 }));
    }

    #[test]
    fn an_image_that_contradicts_itself_is_a_fault_and_no_panic() {
        let image = Image { width: 4, height: 4, layers: 1, channels: 3, data: vec![0.0; 5] };
        assert!(image.check("x").is_err());
        assert_eq!(image.pixel(0, 3, 3), None);
        assert_eq!(image.layer(0), None);
    }
}
