//! Light from all around and infinitely far: what a ray sees that meets nothing.
//!
//! A square of texels stands for all directions, each texel for the same solid angle (Clarberg, "Fast Equal-Area
//! Mapping of the (Hemi)Sphere using SIMD", 2008): the middle of the square is up, its corners are down. Halved again
//! and again, down to one texel, it also says how much light comes from each part of the sky, which is what shaders
//! draw directions by.

use super::{Column, Table, pieces::Pieces};
use crate::parallel::each;
use glam::{UVec2, Vec2, Vec3};
use std::f32::consts::FRAC_PI_4;
use std::sync::Arc;

/// Light by direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// The table `environment`: all levels, that of one texel first, each row by row.
    table: Table,
    /// Texels along the finest square, a power of two.
    edge: u32,
}

/// Texels along the finest square at most: 22 MB with all levels.
pub const LARGEST_EDGE: u32 = 1024;

impl Environment {
    /// The same radiance from everywhere.
    pub fn constant(radiance: Vec3) -> Environment {
        Environment::of(1, vec![radiance])
    }

    /// `edge` by `edge` texels, each the mean of `side` by `side` directions; `edge` is rounded up to a power of two.
    pub fn from_fn(edge: u32, side: u32, radiance: impl Fn(Vec3) -> Vec3 + Sync) -> Environment {
        let edge = edge.clamp(1, LARGEST_EDGE).next_power_of_two();
        let across = (edge * side) as f32;
        let row = |y: usize| -> Vec<Vec3> {
            let texel = |x: u32| {
                let places = (0..side * side).map(|i| UVec2::new(x * side + i % side, y as u32 * side + i / side));
                let sum: Vec3 = places.map(|p| radiance(direction((p.as_vec2() + 0.5) / across))).sum();
                sum / (side * side) as f32
            };
            (0..edge).map(texel).collect()
        };
        Environment::of(edge, each(0..edge as usize, row).concat())
    }

    fn of(edge: u32, finest: Vec<Vec3>) -> Environment {
        let weights = weights(edge, &finest);
        let (mut levels, mut shares) = (vec![finest], vec![weights]);
        while let (Some(level), Some(share)) = (levels.last(), shares.last())
            && level.len() > 1
        {
            let halved = (halved(level), halved(share));
            levels.push(halved.0);
            shares.push(halved.1);
        }
        let radiance: Pieces<Vec3> = levels.into_iter().rev().flatten().collect();
        let weight: Pieces<f32> = shares.into_iter().rev().flatten().collect();
        Environment { table: table(radiance, weight), edge }
    }

    /// Texels along the finest square.
    pub fn edge(&self) -> u32 {
        self.edge
    }

    /// The mean radiance over all directions.
    pub fn mean(&self) -> Vec3 {
        match self.table.column("radiance") {
            Some(Column::Vec3(all)) => all.get(0).copied().unwrap_or_default(),
            _ => Vec3::ZERO,
        }
    }

    pub(super) fn table(&self) -> Table {
        self.table.clone()
    }

    /// The table of a scene without one.
    pub(super) fn nothing() -> Table {
        table(Pieces::default(), Pieces::default())
    }
}

fn table(radiance: Pieces<Vec3>, weight: Pieces<f32>) -> Table {
    let rows = radiance.len();
    let columns = Arc::new([("radiance", Column::Vec3(radiance)), ("weight", Column::Float(weight))]);
    Table { name: "environment", rows, columns, since: None }
}

/// What each texel is drawn by: the mean over it of the radiance that shaders find between the texels' centres, red,
/// green and blue summed. A texel beside a bright one is bright at that edge; drawn by its own radiance alone it would
/// be met too seldom.
fn weights(edge: u32, texels: &[Vec3]) -> Vec<f32> {
    // Of a line between two centres a texel has the half near its own, an eighth of it the other's.
    const SHARES: [f32; 3] = [0.125, 0.75, 0.125];
    let edge_i = edge as i32;
    let weight = |i: i32| {
        let neighbours = (0..9).map(|k| {
            let (dx, dy) = (k % 3 - 1, k / 3 - 1);
            let at = wrapped(i % edge_i + dx, i / edge_i + dy, edge_i);
            SHARES[(dx + 1) as usize] * SHARES[(dy + 1) as usize] * texels[at].element_sum()
        });
        neighbours.sum()
    };
    (0..edge_i * edge_i).map(weight).collect()
}

/// Number of the texel beside the square's edge, at most one away: edges are folded in their middles.
fn wrapped(x: i32, y: i32, edge: i32) -> usize {
    let fold = |a: i32, b: i32| match a {
        a if a < 0 => (-1 - a, edge - 1 - b),
        a if a >= edge => (2 * edge - 1 - a, edge - 1 - b),
        a => (a, b),
    };
    let (x, y) = fold(x, y);
    let (y, x) = fold(y, x);
    (y * edge + x) as usize
}

/// The means of each two by two of a square with an even edge.
fn halved<T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>>(level: &[T]) -> Vec<T> {
    let edge = level.len().isqrt();
    let half = edge / 2;
    let mean = |i: usize| {
        let first = 2 * (i / half) * edge + 2 * (i % half);
        (level[first] + level[first + 1] + level[first + edge] + level[first + edge + 1]) * 0.25
    };
    (0..half * half).map(mean).collect()
}

/// The unit direction of a place in the unit square.
fn direction(place: Vec2) -> Vec3 {
    let p = 2.0 * place - 1.0;
    let size = p.abs();
    let below = 1.0 - (size.x + size.y);
    let r = 1.0 - below.abs();
    let turn = if r > 0.0 { FRAC_PI_4 * ((size.y - size.x) / r + 1.0) } else { 0.0 };
    let height = (1.0 - r * r).copysign(below);
    let across = r * (2.0 - r * r).sqrt();
    Vec3::new((across * turn.cos()).copysign(p.x), height, (across * turn.sin()).copysign(p.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(e: &Environment) -> Vec<Vec3> {
        match e.table().column("radiance") {
            Some(Column::Vec3(all)) => all.iter().copied().collect(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn texels_stand_for_equal_solid_angles() {
        // The mean of 1 over all directions is 1, that of y² a third, that of y, x and z nothing.
        let e = Environment::from_fn(32, 2, |d| Vec3::new(d.y * d.y, d.y + 2.0, d.x * d.z + d.x + 3.0));
        let mean = e.mean();
        assert!((mean - Vec3::new(1.0 / 3.0, 2.0, 3.0)).abs().max_element() < 1e-3, "{mean}");
        // Directions of a texel's middle lie in the horizon itself.
        let above = |y: f32| if y.abs() < 1e-5 { 0.5 } else { f32::from(y > 0.0) };
        let up = Environment::from_fn(64, 2, |d| Vec3::splat(above(d.y))).mean();
        assert!((up.x - 0.5).abs() < 1e-3, "{up}");
    }

    #[test]
    fn directions_are_units_and_as_the_square_is_laid_out() {
        for (place, expected) in [
            (Vec2::splat(0.5), Vec3::Y),
            (Vec2::new(1.0, 0.5), Vec3::X),
            (Vec2::new(0.5, 0.0), Vec3::NEG_Z),
            (Vec2::new(0.0, 1.0), Vec3::NEG_Y),
        ] {
            assert!((direction(place) - expected).length() < 1e-6, "{place}: {}", direction(place));
        }
        for i in 0..400 {
            let d = direction(Vec2::new((i % 20) as f32 + 0.5, (i / 20) as f32 + 0.5) / 20.0);
            assert!((d.length() - 1.0).abs() < 1e-6, "{d}");
        }
    }

    #[test]
    fn edges_are_folded_where_the_square_s_are_one() {
        let edge = 16;
        for i in 0..edge {
            // Texels across an edge are nearer in direction than two texels' width.
            let at = |x: i32, y: i32| direction((Vec2::new(x as f32, y as f32) + 0.5) / edge as f32);
            for (x, y, dx, dy) in [(0, i, -1, 0), (edge - 1, i, 1, 0), (i, 0, 0, -1), (i, edge - 1, 0, 1)] {
                let other = wrapped(x + dx, y + dy, edge) as i32;
                let apart = at(x, y).angle_between(at(other % edge, other / edge));
                assert!(apart < 0.4, "{x} {y}: {apart}");
            }
        }
    }

    #[test]
    fn every_level_holds_the_means_of_the_next() {
        let e = Environment::from_fn(8, 1, |d| d.abs());
        let all = column(&e);
        assert_eq!(all.len(), 1 + 4 + 16 + 64);
        let finest = &all[21..];
        let mean: Vec3 = finest.iter().sum::<Vec3>() / 64.0;
        assert!((all[0] - mean).length() < 1e-5);
        assert_eq!(column(&Environment::constant(Vec3::X)), [Vec3::X]);
        let Some(Column::Float(weight)) = e.table().column("weight").cloned() else { panic!() };
        assert!((weight[0] - mean.element_sum()).abs() < 1e-4, "weights have the mean of the radiance");
    }
}
