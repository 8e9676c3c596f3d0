//! A hierarchy of boxes over triangles, for rays.
//!
//! Built from the top by the surface area heuristic over bins of the centres (Wald, "On fast Construction of
//! SAH-based Bounding Volume Hierarchies", 2007). The same triangles give the same hierarchy, on however many cores: the
//! top is split by one thread with the help of the others, the parts below it by all of them at once.

use super::model::Bounds;
use glam::Vec3;
use std::sync::{Mutex, PoisonError};

/// Boxes within boxes; row 0 holds everything. By row: never empty, since without triangles there is one leaf with the zeroed
/// row that an empty table is bound as, which no ray meets. Both children of a row stand side by side, after it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bvh {
    /// Corners of the boxes.
    pub lower: Vec<Vec3>,
    pub upper: Vec<Vec3>,
    /// [`BvhNode::first`]
    pub first: Vec<u32>,
    /// [`BvhNode::count`]
    pub count: Vec<u32>,
    /// The triangles in the order of the leaves.
    pub order: Vec<u32>,
}

/// A box, and what is in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BvhNode {
    pub bounds: Bounds,
    /// Of a leaf: its first place in [`Bvh::order`]. Else: the row of its first child.
    pub first: u32,
    /// Of a leaf: its triangles, at least 1. Else 0.
    pub count: u32,
}

/// Leaves are at most so many levels below the root: what a traversal's stack must hold.
pub const MAX_DEPTH: u32 = 47;

/// Bins along the axis of a split.
const BINS: usize = 16;

/// Triangles that a leaf may hold where a split would not pay.
const MAX_LEAF: usize = 8;

/// Cost of a step down, in intersections of a triangle.
const STEP_COST: f32 = 1.0;

/// Parts that the items are split into before threads take one each: enough that none waits long for the last.
const PARTS: usize = 64;

/// Items that are not worth a thread.
const FEW: usize = 1 << 14;

/// A triangle as the builder sees it.
#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds,
    triangle: u32,
}

impl Item {
    /// Twice the centre of the bounds.
    fn centre(&self) -> Vec3 {
        self.bounds.min + self.bounds.max
    }
}

/// A range of items still to be split.
#[derive(Clone, Copy)]
struct Task {
    node: usize,
    start: usize,
    end: usize,
    depth: u32,
}

impl Bvh {
    /// The hierarchy over triangles given by their corners, all of them finite.
    pub fn new(triangles: impl Iterator<Item = [Vec3; 3]>) -> Bvh {
        Bvh::with_leaves(triangles, 1)
    }

    /// As [`Bvh::new`], but parts of at most `enough` triangles are not split.
    pub fn with_leaves(triangles: impl Iterator<Item = [Vec3; 3]>, enough: usize) -> Bvh {
        let mut items = Vec::with_capacity(triangles.size_hint().0);
        items.extend((0..).zip(triangles).map(|(triangle, corners)| Item { bounds: Bounds::of(corners), triangle }));
        if items.is_empty() {
            let mut bvh = Bvh::default();
            bvh.push(&BvhNode { bounds: Bounds { min: Vec3::ZERO, max: Vec3::ZERO }, first: 0, count: 1 });
            return bvh;
        }
        let whole = Task { node: 0, start: 0, end: items.len(), depth: 0 };
        let part = (items.len() / PARTS).max(FEW);
        let mut top = vec![];
        let mut parts = vec![];
        grow(&mut items, whole, enough, &mut top, |task| {
            let small = task.end - task.start <= part;
            if small {
                parts.push(*task);
            }
            small
        });
        parts.sort_by_key(|p| p.start);
        let subtrees = subtrees(&mut items, &parts, enough);
        let order = items.iter().map(|i| i.triangle).collect();
        drop(items);
        let mut bvh = Bvh { order, ..Bvh::default() };
        bvh.reserve(top.len() + subtrees.iter().map(|s| s.len() - 1).sum::<usize>());
        top.iter().for_each(|n| bvh.push(n));
        for (part, below) in parts.iter().zip(subtrees) {
            // All but the root of a part go to the end; what they call row i is then row `base + i`.
            let base = bvh.rows() as u32 - 1;
            let mut below = below.into_iter().map(|n| match n.count {
                0 => BvhNode { first: n.first + base, ..n },
                _ => BvhNode { first: n.first + part.start as u32, ..n },
            });
            if let Some(root) = below.next() {
                bvh.set(part.node, &root);
            }
            below.for_each(|n| bvh.push(&n));
        }
        // Rays that run along a flat box, or exactly through its edge, must not slip by for a rounding error.
        let largest = bvh.lower[0].abs().max(bvh.upper[0].abs()).max_element();
        let margin = Vec3::splat(largest * 4.0 * f32::EPSILON);
        bvh.lower.iter_mut().for_each(|p| *p -= margin);
        bvh.upper.iter_mut().for_each(|p| *p += margin);
        bvh
    }

    pub fn rows(&self) -> usize {
        self.count.len()
    }

    /// The box of a row below [`Bvh::rows`].
    #[cfg(test)]
    pub fn node(&self, row: usize) -> BvhNode {
        let bounds = Bounds { min: self.lower[row], max: self.upper[row] };
        BvhNode { bounds, first: self.first[row], count: self.count[row] }
    }

    fn reserve(&mut self, rows: usize) {
        self.lower.reserve_exact(rows);
        self.upper.reserve_exact(rows);
        self.first.reserve_exact(rows);
        self.count.reserve_exact(rows);
    }

    fn push(&mut self, node: &BvhNode) {
        self.lower.push(node.bounds.min);
        self.upper.push(node.bounds.max);
        self.first.push(node.first);
        self.count.push(node.count);
    }

    fn set(&mut self, row: usize, node: &BvhNode) {
        self.lower[row] = node.bounds.min;
        self.upper[row] = node.bounds.max;
        self.first[row] = node.first;
        self.count[row] = node.count;
    }
}

/// Splits a task and what comes of it into `nodes`, whose first free row is the task's, down to `enough` items, but for those
/// that `skip` takes: their rows stay empty.
fn grow(items: &mut [Item], whole: Task, enough: usize, nodes: &mut Vec<BvhNode>, mut skip: impl FnMut(&Task) -> bool) {
    let empty = BvhNode { bounds: Bounds::EMPTY, first: 0, count: 0 };
    nodes.push(empty);
    let mut tasks = vec![whole];
    while let Some(task) = tasks.pop() {
        if skip(&task) {
            continue;
        }
        let range = &mut items[task.start..task.end];
        let bounds = joined(range, |b, i| *b = b.union(i.bounds), Bounds::EMPTY, Bounds::union);
        let Some(left) = split(range, bounds, task.depth, enough) else {
            nodes[task.node] = BvhNode { bounds, first: task.start as u32, count: range.len() as u32 };
            continue;
        };
        let first = nodes.len();
        nodes[task.node] = BvhNode { bounds, first: first as u32, count: 0 };
        nodes.extend([empty, empty]);
        let (middle, depth) = (task.start + left, task.depth + 1);
        tasks.push(Task { node: first + 1, start: middle, end: task.end, depth });
        tasks.push(Task { node: first, start: task.start, end: middle, depth });
    }
}

/// The hierarchies over parts in the order of their items, each with its root in row 0 and its items from 0 on.
fn subtrees(items: &mut [Item], parts: &[Task], enough: usize) -> Vec<Vec<BvhNode>> {
    let mut done: Vec<Vec<BvhNode>> = parts.iter().map(|_| vec![]).collect();
    let mut open = vec![];
    let (mut rest, mut at) = (items, 0);
    for (part, out) in parts.iter().zip(&mut done) {
        let (own, after) = rest.split_at_mut(part.end - at);
        (rest, at) = (after, part.end);
        open.push((own, part.depth, out));
    }
    let open = Mutex::new(open);
    let work = || {
        loop {
            let next = open.lock().unwrap_or_else(PoisonError::into_inner).pop();
            let Some((own, depth, out)) = next else { return };
            let whole = Task { node: 0, start: 0, end: own.len(), depth };
            grow(own, whole, enough, out, |_| false);
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

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Folds items on all cores when they are many. `join` must not care how they were parted.
fn joined<T: Clone + Send + Sync>(
    items: &[Item],
    add: impl Fn(&mut T, &Item) + Sync,
    none: T,
    join: impl Fn(T, T) -> T,
) -> T {
    let run = |chunk: &[Item]| {
        let mut sum = none.clone();
        chunk.iter().for_each(|item| add(&mut sum, item));
        sum
    };
    // How many threads there are is a question to the system: it isn't asked for each of many small ranges.
    let count = if items.len() < 2 * FEW { 1 } else { threads() };
    if count == 1 {
        return run(items);
    }
    std::thread::scope(|scope| {
        let run = &run;
        let chunks: Vec<_> = items.chunks(items.len().div_ceil(count)).map(|c| scope.spawn(move || run(c))).collect();
        let parts = chunks.into_iter().map(|c| c.join().unwrap_or_else(|e| std::panic::resume_unwind(e)));
        parts.fold(none.clone(), join)
    })
}

/// Sorts the items into two halves; the size of the first, or `None` for a leaf.
fn split(items: &mut [Item], bounds: Bounds, depth: u32, enough: usize) -> Option<usize> {
    let count = items.len();
    if count <= enough {
        return None;
    }
    let levels_left = MAX_DEPTH - depth;
    let grown = |b: &mut Bounds, i: &Item| *b = b.union(Bounds::of([i.centre()]));
    let centres = joined(items, grown, Bounds::EMPTY, Bounds::union);
    // Halving always ends in time; the heuristic may not.
    let balanced = usize::BITS - (count - 1).leading_zeros() >= levels_left;
    if !balanced && let Some((axis, bin, cost)) = best_plane(items, centres) {
        if count <= MAX_LEAF && count as f32 <= STEP_COST + cost / area(bounds).max(f32::MIN_POSITIVE) {
            return None;
        }
        let left = partition(items, |i| bin_of(i.centre()[axis], centres, axis) <= bin);
        if left > 0 && left < count {
            return Some(left);
        }
    }
    if count <= MAX_LEAF {
        return None;
    }
    let extent = centres.max - centres.min;
    let axis = if extent.x >= extent.y && extent.x >= extent.z { 0 } else { 1 + usize::from(extent.z > extent.y) };
    let order = |a: &Item, b: &Item| a.centre()[axis].total_cmp(&b.centre()[axis]).then(a.triangle.cmp(&b.triangle));
    items.select_nth_unstable_by(count / 2, order);
    Some(count / 2)
}

/// The cheapest plane between two bins: its axis, the last bin before it, and the sum of areas times counts on both
/// sides. `None` when all centres coincide.
fn best_plane(items: &[Item], centres: Bounds) -> Option<(usize, usize, f32)> {
    let bins = filled(items, centres);
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
            let splits = sum.1 > 0 && sum.1 < items.len();
            if splits && best.is_none_or(|b| cost < b.2) {
                best = Some((axis, i, cost));
            }
        }
    }
    best
}

/// Along each axis: the box and the number of the items whose centres lie in each bin.
type Bins = [[(Bounds, usize); BINS]; 3];

fn filled(items: &[Item], centres: Bounds) -> Bins {
    let add = |bins: &mut Bins, item: &Item| {
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
    joined(items, add, [[(Bounds::EMPTY, 0); BINS]; 3], join)
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
fn partition(items: &mut [Item], pass: impl Fn(&Item) -> bool) -> usize {
    let mut front = 0;
    for i in 0..items.len() {
        if pass(&items[i]) {
            items.swap(front, i);
            front += 1;
        }
    }
    front
}
