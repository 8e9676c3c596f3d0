//! Probes, and the coefficients they hold. They make a uniform grid in a box; with PROBE_TABLE a grid whose planes
//! along each axis stand where a table says; with PROBE_TREE they stand at the corners of an octree's leaves; with
//! PROBE_VIEW a finer grid that follows the camera comes after the uniform one. In the last two `grid` is but how they
//! are numbered.
//!
//! Coefficients lie in a 3D texture of (grid.x, grid.y, grid.z * COUNT) texels: coefficient k of all probes in the
//! slices from k * grid.z on. The alpha of coefficient (0, 0) tells how open a probe is: alpha 1 in every direction
//! but those that show the back of a single-sided surface, projected as light is.
#define_import_path lightgraph::probes
#import lightgraph::sh::COUNT
#ifdef PROBE_TREE
#import lightgraph::probe_tree
#endif
#ifdef PROBE_VIEW
#import lightgraph::probe_view
#endif

struct Grid {
    /// Probes along x, y, z.
    grid: vec3u,
#ifndef PROBE_TREE
    /// The box, metres.
    grid_min: vec3f,
    grid_max: vec3f,
    /// Distance of the outer probes from the box, in distances between probes.
    inset: f32,
#endif
#ifdef PROBE_VIEW
    /// Probes of the uniform grid along x, y, z.
    coarse: vec3u,
#endif
}
var<uniform> probe_grid: Grid;

/// Coefficient (0, 0) of 1 in every direction: sqrt(4 pi).
const FULLY_OPEN: f32 = 3.54490770181;

/// Grid coordinates of probe number `index`: x fastest, then y, then z.
fn coordinates(index: u32) -> vec3u {
    let n = probe_grid.grid;
    return vec3u(index % n.x, index / n.x % n.y, index / (n.x * n.y));
}

/// Number of a probe: the inverse of `coordinates`.
fn number(probe: vec3u) -> u32 {
    return (probe.z * probe_grid.grid.y + probe.y) * probe_grid.grid.x + probe.x;
}

#ifdef PROBE_TREE
/// For each cell of the lattice the edge of the leaf it lies in, in cells.
var<storage, read> leaf_edges: array<u32>;
/// For each point of the lattice its probe, or `NO_PROBE`.
var<storage, read> point_probes: array<u32>;
/// For each probe its point, or `NO_PROBE`.
var<storage, read> probe_points: array<u32>;

/// Where a probe stands.
fn position(probe: vec3u) -> vec3f {
    let point = probe_points[number(probe)];
    let stands = select(point, 0u, point == probe_tree::NO_PROBE);
    return probe_tree::point_position(probe_tree::unpack(stands, probe_tree::points()));
}

/// The probes round a point: the corners of a leaf that begins at `base` and is `edge` long, in cells of the lattice;
/// `fraction` is how far the point lies towards its far sides.
struct Cell {
    base: vec3u,
    edge: u32,
    fraction: vec3f,
}

/// The leaf that a point in the world lies in. Outside the lattice its nearest face counts.
fn cell(point: vec3f) -> Cell {
    let cells = probe_tree::cells();
    let at = clamp((point - probe_tree::low()) / probe_tree::cell_size(), vec3f(0.0), vec3f(cells));
    let lowest = min(vec3u(at), cells - 1u);
    let edge = leaf_edges[probe_tree::pack(lowest, cells)];
    let base = lowest / edge * edge;
    return Cell(base, edge, (at - vec3f(base)) / f32(edge));
}

/// The probe at a cell's corner number `corner`, or `NO_PROBE`.
fn corner_probe(c: Cell, corner: u32) -> u32 {
    let side = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
    return point_probes[probe_tree::pack(c.base + c.edge * side, probe_tree::points())];
}

/// A cell's corner number `corner`, 0 to 7: bits 0, 1, 2 are the sides along x, y, z.
fn probe_at(c: Cell, corner: u32) -> vec3u {
    let probe = corner_probe(c, corner);
    return coordinates(select(probe, 0u, probe == probe_tree::NO_PROBE));
}

/// Whether a probe stands at a cell's corner.
fn has_probe(c: Cell, corner: u32) -> bool {
    return corner_probe(c, corner) != probe_tree::NO_PROBE;
}
#else
#ifdef PROBE_TABLE
/// Planes along each axis, as `grid` has them: with counts that a compiler knows it unrolls the search.
const ALONG_X: u32 = #{PLANES_X}u;
const ALONG_Y: u32 = #{PLANES_Y}u;
const ALONG_Z: u32 = #{PLANES_Z}u;
/// Planes of the grid along x, then y, then z: x is where one stands in the world, ascending, metres; y is 1 by the
/// distance to the next, of the last 0.
var<uniform> probe_axes: array<vec4f, ALONG_X + ALONG_Y + ALONG_Z>;

/// The edges of the box in mean distances between probes.
fn span() -> vec3f {
    return max(vec3f(probe_grid.grid - 1u) + 2.0 * probe_grid.inset, vec3f(1e-20));
}

/// Where a probe stands.
fn position(probe: vec3u) -> vec3f {
    let y = ALONG_X + probe.y;
    let z = ALONG_X + ALONG_Y + probe.z;
    return vec3f(probe_axes[probe.x].x, probe_axes[y].x, probe_axes[z].x);
}

/// Coordinate in the grid of `at` along an axis of `count` planes that begin at `first` of the table.
fn locate(at: f32, first: u32, count: u32) -> f32 {
    var below = 0.0;
    var plane = probe_axes[first].xy;
    for (var i = 1u; i + 1u < count; i++) {
        let next = probe_axes[first + i].xy;
        let beyond = next.x <= at;
        below = select(below, f32(i), beyond);
        plane = select(plane, next, beyond);
    }
    return below + clamp((at - plane.x) * plane.y, 0.0, 1.0);
}

/// Coordinates in the grid of a point in the world.
fn grid_place(point: vec3f) -> vec3f {
    return vec3f(
        locate(point.x, 0u, ALONG_X),
        locate(point.y, ALONG_X, ALONG_Y),
        locate(point.z, ALONG_X + ALONG_Y, ALONG_Z),
    );
}
#else
/// Probes of the uniform grid along x, y, z.
fn counts() -> vec3u {
#ifdef PROBE_VIEW
    return probe_grid.coarse;
#else
    return probe_grid.grid;
#endif
}

/// The box's edges in distances between probes; a single probe stands in the middle.
fn span() -> vec3f {
    return max(vec3f(counts() - 1u) + 2.0 * probe_grid.inset, vec3f(1e-20));
}

/// Where a probe of the uniform grid stands: min + (i + inset)/(n - 1 + 2 inset) * (max - min).
fn even_position(probe: vec3u) -> vec3f {
    let share = (vec3f(probe) + probe_grid.inset) / span();
    return mix(probe_grid.grid_min, probe_grid.grid_max, select(share, vec3f(0.5), counts() == vec3u(1u)));
}

/// Coordinates in the grid of a point in the world.
fn grid_place(point: vec3f) -> vec3f {
    let extent = max(probe_grid.grid_max - probe_grid.grid_min, vec3f(1e-20));
    let last = vec3f(counts() - 1u);
    return clamp((point - probe_grid.grid_min) / extent * span() - probe_grid.inset, vec3f(0.0), last);
}

#ifndef PROBE_VIEW
/// Where a probe stands.
fn position(probe: vec3u) -> vec3f {
    return even_position(probe);
}
#endif
#endif

#ifdef PROBE_VIEW
/// Probes of the uniform grid.
fn coarse_count() -> u32 {
    return probe_grid.coarse.x * probe_grid.coarse.y * probe_grid.coarse.z;
}

/// Where a probe stands.
fn position(probe: vec3u) -> vec3f {
    let index = number(probe);
    if index < coarse_count() {
        return even_position(probe_view::unpack(index, probe_grid.coarse));
    }
    return probe_view::position(index - coarse_count());
}

/// The probes round a point: `base` is the lowest of eight, `fraction` how far towards the next along each axis. `near`
/// says whether they are those that follow the camera; `base` is then a place in their ring.
struct Cell {
    base: vec3u,
    fraction: vec3f,
    near: bool,
}

/// The cell of the uniform grid that a point in the world lies in. Outside the probes the nearest face counts.
fn cell(point: vec3f) -> Cell {
    let at = grid_place(point);
    return Cell(vec3u(at), fract(at), false);
}

/// The cell of the grid that follows the camera; only where `probe_view::share` is above 0.
fn near_cell(point: vec3f) -> Cell {
    let at = probe_view::lattice_place(point);
    return Cell(probe_view::ring_place(vec3i(floor(at))), fract(at), true);
}

/// A cell's corner number `corner`, 0 to 7: bits 0, 1, 2 are the sides along x, y, z.
fn probe_at(c: Cell, corner: u32) -> vec3u {
    let there = c.base + vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
    if c.near {
        return coordinates(coarse_count() + probe_view::ring_number(there));
    }
    return coordinates(probe_view::pack(min(there, probe_grid.coarse - 1u), probe_grid.coarse));
}
#else
/// The probes round a point: `base` is the lowest of eight, `fraction` how far towards the next along each axis.
struct Cell {
    base: vec3u,
    fraction: vec3f,
}

/// The cell that a point in the world lies in. Outside the probes the nearest face of the grid counts.
fn cell(point: vec3f) -> Cell {
    let at = grid_place(point);
    return Cell(vec3u(at), fract(at));
}

/// A cell's corner number `corner`, 0 to 7: bits 0, 1, 2 are the sides along x, y, z.
fn probe_at(c: Cell, corner: u32) -> vec3u {
    return min(c.base + vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u), probe_grid.grid - 1u);
}
#endif

/// Whether a probe stands at a cell's corner.
fn has_probe(c: Cell, corner: u32) -> bool {
    return true;
}
#endif

/// The share of a cell's corner in trilinear interpolation.
fn share_of(c: Cell, corner: u32) -> f32 {
    let far = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u) == vec3u(1u);
    let near = select(1.0 - c.fraction, c.fraction, far);
    return select(0.0, near.x * near.y * near.z, has_probe(c, corner));
}

/// The corners of a cell that have a share, as bits: where an axis has none on its far side, as outside the probes,
/// those on that side are left out.
fn corners_with_share(c: Cell) -> u32 {
    let far = select(vec3u(1u), vec3u(3u, 5u, 17u), c.fraction > vec3f(0.0));
    return far.x * far.y * far.z;
}

#ifndef PROBE_TREE
/// One of the 4x4x4 probes round a cell, by number: two bits each for x, y, z. Beyond the grid those at its edge come
/// again.
fn near_probe(c: Cell, i: u32) -> vec3u {
    let there = vec3i(c.base) + vec3i(vec3u(i, i >> 2u, i >> 4u) & vec3u(3u)) - 1;
    return vec3u(clamp(there, vec3i(0), vec3i(probe_grid.grid) - 1));
}
#endif

/// A weight times coefficient k of a probe. Of many coefficients a matte surface reflects few.
fn weigh_one(coefficients: texture_3d<f32>, weight: vec3f, probe: vec3u, k: u32) -> vec3f {
    if all(weight == vec3f(0.0)) {
        return vec3f(0.0);
    }
    return weight * textureLoad(coefficients, vec3u(probe.xy, probe.z + k * probe_grid.grid.z), 0).rgb;
}

/// Sum over the coefficients of `weights`, a colour each, times one probe's.
fn weigh(coefficients: texture_3d<f32>, weights: ptr<function, array<vec3f, COUNT>>, probe: vec3u) -> vec3f {
    var light = vec3f(0.0);
#if SH_ORDER >= 5
    // As in `lightgraph::lobe_table`, so that loops stay loops.
    let count = textureDimensions(coefficients).z / probe_grid.grid.z;
    for (var l = 0u; l * l < count; l++) {
        for (var k = 0u; k < 2u * l + 1u; k++) {
            light += weigh_one(coefficients, (*weights)[l * l + k], probe, l * l + k);
        }
    }
#else
    for (var k = 0u; k < COUNT; k++) {
        light += weigh_one(coefficients, (*weights)[k], probe, k);
    }
#endif
    return light;
}

/// The share of a cell's corner at a surface point in the world; the shares of the corners need not sum to 1.
///
/// Its trilinear share is multiplied by the cosine between the normal and the direction to the probe, and by how open
/// the probe is (1 for no backs in sight, 0 for half of all directions or more), each at least `behind`. 1 for `behind`
/// leaves plain trilinear interpolation; near 0, probes on the other side of the surface and inside solids hardly count
/// (as in Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", 2019).
fn facing_share(coefficients: texture_3d<f32>, c: Cell, corner: u32, point: vec3f, normal: vec3f, behind: f32) -> f32 {
    let probe = probe_at(c, corner);
    let offset = position(probe) - point;
    let cosine = dot(offset, normal) * inverseSqrt(max(dot(offset, offset), 1e-12));
    return share_of(c, corner) * max(cosine, behind) * max(open(coefficients, probe), behind);
}

/// How open a probe is: 1 for no backs in sight, 0 or less for half of all directions or more.
fn open(coefficients: texture_3d<f32>, probe: vec3u) -> f32 {
    return 2.0 * textureLoad(coefficients, probe, 0).a / FULLY_OPEN - 1.0;
}

/// Whether all probes round a point see more backs of surfaces than fronts: they stand in solids, or outside.
fn is_blind(coefficients: texture_3d<f32>, point: vec3f) -> bool {
#ifdef PROBE_VIEW
    if probe_view::share(point) > 0.0 && !is_closed(coefficients, near_cell(point)) {
        return false;
    }
#endif
    return is_closed(coefficients, cell(point));
}

/// Whether the probes at all corners of a cell that have a share stand in solids, or outside.
fn is_closed(coefficients: texture_3d<f32>, c: Cell) -> bool {
    for (var corner = 0u; corner < 8u; corner++) {
        if share_of(c, corner) > 0.0 && open(coefficients, probe_at(c, corner)) > 0.0 {
            return false;
        }
    }
    return true;
}

/// Sum over the coefficients of `weights` times their interpolation at a surface point in the world.
/// With a lobe's weights: the radiance it reflects. Outside the probes the nearest face of the grid counts.
/// `behind` is as `facing_share` states it.
fn gather(
    coefficients: texture_3d<f32>,
    weights: ptr<function, array<vec3f, COUNT>>,
    point: vec3f,
    normal: vec3f,
    behind: f32,
) -> vec3f {
#ifdef PROBE_VIEW
    let near = probe_view::share(point);
    var mean = vec3f(0.0);
    for (var grid = 0u; grid < select(1u, 2u, near > 0.0); grid++) {
        var here = cell(point);
        if grid == 1u {
            here = near_cell(point);
        }
        let light = gather_cell(coefficients, weights, here, point, normal, behind);
        mean = mix(light, mix(mean, light, near), f32(grid));
    }
    return mean;
#else
    return gather_cell(coefficients, weights, cell(point), point, normal, behind);
#endif
}

/// The same of the probes at the corners of one cell.
fn gather_cell(
    coefficients: texture_3d<f32>,
    weights: ptr<function, array<vec3f, COUNT>>,
    here: Cell,
    point: vec3f,
    normal: vec3f,
    behind: f32,
) -> vec3f {
    var sum = vec3f(0.0);
    var shares = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let share = facing_share(coefficients, here, corner, point, normal, behind);
        sum += share * weigh(coefficients, weights, probe_at(here, corner));
        shares += share;
    }
    return sum / max(shares, 1e-20);
}
