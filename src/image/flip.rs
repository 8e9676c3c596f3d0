//! HDR-FLIP: the difference that a viewer sees when two images take turns on a screen.

use super::{
    Image,
    metrics::{check, kept},
};
use crate::diag::{Checked, Diagnostic};
use flip_rs::{FlipError, HdrOptions, RgbImage, hdr_flip};

/// The mean HDR-FLIP error over the pixels kept, from 0 (the same) to 1 (Andersson et al., "Visualizing Errors in
/// Rendered High Dynamic Range Images", 2021): linear RGB, ACES, exposures from the reference, 67 pixels a degree
/// of the viewer's field of view (a 0.7 m wide 4K screen seen from 0.7 m).
///
/// The mask chooses what is averaged; the error of a pixel still depends on its neighbours.
///
/// # Errors
/// Those of [`compare`](super::metrics::compare), and a fault when a pixel of the reference that isn't kept holds a
/// NaN or an infinity, or a layer of the reference is black, so that no exposure suits it, and the test image isn't.
pub fn flip(test: &Image, reference: &Image, mask: Option<&[bool]>) -> Checked<f64> {
    check(test, reference, mask)?;
    let (width, height) = (test.width as usize, test.height as usize);
    let layer_of = |image: &Image, layer: usize| -> Vec<f32> {
        image.rgb().skip(layer * width * height).take(width * height).flatten().collect()
    };
    let (mut sum, mut count) = (0.0, 0u64);
    for layer in 0..test.layers as usize {
        let errors = errors(width, height, layer_of(test, layer), layer_of(reference, layer))
            .map_err(|e| Diagnostic::error(format!("HDR-FLIP can't compare these images: {e}")))?;
        let start = layer * width * height;
        for (_, error) in errors.iter().enumerate().filter(|(i, _)| kept(mask, start + i)) {
            sum += f64::from(*error);
            count += 1;
        }
    }
    Ok(sum / count as f64)
}

/// One error a pixel; RGB in, row by row.
fn errors(width: usize, height: usize, test: Vec<f32>, reference: Vec<f32>) -> Result<Vec<f32>, FlipError> {
    // Two black layers have no error, but no exposure either.
    if test == reference {
        return Ok(vec![0.0; width * height]);
    }
    let mut options = HdrOptions::default();
    options.return_exposure_map = false;
    let test = RgbImage::new(width, height, test)?;
    let reference = RgbImage::new(width, height, reference)?;
    Ok(hdr_flip(&reference, &test, options)?.error_map.into_pixels())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp with a bright spot: several exposures.
    fn scene() -> Image {
        let value = |i: u32| if i == 200 { [40.0, 30.0, 20.0] } else { [0.1 + (i % 24) as f32 / 24.0, 0.4, 0.2] };
        Image::new(24, 24, 3, (0..24 * 24).flat_map(value).collect()).unwrap()
    }

    #[test]
    fn the_same_is_0_and_more_error_is_more() {
        let reference = scene();
        let scaled = |k: f32| Image { data: reference.data.iter().map(|v| v * k).collect(), ..reference.clone() };
        assert_eq!(flip(&reference, &reference, None).unwrap(), 0.0);
        let (little, much) = (flip(&scaled(1.05), &reference, None), flip(&scaled(2.0), &reference, None));
        let (little, much) = (little.unwrap(), much.unwrap());
        assert!(0.0 < little && little < much && much <= 1.0, "{little}, {much}");
    }

    #[test]
    fn the_mask_chooses_what_is_averaged() {
        let reference = scene();
        let mut test = reference.clone();
        test.pixel_mut(0, 0, 0).unwrap()[0] = 5.0;
        let near: Vec<bool> = (0..24 * 24).map(|i| i % 24 < 4 && i / 24 < 4).collect();
        let far: Vec<bool> = near.iter().map(|n| !n).collect();
        assert!(flip(&test, &reference, Some(&near)).unwrap() > 10.0 * flip(&test, &reference, Some(&far)).unwrap());
    }

    #[test]
    fn black_references_and_nan_are_no_panic() {
        let black = Image::filled(4, 4, &[0.0; 3]).unwrap();
        assert_eq!(flip(&black, &black, None).unwrap(), 0.0);
        assert!(flip(&Image::filled(4, 4, &[1.0; 3]).unwrap(), &black, None).is_err());
        assert!(flip(&Image::filled(4, 4, &[f32::NAN; 3]).unwrap(), &black, None).is_err());
    }
}
