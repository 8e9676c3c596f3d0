//! An octree in a box, with probes at the corners of its leaves.
//!
//! The box is cut into `roots`, each of which may be halved along all axes `levels` times. The smallest cells that can
//! come of it make a lattice: leaves begin at its cells, probes stand at its points. Leaves without surfaces in them
//! have no probes of their own: no light is ever asked for there.
#define_import_path lightgraph::probe_tree

struct Tree {
    roots: vec3u,
    levels: u32,
    /// The box, metres.
    grid_min: vec3f,
    grid_max: vec3f,
    /// Distance of the outer probes from the box, as a share of its shortest edge.
    margin: f32,
}
var<uniform> tree: Tree;

/// What is known of the light at a point of the lattice before probes are placed.
struct Sketch {
    /// Coefficients (0,0) (1,-1) (1,0) (1,1), the mean of the channels, as a Lambert surface weighs them.
    light: vec4f,
    /// Share of the directions that do not show the back of a single-sided surface.
    open: f32,
}

/// Points that are less open than this lie inside solids.
const OPEN: f32 = 0.5;

/// In place of a probe, where there is none.
const NO_PROBE: u32 = 0xffffffffu;

/// Cells of the lattice along x, y, z.
fn cells() -> vec3u {
    return tree.roots << vec3u(tree.levels);
}

/// Points of the lattice along x, y, z.
fn points() -> vec3u {
    return cells() + 1u;
}

/// Number of a cell or point among `counts` along the axes: x fastest, then y, then z.
fn pack(at: vec3u, counts: vec3u) -> u32 {
    return (at.z * counts.y + at.y) * counts.x + at.x;
}

/// The inverse of `pack`.
fn unpack(number: u32, counts: vec3u) -> vec3u {
    return vec3u(number % counts.x, number / counts.x % counts.y, number / (counts.x * counts.y));
}

/// The corner of the lattice with the least coordinates, metres.
fn low() -> vec3f {
    return tree.grid_min + inside();
}

/// Edges of the lattice's cells, metres.
fn cell_size() -> vec3f {
    return (tree.grid_max - tree.grid_min - 2.0 * inside()) / vec3f(cells());
}

/// Distance of the lattice from the box, metres.
fn inside() -> f32 {
    let edges = tree.grid_max - tree.grid_min;
    return tree.margin * min(edges.x, min(edges.y, edges.z));
}

/// Where a point of the lattice stands.
fn point_position(point: vec3u) -> vec3f {
    return low() + vec3f(point) * cell_size();
}

/// Number of cells above `level`: where the level begins in a table of all levels, the roots first.
fn level_start(level: u32) -> u32 {
    let roots = tree.roots.x * tree.roots.y * tree.roots.z;
    return roots * ((1u << (3u * level)) - 1u) / 7u;
}
