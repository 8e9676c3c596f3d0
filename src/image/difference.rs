//! A picture of where an image differs from a reference, and in which direction.

use super::{Image, check_same_size};
use crate::diag::Checked;

/// A signed difference in false colours and what they stand for.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// RGB, linear: save it without a tone map. White: equal. Red: the test image is brighter. Blue: it is darker.
    /// NaN (magenta in a PNG) where one of the two is NaN or both are infinite.
    pub image: Image,
    /// The difference, as a mean over red, green and blue, that has the full colour, in the images' unit.
    pub full: f64,
}

/// The difference between two images of the same size; the full colour stands for half the reference's mean.
///
/// # Errors
/// A fault when sizes differ.
pub fn difference(test: &Image, reference: &Image) -> Checked<Difference> {
    check_same_size(("the test image", test), ("the reference", reference))?;
    let finite = || reference.rgb().flatten().map(f64::from).filter(|v| v.is_finite());
    let full = match 0.5 * (finite().sum::<f64>() / finite().count().max(1) as f64).abs() {
        0.0 => 1.0,
        half => half,
    };
    let data = test.rgb().zip(reference.rgb()).flat_map(|(t, r)| {
        let error = t.iter().zip(r).map(|(t, r)| f64::from(*t) - f64::from(r)).sum::<f64>() / 3.0 / full;
        let rest = 1.0 - error.abs().min(1.0) as f32;
        match error {
            e if e.is_nan() => [f32::NAN; 3],
            e if e > 0.0 => [1.0, rest, rest],
            _ => [rest, rest, 1.0],
        }
    });
    let image = Image::array(test.width, test.height, test.layers, 3, data.collect())?;
    Ok(Difference { image, full })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brighter_is_red_and_darker_is_blue() {
        let reference = Image::filled(5, 1, &[2.0]).unwrap();
        let test = Image::new(5, 1, 1, vec![2.0, 2.25, 1.5, 9.0, f32::NAN]).unwrap();
        let shown = difference(&test, &reference).unwrap();
        assert_eq!(shown.full, 1.0);
        assert_eq!(shown.image.data[..12], [1.0, 1.0, 1.0, 1.0, 0.75, 0.75, 0.5, 0.5, 1.0, 1.0, 0.0, 0.0]);
        assert!(shown.image.data[12..].iter().all(|v| v.is_nan()));
    }

    #[test]
    fn a_black_reference_and_unequal_sizes_are_no_panic() {
        let black = Image::filled(2, 2, &[0.0]).unwrap();
        assert_eq!(difference(&black, &black).unwrap().full, 1.0);
        assert!(difference(&black, &Image::filled(1, 2, &[0.0]).unwrap()).is_err());
    }
}
