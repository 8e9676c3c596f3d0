//! The transfer function of sRGB (IEC 61966-2-1), from linear values to codes and back, both from 0 to 1.

use std::sync::LazyLock;

/// The code of a linear value.
pub fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The linear value of a code.
pub fn decode(code: f32) -> f32 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

/// The code of 8 bits that is nearest to a linear value: [`encode`] and rounding, by a table.
pub fn nearest(linear: f32) -> u8 {
    /// The linear values half-way between codes.
    static MIDDLES: LazyLock<[f32; 255]> = LazyLock::new(|| std::array::from_fn(|i| decode((i as f32 + 0.5) / 255.0)));
    MIDDLES.partition_point(|m| *m < linear) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_come_back() {
        for code in 0..=255u8 {
            let linear = decode(f32::from(code) / 255.0);
            assert_eq!(nearest(linear), code);
            assert!((encode(f64::from(linear)) * 255.0 - f64::from(code)).abs() < 1e-3, "{code}");
        }
        assert_eq!([nearest(-1.0), nearest(f32::NAN), nearest(2.0)], [0, 0, 255]);
    }

    #[test]
    fn the_table_rounds_as_the_function_does() {
        for i in 0..=65_535 {
            let linear = i as f32 / 65_535.0;
            let exact = encode(f64::from(linear)) * 255.0;
            assert!((f64::from(nearest(linear)) - exact).abs() < 0.5 + 1e-4, "{linear}: {exact}");
        }
    }
}
