//! Meshes to one vertex and one index array.

mod flipped;
mod placing;

use flipped::Flipped;
pub(super) use placing::assemble;

use super::{
    clusters::Cluster,
    deform::Owners,
    deformer::{Deformable, Deformer},
    document::{Document, ElementIndices, Vectors, place},
    tangents,
};
use crate::diag::Diagnostic;
use glam::{DVec3, Mat4, Vec3};
use gltf::json::{
    Accessor, Index, Mesh,
    mesh::{Mode, Primitive as RawPrimitive, Semantic},
    validation::Checked,
};

/// A vertex as the draw passes see it. A shader names the attributes it wants.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// In the node's space, metres.
    pub position: [f32; 3],
    /// In the node's space, unit length.
    pub normal: [f32; 3],
    pub uv: [f32; 2],
    /// Row of the `nodes` table.
    pub node: u32,
    /// Row of the `materials` table.
    pub material: u32,
}

/// The attributes of [`Vertex`]: name, format, byte offset.
pub const VERTEX_ATTRIBUTES: [(&str, wgpu_types::VertexFormat, u64); 5] = [
    ("position", wgpu_types::VertexFormat::Float32x3, 0),
    ("normal", wgpu_types::VertexFormat::Float32x3, 12),
    ("uv", wgpu_types::VertexFormat::Float32x2, 24),
    ("node", wgpu_types::VertexFormat::Uint32, 32),
    ("material", wgpu_types::VertexFormat::Uint32, 36),
];

/// One indexed triangle list; counter-clockwise triangles face front.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Geometry {
    pub vertices: Vec<Vertex>,
    /// Triangles of single-sided materials come first, each part in the order of its clusters.
    pub indices: Vec<u32>,
    /// How many indices belong to single-sided materials.
    pub one_sided: u32,
    /// All triangles, one group after the other.
    pub clusters: Vec<Cluster>,
    pub more: More,
    /// Whose the rows of the `nodes` table are that belong to vertices.
    pub owners: Owners,
}

/// What only some scenes' vertices have. Each list is empty, or has as many as there are vertices.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct More {
    /// A second set of texture coordinates.
    pub uvs: Vec<[f32; 2]>,
    /// Linear; base colours are multiplied by them.
    pub colors: Vec<[f32; 4]>,
    /// In the node's space, unit length; in w the side of the third axis, 1 or -1.
    pub tangents: Vec<[f32; 4]>,
}

impl More {
    /// A vertex's second texture coordinates; zeros without.
    pub fn uv(&self, vertex: usize) -> [f32; 2] {
        self.uvs.get(vertex).copied().unwrap_or([0.0; 2])
    }

    /// A vertex's colour; white without.
    pub fn color(&self, vertex: usize) -> [f32; 4] {
        self.colors.get(vertex).copied().unwrap_or([1.0; 4])
    }

    /// A vertex's tangent; an axis without.
    pub fn tangent(&self, vertex: usize) -> [f32; 4] {
        self.tangents.get(vertex).copied().unwrap_or([1.0, 0.0, 0.0, 1.0])
    }
}

impl Geometry {
    /// The node that shows a triangle, by its place in the indices.
    pub(super) fn node(&self, triangle: usize) -> u32 {
        self.owners.node(self.vertices[self.indices[3 * triangle] as usize].node)
    }

    /// How many of the clusters belong to single-sided materials; they come first.
    pub fn one_sided_clusters(&self) -> usize {
        self.clusters.iter().take_while(|c| c.first < self.one_sided).count()
    }
}

/// A mesh's primitive, checked, in the mesh's own space. Vertices and indices stay in the document.
pub(super) struct Primitive<'d> {
    positions: Vectors<'d, 3>,
    normals: Option<Vectors<'d, 3>>,
    uvs: [Option<Vectors<'d, 2>>; 2],
    colors: Option<Colors<'d>>,
    tangents: Tangents<'d>,
    triangles: Triangles<'d>,
    /// What skins and morph targets need.
    pub deformable: Deformable<'d>,
    /// How many of the triangles have an area; the others are not drawn.
    drawn: usize,
    /// Row of the `materials` table.
    material: u32,
    flipped: Flipped,
}

/// Vertex colours, without alpha or with it.
#[derive(Clone, Copy)]
enum Colors<'d> {
    Opaque(Vectors<'d, 3>),
    Clear(Vectors<'d, 4>),
}

impl Colors<'_> {
    fn len(self) -> usize {
        match self {
            Colors::Opaque(v) => v.len(),
            Colors::Clear(v) => v.len(),
        }
    }

    fn get(self, place: usize) -> [f32; 4] {
        match self {
            Colors::Opaque(v) => Vec3::from(v.get(place)).extend(1.0).to_array(),
            Colors::Clear(v) => v.get(place),
        }
    }
}

/// The frames of normal maps.
enum Tangents<'d> {
    /// Nothing needs any.
    None,
    Given(Vectors<'d, 4>),
    /// By drawn triangle: of its corners.
    Made(Vec<[[f32; 4]; 3]>),
}

/// Vertices, by their indices where there are any, taken as triangles.
#[derive(Clone, Copy)]
struct Triangles<'d> {
    mode: Mode,
    indices: Option<ElementIndices<'d>>,
    /// How many indices, or vertices without them.
    count: usize,
}

impl<'d> Triangles<'d> {
    /// The index at a place below the count.
    fn index(self, place: usize) -> u32 {
        self.indices.map_or(place as u32, |indices| indices.get(place))
    }

    fn indices(self) -> impl Iterator<Item = u32> + use<'d> {
        (0..self.count).map(move |i| self.index(i))
    }

    fn len(self) -> usize {
        triangles(self.mode, self.count)
    }

    /// Source: glTF 2.0, section 3.7.2.1: strips {vᵢ, vᵢ₊₁₊ᵢ%₂, vᵢ₊₂₋ᵢ%₂}, fans {vᵢ₊₁, vᵢ₊₂, v₀}.
    fn iter(self) -> impl Iterator<Item = [u32; 3]> + use<'d> {
        let places = move |i: usize| match self.mode {
            Mode::TriangleStrip => [i, i + 1 + i % 2, i + 2 - i % 2],
            Mode::TriangleFan => [i + 1, i + 2, 0],
            _ => [3 * i, 3 * i + 1, 3 * i + 2],
        };
        (0..self.len()).map(move |i| places(i).map(|place| self.index(place)))
    }
}

/// How many triangles so many vertices are.
fn triangles(mode: Mode, vertices: usize) -> usize {
    match mode {
        Mode::Triangles => vertices / 3,
        Mode::TriangleStrip | Mode::TriangleFan => vertices.saturating_sub(2),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => 0,
    }
}

impl Primitive<'_> {
    /// The corners of a triangle.
    fn corners(&self, triangle: [u32; 3]) -> [Vec3; 3] {
        triangle.map(|i| self.positions.get(i as usize).into())
    }

    /// Row of the `materials` table.
    pub fn material(&self) -> usize {
        self.material as usize
    }

    /// Whether a vertex is less than opaque by itself.
    pub fn is_thin(&self) -> bool {
        matches!(self.colors, Some(Colors::Clear(v)) if v.iter().any(|c| c[3] < 1.0))
    }

    /// A triangle's normal, or those of its vertices.
    fn normal(&self, vertex: u32, flat: Vec3) -> Vec3 {
        let given = self.normals.map(|normals| Vec3::from(normals.get(vertex as usize)));
        let given = given.and_then(Vec3::try_normalize);
        given.map_or(flat, |n| if self.flipped == Flipped::Normals { -n } else { n })
    }
}

/// A primitive at a node.
pub(super) struct Instance<'a> {
    pub primitive: &'a Primitive<'a>,
    /// Row of the `nodes` table.
    pub node: u32,
    pub node_name: &'a str,
    /// Node to world, before any motion.
    pub world: Mat4,
    /// Where its vertices move by more than the node.
    pub deformer: Option<&'a Deformer<'a>>,
    pub double_sided: bool,
}

/// What a primitive needs to know of its material.
pub(super) struct Surface {
    /// Row of the `materials` table.
    pub material: u32,
    /// Whether it is anything but unlit.
    pub lit: bool,
    /// The texture coordinates that its textures take.
    pub uv_sets: [Option<u32>; 2],
    /// Which of them its normal map takes, where it has one.
    pub normal_map: Option<u32>,
}

/// Triangles over all instances. Vertices and indices of more would not fit a GPU buffer, and a file of a few
/// kilobytes can ask for any number by placing one mesh at many nodes.
pub(super) const MAX_TRIANGLES: usize = 1 << 24;

/// Vectors and indices that all primitives together are read from. A file of a few kilobytes can ask for any number
/// by making many primitives of one accessor; primitives of [`MAX_TRIANGLES`] that share nothing stay below.
pub(super) const MAX_ELEMENTS: usize = 1 << 29;

/// Metres. Squared distances between farther points leave the range of `f32` arithmetic that shaders do.
pub(super) const MAX_COORDINATE: f32 = 1e9;

/// How many triangles a mesh has, with those that have no area, and how many elements of accessors its primitives are
/// read from. Nothing is read yet.
pub(super) fn extent(document: &Document<'_>, mesh: &Mesh) -> [usize; 2] {
    let of = |raw: &RawPrimitive| {
        let Checked::Valid(mode) = raw.mode else { return [0; 2] };
        let count = |accessor: Index<Accessor>| document.count(accessor.value());
        let listed = raw.indices.or_else(|| raw.attributes.get(&Checked::Valid(Semantic::Positions)).copied());
        let targets = raw.targets.iter().flatten().flat_map(|t| [t.positions, t.normals]);
        let named = raw.attributes.values().copied().chain(raw.indices).chain(targets.flatten());
        [triangles(mode, listed.map_or(0, count)), named.map(count).fold(0, usize::saturating_add)]
    };
    mesh.primitives.iter().map(of).fold([0; 2], |[a, b], [t, e]| [a.saturating_add(t), b.saturating_add(e)])
}

/// Reads one primitive. `None` when there is nothing to draw; the faults say why.
pub(super) fn primitive<'d>(
    document: &'d Document<'_>,
    raw: &RawPrimitive,
    at: &str,
    surface: &Surface,
    faults: &mut Vec<Diagnostic>,
) -> Option<Primitive<'d>> {
    let Checked::Valid(mode) = raw.mode else {
        faults.push(document.error(at, "unknown primitive mode"));
        return None;
    };
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        faults.push(document.warning(at, format!("{mode:?} are not drawn; only triangles are")));
        return None;
    }
    let attribute = |semantic| raw.attributes.get(&Checked::Valid(semantic)).map(gltf::json::Index::value);
    let Some(position) = attribute(Semantic::Positions) else {
        faults.push(document.error(at, "it has no POSITION"));
        return None;
    };
    let before = faults.len();
    let positions = vectors(document, at, "POSITION", position, faults)?;
    let count = positions.len();
    let normals = attribute(Semantic::Normals).and_then(|a| vectors(document, at, "NORMAL", a, faults));
    let normals = normals.filter(|n| same_count(document, at, "NORMAL", n.len(), count, faults));
    let uvs =
        surface.uv_sets.map(|set| set.and_then(|set| texture_coordinates(document, at, set, attribute, count, faults)));
    let colors = attribute(Semantic::Colors(0)).and_then(|a| vertex_colors(document, at, a, count, faults));
    let tangents = attribute(Semantic::Tangents).filter(|_| surface.normal_map.is_some());
    let tangents = tangents.and_then(|a| given_tangents(document, at, a, count, faults));
    let deformable = Deformable::read(document, raw, at, count, faults);
    let indices = match raw.indices.as_ref().map(|index| document.indices(index.value())).transpose() {
        Ok(indices) => indices,
        Err(why) => {
            faults.push(document.error(at, format!("indices: {why}")));
            None
        }
    };
    // Without indices as many vertices as an index can name.
    let listed = indices.map_or(count.min(u32::MAX as usize), ElementIndices::len);
    let triangles = Triangles { mode, indices, count: listed };
    if let Some(wrong) = triangles.indices().find(|i| *i as usize >= count)
        && faults.len() == before
    {
        let why = format!("index {wrong} is out of range: it has {count} vertices");
        faults.push(document.error(at, why).help("export the mesh again; primitive restart is not part of glTF"));
    }
    if faults[before..].iter().any(|d| d.severity == crate::diag::Severity::Error) {
        return None;
    }
    if mode == Mode::Triangles && listed % 3 != 0 {
        let left = listed % 3;
        faults.push(
            document.warning(at, format!("{listed} vertices do not make whole triangles; the last {left} are ignored")),
        );
    }
    let tangents = tangents.map_or(Tangents::None, Tangents::Given);
    let material = surface.material;
    let flipped = Flipped::Nothing;
    let mut primitive =
        Primitive { positions, normals, uvs, colors, tangents, triangles, deformable, drawn: 0, material, flipped };
    // What no light shows is often the far side of a model, made larger and turned inside out, as its outline.
    primitive.flipped = if surface.lit { primitive.contradiction() } else { Flipped::Nothing };
    faults.extend(primitive.flipped.notice().map(|what| document.warning(at, what)));
    primitive.drawn = triangles.iter().filter(|t| has_area(primitive.corners(*t))).count();
    if let (Some(set), Tangents::None) = (surface.normal_map, &primitive.tangents) {
        primitive.tangents = Tangents::Made(made_tangents(&primitive, set as usize));
    }
    // Strips repeat vertices on purpose to jump; only a strip of nothing else is worth a word.
    let (all, drawn) = (triangles.len(), primitive.drawn);
    if drawn < all && (mode == Mode::Triangles || drawn == 0) {
        let dropped = all - drawn;
        faults.push(document.warning(at, format!("{dropped} of {all} triangles have no area and are dropped")));
    }
    (drawn > 0).then_some(primitive)
}

/// Tangents of the corners of drawn triangles, by the coordinates of a set.
fn made_tangents(primitive: &Primitive<'_>, set: usize) -> Vec<[[f32; 4]; 3]> {
    let drawn = primitive.triangles.iter().filter(|t| has_area(primitive.corners(*t)));
    let corners: Vec<[tangents::Corner; 3]> = drawn
        .map(|triangle| {
            let flat = face_normal(primitive.corners(triangle));
            triangle.map(|index| tangents::Corner {
                position: primitive.positions.get(index as usize),
                normal: primitive.normal(index, flat).to_array(),
                uv: primitive.uvs[set.min(1)].map_or([0.0; 2], |uvs| uvs.get(index as usize)),
            })
        })
        .collect();
    tangents::made(&corners)
}

/// Whether a triangle is more than a line or a point, as far as `f32` corners can tell.
fn has_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    longest > 0.0 && (b - a).cross(c - a).length() > 1e-9 * longest
}

/// Unit normal of a triangle that has an area.
pub(super) fn face_normal(corners: [Vec3; 3]) -> Vec3 {
    let [a, b, c]: [DVec3; 3] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero().as_vec3()
}

fn vectors<'d>(
    document: &'d Document<'_>,
    at: &str,
    what: &str,
    accessor: usize,
    faults: &mut Vec<Diagnostic>,
) -> Option<Vectors<'d, 3>> {
    let values = match document.floats::<3>(accessor) {
        Ok(values) => values,
        Err(why) => {
            faults.push(document.error(at, format!("{what}: {why}")));
            return None;
        }
    };
    if let Some((i, v)) = values.iter().enumerate().find(|(_, v)| !in_range(v)) {
        let bad = values.iter().filter(|v| !in_range(v)).count();
        let why = format!("{what} of vertex {i} is {v:?}, no usable vector ({bad} like it)");
        faults.push(document.error(at, why).help(format!("components must be finite and within ±{MAX_COORDINATE:e}")));
        return None;
    }
    Some(values)
}

fn vertex_colors<'d>(
    document: &'d Document<'_>,
    at: &str,
    accessor: usize,
    count: usize,
    faults: &mut Vec<Diagnostic>,
) -> Option<Colors<'d>> {
    let found = match document.is_vec3(accessor) {
        true => document.floats::<3>(accessor).map(Colors::Opaque),
        false => document.floats::<4>(accessor).map(Colors::Clear),
    };
    let colors = found.map_err(|why| faults.push(document.error(at, format!("COLOR_0: {why}")))).ok()?;
    if !same_count(document, at, "COLOR_0", colors.len(), count, faults) {
        return None;
    }
    let bad = (0..count).find(|i| !colors.get(*i).iter().all(|x| (0.0..=MAX_COORDINATE).contains(x)));
    if let Some(i) = bad {
        let color = colors.get(i);
        let why = format!("COLOR_0 of vertex {i} is {color:?}, no usable colour; its colours are left out");
        faults.push(document.warning(at, why));
        return None;
    }
    // White changes nothing.
    (0..count).any(|i| colors.get(i) != [1.0; 4]).then_some(colors)
}

fn given_tangents<'d>(
    document: &'d Document<'_>,
    at: &str,
    accessor: usize,
    count: usize,
    faults: &mut Vec<Diagnostic>,
) -> Option<Vectors<'d, 4>> {
    let found = document.floats::<4>(accessor).map_err(|why| format!("TANGENT: {why}"));
    let tangents = found.map_err(|why| faults.push(document.error(at, why))).ok()?;
    if let Some((i, v)) = tangents.iter().enumerate().find(|(_, v)| !in_range(v)) {
        faults.push(document.error(at, format!("TANGENT of vertex {i} is {v:?}, no usable vector")));
        return None;
    }
    same_count(document, at, "TANGENT", tangents.len(), count, faults).then_some(tangents)
}

fn texture_coordinates<'d>(
    document: &'d Document<'_>,
    at: &str,
    set: u32,
    attribute: impl Fn(Semantic) -> Option<usize>,
    count: usize,
    faults: &mut Vec<Diagnostic>,
) -> Option<Vectors<'d, 2>> {
    let what = format!("TEXCOORD_{set}");
    let Some(accessor) = attribute(Semantic::TexCoords(set)) else {
        faults.push(document.warning(at, format!("its material has a texture, but it has no {what}; (0, 0) is used")));
        return None;
    };
    match document.floats::<2>(accessor) {
        Ok(values) => {
            if let Some((i, v)) = values.iter().enumerate().find(|(_, v)| !in_range(v)) {
                faults.push(document.error(at, format!("{what} of vertex {i} is {v:?}, no usable vector")));
                return None;
            }
            same_count(document, at, &what, values.len(), count, faults).then_some(values)
        }
        Err(why) => {
            faults.push(document.error(at, format!("{what}: {why}")));
            None
        }
    }
}

fn in_range(v: &[f32]) -> bool {
    v.iter().all(|x| x.abs() <= MAX_COORDINATE)
}

fn same_count(
    document: &Document<'_>,
    at: &str,
    what: &str,
    found: usize,
    wanted: usize,
    faults: &mut Vec<Diagnostic>,
) -> bool {
    if found != wanted {
        faults.push(document.error(at, format!("{found} of {what}, but {wanted} of POSITION")));
    }
    found == wanted
}

/// `meshes[i] "name" primitive j`.
pub(super) fn primitive_place(mesh: usize, name: Option<&str>, primitive: usize) -> String {
    format!("{} primitive {primitive}", place("meshes", mesh, name))
}
