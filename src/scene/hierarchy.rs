//! The hierarchy that rays walk, at a pose: the device fits its boxes round the triangles, and the host works them out
//! only where it is asked for them.

use super::{
    bvh::{Bvh, Refit, Tree, margin},
    corners::Corners,
    model::Bounds,
};
use glam::Vec3;
use std::ops::Range;
use std::sync::{Arc, OnceLock, Weak};

/// A hierarchy over the triangles of a scene at a pose.
#[derive(Debug)]
pub struct Hierarchy {
    pub corners: Arc<Corners>,
    pub(super) tree: Tree,
    /// The box round everything.
    all: Bounds,
    /// What has moved since which; `None`: all rows are to be fitted.
    moved: Option<(Weak<Hierarchy>, Arc<Refit>)>,
    /// As the host works them out.
    boxes: OnceLock<Bvh>,
}

impl PartialEq for Hierarchy {
    fn eq(&self, other: &Hierarchy) -> bool {
        (&self.corners, &self.tree, self.margin()) == (&other.corners, &other.tree, other.margin())
    }
}

impl Hierarchy {
    /// Over triangles in the order of the tree, which `all` is the box round.
    pub(super) fn new(tree: Tree, corners: Arc<Corners>, all: Bounds) -> Hierarchy {
        Hierarchy { corners, tree, all, moved: None, boxes: OnceLock::new() }
    }

    /// The same triangles at another pose.
    pub(super) fn at(self: &Arc<Hierarchy>, corners: Arc<Corners>, all: Bounds) -> Hierarchy {
        let next = Hierarchy::new(self.tree.clone(), corners, all);
        let moved = (next.margin() == self.margin()).then(|| {
            let places: Vec<Range<usize>> = self.corners.moved(next.corners.nodes()).map(|(rows, _)| rows).collect();
            // What moves goes on moving.
            let before = self.moved.as_ref().filter(|(_, before)| before.places == places);
            let moved = before.map_or_else(|| Arc::new(self.tree.refit(places)), |(_, before)| before.clone());
            (Arc::downgrade(self), moved)
        });
        Hierarchy { moved, ..next }
    }

    /// The rows to fit where those of another hierarchy have been; `None`: all.
    pub fn moved_since(&self, before: &Arc<Hierarchy>) -> Option<&Arc<Refit>> {
        let (of, moved) = self.moved.as_ref()?;
        std::ptr::addr_eq(of.as_ptr(), Arc::as_ptr(before)).then_some(moved)
    }

    /// How much wider leaves are than their triangles.
    pub fn margin(&self) -> f32 {
        margin(self.all)
    }

    /// All rows.
    pub fn whole(&self) -> Refit {
        self.tree.refit(std::iter::once(0..self.tree.order.len()).collect())
    }

    /// Marks the rows whose boxes may be others than before; false where they are of another tree.
    pub(super) fn mark(&self, before: &Arc<Hierarchy>, other: &mut [bool]) -> bool {
        if self.tree != before.tree || other.len() != self.tree.rows() {
            return false;
        }
        match before.at(self.corners.clone(), self.all).moved {
            Some((_, moved)) => moved.rows.iter().for_each(|[row, ..]| other[*row as usize] = true),
            None => other.fill(true),
        }
        true
    }

    /// The lower or the upper corner of a row's box.
    pub fn corner(&self, row: usize, upper: bool) -> Option<Vec3> {
        let made = || Bvh::of(self.tree.clone(), self.all, |triangle| self.corners.triangle(triangle));
        let boxes = self.boxes.get_or_init(made);
        if upper { &boxes.upper } else { &boxes.lower }.get(row).copied()
    }
}
