//! The bytes of an image file to numbers, whatever kind of file it is.

use super::{Image, exr, lut};
use crate::caught::caught;
use crate::diag::Diagnostic;
use ::image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::path::Path;

/// An image as its file has it.
#[derive(Debug)]
pub struct Decoded {
    /// Integers as shares of their largest.
    pub image: Image,
    pub numbers: Numbers,
}

/// How exact the numbers of a file are, the least first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Numbers {
    /// Integers of 8 bits.
    Bytes,
    /// Integers of 16 bits.
    Words,
    Floats,
}

/// Decodes a PNG, JPEG, Radiance or OpenEXR file, or a table of colours (`.cube`), of `most` texels.
///
/// # Errors
/// Another kind of file, a damaged one, and one of more texels: before memory is taken for them.
pub fn decode(path: &Path, bytes: &[u8], most: u64) -> Result<Decoded, Diagnostic> {
    let fault = |why: String| Diagnostic::error(format!("can't read the image {}: {why}", path.display()));
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if ending == "cube" {
        let text = std::str::from_utf8(bytes).map_err(|_| fault("it is not UTF-8 text".into()))?;
        let image = lut::parse(text, most).map_err(fault)?;
        return Ok(Decoded { image, numbers: Numbers::Floats });
    }
    if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        let image = exr::from_bytes_up_to(path, bytes, most);
        let image = image.map_err(|mut faults| faults.0.pop().unwrap_or_else(|| fault("it is damaged".into())))?;
        return Ok(Decoded { image, numbers: Numbers::Floats });
    }
    // The decoders may panic on damaged files; they hold no state that outlives the call.
    caught(|| integers(bytes, most)).unwrap_or_else(|| Err("it is damaged".into())).map_err(fault)
}

fn integers(bytes: &[u8], most: u64) -> Result<Decoded, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let known = matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Hdr));
    if !known {
        return Err("it is no PNG, JPEG, Radiance (.hdr), OpenEXR (.exr) or .cube file".into());
    }
    let mut limits = Limits::default();
    // A pixel of four floats, and as much again for what the decoder needs.
    limits.max_alloc = Some(32 * most);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > most {
        return Err(too_large(width, height, most));
    }
    let color = decoder.color_type();
    let image = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?;
    let numbers = match color.bytes_per_pixel() / color.channel_count() {
        1 => Numbers::Bytes,
        2 => Numbers::Words,
        _ => Numbers::Floats,
    };
    let (channels, data) = match color.has_alpha() {
        true => (4, image.into_rgba32f().into_raw()),
        false => (3, image.into_rgb32f().into_raw()),
    };
    let image = Image { width, height, layers: 1, channels, data };
    image.check("it").map_err(|_| "it has no pixels".to_string())?;
    Ok(Decoded { image, numbers })
}

pub(super) fn too_large(width: u32, height: u32, most: u64) -> String {
    format!("it has {width}×{height} pixels, more than {most}; make it smaller")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::image::{ImageBuffer, Luma, Rgb};

    fn written(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(vec![]);
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn kinds_of_files_are_told_apart_by_their_bytes() {
        let bytes = DynamicImage::from(ImageBuffer::from_pixel(4, 2, Rgb([51u8, 102, 204])));
        let words = DynamicImage::from(ImageBuffer::from_pixel(4, 2, Luma([13107u16])));
        let floats = DynamicImage::from(ImageBuffer::from_pixel(4, 2, Rgb([0.5f32, 2.0, 64.0])));
        for (image, format, numbers, first) in [
            (&bytes, ImageFormat::Png, Numbers::Bytes, 0.2),
            (&bytes, ImageFormat::Jpeg, Numbers::Bytes, 0.2),
            (&words, ImageFormat::Png, Numbers::Words, 0.2),
            (&floats, ImageFormat::Hdr, Numbers::Floats, 0.5),
        ] {
            let file = written(image, format);
            let decoded = decode(Path::new("a"), &file, 8).unwrap();
            let Image { width, height, channels, .. } = decoded.image;
            assert_eq!((width, height, channels, decoded.numbers), (4, 2, 3, numbers), "{format:?}");
            assert!((decoded.image.data[0] - first).abs() < 0.02, "{format:?}: {}", decoded.image.data[0]);
            let refused = decode(Path::new("a"), &file, 7).unwrap_err().message;
            assert!(refused.contains("4×2 pixels, more than 7"), "{refused}");
            for length in 0..file.len() {
                // A part may decode; none may panic.
                let _ = decode(Path::new("a"), &file[..length], 8);
            }
        }
        let refused = decode(Path::new("a.png"), b"GIF89a\0\0", 8).unwrap_err().message;
        assert!(refused.contains("it is no PNG"), "{refused}");
    }
}
