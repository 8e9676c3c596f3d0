//! A hierarchy of boxes over triangles, for rays.
//!
//! Built from the top by the surface area heuristic over bins of the centres (Wald, "On fast Construction of SAH-based
//! Bounding Volume Hierarchies", 2007). The same triangles give the same hierarchy, on however many cores: the top is
//! split by one thread with the help of the others, the parts below it by all of them at once. Triangles that move keep
//! their places in it: the boxes alone are made anew, on the device ([`super::hierarchy`]).

use super::{model::Bounds, pieces::Pieces};
use crate::parallel::threads;
use glam::Vec3;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

/// Boxes within boxes; row 0 holds everything. By row: never empty, since without triangles there is one leaf with the
/// zeroed row that an empty table is bound as, which no ray meets. Both children of a row stand side by side, after it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bvh {
    /// Corners of the boxes.
    pub lower: Pieces<Vec3>,
    pub upper: Pieces<Vec3>,
    pub tree: Tree,
}

/// A hierarchy without its boxes. By row, as in [`Bvh`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tree {
    /// Of a leaf: its first place in [`Tree::order`]. Else: the row of its first child.
    pub first: Pieces<u32>,
    /// Of a leaf: its triangles, at least 1. Else 0.
    pub count: Pieces<u32>,
    /// The triangles in the order of the leaves.
    pub order: Arc<Vec<u32>>,
}

/// Rows whose boxes are to be fitted anew after triangles moved.
#[derive(Debug, PartialEq, Default)]
pub struct Refit {
    /// Where those triangles stand in [`Tree::order`].
    pub places: Vec<Range<usize>>,
    /// By row: its number, `first` and `count`. Those of a level come after all of the levels below it.
    pub rows: Vec<[u32; 3]>,
    /// Where the levels end, from the leaves up.
    pub ends: Vec<u32>,
    /// The numbers of the rows, in their order.
    pub spans: Vec<Range<usize>>,
}

/// Leaves are at most so many levels below the root: what a traversal's stack must hold.
pub const MAX_DEPTH: u32 = 47;

/// Bins along the axis of a split.
const BINS: usize = 16;

/// Triangles that a leaf may hold where a split would not pay.
const MAX_LEAF: usize = 8;

/// Cost of a step down, in intersections of a triangle.
const STEP_COST: f32 = 1.0;

/// Parts that the triangles are split into before threads take one each: enough that none waits long for the last, and
/// that their items take little memory.
const PARTS: usize = 64;

/// Triangles that are not worth a thread.
const FEW: usize = 1 << 14;

/// A triangle as the builder sees it.
#[derive(Clone, Copy)]
struct BuildTriangle {
    bounds: Bounds,
    triangle: u32,
    node: u32,
}

impl BuildTriangle {
    /// Twice the centre of the bounds.
    fn centre(&self) -> Vec3 {
        self.bounds.min + self.bounds.max
    }
}

/// A row of a [`Tree`].
#[derive(Clone, Copy, Default)]
struct BvhRow {
    first: u32,
    count: u32,
}

/// A range still to be split.
#[derive(Clone, Copy)]
struct Task {
    row: usize,
    start: usize,
    end: usize,
    depth: u32,
}

impl Bvh {
    /// The boxes of a hierarchy over triangles that stand where it was made for, or elsewhere; all corners finite.
    /// `all` is the box round all of them.
    pub fn of(tree: Tree, all: Bounds, corners: impl Fn(usize) -> [Vec3; 3]) -> Bvh {
        let rows = tree.rows();
        let mut bvh = Bvh { lower: Pieces::repeat(Vec3::ZERO, rows), upper: Pieces::repeat(Vec3::ZERO, rows), tree };
        if !bvh.tree.order.is_empty() {
            let margin = Vec3::splat(margin(all));
            for row in (0..rows).rev() {
                let bounds = match bvh.tree.count[row] {
                    0 => bvh.round_children(row),
                    _ => bvh.round_triangles(row, margin, &corners),
                };
                bvh.lower.set(row, bounds.min);
                bvh.upper.set(row, bounds.max);
            }
        }
        bvh
    }

    /// The box round the children of a row.
    fn round_children(&self, row: usize) -> Bounds {
        let (first, lower, upper) = (self.tree.first[row] as usize, &self.lower, &self.upper);
        Bounds { min: lower[first].min(lower[first + 1]), max: upper[first].max(upper[first + 1]) }
    }

    /// The box of a leaf.
    fn round_triangles(&self, row: usize, margin: Vec3, corners: impl Fn(usize) -> [Vec3; 3]) -> Bounds {
        let (first, count) = (self.tree.first[row] as usize, self.tree.count[row] as usize);
        let round = |all: Bounds, i: &u32| all.union(Bounds::of(corners(*i as usize)));
        let exact = self.tree.order[first..first + count].iter().fold(Bounds::EMPTY, round);
        Bounds { min: exact.min - margin, max: exact.max + margin }
    }
}

/// How much wider leaves are than their triangles: rays that run along a flat box, or exactly through its edge, must
/// not slip by for a rounding error.
pub fn margin(all: Bounds) -> f32 {
    reach(all) * 4.0 * f32::EPSILON
}

/// The least power of two that no coordinate of a box exceeds: what moves changes it hardly ever.
pub fn reach(bounds: Bounds) -> f32 {
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    // Beyond the largest power it is infinite; a box of nothing has no coordinates.
    if largest > 0.0 && largest.is_finite() { largest.log2().ceil().exp2().max(largest) } else { 0.0 }
}

impl Tree {
    /// The hierarchy over so many triangles, all corners finite. Parts of at most `enough` triangles are not split,
    /// unless they are of several nodes: `node` tells those.
    ///
    /// Corners are asked for again and again instead of kept: at the top by all threads, then once for each part, so
    /// that boxes of a few parts only are held at a time.
    pub fn new(
        triangles: usize,
        corners: impl Fn(usize) -> [Vec3; 3] + Sync,
        node: impl Fn(usize) -> u32 + Sync,
        enough: usize,
    ) -> Tree {
        let mut order: Vec<u32> = (0..triangles as u32).collect();
        if order.is_empty() {
            return Tree { first: Pieces::repeat(0, 1), count: Pieces::repeat(1, 1), order: Arc::default() };
        }
        let item = |triangle: &u32| BuildTriangle {
            bounds: Bounds::of(corners(*triangle as usize)),
            triangle: *triangle,
            node: node(*triangle as usize),
        };
        let whole = Task { row: 0, start: 0, end: order.len(), depth: 0 };
        let part = (order.len() / PARTS).max(FEW);
        let (mut top, mut parts) = (vec![], vec![]);
        grow(&mut order, &item, whole, enough, &mut top, |task| {
            let small = task.end - task.start <= part;
            if small {
                parts.push(*task);
            }
            small
        });
        parts.sort_by_key(|p| p.start);
        let subtrees = subtrees(&mut order, &item, &parts, enough);
        let mut tree = Tree { order: Arc::new(order), ..Tree::default() };
        top.iter().for_each(|row| tree.push(*row));
        for (part, below) in parts.iter().zip(subtrees) {
            // All but the root of a part go to the end; what they call row i is then row `base + i`.
            let base = tree.rows() as u32 - 1;
            let mut below = below.into_iter().map(|row| match row.count {
                0 => BvhRow { first: row.first + base, ..row },
                _ => BvhRow { first: row.first + part.start as u32, ..row },
            });
            if let Some(root) = below.next() {
                tree.first.set(part.row, root.first);
                tree.count.set(part.row, root.count);
            }
            below.for_each(|row| tree.push(row));
        }
        tree
    }

    pub fn rows(&self) -> usize {
        self.count.len()
    }

    /// The leaves over some places of [`Tree::order`], given in their order, and all rows above these.
    pub fn refit(&self, places: Vec<Range<usize>>) -> Refit {
        let mut levels = vec![];
        if !self.order.is_empty() {
            self.gather(0, 0..self.order.len(), &places, &mut levels);
        }
        let ends = levels.iter().scan(0, |end, level: &Vec<[u32; 3]>| {
            *end += level.len() as u32;
            Some(*end)
        });
        let (ends, rows) = (ends.collect(), levels.concat());
        let mut numbers: Vec<usize> = rows.iter().map(|[row, ..]| *row as usize).collect();
        numbers.sort_unstable();
        let spans = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| run[0]..run[run.len() - 1] + 1).collect();
        Refit { places, rows, ends, spans }
    }

    /// Adds a row that lies over some places, and all such rows below it. Returns its level; `None` where it is over
    /// none of them.
    fn gather(
        &self,
        row: usize,
        over: Range<usize>,
        places: &[Range<usize>],
        levels: &mut Vec<Vec<[u32; 3]>>,
    ) -> Option<usize> {
        places.get(places.partition_point(|p| p.end <= over.start)).filter(|p| p.start < over.end)?;
        let [first, count] = [self.first[row], self.count[row]];
        let mut level = 0;
        if count == 0 {
            let child = first as usize;
            let middle = self.start(child + 1);
            let left = self.gather(child, over.start..middle, places, levels);
            level = 1 + left.max(self.gather(child + 1, middle..over.end, places, levels))?;
        }
        levels.resize_with(levels.len().max(level + 1), Vec::new);
        levels[level].push([row as u32, first, count]);
        Some(level)
    }

    /// The first place below a row.
    fn start(&self, mut row: usize) -> usize {
        while self.count[row] == 0 {
            row = self.first[row] as usize;
        }
        self.first[row] as usize
    }

    fn push(&mut self, row: BvhRow) {
        self.first.push(row.first);
        self.count.push(row.count);
    }
}

/// Splits a task and what comes of it into `rows`, whose first free row is the task's, down to `enough` triangles, but
/// for those that `skip` takes: their rows stay empty. `look` tells what is sorted.
fn grow<T: Sync>(
    all: &mut [T],
    look: &(impl Fn(&T) -> BuildTriangle + Sync),
    whole: Task,
    enough: usize,
    rows: &mut Vec<BvhRow>,
    mut skip: impl FnMut(&Task) -> bool,
) {
    rows.push(BvhRow::default());
    let mut tasks = vec![whole];
    while let Some(task) = tasks.pop() {
        if skip(&task) {
            continue;
        }
        let range = &mut all[task.start..task.end];
        let Some(left) = split(range, look, task.depth, enough) else {
            rows[task.row] = BvhRow { first: task.start as u32, count: range.len() as u32 };
            continue;
        };
        let first = rows.len();
        rows[task.row] = BvhRow { first: first as u32, count: 0 };
        rows.extend([BvhRow::default(); 2]);
        let (middle, depth) = (task.start + left, task.depth + 1);
        tasks.push(Task { row: first + 1, start: middle, end: task.end, depth });
        tasks.push(Task { row: first, start: task.start, end: middle, depth });
    }
}

/// The hierarchies over parts in the order of their triangles, each with its root in row 0 and its triangles from 0 on.
fn subtrees(
    order: &mut [u32],
    item: &(impl Fn(&u32) -> BuildTriangle + Sync),
    parts: &[Task],
    enough: usize,
) -> Vec<Vec<BvhRow>> {
    let mut done: Vec<Vec<BvhRow>> = parts.iter().map(|_| vec![]).collect();
    let mut open = vec![];
    let (mut rest, mut at) = (order, 0);
    for (part, out) in parts.iter().zip(&mut done) {
        let (own, after) = rest.split_at_mut(part.end - at);
        (rest, at) = (after, part.end);
        open.push((own, part.depth, out));
    }
    let open = Mutex::new(open);
    let work = || {
        let mut items = vec![];
        loop {
            let next = open.lock().unwrap_or_else(PoisonError::into_inner).pop();
            let Some((own, depth, out)) = next else { return };
            items.clear();
            items.extend(own.iter().map(item));
            let whole = Task { row: 0, start: 0, end: own.len(), depth };
            grow(&mut items, &|item| *item, whole, enough, out, |_| false);
            out.shrink_to_fit();
            own.iter_mut().zip(&items).for_each(|(triangle, item)| *triangle = item.triangle);
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads().min(parts.len()) {
            scope.spawn(work);
        }
        work();
    });
    done
}

/// Folds items on all cores when they are many. `join` must not care how they were parted.
fn joined<T: Sync, S: Clone + Send + Sync>(
    all: &[T],
    add: impl Fn(&mut S, &T) + Sync,
    none: S,
    join: impl Fn(S, S) -> S,
) -> S {
    let run = |chunk: &[T]| {
        let mut sum = none.clone();
        chunk.iter().for_each(|one| add(&mut sum, one));
        sum
    };
    // How many threads there are is a question to the system: it isn't asked for each of many small ranges.
    let count = if all.len() < 2 * FEW { 1 } else { threads() };
    if count == 1 {
        return run(all);
    }
    std::thread::scope(|scope| {
        let run = &run;
        let chunks: Vec<_> = all.chunks(all.len().div_ceil(count)).map(|c| scope.spawn(move || run(c))).collect();
        let parts = chunks.into_iter().map(|c| c.join().unwrap_or_else(|e| std::panic::resume_unwind(e)));
        parts.fold(none.clone(), join)
    })
}

/// Sorts what is in a range into two halves; the size of the first, or `None` for a leaf.
fn split<T: Sync>(
    all: &mut [T],
    look: &(impl Fn(&T) -> BuildTriangle + Sync),
    depth: u32,
    enough: usize,
) -> Option<usize> {
    if let Some(left) = split_in_space(all, look, depth, enough) {
        return Some(left);
    }
    // A leaf is of one node: what moves then changes no leaf of anything else.
    let node = look(all.first()?).node;
    let left = partition(all, |one| look(one).node == node);
    (left < all.len()).then_some(left)
}

fn split_in_space<T: Sync>(
    all: &mut [T],
    look: &(impl Fn(&T) -> BuildTriangle + Sync),
    depth: u32,
    enough: usize,
) -> Option<usize> {
    let count = all.len();
    if count <= enough {
        return None;
    }
    // Leaves of several nodes are split again.
    let levels_left = MAX_DEPTH.saturating_sub(depth + MAX_LEAF as u32 - 1);
    // The box of everything, and that of the centres.
    let grown = |(bounds, centres): &mut (Bounds, Bounds), one: &T| {
        let item = look(one);
        *bounds = bounds.union(item.bounds);
        *centres = centres.union(Bounds::of([item.centre()]));
    };
    let (bounds, centres) = joined(all, grown, (Bounds::EMPTY, Bounds::EMPTY), |a, b| (a.0.union(b.0), a.1.union(b.1)));
    // Halving always ends in time; the heuristic may not.
    let balanced = usize::BITS - (count - 1).leading_zeros() >= levels_left;
    if !balanced && let Some((axis, bin, cost)) = best_plane(all, look, centres) {
        if count <= MAX_LEAF && count as f32 <= STEP_COST + cost / area(bounds).max(f32::MIN_POSITIVE) {
            return None;
        }
        let left = partition(all, |one| bin_of(look(one).centre()[axis], centres, axis) <= bin);
        if left > 0 && left < count {
            return Some(left);
        }
    }
    if count <= MAX_LEAF {
        return None;
    }
    let extent = centres.max - centres.min;
    let axis = if extent.x >= extent.y && extent.x >= extent.z { 0 } else { 1 + usize::from(extent.z > extent.y) };
    let order = |a: &BuildTriangle, b: &BuildTriangle| {
        a.centre()[axis].total_cmp(&b.centre()[axis]).then(a.triangle.cmp(&b.triangle))
    };
    all.select_nth_unstable_by(count / 2, |a, b| order(&look(a), &look(b)));
    Some(count / 2)
}

/// The cheapest plane between two bins: its axis, the last bin before it, and the sum of areas times counts on both
/// sides. `None` when all centres coincide.
fn best_plane<T: Sync>(
    all: &[T],
    look: &(impl Fn(&T) -> BuildTriangle + Sync),
    centres: Bounds,
) -> Option<(usize, usize, f32)> {
    let bins = filled(all, look, centres);
    let mut best: Option<(usize, usize, f32)> = None;
    for axis in 0..3 {
        if centres.max[axis] <= centres.min[axis] {
            continue;
        }
        let bins = bins[axis];
        let mut above = [0.0; BINS];
        let mut sum = (Bounds::EMPTY, 0usize);
        for i in (1..BINS).rev() {
            sum = (sum.0.union(bins[i].0), sum.1 + bins[i].1);
            above[i - 1] = area(sum.0) * sum.1 as f32;
        }
        let mut sum = (Bounds::EMPTY, 0usize);
        for i in 0..BINS - 1 {
            sum = (sum.0.union(bins[i].0), sum.1 + bins[i].1);
            let cost = area(sum.0) * sum.1 as f32 + above[i];
            let splits = sum.1 > 0 && sum.1 < all.len();
            if splits && best.is_none_or(|b| cost < b.2) {
                best = Some((axis, i, cost));
            }
        }
    }
    best
}

/// Along each axis: the box and the number of the items whose centres lie in each bin.
type Bins = [[(Bounds, usize); BINS]; 3];

fn filled<T: Sync>(all: &[T], look: &(impl Fn(&T) -> BuildTriangle + Sync), centres: Bounds) -> Bins {
    let add = |bins: &mut Bins, one: &T| {
        let item = look(one);
        let centre = item.centre();
        for (axis, bins) in bins.iter_mut().enumerate() {
            let bin = &mut bins[bin_of(centre[axis], centres, axis)];
            *bin = (bin.0.union(item.bounds), bin.1 + 1);
        }
    };
    let join = |mut a: Bins, b: Bins| {
        for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
            *a = (a.0.union(b.0), a.1 + b.1);
        }
        a
    };
    joined(all, add, [[(Bounds::EMPTY, 0); BINS]; 3], join)
}

fn bin_of(centre: f32, centres: Bounds, axis: usize) -> usize {
    let (low, high) = (centres.min[axis], centres.max[axis]);
    // The conversion saturates: what overflows goes to an end.
    (((centre - low) / (high - low) * BINS as f32) as usize).min(BINS - 1)
}

/// Half the surface of a box; 0 for the box of nothing.
fn area(b: Bounds) -> f32 {
    let e = (b.max - b.min).max(Vec3::ZERO);
    e.x * e.y + e.y * e.z + e.z * e.x
}

/// Brings those that pass to the front; how many they are.
fn partition<T>(all: &mut [T], pass: impl Fn(&T) -> bool) -> usize {
    let mut front = 0;
    for i in 0..all.len() {
        if pass(&all[i]) {
            all.swap(front, i);
            front += 1;
        }
    }
    front
}
