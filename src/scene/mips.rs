//! An image's mips: means of light for colours, of numbers for data.

use super::textures::TextureImage;
use crate::image::mips::spans;
use crate::image::srgb;
use std::sync::OnceLock;

/// What an image's numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TexelCoding {
    /// Red, green and blue in sRGB.
    Color,
    /// As they stand.
    Data,
}

/// An image and its mips, down to one texel.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MipChain(Vec<TextureImage>);

impl MipChain {
    /// Each row of each mip, with its place in the block.
    pub fn each_row(&self, mut row: impl FnMut([u32; 2], &[u8])) {
        let mut below = 0;
        for (i, level) in self.0.iter().enumerate() {
            let [x, y] = if i == 0 { [0, 0] } else { [self.0[0].width, below] };
            for (line, texels) in (y..).zip(level.texels.chunks_exact(level.width as usize)) {
                row([x, line], texels.as_flattened());
            }
            below += if i == 0 { 0 } else { level.height };
        }
    }
}

fn half(size: [u32; 2]) -> [u32; 2] {
    size.map(|edge| (edge / 2).max(1))
}

/// A size, halved until it is no more than `most` texels along an edge.
pub(super) fn shrunk(size: [u32; 2], most: u32) -> [u32; 2] {
    let mut size = size;
    while size[0].max(size[1]) > most.max(1) {
        size = half(size);
    }
    size
}

/// Mips of an image, the largest among them.
pub(super) fn count([width, height]: [u32; 2]) -> u32 {
    width.max(height).max(1).ilog2() + 1
}

/// The size of what holds an image and, right of it, one below the other, its mips.
pub(super) fn block(size: [u32; 2]) -> [u32; 2] {
    let [width, height] = size;
    let beside: Vec<[u32; 2]> =
        std::iter::successors(Some(size), |s| Some(half(*s))).take(count(size) as usize).skip(1).collect();
    let below: u32 = beside.iter().map(|[_, height]| height).sum();
    [width + beside.first().map_or(0, |[width, _]| *width), height.max(below)]
}

/// A picture with its mips; one wider than `most` texels is halved until it is not.
pub(super) fn levels(picture: TextureImage, coding: TexelCoding, most: u32) -> MipChain {
    let mut picture = picture;
    while picture.width.max(picture.height) > most.max(1) {
        picture = halved(&picture, coding);
    }
    let mut all = vec![picture];
    while let Some(last) = all.last().filter(|p| p.width.max(p.height) > 1) {
        let next = halved(last, coding);
        all.push(next);
    }
    MipChain(all)
}

/// Half as large, rounded down: each texel the mean over the part of the picture that it covers.
fn halved(picture: &TextureImage, coding: TexelCoding) -> TextureImage {
    let (width, height) = ((picture.width / 2).max(1), (picture.height / 2).max(1));
    let (across, down) = (spans(picture.width, width), spans(picture.height, height));
    let stride = picture.width as usize;
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    let code = Codes::of(coding);
    if picture.width.is_multiple_of(2) && picture.height.is_multiple_of(2) {
        for rows in picture.texels.chunks_exact(2 * stride) {
            let (above, below) = rows.split_at(stride);
            texels.extend(
                above
                    .as_chunks::<2>()
                    .0
                    .iter()
                    .zip(below.as_chunks::<2>().0)
                    .map(|(a, b)| code.mean([a[0], a[1], b[0], b[1]])),
            );
        }
        return TextureImage { width, height, texels };
    }
    for (top, rows) in &down {
        for (left, columns) in &across {
            let mut sum = [0.0f32; 4];
            for (y, high) in (*top..).zip(rows).filter(|(_, share)| **share > 0.0) {
                for (x, wide) in (*left..).zip(columns).filter(|(_, share)| **share > 0.0) {
                    let [r, g, b, a] = picture.texels[y * stride + x];
                    let share = high * wide;
                    let texel = [code.light[r as usize], code.light[g as usize], code.light[b as usize]];
                    (0..3).for_each(|i| sum[i] += share * texel[i]);
                    sum[3] += share * f32::from(a);
                }
            }
            let coded = |light: f32| code.of_light(light);
            texels.push([coded(sum[0]), coded(sum[1]), coded(sum[2]), (sum[3] + 0.5) as u8]);
        }
    }
    TextureImage { width, height, texels }
}

/// What 8 bits stand for, and back.
struct Codes {
    light: [f32; 256],
    /// By light in 4096ths where it is coded in sRGB, else not asked for. Enough for what 8 bits tell apart above the
    /// darkest codes; these lie on the straight part of the curve.
    code: Option<Vec<u8>>,
}

const STEPS: f32 = 16383.0;

impl Codes {
    fn of(coding: TexelCoding) -> &'static Codes {
        static BOTH: OnceLock<[Codes; 2]> = OnceLock::new();
        let [color, data] = BOTH.get_or_init(|| {
            let plain = |i: usize| i as f32 / 255.0;
            let step = |i: u32| srgb::nearest(i as f32 / STEPS);
            let color = Codes {
                light: std::array::from_fn(|i| srgb::decode(plain(i))),
                code: Some((0..=STEPS as u32).map(step).collect()),
            };
            [color, Codes { light: std::array::from_fn(plain), code: None }]
        });
        if coding == TexelCoding::Color { color } else { data }
    }

    /// The mean of four texels.
    fn mean(&self, four: [[u8; 4]; 4]) -> [u8; 4] {
        let light = |i: usize| four.iter().fold(0.0, |sum, t| sum + 0.25 * self.light[t[i] as usize]);
        let alpha = four.iter().fold(0.0, |sum, t| sum + 0.25 * f32::from(t[3]));
        [self.of_light(light(0)), self.of_light(light(1)), self.of_light(light(2)), (alpha + 0.5) as u8]
    }

    fn of_light(&self, light: f32) -> u8 {
        match &self.code {
            Some(code) => code[(light.clamp(0.0, 1.0) * STEPS + 0.5) as usize],
            None => (light.clamp(0.0, 1.0) * 255.0 + 0.5) as u8,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32, texels: &[[u8; 4]]) -> TextureImage {
        TextureImage { width, height, texels: texels.to_vec() }
    }

    #[test]
    fn mips_are_means_of_light_not_of_codes() {
        let (black, white) = ([0, 0, 0, 255], [255; 4]);
        let half = |coding| levels(picture(2, 1, &[black, white]), coding, 4096).0.pop().unwrap();
        // Half the light of white is code 188 in sRGB; the mean of the codes is 128.
        assert_eq!(half(TexelCoding::Color).texels, [[188, 188, 188, 255]]);
        assert_eq!(half(TexelCoding::Data).texels, [[128, 128, 128, 255]]);
    }

    #[test]
    fn a_plain_image_stays_plain_in_every_mip() {
        for code in 0..=255 {
            for coding in [TexelCoding::Color, TexelCoding::Data] {
                let all = levels(picture(5, 3, &[[code, 255 - code, 7, code]; 15]), coding, 4096);
                assert_eq!((all.0.len(), count([5, 3])), (3, 3));
                assert!(
                    all.0.iter().all(|p| p.texels.iter().all(|t| *t == [code, 255 - code, 7, code])),
                    "{code} {coding:?}"
                );
            }
        }
    }

    #[test]
    fn images_past_the_limit_shrink() {
        let all = levels(picture(300, 1, &[[9, 9, 9, 255]; 300]), TexelCoding::Color, 100);
        let size = [all.0[0].width, all.0[0].height];
        assert_eq!((size, shrunk([300, 1], 100), block(size)), ([75, 1], [75, 1], [112, 6]));
        assert_eq!((all.0.len() as u32, count(size)), (7, 7));
    }

    #[test]
    fn each_mip_stands_where_its_texels_are_looked_for() {
        let green = levels(picture(3, 5, &[[0, 100, 0, 255]; 15]), TexelCoding::Color, 4096);
        let mut found = vec![];
        // The image, and right of it its mips: 1 × 2, then 1 × 1.
        green.each_row(|[x, y], row| found.push((x, y, row.len() / 4)));
        assert_eq!(found, [(0, 0, 3), (0, 1, 3), (0, 2, 3), (0, 3, 3), (0, 4, 3), (3, 0, 1), (3, 1, 1), (3, 2, 1)]);
        assert_eq!(block([3, 5]), [4, 5]);
    }

    #[test]
    fn each_texel_of_an_even_size_is_the_mean_of_its_four() {
        let texels: Vec<[u8; 4]> = (0..64u32).map(|i| [i * 37, i * 91 + 5, i * i, 255 - i].map(|n| n as u8)).collect();
        for coding in [TexelCoding::Color, TexelCoding::Data] {
            let (even, code) = (halved(&picture(8, 8, &texels), coding), Codes::of(coding));
            for (i, texel) in even.texels.iter().enumerate() {
                let at = i / 4 * 16 + i % 4 * 2;
                assert_eq!(*texel, code.mean([0, 1, 8, 9].map(|beside| texels[at + beside])), "texel {i}");
            }
            assert_eq!(even.texels.len(), 16);
        }
    }
}
