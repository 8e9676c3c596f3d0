//! An output against its references, in numbers.

use super::references::{LoadedReference, ReferenceSet};
use lightgraph::internals::image::flip::flip;
use lightgraph::internals::image::metrics::{Metrics, compare};
use lightgraph::internals::parallel;
use lightgraph::{Checked, Diagnostic, Image};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How far an output is from a reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Score {
    pub output: String,
    /// Parameters under which the reference applies, as `bounces=1`; empty: always.
    pub only_when: Vec<(String, String)>,
    /// Whose the reference is.
    pub origin: String,
    /// Standard error of the reference in percent of its mean, where it is known.
    pub stderr_percent: Option<f64>,
    /// Over all pixels that have a reference.
    pub metrics: Metrics,
    /// What of `rmse_percent` is no error of 8 × 8 means: `√(rmse² − block rmse²)`. Noise, and detail finer than a
    /// block.
    pub fine_percent: f64,
    /// Mean HDR-FLIP error, 0 to 1.
    pub flip: Option<f64>,
}

/// Compares outputs with all references that apply to a setting. Outputs that aren't there are skipped, and so are
/// black references, to which nothing is relative.
///
/// # Errors
/// As [`compare`]: an output that holds a NaN, say.
pub fn score(
    images: &BTreeMap<String, Image>,
    references: &ReferenceSet,
    params: &BTreeMap<String, String>,
) -> Checked<Vec<Score>> {
    let applying = references.all.iter().filter(|r| r.applies(params) && mean(&r.image) != 0.0);
    let pairs: Vec<(&Image, &LoadedReference)> = applying.filter_map(|r| Some((images.get(&r.output)?, r))).collect();
    let one = |i: usize| one(pairs[i].0, pairs[i].1, references.answered.as_deref());
    parallel::each(0..pairs.len(), one).into_iter().collect()
}

fn one(image: &Image, reference: &LoadedReference, answered: Option<&[bool]>) -> Checked<Score> {
    let metrics = compare(image, &reference.image, answered)?;
    let (rmse, block) = (metrics.rmse_percent, metrics.block_rmse_percent);
    Ok(Score {
        output: reference.output.clone(),
        only_when: reference.only_when.clone(),
        origin: reference.origin.clone(),
        stderr_percent: reference.stderr_percent,
        metrics,
        fine_percent: (rmse * rmse - block * block).max(0.0).sqrt(),
        flip: Some(flip(image, &reference.image, answered)?),
    })
}

/// Mean over pixels and channels.
pub fn mean(image: &Image) -> f64 {
    image.rgb().flatten().map(f64::from).sum::<f64>() / (3 * image.pixel_count().max(1)) as f64
}

/// Root mean square change from one image to another, in percent of the first's mean; 0 between two black ones.
///
/// # Errors
/// Images of different sizes.
pub fn change(before: &Image, after: &Image) -> Checked<f64> {
    if (before.width, before.height, before.layers) != (after.width, after.height, after.layers) {
        return Err(Diagnostic::error("the images before and after a change differ in size").into());
    }
    let squares: f64 = before.rgb().flatten().zip(after.rgb().flatten()).map(|(a, b)| f64::from(b - a).powi(2)).sum();
    let rms = (squares / (3 * before.pixel_count().max(1)) as f64).sqrt();
    Ok(if rms == 0.0 { 0.0 } else { 100.0 * rms / mean(before) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_relative_to_the_mean_before() {
        let image = |v: f32| Image::filled(4, 2, &[v; 3]).unwrap();
        assert!((change(&image(0.5), &image(0.75)).unwrap() - 50.0).abs() < 1e-9);
        assert_eq!(change(&image(0.0), &image(0.0)), Ok(0.0));
        assert!(change(&image(1.0), &Image::filled(1, 1, &[1.0]).unwrap()).is_err());
    }

    #[test]
    fn a_wrong_level_is_structural_and_a_checkerboard_is_fine() {
        let checker: Vec<f32> = (0..256u32).map(|i| if (i % 16 + i / 16) % 2 == 0 { 0.9 } else { 1.1 }).collect();
        let images = BTreeMap::from([
            ("level".to_string(), Image::filled(16, 16, &[0.9]).unwrap()),
            ("noise".to_string(), Image::new(16, 16, 1, checker).unwrap()),
        ]);
        let reference = |output: &str| LoadedReference {
            output: output.into(),
            only_when: vec![],
            image: Image::filled(16, 16, &[1.0]).unwrap(),
            origin: "exact".into(),
            stderr_percent: None,
        };
        let all = vec![reference("level"), reference("noise"), reference("absent")];
        let scores = score(&images, &ReferenceSet { all, ..ReferenceSet::default() }, &BTreeMap::new()).unwrap();
        assert_eq!(scores.len(), 2);
        assert!(scores[0].fine_percent < 1e-3 && (scores[0].metrics.block_rmse_percent - 10.0).abs() < 1e-3);
        assert!(scores[1].metrics.block_rmse_percent < 1e-3 && (scores[1].fine_percent - 10.0).abs() < 1e-3);
    }
}
