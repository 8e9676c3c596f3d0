//! A uniform grid of probes in a box, and trilinear interpolation between them.

use glam::{DVec3, UVec3};

/// Probes in a box. Along each axis probe i of n stands at `min + (i + inset)/(n − 1 + 2·inset)·(max − min)`:
/// an inset of 0.5 puts probes at the centres of n equal cells, 0 puts the outer ones on the box. A single probe
/// stands in the middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Probes along x, y, z; each at least 1.
    pub counts: UVec3,
    pub min: DVec3,
    pub max: DVec3,
    /// Distance of the outer probes from the box, in distances between probes.
    pub inset: f64,
}

impl Grid {
    /// Where the probe with these coordinates stands.
    pub fn position(&self, probe: UVec3) -> DVec3 {
        let axis = |i: u32, n: u32| {
            if n <= 1 { 0.5 } else { (f64::from(i) + self.inset) / self.span(n) }
        };
        let share =
            DVec3::new(axis(probe.x, self.counts.x), axis(probe.y, self.counts.y), axis(probe.z, self.counts.z));
        self.min + share * (self.max - self.min)
    }

    /// Place of a probe in an array: x fastest, then y, then z.
    pub fn index(&self, probe: UVec3) -> usize {
        let [x, y, z] = probe.to_array().map(|v| v as usize);
        let [nx, ny, _] = self.counts.to_array().map(|v| v as usize);
        (z * ny + y) * nx + x
    }

    /// The eight probes round a point and their shares, which sum to 1. Outside the probes the nearest cell's face
    /// counts. A probe may occur more than once where an axis has a single one.
    pub fn neighbours(&self, point: DVec3) -> [(UVec3, f64); 8] {
        let extent = (self.max - self.min).max(DVec3::splat(f64::MIN_POSITIVE));
        let share = (point - self.min) / extent;
        let axis = |t: f64, n: u32| {
            let last = n.max(1) - 1;
            let at = (t * self.span(n) - self.inset).clamp(0.0, f64::from(last));
            let base = (at as u32).min(last.max(1) - 1);
            (base, at - f64::from(base), last)
        };
        let axes = [axis(share.x, self.counts.x), axis(share.y, self.counts.y), axis(share.z, self.counts.z)];
        std::array::from_fn(|corner| {
            let mut weight = 1.0;
            let coordinate = |k: usize, weight: &mut f64| {
                let (base, fraction, last) = axes[k];
                let far = corner >> k & 1 == 1;
                *weight *= if far { fraction } else { 1.0 - fraction };
                (base + u32::from(far)).min(last)
            };
            let probe = UVec3::new(coordinate(0, &mut weight), coordinate(1, &mut weight), coordinate(2, &mut weight));
            (probe, weight)
        })
    }

    /// [`Grid::neighbours`] of a surface point with this unit normal, each share multiplied by the cosine between the
    /// normal and the direction to the probe, and by how open the probe is: `open` gives the share of directions in
    /// which it doesn't see the backs of surfaces, and half or less counts as 0. Each factor is at least `behind`
    /// (above 0); the shares sum to 1 again. With `behind` 1 nothing changes; near 0, probes behind the surface or
    /// inside solids hardly count.
    pub fn facing(&self, point: DVec3, normal: DVec3, behind: f64, open: impl Fn(UVec3) -> f64) -> [(UVec3, f64); 8] {
        let weighed = self.neighbours(point).map(|(probe, share)| {
            let cosine = (self.position(probe) - point).normalize_or_zero().dot(normal);
            (probe, share * cosine.max(behind) * (2.0 * open(probe) - 1.0).max(behind))
        });
        let sum: f64 = weighed.iter().map(|w| w.1).sum();
        weighed.map(|(probe, share)| (probe, share / sum))
    }

    /// Trilinear interpolation of one value a probe, in the order of [`Grid::index`]; missing values count as 0.
    pub fn interpolate(&self, values: &[f64], point: DVec3) -> f64 {
        let value = |probe| values.get(self.index(probe)).copied().unwrap_or(0.0);
        self.neighbours(point).into_iter().map(|(probe, weight)| weight * value(probe)).sum()
    }

    /// The box's edge in distances between probes.
    fn span(&self, n: u32) -> f64 {
        f64::from(n.max(1) - 1) + 2.0 * self.inset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(counts: [u32; 3], inset: f64) -> Grid {
        Grid { counts: counts.into(), min: DVec3::new(-1.0, 0.0, -1.0), max: DVec3::new(1.0, 2.0, 3.0), inset }
    }

    fn probes(grid: &Grid) -> Vec<UVec3> {
        let n = grid.counts;
        (0..n.x * n.y * n.z).map(|i| UVec3::new(i % n.x, i / n.x % n.y, i / (n.x * n.y))).collect()
    }

    #[test]
    fn half_an_inset_centres_probes_in_cells() {
        let g = grid([4, 4, 4], 0.5);
        assert_eq!(g.position(UVec3::ZERO), DVec3::new(-0.75, 0.25, -0.5));
        assert_eq!(g.position(UVec3::splat(3)), DVec3::new(0.75, 1.75, 2.5));
        assert_eq!(grid([3, 3, 3], 0.0).position(UVec3::splat(2)), g.max);
        assert_eq!(grid([1, 1, 1], 0.0).position(UVec3::ZERO), DVec3::new(0.0, 1.0, 1.0));
    }

    #[test]
    fn interpolation_returns_the_probes_own_values() {
        for g in [grid([4, 3, 2], 0.5), grid([4, 3, 2], 0.0), grid([5, 1, 2], 0.0625)] {
            let all = probes(&g);
            let values: Vec<f64> = (0..all.len()).map(|i| (i * i) as f64).collect();
            for (i, probe) in all.into_iter().enumerate() {
                assert_eq!(g.index(probe), i);
                let got = g.interpolate(&values, g.position(probe));
                assert!((got - values[i]).abs() < 1e-9, "{g:?} {probe}: {got}");
            }
        }
    }

    #[test]
    fn interpolation_is_exact_for_linear_fields_and_clamps_outside() {
        let g = grid([4, 3, 5], 0.25);
        let field = |p: DVec3| 1.0 + 2.0 * p.x - 0.5 * p.y + 0.25 * p.z;
        let values: Vec<f64> = probes(&g).into_iter().map(|p| field(g.position(p))).collect();
        let inside = DVec3::new(0.31, 0.9, 1.7);
        assert!((g.interpolate(&values, inside) - field(inside)).abs() < 1e-12);
        let (low, high) = (g.position(UVec3::ZERO), g.position(g.counts - 1));
        for outside in [DVec3::splat(9.0), DVec3::splat(-9.0), DVec3::new(0.2, 5.0, 1.0)] {
            let nearest = outside.clamp(low, high);
            assert!((g.interpolate(&values, outside) - field(nearest)).abs() < 1e-12);
        }
    }

    #[test]
    fn probes_behind_a_surface_or_in_a_solid_hardly_count() {
        let g = grid([2, 2, 2], 0.0);
        let point = DVec3::new(0.1, 1.0, 1.0);
        let buried = |probe: UVec3| if probe == UVec3::ONE { 0.4 } else { 1.0 };
        for behind in [0.001, 0.02] {
            let shares = g.facing(point, DVec3::X, behind, buried);
            assert!((shares.iter().map(|s| s.1).sum::<f64>() - 1.0).abs() < 1e-12);
            for (probe, share) in shares {
                let counts = probe.x == 1 && probe != UVec3::ONE;
                assert!(if counts { share > 0.2 } else { share < behind }, "{probe}: {share}");
            }
        }
        assert_eq!(g.facing(point, DVec3::X, 1.0, |_| 1.0), g.neighbours(point));
    }

    #[test]
    fn shares_sum_to_one() {
        for g in [grid([1, 1, 1], 0.5), grid([2, 1, 7], 0.0), grid([1, 1, 1], 0.0)] {
            for p in [DVec3::ZERO, DVec3::splat(0.7), DVec3::splat(1e6)] {
                let sum: f64 = g.neighbours(p).iter().map(|n| n.1).sum();
                assert!((sum - 1.0).abs() < 1e-12);
            }
        }
    }
}
