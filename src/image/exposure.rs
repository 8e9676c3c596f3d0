//! How bright a picture of an image is made.

use super::Image;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Stops (each doubles the light), or what suits the image.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Exposure {
    #[default]
    Auto,
    Stops(f32),
}

/// Geometric mean of the luminance of a picture that is well exposed: the grey that photographers expose for.
const GREY: f64 = 0.18;

/// Geometric means from which to which an image is shown as it is: renderers' units make most of them so.
const SHOWN: [f64; 2] = [0.01, 1.5];

/// Luminance of linear sRGB (IEC 61966-2-1).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

impl Exposure {
    /// In stops, for an image. `Auto` leaves an image as it is that shows well; a dark or a photometric one it brings
    /// to a middle grey.
    pub fn stops(self, image: &Image) -> f32 {
        match self {
            Exposure::Stops(stops) => stops,
            Exposure::Auto => automatic(image),
        }
    }
}

fn automatic(image: &Image) -> f32 {
    let luminance = |p: [f32; 3]| p.iter().zip(LUMINANCE).map(|(c, share)| f64::from(*c) * share).sum::<f64>();
    let lit = image.rgb().map(luminance).filter(|l| *l > 0.0 && l.is_finite());
    let (count, sum) = lit.fold((0_u64, 0.0), |(count, sum), l| (count + 1, sum + l.ln()));
    if count == 0 {
        return 0.0;
    }
    let mean = (sum / count as f64).exp();
    if (SHOWN[0]..=SHOWN[1]).contains(&mean) { 0.0 } else { (GREY / mean).log2() as f32 }
}

impl FromStr for Exposure {
    type Err = String;

    fn from_str(text: &str) -> Result<Exposure, String> {
        if text == "auto" {
            return Ok(Exposure::Auto);
        }
        let stops = text.parse().ok().filter(|stops: &f32| stops.is_finite());
        stops.map(Exposure::Stops).ok_or_else(|| "write `auto`, or stops such as 0 or -1.5".into())
    }
}

impl fmt::Display for Exposure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Exposure::Auto => f.write_str("auto"),
            Exposure::Stops(stops) => write!(f, "{stops}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(level: f32) -> Image {
        Image::filled(4, 4, &[level, level, level]).unwrap_or_else(|f| panic!("{f}"))
    }

    #[test]
    fn only_what_lies_far_from_one_is_exposed() {
        for level in [0.0, 0.02, 0.2, 1.0] {
            assert_eq!(Exposure::Auto.stops(&grey(level)), 0.0, "{level}");
        }
        for level in [1e-4, 10.0, 20_000.0] {
            let shown = level * Exposure::Auto.stops(&grey(level)).exp2();
            assert!((shown - 0.18).abs() < 1e-3, "{level}: {shown}");
        }
        assert_eq!(Exposure::Stops(-1.5).stops(&grey(20_000.0)), -1.5);
    }

    #[test]
    fn one_broken_pixel_decides_nothing() {
        let mut image = grey(100.0);
        for (x, level) in [(0, f32::NAN), (1, f32::INFINITY), (2, 0.0)] {
            let pixel = image.pixel_mut(0, x, 0).unwrap_or_else(|| panic!("a pixel"));
            pixel.fill(level);
        }
        assert!((Exposure::Auto.stops(&image) - (0.18_f32 / 100.0).log2()).abs() < 1e-3);
    }

    #[test]
    fn an_exposure_is_a_word_or_a_number() {
        assert_eq!("auto".parse(), Ok(Exposure::Auto));
        assert_eq!("-1.5".parse(), Ok(Exposure::Stops(-1.5)));
        assert!("bright".parse::<Exposure>().is_err() && "NaN".parse::<Exposure>().is_err());
    }
}
