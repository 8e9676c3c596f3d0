//! Images of `KHR_texture_basisu`: KTX2 files that hold ETC1S or UASTC blocks of Basis Universal.
//!
//! Source: Khronos, KTX File Format Specification 2.0, section 3, "KTX 2.0 Binary Layout".

use super::textures::{MAX_FILE_EDGE, TextureImage};
use crate::caught::caught;
use basisu::{DecodeFlags, TargetFormat, Transcoder};

/// Supercompression: none, BasisLZ, Zstandard; others are no part of `KHR_texture_basisu`.
const SCHEMES: u32 = 3;

/// Texels along an edge of a block, and its bytes.
const BLOCK: [u64; 2] = [4, 16];

pub(super) fn is_basis(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\xabKTX 20\xbb\r\n\x1a\n")
}

/// The size that a file states.
pub(super) fn stated_size(bytes: &[u8]) -> Option<[u32; 2]> {
    Some([word(bytes, 20)?, word(bytes, 24)?])
}

pub(super) fn decode(bytes: &[u8]) -> Result<TextureImage, String> {
    let [width, height] = checked(bytes)?;
    let texels = caught(|| {
        let transcoder = Transcoder::new(bytes).ok()?;
        let texels = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).ok()?;
        Some(texels.as_chunks::<4>().0.to_vec())
    });
    let texels = texels.flatten().filter(|t| t.len() == width as usize * height as usize);
    Ok(TextureImage { width, height, texels: texels.ok_or("its blocks are no readable ETC1S or UASTC")? })
}

/// The size of a file whose header asks for no more memory than its image.
fn checked(bytes: &[u8]) -> Result<[u32; 2], String> {
    let cut = "its header is cut off";
    let field = |at: usize| word(bytes, at).ok_or(cut);
    let (format, size) = (field(12)?, stated_size(bytes).ok_or(cut)?);
    if format != 0 || field(44)? >= SCHEMES {
        return Err("it holds something else than ETC1S or UASTC, as KHR_texture_basisu has them".into());
    }
    if field(28)? > 0 || field(32)? > 1 || field(36)? != 1 {
        return Err("it holds several images".into());
    }
    if size.contains(&0) {
        return Err("it has no texels".into());
    }
    if size.iter().any(|edge| *edge > MAX_FILE_EDGE) {
        return Err(format!("it is larger than {MAX_FILE_EDGE} × {MAX_FILE_EDGE} texels"));
    }
    let [edge, block] = BLOCK;
    let whole = size.iter().map(|s| u64::from(*s).div_ceil(edge)).product::<u64>() * block;
    // Of each level: where it starts, its bytes, and those before supercompression.
    let levels = field(40)?.clamp(1, 32);
    for level in 0..levels as usize {
        let low = field(80 + 24 * level + 16)?;
        if field(80 + 24 * level + 20)? > 0 || u64::from(low) > whole {
            return Err("one of its levels is larger than its image".into());
        }
    }
    Ok(size)
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes)
}
