//! Images of half the size, down to one texel.

use super::Image;

/// Half as large, rounded down: each texel the mean over the part of its layer that it covers.
pub fn halved(image: &Image) -> Image {
    let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
    let (across, down) = (spans(image.width, width), spans(image.height, height));
    let channels = image.channels as usize;
    let mut data = Vec::with_capacity(width as usize * height as usize * image.layers as usize * channels);
    for layer in 0..image.layers {
        for (top, rows) in &down {
            for (left, columns) in &across {
                let mut sum = [0.0f32; 4];
                for (y, high) in (*top..).zip(rows).filter(|(_, share)| **share > 0.0) {
                    for (x, wide) in (*left..).zip(columns).filter(|(_, share)| **share > 0.0) {
                        let texel = image.pixel(layer, x as u32, y as u32).unwrap_or(&[]);
                        sum.iter_mut().zip(texel).for_each(|(sum, v)| *sum += high * wide * v);
                    }
                }
                data.extend(&sum[..channels]);
            }
        }
    }
    Image { width, height, data, ..*image }
}

/// For each texel of an axis of `to`, the first of `from` that it covers, and its shares of that and the next two.
pub fn spans(from: u32, to: u32) -> Vec<(usize, [f32; 3])> {
    let scale = f64::from(from) / f64::from(to);
    let each = |i: u32| {
        let (start, end) = (f64::from(i) * scale, f64::from(i + 1) * scale);
        let first = (start + 1e-9).floor();
        let share = |n: f64| {
            let (low, high) = ((first + n).max(start), (first + n + 1.0).min(end).min(f64::from(from)));
            // What rounding leaves beyond the last texel is nothing.
            (((high - low) / scale).max(0.0) as f32).max(0.0)
        };
        let shares = [share(0.0), share(1.0), share(2.0)].map(|s| if s < 1e-6 { 0.0 } else { s });
        (first as usize, shares)
    };
    (0..to).map(each).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_texel_of_an_odd_image_counts_alike() {
        for (from, to) in [(3, 1), (5, 2), (7, 3), (1001, 500), (8, 4), (1, 1)] {
            let spans = spans(from, to);
            let mut shares = vec![0.0; from as usize];
            for (first, some) in &spans {
                assert!((some.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{from} to {to}: {some:?}");
                (*first..).zip(some).filter(|(_, s)| **s > 0.0).for_each(|(i, s)| shares[i] += s);
            }
            let each = to as f32 / from as f32;
            assert!(shares.iter().all(|s| (s - each).abs() < 1e-4), "{from} to {to}: {shares:?}");
        }
    }

    #[test]
    fn layers_are_halved_apart() {
        let image = Image::array(3, 1, 2, 1, vec![1.0, 2.0, 6.0, 0.0, 0.0, 3.0]).unwrap();
        assert_eq!(halved(&image).data, [3.0, 1.0]);
    }
}
