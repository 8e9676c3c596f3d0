//! Small pictures for textures, as PNG files.

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

/// Texels along an edge.
const SIZE: u32 = 64;

/// Hills under an evening sky.
pub fn landscape() -> Vec<u8> {
    encode(|x, y| {
        let grain = (hash(x / 2, y) % 17) as i32 - 8;
        let (fx, fy) = (f64::from(x) / 63.0, f64::from(y) / 63.0);
        let far_hill = 0.50 - 0.12 * bump(fx, 0.25, 0.30) - 0.07 * bump(fx, 0.8, 0.22);
        let near_hill = 0.68 - 0.16 * bump(fx, 0.85, 0.45) + 0.05 * bump(fx, 0.35, 0.3);
        let sun = (fx - 0.62).powi(2) + (fy - 0.34).powi(2) < 0.009;
        let base = if fy > 0.86 {
            mix([70, 60, 30], [36, 44, 20], (fy - 0.86) / 0.14)
        } else if fy > near_hill {
            mix([92, 122, 48], [48, 82, 36], (fy - near_hill) / 0.25)
        } else if fy > far_hill {
            mix([88, 84, 140], [120, 110, 150], (fy - far_hill) / 0.2)
        } else if sun {
            [255, 226, 150]
        } else {
            mix([66, 104, 170], [246, 168, 96], fy / 0.5)
        };
        base.map(|c| (i32::from(c) + grain).clamp(0, 255) as u8)
    })
}

/// Coloured rectangles between dark bars.
pub fn composition() -> Vec<u8> {
    encode(|x, y| {
        let bars =
            [(x, [20, 44]), (y, [14, 40])].into_iter().any(|(at, lines)| lines.iter().any(|&l| at.abs_diff(l) < 2));
        let grain = (hash(x, y) % 9) as u8;
        if bars {
            return [18 + grain, 17 + grain, 20 + grain];
        }
        let cell = (u8::from(x > 20) + u8::from(x > 44), u8::from(y > 14) + u8::from(y > 40));
        let base: [u8; 3] = match cell {
            (0, 1) | (2, 0) => [206, 36, 30],
            (1, 2) => [28, 66, 160],
            (2, 1) => [238, 196, 40],
            (0, 0) => [44, 92, 170],
            _ => [236, 230, 214],
        };
        base.map(|c| c.saturating_add(grain))
    })
}

/// Four boards of a wooden floor.
pub fn boards() -> Vec<u8> {
    encode(|x, y| {
        let board = y / 16;
        let tone = f64::from(hash(board, 7) % 100) / 100.0;
        let vein = (f64::from(x) * 0.1 + 5.0 * tone).sin() * 6.0 + (f64::from(y % 16) * 0.8).sin() * 5.0;
        let base = mix([172, 128, 84], [208, 162, 112], tone);
        let seam = if y % 16 == 0 { 40 } else { 0 };
        base.map(|c| (i32::from(c) + vein.round() as i32 - seam).clamp(0, 255) as u8)
    })
}

/// A rug: a border, and diamonds inside.
pub fn rug() -> Vec<u8> {
    encode(|x, y| {
        let (across, along) = (x.abs_diff(31).max(1), y.abs_diff(31).max(1));
        if across > 27 || along > 27 {
            return [120, 28, 30];
        }
        match (across + along) / 8 % 3 {
            0 => [196, 168, 120],
            1 => [150, 44, 40],
            _ => [46, 62, 96],
        }
    })
}

/// Courses of brick.
pub fn bricks() -> Vec<u8> {
    encode(|x, y| {
        let course = y / 8;
        let shifted = (x + 8 * (course % 2)) % 64;
        if y % 8 == 0 || shifted % 16 == 0 {
            return [176, 168, 156];
        }
        let tone = f64::from(hash(shifted / 16, course) % 100) / 100.0;
        mix([142, 70, 52], [178, 98, 70], tone)
    })
}

/// 1 at `center`, falling smoothly to 0 at `width` from it.
fn bump(x: f64, center: f64, width: f64) -> f64 {
    let t = 1.0 - ((x - center) / width).abs().min(1.0);
    t * t * (3.0 - 2.0 * t)
}

fn mix(a: [u8; 3], b: [u8; 3], t: f64) -> [u8; 3] {
    let t = t.clamp(0.0, 1.0);
    std::array::from_fn(|i| (f64::from(a[i]) * (1.0 - t) + f64::from(b[i]) * t).round() as u8)
}

/// A fixed scramble of two integers (the mixing steps of PCG, O'Neill 2014).
pub fn hash(x: u32, y: u32) -> u32 {
    let state =
        (x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663)).wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

fn encode(texel: impl Fn(u32, u32) -> [u8; 3]) -> Vec<u8> {
    let pixels: Vec<u8> =
        (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))).flat_map(|(x, y)| texel(x, y)).collect();
    let mut png = Vec::new();
    let written = PngEncoder::new(&mut png).write_image(&pixels, SIZE, SIZE, ExtendedColorType::Rgb8);
    written.expect("a PNG is written to memory from exactly SIZE × SIZE texels");
    png
}
