//! Texels to numbers and back, format by format, as the Vulkan and WebGPU specifications lay them out.

use super::srgb;
use half::f16;
use wgpu_types::TextureFormat as F;

/// How the bytes of a texel are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ChannelType {
    Unorm8,
    Snorm8,
    /// Stored with the sRGB curve; alpha without.
    Srgb8,
    Uint8,
    Sint8,
    Unorm16,
    Uint16,
    Sint16,
    Float16,
    Uint32,
    Sint32,
    Float32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Texel {
    Plain {
        channel: ChannelType,
        count: usize,
        /// Blue comes first.
        bgra: bool,
    },
    /// 10, 10, 10 and 2 bits from the lowest up; as fractions or as integers.
    Rgb10a2 { unorm: bool },
    /// Unsigned floats of 11, 11 and 10 bits.
    Rg11b10,
}

/// How many values a texel has, when the format can be read.
pub fn channels(format: F) -> Option<u32> {
    Some(match texel(format)? {
        Texel::Plain { count, .. } => count as u32,
        Texel::Rgb10a2 { .. } => 4,
        Texel::Rg11b10 => 3,
    })
}

/// The values of one texel, in linear light, appended to `out`. Integers become the nearest `f32`.
/// `bytes` is one texel long; a shorter one reads as 0 where bytes are missing.
pub fn decode(format: F, bytes: &[u8], out: &mut Vec<f32>) {
    match texel(format) {
        None => {}
        Some(Texel::Plain { channel, count, bgra }) => {
            for i in 0..count {
                let stored = if bgra && i < 3 { 2 - i } else { i };
                let width = channel.width();
                let mut raw = [0u8; 4];
                for (to, from) in raw.iter_mut().zip(bytes.iter().skip(stored * width).take(width)) {
                    *to = *from;
                }
                out.push(channel.decode(raw, i == 3));
            }
        }
        Some(Texel::Rgb10a2 { unorm }) => {
            let word = word(bytes);
            for (shift, most) in [(0, 1023u32), (10, 1023), (20, 1023), (30, 3)] {
                let v = ((word >> shift) & most) as f32;
                out.push(if unorm { v / most as f32 } else { v });
            }
        }
        Some(Texel::Rg11b10) => {
            let word = word(bytes);
            for (shift, mantissa) in [(0, 6), (11, 6), (22, 5)] {
                let bits = (word >> shift) & ((1 << (mantissa + 5)) - 1);
                // The same exponent as a half float's, and fewer bits of mantissa.
                out.push(f16::from_bits((bits << (10 - mantissa)) as u16).to_f32());
            }
        }
    }
}

/// As [`decode`], for texels in a row of `texel_bytes` each.
pub fn decode_row(format: F, texel_bytes: usize, bytes: &[u8], out: &mut Vec<f32>) {
    match texel(format) {
        Some(Texel::Plain { channel: ChannelType::Float32, bgra: false, .. }) => {
            out.extend(bytes.as_chunks().0.iter().map(|raw| f32::from_le_bytes(*raw)));
        }
        _ => bytes.chunks_exact(texel_bytes).for_each(|texel| decode(format, texel, out)),
    }
}

/// The bytes of a texel that holds `value`, clamped to what the format can hold; `None` when it can't be written.
pub fn encode(format: F, value: [f64; 4]) -> Option<Vec<u8>> {
    Some(match texel(format)? {
        Texel::Plain { channel, count, bgra } => (0..count)
            .flat_map(|stored| {
                let i = if bgra && stored < 3 { 2 - stored } else { stored };
                channel.encode(value[i], i == 3)
            })
            .collect(),
        Texel::Rgb10a2 { unorm } => {
            let mut word = 0;
            for (v, (shift, most)) in value.iter().zip([(0, 1023u32), (10, 1023), (20, 1023), (30, 3)]) {
                let scaled = if unorm { (v.clamp(0.0, 1.0) * f64::from(most)).round() } else { *v };
                word |= (scaled as u32).min(most) << shift;
            }
            word.to_le_bytes().to_vec()
        }
        Texel::Rg11b10 => {
            let mut word = 0u32;
            for (v, (shift, mantissa)) in value.iter().zip([(0, 6), (11, 6), (22, 5)]) {
                let bits = u32::from(f16::from_f64(v.max(0.0)).to_bits());
                word |= (bits >> (10 - mantissa)) << shift;
            }
            word.to_le_bytes().to_vec()
        }
    })
}

/// The bytes of texels that hold these values, one after the other: as many values a texel as [`channels`] says.
/// Nothing where the format can't be written.
pub fn encode_rows(format: F, values: &[f32]) -> Vec<u8> {
    match (texel(format), channels(format)) {
        (Some(Texel::Plain { channel: ChannelType::Float32, bgra: false, .. }), _) => {
            bytemuck::cast_slice(values).to_vec()
        }
        (Some(Texel::Plain { channel: ChannelType::Float16, bgra: false, .. }), _) => {
            values.iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect()
        }
        (Some(Texel::Plain { channel: ChannelType::Unorm8, bgra: false, .. }), _) => {
            values.iter().map(|v| byte(f64::from(*v))).collect()
        }
        (Some(Texel::Plain { channel: ChannelType::Srgb8, bgra: false, .. }), _) => {
            let code = |(i, v): (usize, &f32)| if i % 4 == 3 { byte(f64::from(*v)) } else { srgb::nearest(*v) };
            values.iter().enumerate().map(code).collect()
        }
        (Some(_), Some(channels)) => {
            let texel = |values: &[f32]| {
                let mut all = [0.0; 4];
                all.iter_mut().zip(values).for_each(|(to, from)| *to = f64::from(*from));
                encode(format, all).unwrap_or_default()
            };
            values.chunks_exact(channels as usize).flat_map(texel).collect()
        }
        _ => vec![],
    }
}

fn byte(v: f64) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn texel(format: F) -> Option<Texel> {
    use ChannelType::*;
    let plain = |channel, count| Some(Texel::Plain { channel, count, bgra: false });
    match format {
        F::R8Unorm => plain(Unorm8, 1),
        F::Rg8Unorm => plain(Unorm8, 2),
        F::Rgba8Unorm => plain(Unorm8, 4),
        F::R8Snorm => plain(Snorm8, 1),
        F::Rg8Snorm => plain(Snorm8, 2),
        F::Rgba8Snorm => plain(Snorm8, 4),
        F::Rgba8UnormSrgb => plain(Srgb8, 4),
        F::Bgra8Unorm => Some(Texel::Plain { channel: Unorm8, count: 4, bgra: true }),
        F::Bgra8UnormSrgb => Some(Texel::Plain { channel: Srgb8, count: 4, bgra: true }),
        F::R8Uint => plain(Uint8, 1),
        F::Rg8Uint => plain(Uint8, 2),
        F::Rgba8Uint => plain(Uint8, 4),
        F::R8Sint => plain(Sint8, 1),
        F::Rg8Sint => plain(Sint8, 2),
        F::Rgba8Sint => plain(Sint8, 4),
        F::Depth16Unorm => plain(Unorm16, 1),
        F::R16Uint => plain(Uint16, 1),
        F::Rg16Uint => plain(Uint16, 2),
        F::Rgba16Uint => plain(Uint16, 4),
        F::R16Sint => plain(Sint16, 1),
        F::Rg16Sint => plain(Sint16, 2),
        F::R16Float => plain(Float16, 1),
        F::Rg16Float => plain(Float16, 2),
        F::Rgba16Float => plain(Float16, 4),
        F::R32Uint => plain(Uint32, 1),
        F::Rg32Uint => plain(Uint32, 2),
        F::Rgba32Uint => plain(Uint32, 4),
        F::R32Sint => plain(Sint32, 1),
        F::Rgba32Sint => plain(Sint32, 4),
        F::R32Float | F::Depth32Float => plain(Float32, 1),
        F::Rg32Float => plain(Float32, 2),
        F::Rgba32Float => plain(Float32, 4),
        F::Rgb10a2Unorm => Some(Texel::Rgb10a2 { unorm: true }),
        F::Rgb10a2Uint => Some(Texel::Rgb10a2 { unorm: false }),
        F::Rg11b10Ufloat => Some(Texel::Rg11b10),
        // Compressed, planar, shared-exponent and stencil formats hold nothing that a graph computes.
        _ => None,
    }
}

impl ChannelType {
    /// In bytes.
    fn width(self) -> usize {
        match self {
            ChannelType::Unorm8
            | ChannelType::Snorm8
            | ChannelType::Srgb8
            | ChannelType::Uint8
            | ChannelType::Sint8 => 1,
            ChannelType::Unorm16 | ChannelType::Uint16 | ChannelType::Sint16 | ChannelType::Float16 => 2,
            ChannelType::Uint32 | ChannelType::Sint32 | ChannelType::Float32 => 4,
        }
    }

    fn decode(self, raw: [u8; 4], alpha: bool) -> f32 {
        let half = [raw[0], raw[1]];
        match self {
            ChannelType::Srgb8 if !alpha => srgb::decode(f32::from(raw[0]) / 255.0),
            ChannelType::Unorm8 | ChannelType::Srgb8 => f32::from(raw[0]) / 255.0,
            ChannelType::Snorm8 => (f32::from(raw[0] as i8) / 127.0).max(-1.0),
            ChannelType::Uint8 => f32::from(raw[0]),
            ChannelType::Sint8 => f32::from(raw[0] as i8),
            ChannelType::Unorm16 => f32::from(u16::from_le_bytes(half)) / 65535.0,
            ChannelType::Uint16 => f32::from(u16::from_le_bytes(half)),
            ChannelType::Sint16 => f32::from(i16::from_le_bytes(half)),
            ChannelType::Float16 => f16::from_le_bytes(half).to_f32(),
            ChannelType::Uint32 => u32::from_le_bytes(raw) as f32,
            ChannelType::Sint32 => i32::from_le_bytes(raw) as f32,
            ChannelType::Float32 => f32::from_le_bytes(raw),
        }
    }

    fn encode(self, v: f64, alpha: bool) -> Vec<u8> {
        let unit = v.clamp(0.0, 1.0);
        let signed = v.clamp(-1.0, 1.0);
        match self {
            ChannelType::Srgb8 if !alpha => vec![srgb::nearest(unit as f32)],
            ChannelType::Unorm8 | ChannelType::Srgb8 => vec![byte(unit)],
            ChannelType::Snorm8 => vec![(signed * 127.0).round() as i8 as u8],
            // `as` clamps to the range of the integer.
            ChannelType::Uint8 => vec![v as u8],
            ChannelType::Sint8 => vec![v as i8 as u8],
            ChannelType::Unorm16 => ((unit * 65535.0).round() as u16).to_le_bytes().to_vec(),
            ChannelType::Uint16 => (v as u16).to_le_bytes().to_vec(),
            ChannelType::Sint16 => (v as i16).to_le_bytes().to_vec(),
            ChannelType::Float16 => f16::from_f64(v).to_le_bytes().to_vec(),
            ChannelType::Uint32 => (v as u32).to_le_bytes().to_vec(),
            ChannelType::Sint32 => (v as i32).to_le_bytes().to_vec(),
            ChannelType::Float32 => (v as f32).to_le_bytes().to_vec(),
        }
    }
}

fn word(bytes: &[u8]) -> u32 {
    let mut raw = [0u8; 4];
    for (to, from) in raw.iter_mut().zip(bytes) {
        *to = *from;
    }
    u32::from_le_bytes(raw)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn there_and_back(format: F, value: [f64; 4]) -> Vec<f32> {
        let mut out = vec![];
        decode(format, &encode(format, value).unwrap(), &mut out);
        out
    }

    #[test]
    fn what_is_written_reads_back() {
        for format in [F::Rgba8Unorm, F::Rgba8UnormSrgb, F::Bgra8UnormSrgb, F::Rgba16Float, F::Rgba32Float] {
            let got = there_and_back(format, [0.25, 0.5, 0.75, 1.0]);
            for (g, want) in got.iter().zip([0.25, 0.5, 0.75, 1.0]) {
                assert!((g - want).abs() < 0.005, "{format:?} {got:?}");
            }
        }
        assert_eq!(there_and_back(F::Rgba32Uint, [7.0, 0.0, 3.0, 9.0]), [7.0, 0.0, 3.0, 9.0]);
        assert_eq!(there_and_back(F::Rg8Sint, [-7.0, 100.0, 0.0, 0.0]), [-7.0, 100.0]);
        assert_eq!(there_and_back(F::Rgba8Snorm, [-1.0, 1.0, 0.0, -2.0]), [-1.0, 1.0, 0.0, -1.0]);
    }

    #[test]
    fn every_format_of_numbers_holds_zero_and_one_in_each_channel() {
        for format in crate::graph::parse::FORMATS.into_iter().filter(|f| !f.has_stencil_aspect()) {
            let count = format.components() as usize;
            let values = [1.0, 0.0, 1.0, 1.0];
            let got = there_and_back(format, values);
            assert_eq!(got, values.map(|v| v as f32)[..count], "{format:?}");
        }
    }

    #[test]
    fn many_texels_are_written_as_one_is() {
        let values = [0.1f32, 0.5, 0.9, 0.3, 1.0, 0.0, 0.25, 0.75];
        for format in [F::Rgba8Unorm, F::Rgba8UnormSrgb, F::Bgra8Unorm, F::Rgba16Float, F::Rgba32Float, F::Rgb10a2Unorm]
        {
            let one = |v: &[f32]| encode(format, [v[0], v[1], v[2], v[3]].map(f64::from)).unwrap();
            assert_eq!(encode_rows(format, &values), [one(&values[..4]), one(&values[4..])].concat(), "{format:?}");
        }
    }

    #[test]
    fn packed_words_unpack() {
        assert_eq!(there_and_back(F::Rgb10a2Unorm, [1.0, 0.0, 1.0, 1.0]), [1.0, 0.0, 1.0, 1.0]);
        assert_eq!(there_and_back(F::Rg11b10Ufloat, [0.5, 1.5, 24.0, 0.0]), [0.5, 1.5, 24.0]);
    }

    #[test]
    fn blue_comes_first_only_in_memory() {
        assert_eq!(encode(F::Bgra8Unorm, [1.0, 0.0, 0.0, 1.0]).unwrap(), [0, 0, 255, 255]);
    }
}
