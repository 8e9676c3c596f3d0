//! A table as data: rows of named columns, and what one has other than one before.

use super::{Corners, Hierarchy, NodeMatrix, Pieces, Transforms, VertexAttribute};
use crate::value::Value;
use glam::{Mat4, Vec2, Vec3, Vec4};
use std::ops::Range;
use std::sync::{Arc, Weak};

/// Rows of named columns; what a shader's `var<storage> NAME: array<T>` binds to when NAME is a table's.
/// `T`'s members pick columns by name. A clone shares the columns.
#[derive(Debug, Clone)]
pub struct Table {
    pub name: &'static str,
    pub rows: usize,
    pub columns: Columns,
    /// Where that is known already: what [`Table::differs`] says of one before.
    pub(crate) since: Option<Since>,
}

type Columns = Arc<[(&'static str, Column)]>;

/// What a table has other than one before.
#[derive(Debug, Clone)]
pub(crate) struct Since {
    /// The columns of that one, for as long as somebody else holds them.
    before: Weak<[(&'static str, Column)]>,
    rows: Arc<[Range<usize>]>,
}

impl Since {
    /// Of a table with these columns; `other`: rows that may be others, in their order.
    pub(crate) fn of(before: &Columns, other: impl Iterator<Item = Range<usize>>) -> Since {
        Since { before: Arc::downgrade(before), rows: joined(other).into() }
    }
}

/// Ranges of rows in their order, with those between that are near enough.
fn joined(all: impl Iterator<Item = Range<usize>>) -> Vec<Range<usize>> {
    let mut joined: Vec<Range<usize>> = vec![];
    for rows in all {
        match joined.last_mut() {
            // To begin anew costs more than a few rows.
            Some(last) if rows.start < last.end + 64 => last.end = rows.end,
            _ => joined.push(rows),
        }
    }
    joined
}

impl PartialEq for Table {
    fn eq(&self, other: &Table) -> bool {
        (self.name, self.rows, &self.columns) == (other.name, other.rows, &other.columns)
    }
}

impl Table {
    /// A column by its name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|(n, _)| *n == name).map(|(_, c)| c)
    }

    /// Whether one is a clone of the other.
    pub fn is_clone(&self, other: &Table) -> bool {
        self.name == other.name && Arc::ptr_eq(&self.columns, &other.columns)
    }

    /// Where the nodes stand that it holds, or whose triangles; `None` for tables of anything else.
    pub fn places(&self) -> Option<&Transforms> {
        self.matrices(NodeMatrix::Transform).or_else(|| self.corners().map(|of| of.nodes()))
    }

    /// The transforms of nodes that a matrix of each is held of.
    pub fn matrices(&self, wanted: NodeMatrix) -> Option<&Transforms> {
        self.columns.iter().find_map(|(_, column)| match column {
            Column::Node { of, matrix } if *matrix == wanted => Some(of),
            _ => None,
        })
    }

    /// The triangles whose corners it holds, or that its boxes lie round.
    pub fn corners(&self) -> Option<&Arc<Corners>> {
        self.columns.iter().find_map(|(_, column)| match column {
            Column::Corner { of, .. } => Some(of),
            Column::Box { of, .. } => Some(&of.corners),
            _ => None,
        })
    }

    /// The hierarchy whose boxes it holds.
    pub fn hierarchy(&self) -> Option<&Arc<Hierarchy>> {
        self.columns.iter().find_map(|(_, c)| if let Column::Box { of, .. } = c { Some(of) } else { None })
    }

    /// Ranges of rows, in their order, outside of which it is the same as an earlier one; `None`: it has other rows, or
    /// other columns.
    pub fn differs(&self, before: &Table) -> Option<Vec<Range<usize>>> {
        if (self.name, self.rows, self.columns.len()) != (before.name, before.rows, before.columns.len()) {
            return None;
        }
        if let Some(since) =
            self.since.as_ref().filter(|s| std::ptr::addr_eq(s.before.as_ptr(), Arc::as_ptr(&before.columns)))
        {
            return Some(since.rows.to_vec());
        }
        let mut other = vec![false; self.rows];
        if let (None, Some(now), Some(then)) = (self.hierarchy(), self.corners(), before.corners()) {
            now.mark(then, &mut other)?;
        }
        for ((name, now), (then_name, then)) in self.columns.iter().zip(before.columns.iter()) {
            if name != then_name || !now.mark(then, &mut other) {
                return None;
            }
        }
        let marked = other.iter().enumerate().filter(|(_, other)| **other);
        Some(joined(marked.map(|(row, _)| row..row + 1)))
    }
}

/// One column of a [`Table`].
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    Uint(Pieces<u32>),
    Float(Pieces<f32>),
    Vec2(Pieces<Vec2>),
    Vec3(Pieces<Vec3>),
    Vec4(Pieces<Vec4>),
    Mat4(Pieces<Mat4>),
    /// What the vertices at one corner (0 to 2) of triangles hold.
    Corner {
        of: Arc<Corners>,
        corner: usize,
        held: VertexAttribute,
    },
    /// A matrix of each node.
    Node {
        of: Transforms,
        matrix: NodeMatrix,
    },
    /// The lower or the upper corner of a hierarchy's boxes.
    Box {
        of: Arc<Hierarchy>,
        upper: bool,
    },
}

impl Column {
    /// Marks the rows in which it differs; false where the two have nothing in common. Corners are marked by their own.
    fn mark(&self, before: &Column, other: &mut [bool]) -> bool {
        // By bits: 0 and -0 are told apart, as everywhere where results are kept.
        fn each<T: bytemuck::NoUninit>(now: &Pieces<T>, then: &Pieces<T>, other: &mut [bool]) -> bool {
            if [now.len(), then.len()] != [other.len(); 2] {
                return false;
            }
            for (start, now, then) in now.apart(then) {
                let rows = now.iter().zip(then).zip(&mut other[start..]);
                rows.for_each(|((a, b), other)| *other |= bytemuck::bytes_of(a) != bytemuck::bytes_of(b));
            }
            true
        }
        match (self, before) {
            (Column::Uint(a), Column::Uint(b)) => each(a, b, other),
            (Column::Float(a), Column::Float(b)) => each(a, b, other),
            (Column::Vec2(a), Column::Vec2(b)) => each(a, b, other),
            (Column::Vec3(a), Column::Vec3(b)) => each(a, b, other),
            (Column::Vec4(a), Column::Vec4(b)) => each(a, b, other),
            (Column::Mat4(a), Column::Mat4(b)) => each(a, b, other),
            (Column::Corner { corner: a, held: x, .. }, Column::Corner { corner: b, held: y, .. }) => (a, x) == (b, y),
            (Column::Node { of: a, matrix: x }, Column::Node { of: b, matrix: y }) => {
                let same = x == y && [a.len(), b.len()] == [other.len(); 2];
                // The transforms beside it mark its rows.
                if same && *x != NodeMatrix::InverseTranspose {
                    a.differ(b).into_iter().for_each(|rows| other[rows].fill(true));
                }
                same
            }
            (Column::Box { of: a, upper: x }, Column::Box { of: b, upper: y }) => x == y && a.mark(b, other),
            _ => false,
        }
    }

    /// The value in a row.
    pub fn get(&self, row: usize) -> Option<Value> {
        match self {
            Column::Corner { of, corner, held } => of.get(row, *corner, *held),
            Column::Node { of, matrix } => matrix.get(of, row),
            Column::Box { of, upper } => of.corner(row, *upper).map(Value::Vec3),
            Column::Uint(v) => v.get(row).map(|x| Value::Uint(*x)),
            Column::Float(v) => v.get(row).map(|x| Value::Float(*x)),
            Column::Vec2(v) => v.get(row).map(|x| Value::Vec2(*x)),
            Column::Vec3(v) => v.get(row).map(|x| Value::Vec3(*x)),
            Column::Vec4(v) => v.get(row).map(|x| Value::Vec4(*x)),
            Column::Mat4(v) => v.get(row).map(|x| Value::Mat4(*x)),
        }
    }
}
