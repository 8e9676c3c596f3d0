//! Draws that go over a part of what they drew: the texels of which something moved covers a centre, where it was or where it is. All
//! others keep what they hold. No device.

use super::sight::Covered;
use super::{Indirect, ResourceId};
use crate::scene::{Column, Table};
use glam::{Vec3, Vec4};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A part of a member's place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// From the place's corner: x, y, width, height.
    pub texels: [u32; 4],
    /// The same in clip space, by w: the lower x and y, the upper x and y.
    pub edges: [f32; 4],
}

/// By buffer of draws: of each member that goes over a part of its place, that part.
pub type Windows = BTreeMap<ResourceId, Arc<Vec<Option<Window>>>>;

/// The edges of a whole place.
pub const WHOLE: [f32; 4] = [-1.0, -1.0, 1.0, 1.0];

/// Squares along an edge of a layer that a draw makes, each of which is another one only where a window meets it.
pub const SQUARES: u32 = 32;

/// Layers of a draw of which squares are told apart, at most.
pub const MOST_LAYERS: usize = 16;

/// The share of a place above which all of it is drawn: to clear by drawing takes time too.
const MOST: f64 = 0.5;

impl Window {
    /// Round what boxes cover of a place of some width and height. `None`: that is most of it, or nothing.
    pub fn round(covered: impl IntoIterator<Item = Covered>, [width, height]: [u32; 2]) -> Option<Window> {
        let joined = |a: Covered, b: Covered| Covered {
            columns: a.columns.start.min(b.columns.start)..a.columns.end.max(b.columns.end),
            rows: a.rows.start.min(b.rows.start)..a.rows.end.max(b.rows.end),
            nearest: a.nearest.min(b.nearest),
        };
        let Covered { columns, rows, .. } = covered.into_iter().reduce(joined)?;
        let texels = [columns.start, rows.start, columns.end - columns.start, rows.end - rows.start];
        let all = f64::from(width) * f64::from(height);
        if f64::from(texels[2]) * f64::from(texels[3]) > MOST * all {
            return None;
        }
        let edge = |at: u32, count: u32| (f64::from(at) / f64::from(count) * 2.0 - 1.0) as f32;
        // Rows begin at the top.
        let edges =
            [edge(columns.start, width), -edge(rows.end, height), edge(columns.end, width), -edge(rows.start, height)];
        Some(Window { texels, edges })
    }
}

/// Whether a square of a layer of some size, of those numbered row by row, meets a part of it.
pub fn meets_square(window: &Window, square: u32, [width, height]: [u32; 2]) -> bool {
    let Window { texels: [x, y, columns, rows], .. } = *window;
    let meets = |first: u32, count: u32, size: u32, at: u32| {
        let of = |texel: u32| u64::from(texel) * u64::from(SQUARES) / u64::from(size.max(1));
        count > 0 && (of(first)..=of(first + count - 1)).contains(&u64::from(at))
    };
    meets(x, columns, width, square % SQUARES) && meets(y, rows, height, square / SQUARES)
}

/// Whether a draw that leaves out what can hide nothing from an eye leaves out all of it. Where some of it lies between what is drawn, it is
/// drawn as well, or not, as what else there is in sight has it.
pub fn clear_cut(indirect: &Indirect, clusters: &Table, eye: Vec4) -> bool {
    let column = |name: &str| clusters.column(name);
    let (Some(Column::Vec3(lower)), Some(Column::Vec3(upper)), Some(Column::Uint(sides))) =
        (column("lower"), column("upper"), column("sides"))
    else {
        return false;
    };
    let all = lower.iter().zip(upper.iter()).zip(sides.iter());
    let left_out: Vec<Option<bool>> =
        all.map(|((lower, upper), sides)| hides_nothing((*lower, *upper), *sides, eye)).collect();
    let [start, first, second] = indirect.clusters.map(|n| n as usize);
    let ends = [(start, first, indirect.first), (start + first, second, indirect.second)];
    // As the device deals them out to draws.
    let draws = ends.into_iter().flat_map(|(start, count, draws)| {
        let share = count.div_ceil(draws.max(1) as usize).max(1);
        (0..count).step_by(share).map(move |from| start + from..start + (from + share).min(count))
    });
    let clear = |of: &[Option<bool>]| {
        let rest = of.iter().skip_while(|out| **out == Some(true)).skip_while(|out| **out == Some(false));
        rest.clone().all(|out| *out == Some(true))
    };
    draws.into_iter().all(|draw| left_out.get(draw).is_some_and(clear))
}

/// Whether a cluster lies in a side of the box round everything, of which the eye is on the inner side: the twin of the function in
/// `cull.wgsl`. `None`: rounding may have it either way.
fn hides_nothing((lower, upper): (Vec3, Vec3), sides: u32, eye: Vec4) -> Option<bool> {
    let mut unsure = false;
    for side in (0..6).filter(|side| sides >> side & 1 == 1) {
        let axis = side % 3;
        let at = if side < 3 { upper[axis] } else { lower[axis] } * eye.w;
        let by = if side < 3 { eye[axis] - at } else { at - eye[axis] };
        if by.abs() > 1e-4 * eye[axis].abs().max(at.abs()) {
            if by > 0.0 {
                return Some(true);
            }
        } else {
            unsure = true;
        }
    }
    (!unsure).then_some(false)
}

/// The share of all that some members draw which they draw with these windows.
pub fn share(windows: &[Option<Window>], members: &[bool]) -> f64 {
    let part = |window: &Option<Window>| {
        window.map_or(1.0, |Window { edges: [x0, y0, x1, y1], .. }| f64::from((x1 - x0) * (y1 - y0)) / 4.0)
    };
    let parts: Vec<f64> = windows.iter().zip(members).filter(|(_, runs)| **runs).map(|(w, _)| part(w)).collect();
    if parts.is_empty() { 1.0 } else { parts.iter().sum::<f64>() / parts.len() as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covered(columns: std::ops::Range<u32>, rows: std::ops::Range<u32>) -> Covered {
        Covered { columns, rows, nearest: 0.0 }
    }

    #[test]
    fn a_window_goes_round_what_was_and_what_is() {
        let window = Window::round([covered(2..4, 1..2), covered(3..6, 1..3)], [16, 8]).unwrap();
        assert_eq!(window.texels, [2, 1, 4, 2]);
        assert_eq!(window.edges, [-0.75, 0.25, -0.25, 0.75]);
        let corner = Window::round([covered(0..2, 0..2)], [8, 8]).unwrap();
        assert_eq!(corner.edges, [-1.0, 0.5, -0.5, 1.0]);
        let all = [Some(window), None, Some(corner)];
        assert_eq!(share(&all, &[true, false, true]), 0.0625);
        assert_eq!(share(&all, &[false, true, false]), 1.0);
    }

    #[test]
    fn squares_meet_windows_by_their_texels() {
        let met = |window: Option<Window>, size: [u32; 2]| -> Vec<u32> {
            let window = window.expect("it is small");
            (0..SQUARES * SQUARES).filter(|square| meets_square(&window, *square, size)).collect()
        };
        // Two texels to a square.
        let size = [2 * SQUARES; 2];
        assert_eq!(met(Window::round([covered(3..6, 2..3)], size), size), [SQUARES + 1, SQUARES + 2]);
        // Fewer texels than squares: the first one of those that a texel covers stands for it.
        let few = [SQUARES / 8; 2];
        assert_eq!(met(Window::round([covered(1..2, 3..4)], few), few), [24 * SQUARES + 8]);
    }

    #[test]
    fn there_is_none_round_most_of_a_place_or_nothing() {
        assert_eq!(Window::round([covered(0..8, 0..5)], [8, 8]), None);
        assert_eq!(Window::round([], [8, 8]), None);
    }
}
