//! The texels of a resource as colours.

use super::{Image, srgb};
use serde::{Deserialize, Serialize};

/// How numbers become colours.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PaintLook {
    pub channel: Channel,
    /// The numbers shown darkest and brightest; `None`: the least and the largest there are.
    pub range: Option<[f32; 2]>,
    /// A scale of colours in place of greys, for a single channel.
    pub false_color: bool,
}

/// What of a texel is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Channel {
    Color,
    Red,
    Green,
    Blue,
    Alpha,
}

impl Channel {
    pub const ALL: [Channel; 5] = [Channel::Color, Channel::Red, Channel::Green, Channel::Blue, Channel::Alpha];

    pub fn label(self) -> &'static str {
        match self {
            Channel::Color => "RGB",
            Channel::Red => "R",
            Channel::Green => "G",
            Channel::Blue => "B",
            Channel::Alpha => "A",
        }
    }

    fn of(self, texel: &[f32]) -> f32 {
        let at = match self {
            Channel::Color | Channel::Red => 0,
            Channel::Green => 1,
            Channel::Blue => 2,
            Channel::Alpha => 3,
        };
        texel.get(at).copied().unwrap_or(0.0)
    }
}

impl Default for PaintLook {
    fn default() -> PaintLook {
        PaintLook { channel: Channel::Color, range: None, false_color: false }
    }
}

/// What is known of the numbers shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueRange {
    /// Of the finite ones; both 0 without any.
    pub least: f32,
    pub most: f32,
    pub mean: f32,
    pub not_a_number: usize,
    pub infinite: usize,
}

/// The mark of a NaN.
pub const NOT_A_NUMBER: [u8; 4] = [255, 0, 255, 255];
/// The mark of an infinity.
pub const INFINITE: [u8; 4] = [0, 255, 255, 255];

/// Every texel as red, green, blue and alpha in sRGB; and what the numbers are. NaN is magenta and infinity cyan. Alpha
/// is shown only by itself.
pub fn paint(image: &Image, look: PaintLook) -> (Vec<u8>, ValueRange) {
    let extent = measure(image, look.channel);
    let [low, high] = look.range.unwrap_or([extent.least, extent.most]);
    let width = high - low;
    let share = |v: f32| if width > 0.0 { ((v - low) / width).clamp(0.0, 1.0) } else { f32::from(v > low) };
    let mut out = Vec::with_capacity(image.pixel_count() * 4);
    for texel in image.data.chunks_exact(image.channels.max(1) as usize) {
        let values = shown(texel, look.channel);
        let pixel = if values.iter().any(|v| v.is_nan()) {
            NOT_A_NUMBER
        } else if values.iter().any(|v| v.is_infinite()) {
            INFINITE
        } else if look.false_color && look.channel != Channel::Color {
            let [r, g, b] = scale(share(values[0]));
            [r, g, b, 255]
        } else {
            let [r, g, b] = values.map(|v| (srgb::encode(f64::from(share(v))) * 255.0).round() as u8);
            [r, g, b, 255]
        };
        out.extend(pixel);
    }
    (out, extent)
}

/// The three numbers that a texel is shown by.
fn shown(texel: &[f32], channel: Channel) -> [f32; 3] {
    match (channel, texel) {
        (Channel::Color, [y]) => [*y; 3],
        (Channel::Color, [r, g]) => [*r, *g, 0.0],
        (Channel::Color, [r, g, b, ..]) => [*r, *g, *b],
        _ => [channel.of(texel); 3],
    }
}

fn measure(image: &Image, channel: Channel) -> ValueRange {
    let (mut least, mut most, mut sum, mut finite) = (f32::INFINITY, f32::NEG_INFINITY, 0.0f64, 0usize);
    let (mut not_a_number, mut infinite) = (0, 0);
    for texel in image.data.chunks_exact(image.channels.max(1) as usize) {
        let count = if channel == Channel::Color { image.channels.clamp(1, 3) as usize } else { 1 };
        let values = &shown(texel, channel)[..count];
        not_a_number += usize::from(values.iter().any(|v| v.is_nan()));
        infinite += usize::from(values.iter().any(|v| v.is_infinite()));
        for v in values.iter().filter(|v| v.is_finite()) {
            (least, most) = (least.min(*v), most.max(*v));
            sum += f64::from(*v);
            finite += 1;
        }
    }
    if finite == 0 {
        (least, most) = (0.0, 0.0);
    }
    ValueRange { least, most, mean: (sum / finite.max(1) as f64) as f32, not_a_number, infinite }
}

/// A colour for a share from 0 to 1: the polynomial fit of Google's "Turbo" (Mikhailov, 2019).
pub fn scale(share: f32) -> [u8; 3] {
    let x = share.clamp(0.0, 1.0);
    let polynomial = |c: [f32; 6]| c.iter().rev().fold(0.0, |sum, k| sum * x + k);
    let red = polynomial([0.135_721_4, 4.615_392_6, -42.660_32, 132.131_08, -152.942_4, 59.286_38]);
    let green = polynomial([0.091_402_61, 2.194_188_4, 4.842_967, -14.185_033, 4.277_298_6, 2.829_566]);
    let blue = polynomial([0.106_673_3, 12.641_946, -60.582_05, 110.362_77, -89.903_11, 27.348_25]);
    [red, green, blue].map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(channels: u32, data: Vec<f32>) -> Image {
        Image::new(data.len() as u32 / channels, 1, channels, data).unwrap()
    }

    #[test]
    fn the_range_runs_from_the_least_to_the_most() {
        let (pixels, extent) = paint(&image(1, vec![-2.0, 0.0, 2.0]), PaintLook::default());
        assert_eq!((extent.least, extent.most, extent.mean), (-2.0, 2.0, 0.0));
        // Half of the light is 188 of 255 in sRGB.
        assert_eq!(pixels, [0, 0, 0, 255, 188, 188, 188, 255, 255, 255, 255, 255]);
    }

    #[test]
    fn a_given_range_cuts_off() {
        let look = PaintLook { range: Some([0.0, 1.0]), ..PaintLook::default() };
        let (pixels, _) = paint(&image(3, vec![-1.0, 0.5, 7.0]), look);
        assert_eq!(pixels, [0, 188, 255, 255]);
    }

    #[test]
    fn what_is_no_number_is_marked_and_counted() {
        let (pixels, extent) = paint(&image(1, vec![f32::NAN, f32::NEG_INFINITY, 1.0, 3.0]), PaintLook::default());
        assert_eq!((extent.not_a_number, extent.infinite), (1, 1));
        assert_eq!((extent.least, extent.most), (1.0, 3.0));
        assert_eq!(pixels[..8], [NOT_A_NUMBER, INFINITE].concat());
    }

    #[test]
    fn a_channel_is_shown_by_itself() {
        let look = PaintLook { channel: Channel::Alpha, range: Some([0.0, 1.0]), false_color: false };
        let (pixels, extent) = paint(&image(4, vec![0.2, 0.3, 0.4, 1.0]), look);
        assert_eq!((pixels, extent.most), (vec![255; 4], 1.0));
        // A NaN elsewhere does not matter to it.
        let (_, extent) = paint(&image(4, vec![f32::NAN, 0.0, 0.0, 1.0]), look);
        assert_eq!(extent.not_a_number, 0);
    }

    #[test]
    fn one_value_everywhere_has_no_range_and_no_fault() {
        let (pixels, _) = paint(&image(1, vec![5.0, 5.0]), PaintLook::default());
        assert_eq!(pixels[0], 0);
        let (pixels, extent) = paint(&image(1, vec![f32::NAN]), PaintLook::default());
        assert_eq!((&pixels[..], extent.least, extent.mean), (&NOT_A_NUMBER[..], 0.0, 0.0));
    }

    #[test]
    fn the_scale_goes_from_blue_over_green_to_red() {
        let [low, middle, high] = [0.1, 0.5, 0.9].map(scale);
        assert!(low[2] > low[0] && middle[1] > middle[2] && high[0] > high[1], "{low:?} {middle:?} {high:?}");
    }
}
