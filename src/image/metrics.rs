//! How far an image is from a reference, in numbers: relative errors of linear light.

use super::{Image, check_same_size};
use crate::diag::{Checked, Diagnostic, Faults};
use serde::{Deserialize, Serialize};

/// Errors of a test image `t` against a reference `r`, over the pixels kept and the channels red, green and blue.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Pixels that were compared.
    pub pixels: u64,
    /// Mean of `t`, in the images' unit.
    pub mean_test: f64,
    /// Mean of `r`, in the images' unit.
    pub mean_reference: f64,
    /// `100 · √mean((t − r)²) / mean(r)`.
    pub rmse_percent: f64,
    /// `100 · (mean(t) / mean(r) − 1)`: too dark is negative.
    pub bias_percent: f64,
    /// `mean((t − r)² / (r² + 0.01))`: what is dark counts as much as what is bright (Rousselle, Knaus and Zwicker,
    /// "Adaptive Sampling and Reconstruction using Greedy Error Minimization", 2011).
    pub relmse: f64,
    /// As `rmse_percent` of the means over blocks of 8 × 8 pixels: noise averages out, a wrong level doesn't. Blocks
    /// that the mask or the image's edge leaves incomplete weigh as many pixels as they have.
    pub block_rmse_percent: f64,
    /// `|t − r|` that 95 % of the values don't exceed (nearest rank), in the images' unit.
    pub p95_error: f64,
    /// The largest `|t − r|`, in the images' unit.
    pub max_error: f64,
}

/// The edge of a block, in pixels.
const BLOCK: usize = 8;

/// Keeps `relmse` finite where the reference is black; the customary value.
const RELMSE_FLOOR: f64 = 0.01;

/// Compares a test image with a reference of the same size. Alpha is ignored and one channel is widened to grey, see
/// [`Image::rgb`]. `mask` holds a value for each pixel, `true` for those to compare.
///
/// # Errors
/// A fault when sizes differ, the mask has another length or keeps nothing, the test image holds a NaN or an infinity
/// (anywhere: an average would hide it), or the reference does in a pixel that is kept, or the reference is black and
/// the test image isn't, so that nothing is relative to it.
pub fn compare(test: &Image, reference: &Image, mask: Option<&[bool]>) -> Checked<Metrics> {
    check(test, reference, mask)?;
    let (width, height) = (test.width as usize, test.height as usize);
    let (across, down) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
    let block_of = |i: usize| (i / width / height * down + i / width % height / BLOCK) * across + i % width / BLOCK;
    let mut blocks = vec![([0.0f64; 3], 0.0f64); across * down * test.layers as usize];

    let (mut sum_test, mut sum_reference, mut squares, mut relative) = (0.0, 0.0, 0.0, 0.0);
    let mut errors: Vec<f64> = vec![];
    for (i, (t, r)) in test.rgb().zip(reference.rgb()).enumerate() {
        if !kept(mask, i) {
            continue;
        }
        let block = &mut blocks[block_of(i)];
        block.1 += 1.0;
        for ((t, r), block) in t.into_iter().zip(r).zip(&mut block.0) {
            let (t, r) = (f64::from(t), f64::from(r));
            let error = t - r;
            sum_test += t;
            sum_reference += r;
            squares += error * error;
            relative += error * error / (r * r + RELMSE_FLOOR);
            *block += error;
            errors.push(error.abs());
        }
    }
    let values = errors.len() as f64;
    let (mean_test, mean_reference) = (sum_test / values, sum_reference / values);
    // (sum/n)² · n for each block: the square of its mean error, weighed by its pixels.
    let block_squares: f64 =
        blocks.iter().filter(|b| b.1 > 0.0).map(|(sums, n)| sums.iter().map(|s| s * s / n).sum::<f64>()).sum();
    let percent = |absolute: f64| if absolute == 0.0 { 0.0 } else { 100.0 * absolute / mean_reference };
    if mean_reference == 0.0 && squares > 0.0 {
        let message = "the reference's mean is 0, so no error can be given relative to it";
        return Err(Diagnostic::error(message).help("compare with a reference that isn't black").into());
    }
    Ok(Metrics {
        pixels: errors.len() as u64 / 3,
        mean_test,
        mean_reference,
        rmse_percent: percent((squares / values).sqrt()),
        bias_percent: percent(mean_test - mean_reference),
        relmse: relative / values,
        block_rmse_percent: percent((block_squares / values).sqrt()),
        max_error: errors.iter().copied().fold(0.0, f64::max),
        p95_error: percentile(&mut errors, 0.95),
    })
}

/// What [`compare`] asks of its arguments.
pub(super) fn check(test: &Image, reference: &Image, mask: Option<&[bool]>) -> Checked<()> {
    check_same_size(("the test image", test), ("the reference", reference))?;
    let mut faults = vec![];
    if let Some(mask) = mask {
        if mask.len() != test.pixel_count() {
            let message = format!("the mask holds {} values for {} pixels", mask.len(), test.pixel_count());
            return Err(Diagnostic::error(message).into());
        }
        if !mask.contains(&true) {
            faults.push(Diagnostic::error("the mask keeps no pixel").help("use a narrower mask"));
        }
    }
    let bad = [("the test image", test.non_finite(None)), ("the reference", reference.non_finite(mask))];
    for (what, found) in bad {
        if let Some(found) = found {
            faults.push(Diagnostic::error(format!("{what} holds {found}")));
        }
    }
    if faults.is_empty() { Ok(()) } else { Err(Faults(faults)) }
}

pub(super) fn kept(mask: Option<&[bool]>, pixel: usize) -> bool {
    mask.is_none_or(|m| m.get(pixel) == Some(&true))
}

/// The nearest rank: the smallest value that a share `p` of all values doesn't exceed. Reorders; 0 for no values.
fn percentile(values: &mut [f64], p: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((p * values.len() as f64).ceil() as usize).clamp(1, values.len());
    *values.select_nth_unstable_by(rank - 1, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{a} is not {b}");
    }

    #[test]
    fn values_worked_out_by_hand() {
        let reference = Image::new(2, 1, 3, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
        let test = Image::new(2, 1, 3, vec![1.5, 2.0, 3.0, 3.0, 5.0, 8.0]).unwrap();
        let m = compare(&test, &reference, None).unwrap();
        assert_eq!(m.pixels, 2);
        near(m.mean_reference, 3.5);
        near(m.mean_test, 22.5 / 6.0);
        // Errors 0.5, 0, 0, −1, 0, 2: squares sum to 5.25.
        near(m.rmse_percent, 100.0 * (5.25f64 / 6.0).sqrt() / 3.5);
        near(m.bias_percent, 100.0 * (22.5 / 21.0 - 1.0));
        near(m.relmse, (0.25 / 1.01 + 1.0 / 16.01 + 4.0 / 36.01) / 6.0);
        // One block: mean errors −0.25, 0 and 1 in the channels.
        near(m.block_rmse_percent, 100.0 * (1.0625f64 / 3.0).sqrt() / 3.5);
        near(m.p95_error, 2.0);
        near(m.max_error, 2.0);
    }

    #[test]
    fn noise_averages_out_in_blocks_and_a_level_does_not() {
        let checker = |i: u32| if (i % 16 + i / 16).is_multiple_of(2) { 0.9 } else { 1.1 };
        let reference = Image::filled(16, 16, &[1.0]).unwrap();
        let noisy = Image::new(16, 16, 1, (0..256).map(checker).collect()).unwrap();
        let m = compare(&noisy, &reference, None).unwrap();
        assert!((m.rmse_percent - 10.0).abs() < 1e-4 && m.block_rmse_percent < 1e-4, "{m:?}");
        let m = compare(&Image::filled(16, 16, &[0.75]).unwrap(), &reference, None).unwrap();
        near(m.rmse_percent, 25.0);
        near(m.block_rmse_percent, 25.0);
        near(m.bias_percent, -25.0);
    }

    #[test]
    fn partial_blocks_and_layers_count_by_their_pixels() {
        // 9 × 1 pixels in two layers: blocks of 8, 1, 8 and 1 pixels; the last is wrong by 1.
        let reference = Image::array(9, 1, 2, 1, vec![1.0; 18]).unwrap();
        let mut test = reference.clone();
        test.data[17] = 2.0;
        near(compare(&test, &reference, None).unwrap().block_rmse_percent, 100.0 * (1.0f64 / 18.0).sqrt());
    }

    #[test]
    fn alpha_is_ignored_and_grey_is_widened() {
        let rgba = Image::filled(2, 2, &[0.5, 0.5, 0.5, 0.0]).unwrap();
        let grey = Image::filled(2, 2, &[0.5]).unwrap();
        let m = compare(&rgba, &grey, None).unwrap();
        assert_eq!((m.rmse_percent, m.max_error, m.mean_test), (0.0, 0.0, 0.5));
    }

    #[test]
    fn the_mask_leaves_pixels_out() {
        let reference = Image::new(2, 1, 1, vec![1.0, f32::NAN]).unwrap();
        let test = Image::new(2, 1, 1, vec![1.5, 9.0]).unwrap();
        let m = compare(&test, &reference, Some(&[true, false])).unwrap();
        assert_eq!((m.pixels, m.rmse_percent, m.max_error), (1, 50.0, 0.5));
        assert!(compare(&test, &reference, Some(&[false, false])).is_err());
        assert!(compare(&test, &reference, Some(&[true])).is_err());
    }

    #[test]
    fn a_nan_is_a_fault_that_says_where() {
        let reference = Image::filled(4, 4, &[1.0; 3]).unwrap();
        let mut test = reference.clone();
        test.pixel_mut(0, 3, 2).unwrap()[1] = f32::NAN;
        let faults = compare(&test, &reference, None).unwrap_err();
        assert_eq!(
            faults.0[0].message,
            "the test image holds 1 pixel(s) with a NaN or an infinity, the first at (3, 2)"
        );
        let mask: Vec<bool> = (0..16).map(|i| i < 4).collect();
        assert!(compare(&test, &reference, Some(&mask)).is_err(), "even where the mask drops it");
    }

    #[test]
    fn unequal_sizes_are_a_fault() {
        let (a, b) = (Image::filled(4, 4, &[1.0]).unwrap(), Image::filled(4, 3, &[1.0]).unwrap());
        let faults = compare(&a, &b, None).unwrap_err();
        assert_eq!(faults.0[0].message, "the test image is 4 × 4, but the reference is 4 × 3");
    }

    #[test]
    fn black_equals_black_and_nothing_is_relative_to_it() {
        let black = Image::filled(2, 2, &[0.0; 3]).unwrap();
        let m = compare(&black, &black, None).unwrap();
        assert_eq!((m.rmse_percent, m.bias_percent, m.relmse), (0.0, 0.0, 0.0));
        assert!(compare(&Image::filled(2, 2, &[0.1; 3]).unwrap(), &black, None).is_err());
    }

    #[test]
    fn the_percentile_is_a_nearest_rank() {
        let mut values: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        assert_eq!(percentile(&mut values, 0.95), 95.0);
        assert_eq!(percentile(&mut [3.0], 0.95), 3.0);
    }

    #[test]
    fn metrics_survive_json() {
        let a = Image::filled(2, 2, &[0.3]).unwrap();
        let m = compare(&a, &Image::filled(2, 2, &[0.7]).unwrap(), None).unwrap();
        let text = serde_json::to_string(&m).unwrap();
        assert_eq!(serde_json::from_str::<Metrics>(&text).unwrap(), m);
    }
}
