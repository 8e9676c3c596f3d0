//! Where the nodes of a scene are: one list, shared by all that is made of it.

use crate::content::hash;
use crate::value::Value;
use glam::{Mat3, Mat4};
use std::ops::{Deref, DerefMut, Range};
use std::sync::{Arc, OnceLock};

/// Rows that are held against earlier ones at once.
const BLOCK: usize = 64;

/// Node to world, for each node; then for each vertex that a skin or morph targets move. A clone shares the list.
#[derive(Debug, Clone, Default)]
pub struct Transforms(Arc<MatrixList>);

#[derive(Debug, Clone, Default)]
struct MatrixList {
    all: Vec<Mat4>,
    key: OnceLock<u128>,
}

impl Transforms {
    /// Stands for the places.
    pub fn key(&self) -> u128 {
        *self.0.key.get_or_init(|| hash(self.bytes()))
    }

    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0.all)
    }

    /// Ranges of rows, in their order, outside of which they are as before, of as many.
    pub fn differ(&self, before: &Transforms) -> Vec<Range<usize>> {
        let mut ranges: Vec<Range<usize>> = vec![];
        if Arc::ptr_eq(&self.0, &before.0) {
            return ranges;
        }
        let bytes = BLOCK * size_of::<Mat4>();
        let blocks = self.bytes().chunks(bytes).zip(before.bytes().chunks(bytes));
        for (i, _) in blocks.enumerate().filter(|(_, (now, then))| now != then) {
            let rows = BLOCK * i..self.len().min(BLOCK * (i + 1));
            match ranges.last_mut() {
                Some(last) if last.end == rows.start => last.end = rows.end,
                _ => ranges.push(rows),
            }
        }
        ranges
    }
}

impl From<Vec<Mat4>> for Transforms {
    fn from(all: Vec<Mat4>) -> Transforms {
        Transforms(Arc::new(MatrixList { all, key: OnceLock::new() }))
    }
}

impl Deref for Transforms {
    type Target = [Mat4];

    fn deref(&self) -> &[Mat4] {
        &self.0.all
    }
}

impl DerefMut for Transforms {
    /// Takes a list of its own where others share it.
    fn deref_mut(&mut self) -> &mut [Mat4] {
        let held = Arc::make_mut(&mut self.0);
        held.key.take();
        &mut held.all
    }
}

/// By bits: 0 and -0 are told apart, as everywhere where results are kept.
impl PartialEq for Transforms {
    fn eq(&self, other: &Transforms) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.bytes() == other.bytes()
    }
}

/// A matrix of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeMatrix {
    Transform,
    /// Turns normals.
    InverseTranspose,
    /// The transform in the frame before.
    PreviousTransform,
}

impl NodeMatrix {
    /// In a row, of transforms at the time that it is of; `None` past the rows.
    pub(super) fn get(self, of: &Transforms, row: usize) -> Option<Value> {
        let transform = of.get(row)?;
        Some(Value::Mat4(match self {
            NodeMatrix::Transform | NodeMatrix::PreviousTransform => *transform,
            NodeMatrix::InverseTranspose => Mat4::from_mat3(normal_matrix(transform)),
        }))
    }
}

/// The matrix that turns normals: the inverse transpose, or where a flattening transform has none, the matrix of
/// cofactors, which points the same way. Normals are to be normalised after it.
pub(super) fn normal_matrix(transform: &Mat4) -> Mat3 {
    let m = Mat3::from_mat4(*transform);
    let inverse = m.inverse().transpose();
    if inverse.is_finite() {
        return inverse;
    }
    let cofactors = Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if cofactors.is_finite() { cofactors } else { Mat3::IDENTITY }
}
