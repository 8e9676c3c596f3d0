//! Masks: which pixels two renderers can be compared in. A value for each pixel, `true` for those to keep.
//!
//! At the edge of a surface or of a shadow two correct renderers may put a pixel on different sides, so that the error
//! there says how they sample and not how they light.

use super::{Image, check_same_size};
use crate::diag::{Checked, Diagnostic};

/// Unit normals whose cosine is below this (18°) lie on different surfaces.
const NORMAL_COSINE: f32 = 0.95;
/// Depths that differ by more than this share of the smaller lie on different surfaces.
const DEPTH_SHARE: f32 = 0.1;
/// Albedos that differ by more than this in a channel are different materials.
const ALBEDO_STEP: f32 = 0.02;

/// Drops a pixel when it differs from one of its eight neighbours in normal (unit vectors, cosine below 0.95), depth
/// (by more than 10 %) or albedo (by more than 0.02 in a channel), and the image's border of one pixel, whose
/// neighbours aren't known.
///
/// # Errors
/// A fault when the sizes differ.
pub fn edge_mask(normal: &Image, depth: &Image, albedo: &Image) -> Checked<Vec<bool>> {
    check_same_size(("the normals", normal), ("the depths", depth))?;
    check_same_size(("the normals", normal), ("the albedos", albedo))?;
    let normals: Vec<[f32; 3]> = normal.rgb().collect();
    let depths: Vec<f32> = depth.rgb().map(|p| p[0]).collect();
    let albedos: Vec<[f32; 3]> = albedo.rgb().collect();
    let same = |a: usize, b: usize| {
        let cosine: f32 = normals[a].iter().zip(normals[b]).map(|(a, b)| a * b).sum();
        let (near, far) = (depths[a].abs().min(depths[b].abs()), (depths[a] - depths[b]).abs());
        // Equality comes first: the background may have normals of 0 and depths of infinity.
        (normals[a] == normals[b] || cosine >= NORMAL_COSINE)
            && (depths[a] == depths[b] || far <= DEPTH_SHARE * near)
            && albedos[a].iter().zip(albedos[b]).all(|(a, b)| (a - b).abs() <= ALBEDO_STEP)
    };
    Ok(keep_where_neighbours(normal, true, same))
}

/// Drops a pixel when its brightness (the mean of red, green and blue) and that of one of its eight neighbours differ
/// by more than `threshold`, from 0 to 1, as a share of the larger: the edges of shadows, mostly.
///
/// # Errors
/// A fault when the image contradicts itself.
pub fn gradient_mask(reference: &Image, threshold: f32) -> Checked<Vec<bool>> {
    reference.check("the reference")?;
    let values: Vec<f32> = reference.rgb().map(|p| p.iter().sum::<f32>() / 3.0).collect();
    let same = |a: usize, b: usize| {
        let (a, b) = (values[a], values[b]);
        a == b || (a - b).abs() <= threshold * a.abs().max(b.abs())
    };
    Ok(keep_where_neighbours(reference, false, same))
}

/// Drops also what lies within `pixels` of a dropped pixel, along rows, columns and both, inside each layer.
///
/// # Errors
/// A fault when the mask isn't made of whole layers of `width × height` pixels.
pub fn grow(mask: &[bool], width: u32, height: u32, pixels: u32) -> Checked<Vec<bool>> {
    let (width, height, reach) = (width as usize, height as usize, pixels as usize);
    let layer = width.checked_mul(height).filter(|layer| *layer > 0 && mask.len().is_multiple_of(*layer));
    let Some(layer) = layer else {
        let message = format!("a mask of {} values isn't made of layers of {width} × {height} pixels", mask.len());
        return Err(Diagnostic::error(message).into());
    };
    let mut grown = mask.to_vec();
    for layer in grown.chunks_mut(layer) {
        // A square is a row of columns: first along the rows, then along the columns.
        for y in 0..height {
            spread(layer, y * width, 1, width, reach);
        }
        for x in 0..width {
            spread(layer, x, width, height, reach);
        }
    }
    Ok(grown)
}

/// Widens what is dropped along one line of `count` values, `stride` apart.
fn spread(mask: &mut [bool], start: usize, stride: usize, count: usize, reach: usize) {
    let dropped: Vec<usize> = (0..count).filter(|i| !mask[start + i * stride]).collect();
    let mut next = 0;
    for center in dropped {
        let end = center.saturating_add(reach).min(count - 1);
        for i in center.saturating_sub(reach).max(next)..=end {
            mask[start + i * stride] = false;
        }
        next = end + 1;
    }
}

/// Both masks at once: keeps what both keep. A missing value keeps nothing.
pub fn both(a: &[bool], b: &[bool]) -> Vec<bool> {
    a.iter().zip(b).map(|(a, b)| *a && *b).collect()
}

/// Keeps a pixel when `same` holds for it and each of its eight neighbours, given as indices of pixels.
fn keep_where_neighbours(size: &Image, drop_border: bool, same: impl Fn(usize, usize) -> bool) -> Vec<bool> {
    let (width, height) = (size.width as usize, size.height as usize);
    let keep = |i: usize| {
        let (x, y, layer) = (i % width, i / width % height, i / width / height);
        if drop_border && (x == 0 || y == 0 || x + 1 == width || y + 1 == height) {
            return false;
        }
        let columns = x.saturating_sub(1)..=(x + 1).min(width - 1);
        (y.saturating_sub(1)..=(y + 1).min(height - 1))
            .all(|v| columns.clone().all(|u| same(i, (layer * height + v) * width + u)))
    };
    (0..size.pixel_count()).map(keep).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One character a pixel, `#` for what is kept.
    fn shown(mask: &[bool], width: usize) -> Vec<String> {
        mask.chunks(width).map(|row| row.iter().map(|k| if *k { '#' } else { '.' }).collect()).collect()
    }

    fn flat(pixel: &[f32]) -> Image {
        Image::filled(7, 5, pixel).unwrap()
    }

    #[test]
    fn edges_of_each_kind_are_dropped_with_the_border() {
        let (normal, depth, albedo) = (flat(&[0.0, 0.0, 1.0]), flat(&[2.0]), flat(&[0.5; 3]));
        let edges = |n: &Image, d: &Image, a: &Image| shown(&edge_mask(n, d, a).unwrap(), 7);
        let inside = [".......", ".#####.", ".#####.", ".#####.", "......."];
        assert_eq!(edges(&normal, &depth, &albedo), inside);
        // One pixel that differs drops itself and its eight neighbours.
        let outline = [".......", ".##....", ".##....", ".##....", "......."];
        let change = |image: &Image, pixel: &[f32]| {
            let mut changed = image.clone();
            changed.pixel_mut(0, 4, 2).unwrap().copy_from_slice(pixel);
            changed
        };
        assert_eq!(edges(&change(&normal, &[0.0, 0.6, 0.8]), &depth, &albedo), outline);
        assert_eq!(edges(&normal, &change(&depth, &[2.3]), &albedo), outline);
        assert_eq!(edges(&normal, &depth, &change(&albedo, &[0.5, 0.53, 0.5])), outline);
        // Differences within the thresholds.
        assert_eq!(edges(&change(&normal, &[0.0, 0.28, 0.96]), &depth, &albedo), inside);
        assert_eq!(edges(&normal, &change(&depth, &[2.1]), &albedo), inside);
        assert_eq!(edges(&normal, &depth, &change(&albedo, &[0.5, 0.51, 0.5])), inside);
        assert_eq!(edges(&normal, &change(&depth, &[f32::NAN]), &albedo), outline);
    }

    #[test]
    fn the_background_is_no_edge_but_its_outline_is() {
        let (mut normal, mut depth) = (flat(&[0.0; 3]), flat(&[f32::INFINITY]));
        let albedo = flat(&[0.0; 3]);
        assert_eq!(edge_mask(&normal, &depth, &albedo).unwrap().iter().filter(|k| **k).count(), 15);
        normal.pixel_mut(0, 5, 2).unwrap().copy_from_slice(&[0.0, 0.0, 1.0]);
        depth.pixel_mut(0, 5, 2).unwrap()[0] = 3.0;
        let mask = edge_mask(&normal, &depth, &albedo).unwrap();
        assert_eq!(shown(&mask, 7), [".......", ".###...", ".###...", ".###...", "......."]);
    }
    #[test]
    fn steep_gradients_are_dropped_on_both_sides() {
        let step = Image::new(4, 1, 1, vec![1.0, 1.0, 0.5, 0.5]).unwrap();
        assert_eq!(gradient_mask(&step, 0.4).unwrap(), [true, false, false, true]);
        assert_eq!(gradient_mask(&step, 0.6).unwrap(), [true; 4]);
    }

    #[test]
    fn masks_grow_by_squares_within_a_layer() {
        let mut mask = vec![true; 2 * 35];
        mask[3 * 7 + 1] = false;
        let grown = grow(&mask, 7, 5, 1).unwrap();
        assert_eq!(
            shown(&grown, 7),
            [
                "#######", "#######", "...####", "...####", "...####", // the first layer
                "#######", "#######", "#######", "#######", "#######",
            ]
        );
        assert_eq!(grow(&mask, 7, 5, 0).unwrap(), mask);
        assert_eq!(shown(&grow(&mask, 7, 5, u32::MAX).unwrap()[..35], 7), ["......."; 5]);
        assert!(grow(&mask, 7, 6, 1).is_err());
        assert!(grow(&mask, 0, 0, 1).is_err());
    }

    #[test]
    fn neighbouring_drops_merge() {
        let mask = [true, false, true, false, true, true, true, true];
        assert_eq!(grow(&mask, 8, 1, 2).unwrap(), [false, false, false, false, false, false, true, true]);
    }

    #[test]
    fn unequal_sizes_are_a_fault() {
        let other = Image::filled(7, 4, &[1.0]).unwrap();
        assert!(edge_mask(&flat(&[0.0, 0.0, 1.0]), &other, &flat(&[0.5; 3])).is_err());
        assert!(edge_mask(&flat(&[0.0, 0.0, 1.0]), &flat(&[1.0]), &other).is_err());
    }
}
