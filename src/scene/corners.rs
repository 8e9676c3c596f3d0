//! What vertices hold at the corners of triangles, in world space: worked out where it is asked for, since tables of it
//! would take more memory than the scene.

use super::{
    geometry::Geometry,
    model::Scene,
    motion::Pose,
    transforms::{Transforms, normal_matrix},
};
use crate::value::{Type, Value};
use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};
use std::ops::{Index, Range};
use std::sync::Arc;

/// The triangles of a scene at a pose, in some order.
#[derive(Debug, PartialEq)]
pub struct Corners {
    geometry: Arc<Geometry>,
    nodes: Transforms,
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

    /// Rows of one node that follow on each other, with it.
    fn runs(&self) -> impl Iterator<Item = (Range<usize>, u32)> + '_ {
        let starts = std::iter::once(0).chain(self.runs.iter().map(|(_, end)| *end));
        starts.zip(&self.runs).map(|(start, (node, end))| (start..*end, *node))
    }
}

/// World-space values of vertices that follow on each other in the geometry.
#[derive(Debug)]
pub(super) struct VertexRun<T> {
    first: usize,
    values: Vec<T>,
}

impl<T> VertexRun<T> {
    /// `place`: where the vertices are that values are wanted of.
    pub(super) fn of(places: Range<usize>, value: impl FnMut(usize) -> T) -> VertexRun<T> {
        VertexRun { first: places.start, values: places.map(value).collect() }
    }
}

impl<T> Index<u32> for VertexRun<T> {
    type Output = T;

    /// The value of a vertex by its place in the geometry.
    fn index(&self, vertex: u32) -> &T {
        &self.values[vertex as usize - self.first]
    }
}

/// The least range round all of these; empty without any.
pub(super) fn around(places: impl IntoIterator<Item = u32>) -> Range<usize> {
    let (low, high) = places.into_iter().fold((u32::MAX, 0), |(low, high), i| (low.min(i), high.max(i + 1)));
    low.min(high) as usize..high as usize
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

impl VertexAttribute {
    /// Of its values.
    pub fn ty(self) -> Type {
        match self {
            VertexAttribute::Position | VertexAttribute::Normal => Type::Vec3,
            VertexAttribute::Uv | VertexAttribute::SecondUv => Type::Vec2,
            VertexAttribute::Color | VertexAttribute::Tangent => Type::Vec4,
            VertexAttribute::Material | VertexAttribute::Emitter => Type::Uint,
        }
    }

    /// Whether its values are in world space, so that they change when nodes move.
    pub fn in_world_space(self) -> bool {
        matches!(self, VertexAttribute::Position | VertexAttribute::Normal | VertexAttribute::Tangent)
    }
}

impl Corners {
    pub(super) fn new(scene: &Scene, pose: &Pose, order: Arc<TriangleOrder>) -> Corners {
        let emitters = scene.emitter_rows();
        Corners { geometry: scene.geometry.clone(), nodes: pose.nodes.clone(), order, emitters }
    }

    pub fn nodes(&self) -> &Transforms {
        &self.nodes
    }

    /// Marks the rows that hold something else than at an earlier pose; `None`: they are of other triangles.
    pub(super) fn mark(&self, before: &Corners, other: &mut [bool]) -> Option<()> {
        let order = Arc::ptr_eq(&self.order, &before.order) || self.order == before.order;
        let same = Arc::ptr_eq(&self.geometry, &before.geometry) && order;
        if !same || self.nodes.len() != before.nodes.len() || other.len() != self.rows() {
            return None;
        }
        before.moved(&self.nodes).for_each(|(rows, _)| other[rows].fill(true));
        Some(())
    }

    /// The rows whose triangles stand elsewhere when the nodes stand here, in their order and with their nodes.
    pub(super) fn moved<'a>(&'a self, nodes: &'a [Mat4]) -> impl Iterator<Item = (Range<usize>, u32)> + 'a {
        let changed = self.geometry.owners.changed(&self.nodes, nodes);
        self.order.runs().filter(move |(_, node)| changed.get(*node as usize) != Some(&false))
    }

    pub(super) fn order(&self) -> &Arc<TriangleOrder> {
        &self.order
    }

    /// How many rows there are.
    pub fn rows(&self) -> usize {
        self.order.triangles.len()
    }

    /// The vertices at the corners of a row below [`Corners::rows`], as places in the geometry.
    pub fn vertices(&self, row: usize) -> [u32; 3] {
        let first = 3 * self.order.triangles[row] as usize;
        let indices = &self.geometry.indices[first..first + 3];
        [indices[0], indices[1], indices[2]]
    }

    /// The corners of a triangle by its number in the scene.
    pub(super) fn triangle(&self, triangle: usize) -> [Vec3; 3] {
        [0, 1, 2].map(|corner| self.position(self.geometry.indices[3 * triangle + corner]))
    }

    fn position(&self, vertex: u32) -> Vec3 {
        let vertex = &self.geometry.vertices[vertex as usize];
        self.nodes[vertex.node as usize].transform_point3(vertex.position.into())
    }

    fn normal(&self, vertex: u32) -> Vec3 {
        let vertex = &self.geometry.vertices[vertex as usize];
        let turned = normal_matrix(&self.nodes[vertex.node as usize]) * Vec3::from(vertex.normal);
        turned.try_normalize().unwrap_or(Vec3::Y)
    }

    fn tangent(&self, vertex: u32) -> Vec4 {
        let tangent = Vec4::from(self.geometry.more.tangent(vertex as usize));
        let node = Mat3::from_mat4(self.nodes[self.geometry.vertices[vertex as usize].node as usize]);
        let turned = (node * tangent.truncate()).try_normalize().unwrap_or(Vec3::X);
        // What mirrors turns the third axis round.
        turned.extend(tangent.w * if node.determinant() < 0.0 { -1.0 } else { 1.0 })
    }

    /// What is held at a corner (0 to 2) of a row; `None` past the rows.
    pub fn get(&self, row: usize, corner: usize, held: VertexAttribute) -> Option<Value> {
        let vertex = (row < self.rows()).then(|| self.vertices(row)[corner])?;
        let (Geometry { vertices, more, .. }, place) = (&*self.geometry, vertex as usize);
        Some(match held {
            VertexAttribute::Position => Value::Vec3(self.position(vertex)),
            VertexAttribute::Normal => Value::Vec3(self.normal(vertex)),
            VertexAttribute::Uv => Value::Vec2(Vec2::from(vertices[place].uv)),
            VertexAttribute::SecondUv => Value::Vec2(Vec2::from(more.uv(place))),
            VertexAttribute::Color => Value::Vec4(Vec4::from(more.color(place))),
            VertexAttribute::Tangent => Value::Vec4(self.tangent(vertex)),
            VertexAttribute::Material => Value::Uint(vertices[place].material),
            VertexAttribute::Emitter => {
                let triangle = self.order.triangles[row] as usize;
                Value::Uint(self.emitters.get(triangle).copied().unwrap_or(u32::MAX))
            }
        })
    }
}
