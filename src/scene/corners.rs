//! What vertices hold at the corners of triangles, in world space: worked out where it is asked for, since tables of it
//! would take more memory than the scene.

use super::{Vertex, geometry::Geometry, model::Scene, motion::Pose};
use crate::value::Value;
use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};
use std::ops::Range;
use std::sync::Arc;

/// The triangles of a scene at a pose, in some order.
#[derive(Debug, PartialEq)]
pub struct Corners {
    geometry: Arc<Geometry>,
    /// Node to world, by node.
    nodes: Vec<Mat4>,
    /// The same for normals.
    normals: Vec<Mat3>,
    order: Arc<TriangleOrder>,
    /// Row of the `emitters` table, by triangle in the order of indices; empty where no shader needs it.
    emitters: Arc<Vec<u32>>,
}

/// The triangles of a scene in some order, the same at all poses.
#[derive(Debug, PartialEq)]
pub(super) struct TriangleOrder {
    /// By row.
    pub triangles: Arc<Vec<u32>>,
    /// Rows of one node that follow on each other: the node, and where they end.
    runs: Vec<(u32, usize)>,
}

impl TriangleOrder {
    /// Triangles of a scene, each below the number that it has.
    pub(super) fn new(geometry: &Geometry, triangles: Arc<Vec<u32>>) -> TriangleOrder {
        let mut runs: Vec<(u32, usize)> = vec![];
        for (row, triangle) in triangles.iter().enumerate() {
            // A mesh is of one node, and so are all corners of its triangles.
            let node = geometry.node(*triangle as usize);
            match runs.last_mut() {
                Some((last, end)) if *last == node => *end = row + 1,
                _ => runs.push((node, row + 1)),
            }
        }
        runs.shrink_to_fit();
        TriangleOrder { triangles, runs }
    }
}

/// What a vertex holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VertexAttribute {
    /// World space, metres.
    Position,
    /// World space, unit length.
    Normal,
    Uv,
    /// The second set of texture coordinates.
    SecondUv,
    Color,
    /// World space, unit length; in w the side of the third axis.
    Tangent,
    /// Row of the `materials` table.
    Material,
    /// Row of the `emitters` table; `0xffffffff` for none.
    Emitter,
}

impl Corners {
    pub(super) fn new(scene: &Scene, pose: &Pose, order: Arc<TriangleOrder>) -> Corners {
        let normals = pose.nodes.iter().map(normal_matrix).collect();
        let emitters = scene.emitter_rows();
        Corners { geometry: scene.geometry.clone(), nodes: pose.nodes.clone(), normals, order, emitters }
    }

    /// Node to world, by node.
    pub(super) fn nodes(&self) -> &[Mat4] {
        &self.nodes
    }

    /// Marks the rows that hold something else than at an earlier pose; `None`: they are of other triangles.
    pub(super) fn mark(&self, before: &Corners, other: &mut [bool]) -> Option<()> {
        let order = Arc::ptr_eq(&self.order, &before.order) || self.order == before.order;
        let same = Arc::ptr_eq(&self.geometry, &before.geometry) && order;
        if !same || self.nodes.len() != before.nodes.len() || other.len() != self.rows() {
            return None;
        }
        before.moved(&self.nodes).for_each(|rows| other[rows].fill(true));
        Some(())
    }

    /// The rows whose triangles stand elsewhere when the nodes stand here.
    pub(super) fn moved<'a>(&'a self, nodes: &'a [Mat4]) -> impl Iterator<Item = Range<usize>> + 'a {
        let runs = &self.order.runs;
        let starts = std::iter::once(0).chain(runs.iter().map(|(_, end)| *end));
        let changed = self.geometry.owners.changed(&self.nodes, nodes);
        let other = starts.zip(runs).filter(move |(_, (node, _))| changed.get(*node as usize) != Some(&false));
        other.map(|(start, (_, end))| start..*end)
    }

    pub(super) fn order(&self) -> &Arc<TriangleOrder> {
        &self.order
    }

    /// How many rows there are.
    pub fn rows(&self) -> usize {
        self.order.triangles.len()
    }

    /// The vertex at a corner (0 to 2) of a row below [`Corners::rows`].
    pub fn vertex(&self, row: usize, corner: usize) -> &Vertex {
        let Geometry { vertices, indices, .. } = &*self.geometry;
        &vertices[indices[3 * self.order.triangles[row] as usize + corner] as usize]
    }

    /// The node that shows the triangle of a row below [`Corners::rows`].
    pub fn node(&self, row: usize) -> u32 {
        self.geometry.node(self.order.triangles[row] as usize)
    }

    /// The vertex of a corner of a row below [`Corners::rows`], as a place in the geometry.
    fn place(&self, row: usize, corner: usize) -> usize {
        self.geometry.indices[3 * self.order.triangles[row] as usize + corner] as usize
    }

    fn tangent(&self, row: usize, corner: usize) -> Vec4 {
        let place = self.place(row, corner);
        let tangent = Vec4::from(self.geometry.more.tangent(place));
        let node = Mat3::from_mat4(self.nodes[self.geometry.vertices[place].node as usize]);
        let turned = (node * tangent.truncate()).try_normalize().unwrap_or(Vec3::X);
        // What mirrors turns the third axis round.
        turned.extend(tangent.w * if node.determinant() < 0.0 { -1.0 } else { 1.0 })
    }

    fn emitter(&self, row: usize) -> u32 {
        self.emitters.get(self.order.triangles[row] as usize).copied().unwrap_or(u32::MAX)
    }

    pub fn position(&self, vertex: &Vertex) -> Vec3 {
        self.nodes[vertex.node as usize].transform_point3(vertex.position.into())
    }

    pub fn normal(&self, vertex: &Vertex) -> Vec3 {
        let turned = self.normals[vertex.node as usize] * Vec3::from(vertex.normal);
        turned.try_normalize().unwrap_or(Vec3::Y)
    }

    /// What is held at a corner (0 to 2) of a row; `None` past the rows.
    pub fn get(&self, row: usize, corner: usize, held: VertexAttribute) -> Option<Value> {
        let vertex = (row < self.rows()).then(|| self.vertex(row, corner))?;
        Some(match held {
            VertexAttribute::Position => Value::Vec3(self.position(vertex)),
            VertexAttribute::Normal => Value::Vec3(self.normal(vertex)),
            VertexAttribute::Uv => Value::Vec2(Vec2::from(vertex.uv)),
            VertexAttribute::SecondUv => Value::Vec2(Vec2::from(self.geometry.more.uv(self.place(row, corner)))),
            VertexAttribute::Color => Value::Vec4(Vec4::from(self.geometry.more.color(self.place(row, corner)))),
            VertexAttribute::Tangent => Value::Vec4(self.tangent(row, corner)),
            VertexAttribute::Material => Value::Uint(vertex.material),
            VertexAttribute::Emitter => Value::Uint(self.emitter(row)),
        })
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
