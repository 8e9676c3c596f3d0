//! A photographer's studio as a panorama: dim walls, a large soft box overhead, a strip on one side and a window on the
//! other.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

pub const WIDTH: u32 = 128;
pub const HEIGHT: u32 = 64;

/// A lamp that fills a box of the panorama: from and to, in shares of its width and height from the top left; radiance.
const LAMPS: [([f64; 2], [f64; 2], [f64; 3]); 4] = [
    ([0.16, 0.10], [0.40, 0.24], [9.0, 8.4, 7.5]),
    ([0.62, 0.24], [0.66, 0.60], [5.0, 6.5, 9.0]),
    ([0.86, 0.36], [0.96, 0.50], [6.0, 3.2, 1.4]),
    ([0.02, 0.30], [0.05, 0.46], [1.5, 3.0, 1.6]),
];

/// The share of a texel's side along an axis, from `at` on, that lies between two places.
fn share(at: u32, of: u32, [from, to]: [f64; 2]) -> f64 {
    let (from, to) = (from * f64::from(of), to * f64::from(of));
    (to.min(f64::from(at + 1)) - from.max(f64::from(at))).clamp(0.0, 1.0)
}

fn radiance(x: u32, y: u32) -> [f64; 3] {
    let height = 1.0 - (f64::from(y) + 0.5) / f64::from(HEIGHT);
    // Walls are brighter towards the ceiling; the floor is of wood.
    let mut color = if height > 0.42 { [0.24, 0.26, 0.30].map(|c| c * (0.35 + height)) } else { [0.16, 0.11, 0.07] };
    for (from, to, lamp) in LAMPS {
        let covered = share(x, WIDTH, [from[0], to[0]]) * share(y, HEIGHT, [from[1], to[1]]);
        for (color, lamp) in color.iter_mut().zip(lamp) {
            *color = *color * (1.0 - covered) + lamp * covered;
        }
    }
    color
}

/// Where the light of a texel comes from. The middle is seen towards −Z, the top row from above.
pub fn towards(x: u32, y: u32) -> DVec3 {
    let at = |k: u32, of: u32| (f64::from(k) + 0.5) / f64::from(of);
    let (round, down) = (TAU * at(x, WIDTH), PI * at(y, HEIGHT));
    DVec3::new(-round.sin() * down.sin(), down.cos(), round.cos() * down.sin())
}

/// Three mantissas of 8 bits with one exponent.
fn texel(color: [f64; 3]) -> [u8; 4] {
    let most = color.into_iter().fold(0.0, f64::max);
    // The least power of two above all of them.
    let exponent = (-30..30).find(|e| most < 2f64.powi(*e)).unwrap_or(30);
    let unit = 2f64.powi(exponent - 8);
    let [r, g, b] = color.map(|c| (c / unit) as u8);
    [r, g, b, (exponent + 128) as u8]
}

/// The file, in Radiance's format.
pub fn studio() -> Vec<u8> {
    panorama(radiance)
}

/// The file of a panorama of this size whose pixels give this.
pub fn panorama(radiance: impl Fn(u32, u32) -> [f64; 3]) -> Vec<u8> {
    let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n").into_bytes();
    for y in 0..HEIGHT {
        let row: Vec<[u8; 4]> = (0..WIDTH).map(|x| texel(radiance(x, y))).collect();
        bytes.extend([2, 2, (WIDTH >> 8) as u8, (WIDTH & 255) as u8]);
        for channel in 0..4 {
            let mut x = 0;
            while x < row.len() {
                let value = row[x][channel];
                let run = row[x..].iter().take(127).take_while(|t| t[channel] == value).count();
                bytes.extend([128 + run as u8, value]);
                x += run;
            }
        }
    }
    bytes
}
