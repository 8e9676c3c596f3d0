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
    pub fn size(&self) -> [u32; 2] {
        [self.0[0].width, self.0[0].height]
    }

    pub fn count(&self) -> u32 {
        self.0.len() as u32
    }

    /// Whether any texel of the image itself is less than opaque.
    pub fn has_alpha(&self) -> bool {
        self.0[0].texels.iter().any(|t| t[3] < 255)
    }

    /// The size of what holds the image and, right of it, one below the other, its mips.
    pub fn block(&self) -> [u32; 2] {
        let [width, height] = self.size();
        let beside: u32 = self.0.iter().skip(1).map(|p| p.height).sum();
        [width + self.0.get(1).map_or(0, |p| p.width), height.max(beside)]
    }

    /// Each row of each mip, with its place in the block.
    pub fn each_row(&self, mut row: impl FnMut([u32; 2], &[u8])) {
        let mut below = 0;
        for (i, level) in self.0.iter().enumerate() {
            let [x, y] = if i == 0 { [0, 0] } else { [self.size()[0], below] };
            for (line, texels) in (y..).zip(level.texels.chunks_exact(level.width as usize)) {
                row([x, line], texels.as_flattened());
            }
            below += if i == 0 { 0 } else { level.height };
        }
    }
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
                assert_eq!(all.count(), 3);
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
        assert_eq!((all.size(), all.block()), ([75, 1], [112, 6]));
    }
}
