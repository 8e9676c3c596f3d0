//! PNG files: 8-bit sRGB pictures of linear images, for people to look at. Errors are measured on linear values.

use super::{Image, file::write_atomically, srgb};
use crate::diag::{Checked, Diagnostic};
use ::image::{
    ExtendedColorType, ImageEncoder,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, path::Path};

/// How light beyond what a display shows is brought into its range, before sRGB encoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum ToneMap {
    /// Cut off at 0 and 1.
    None,
    /// Khronos PBR Neutral: base colours up to 0.8 are kept in hue and saturation, highlights run to white.
    #[default]
    Neutral,
}

/// Writes an image as an 8-bit RGB PNG, whole or not at all: exposure (in stops: each doubles the light), tone map,
/// sRGB encoding, rounding. Array layers stand one below the other; alpha is left out; a pixel that holds a NaN is
/// magenta. `metadata` becomes text chunks (`tEXt`; `iTXt` where a value isn't Latin-1).
///
/// # Errors
/// A fault when the image contradicts itself or is too tall for a PNG, or the file can't be written.
pub fn write_png(
    path: &Path,
    image: &Image,
    tone_map: ToneMap,
    exposure: f32,
    metadata: &BTreeMap<String, String>,
) -> Checked<()> {
    let fault = |reason: String| Diagnostic::error(format!("can't write {}: {reason}", path.display()));
    image.check(&format!("the image for {}", path.display()))?;
    let rows = image.height.checked_mul(image.layers).filter(|rows| *rows <= i32::MAX as u32);
    let Some(rows) = rows.filter(|_| image.width <= i32::MAX as u32) else {
        return Err(fault("a PNG has at most 2³¹ − 1 rows and columns".into()).into());
    };
    let pixels: Vec<u8> = image.rgb().flat_map(|p| to_bytes(p, tone_map, exposure)).collect();
    let mut bytes = vec![];
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive)
        .write_image(&pixels, image.width, rows, ExtendedColorType::Rgb8)
        .map_err(|e| fault(e.to_string()))?;
    // The signature (8 bytes) and the header chunk (25) must come first.
    let chunks: Vec<u8> = metadata.iter().flat_map(|(key, value)| text_chunk(key, value)).collect();
    let at = bytes.len().min(33);
    bytes.splice(at..at, chunks);
    write_atomically(path, &bytes)
}

/// One linear colour as the three bytes of a PNG.
pub fn to_bytes(color: [f32; 3], tone_map: ToneMap, exposure: f32) -> [u8; 3] {
    if color.iter().any(|v| v.is_nan()) {
        return [255, 0, 255];
    }
    // Infinities become the largest float: white, as any light that strong.
    let exposed = color.map(|v| (f64::from(v) * f64::from(exposure).exp2()).clamp(0.0, f64::from(f32::MAX)));
    let mapped = match tone_map {
        ToneMap::None => exposed,
        ToneMap::Neutral => neutral(exposed),
    };
    mapped.map(|v| (srgb::encode(v.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

/// Khronos PBR Neutral tone mapper (github.com/KhronosGroup/ToneMapping, `PBR_Neutral`), linear in and out.
/// First takes away what Fresnel reflection at normal incidence (0.04) adds to a base colour, then
/// compresses the peak channel above 0.8 − 0.04 towards 1, and mixes white in as that takes effect.
fn neutral(color: [f64; 3]) -> [f64; 3] {
    const START: f64 = 0.8 - 0.04;
    const DESATURATION: f64 = 0.15;
    let lowest = color[0].min(color[1]).min(color[2]);
    let offset = if lowest < 0.08 { lowest - 6.25 * lowest * lowest } else { 0.04 };
    let color = color.map(|v| v - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START {
        return color;
    }
    let d = 1.0 - START;
    let new_peak = 1.0 - d * d / (peak + d - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|v| v * (new_peak / peak) * (1.0 - white) + new_peak * white)
}

/// A `tEXt` chunk (Latin-1) or, where that can't say it, an `iTXt` chunk (UTF-8); PNG specification, 11.3.4.
/// Keywords are cut to what the format allows: 1 to 79 printable characters.
fn text_chunk(key: &str, value: &str) -> Vec<u8> {
    let keyword: Vec<u8> =
        key.chars().filter(|c| c.is_ascii_graphic() || *c == ' ').map(|c| c as u8).take(79).collect();
    let keyword = keyword.trim_ascii();
    if keyword.is_empty() {
        return vec![];
    }
    let value = value.replace('\0', " ");
    let latin: Option<Vec<u8>> = value.chars().map(|c| u8::try_from(u32::from(c)).ok()).collect();
    let content = match latin {
        Some(latin) => [b"tEXt", keyword, b"\0", &latin].concat(),
        // No compression, no language, no translated keyword.
        None => [b"iTXt", keyword, b"\0\0\0\0\0", value.as_bytes()].concat(),
    };
    let length = u32::try_from(content.len() - 4).unwrap_or(0).to_be_bytes();
    [&length[..], &content, &crc(&content).to_be_bytes()].concat()
}

/// The checksum of a chunk's type and content (PNG specification, annex D).
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::file::tests::Folder;

    #[test]
    fn known_values_without_a_tone_map() {
        // 0.5 → 1.055 · 0.5^(1/2.4) − 0.055 = 0.735357 → 187.5 → 188; 0.18 → 0.461356 → 117.6; 0.002 → 0.02584 → 6.6.
        assert_eq!(to_bytes([0.5, 0.18, 0.002], ToneMap::None, 0.0), [188, 118, 7]);
        assert_eq!(to_bytes([-1.0, 7.0, f32::INFINITY], ToneMap::None, 0.0), [0, 255, 255]);
        assert_eq!(to_bytes([0.25, 1.0, 0.0], ToneMap::None, 1.0), [188, 255, 0]);
    }

    #[test]
    fn known_values_of_the_neutral_map() {
        // 0.5 − 0.04 = 0.46 is below the compression.
        let linear = neutral([0.5; 3]);
        assert!((linear[0] - 0.46).abs() < 1e-12);
        // 2 − 0.04 = 1.96: 1 − 0.24²/(1.96 + 0.24 − 0.76) = 0.96.
        let bright = neutral([2.0; 3]);
        assert!(bright.iter().all(|v| (v - 0.96).abs() < 1e-12), "{bright:?}");
        // Pure red of 4: the peak becomes 1 − 0.0576/3.48, and white is 1 − 1/(0.15·(4 − peak) + 1).
        let red = neutral([4.0, 0.0, 0.0]);
        let peak = 1.0 - 0.0576 / 3.48;
        assert!((red[0] - peak).abs() < 1e-12);
        assert!((red[1] - peak * (1.0 - 1.0 / (0.15 * (4.0 - peak) + 1.0))).abs() < 1e-12);
        assert_eq!(to_bytes([f32::INFINITY; 3], ToneMap::Neutral, 3.0), [255; 3]);
    }

    #[test]
    fn nan_is_magenta() {
        for tone_map in [ToneMap::None, ToneMap::Neutral] {
            assert_eq!(to_bytes([0.0, f32::NAN, 1.0], tone_map, 0.0), [255, 0, 255]);
        }
    }

    #[test]
    fn files_hold_pixels_and_texts_and_are_equal_when_written_again() {
        let folder = Folder::new("png-file");
        let image = Image::array(2, 1, 2, 1, vec![0.0, 1.0, 0.5, f32::NAN]).unwrap();
        let texts = [("graph", "grid.ron"), ("parameters", "4 → 5")].map(|(k, v)| (k.to_string(), v.to_string()));
        let metadata = BTreeMap::from(texts);
        let (a, b) = (folder.0.join("a.png"), folder.0.join("b.png"));
        for path in [&a, &b] {
            write_png(path, &image, ToneMap::None, 0.0, &metadata).unwrap();
        }
        let bytes = std::fs::read(&a).unwrap();
        assert_eq!(bytes, std::fs::read(&b).unwrap());
        let back = ::image::load_from_memory(&bytes).unwrap().into_rgb8();
        assert_eq!(back.dimensions(), (2, 2));
        assert_eq!(back.into_raw(), [0, 0, 0, 255, 255, 255, 188, 188, 188, 255, 0, 255]);
        let holds = |text: &[u8]| bytes.windows(text.len()).any(|w| w == text);
        assert!(holds(b"tEXtgraph\0grid.ron"));
        assert!(holds("iTXtparameters\0\0\0\0\x004 → 5".as_bytes()));
    }

    #[test]
    fn the_checksum_is_that_of_png() {
        // Every PNG ends with the same empty chunk.
        assert_eq!(crc(b"IEND"), 0xae42_6082);
    }
}
