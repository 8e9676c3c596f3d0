//! A grid of probes in a box, and the coefficients they hold. The grid is uniform, or with PROBE_TABLE its planes along
//! each axis stand where a table says.
//!
//! Coefficients lie in a 3D texture of (grid.x, grid.y, grid.z * COUNT) texels: coefficient k of all probes in the
//! slices from k * grid.z on. The alpha of coefficient (0, 0) tells how open a probe is: alpha 1 in every direction
//! but those that show the back of a single-sided surface, projected as light is.
#define_import_path lightgraph::probes
#import lightgraph::sh::COUNT

struct Grid {
    /// Probes along x, y, z.
    grid: vec3u,
    /// The box, metres.
    grid_min: vec3f,
    grid_max: vec3f,
    /// Distance of the outer probes from the box, in distances between probes.
    inset: f32,
}
var<uniform> probe_grid: Grid;

/// Coefficient (0, 0) of 1 in every direction: sqrt(4 pi).
const FULLY_OPEN: f32 = 3.54490770181;

#ifdef PROBE_TABLE
/// Positions in the world, ascending, metres: grid.x along x, then grid.y along y, grid.z along z.
var<storage, read> probe_axes: array<f32>;

/// The edges of the box in mean distances between probes.
fn span() -> vec3f {
    return max(vec3f(probe_grid.grid - 1u) + 2.0 * probe_grid.inset, vec3f(1e-20));
}

/// Where a probe stands.
fn position(probe: vec3u) -> vec3f {
    let n = probe_grid.grid;
    return vec3f(probe_axes[probe.x], probe_axes[n.x + probe.y], probe_axes[n.x + n.y + probe.z]);
}

/// Coordinate in the grid of `at` along an axis of `count` probes whose positions begin at `first` of the table.
fn locate(at: f32, first: u32, count: u32) -> f32 {
    var below = 0u;
    for (var i = 1u; i + 1u < count; i++) {
        below = select(below, i, probe_axes[first + i] <= at);
    }
    let low = probe_axes[first + below];
    let high = probe_axes[first + min(below + 1u, count - 1u)];
    return f32(below) + clamp((at - low) / max(high - low, 1e-20), 0.0, select(0.0, 1.0, count > 1u));
}

/// Coordinates in the grid of a point in the world.
fn grid_place(point: vec3f) -> vec3f {
    let n = probe_grid.grid;
    return vec3f(locate(point.x, 0u, n.x), locate(point.y, n.x, n.y), locate(point.z, n.x + n.y, n.z));
}
#else
/// The box's edges in distances between probes; a single probe stands in the middle.
fn span() -> vec3f {
    return max(vec3f(probe_grid.grid - 1u) + 2.0 * probe_grid.inset, vec3f(1e-20));
}

/// Where a probe stands: min + (i + inset)/(n - 1 + 2 inset) * (max - min).
fn position(probe: vec3u) -> vec3f {
    let share = (vec3f(probe) + probe_grid.inset) / span();
    let middle = probe_grid.grid == vec3u(1u);
    return mix(probe_grid.grid_min, probe_grid.grid_max, select(share, vec3f(0.5), middle));
}

/// Coordinates in the grid of a point in the world.
fn grid_place(point: vec3f) -> vec3f {
    let extent = max(probe_grid.grid_max - probe_grid.grid_min, vec3f(1e-20));
    let last = vec3f(probe_grid.grid - 1u);
    return clamp((point - probe_grid.grid_min) / extent * span() - probe_grid.inset, vec3f(0.0), last);
}
#endif

/// Grid coordinates of probe number `index`: x fastest, then y, then z.
fn coordinates(index: u32) -> vec3u {
    let n = probe_grid.grid;
    return vec3u(index % n.x, index / n.x % n.y, index / (n.x * n.y));
}

/// Number of a probe: the inverse of `coordinates`.
fn number(probe: vec3u) -> u32 {
    return (probe.z * probe_grid.grid.y + probe.y) * probe_grid.grid.x + probe.x;
}

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

/// The share of a cell's corner in trilinear interpolation.
fn share_of(c: Cell, corner: u32) -> f32 {
    let far = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u) == vec3u(1u);
    let near = select(1.0 - c.fraction, c.fraction, far);
    return near.x * near.y * near.z;
}

/// Sum over the coefficients of `weights` times one probe's.
fn weigh(coefficients: texture_3d<f32>, weights: array<f32, COUNT>, probe: vec3u) -> vec3f {
    var w = weights;
    var light = vec3f(0.0);
    for (var k = 0u; k < COUNT; k++) {
        // Of many coefficients a matte surface reflects few.
        if w[k] != 0.0 {
            light += w[k] * textureLoad(coefficients, vec3u(probe.xy, probe.z + k * probe_grid.grid.z), 0).rgb;
        }
    }
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
    let open = 2.0 * textureLoad(coefficients, probe, 0).a / FULLY_OPEN - 1.0;
    return share_of(c, corner) * max(cosine, behind) * max(open, behind);
}

/// Sum over the coefficients of `weights` times their interpolation at a surface point in the world.
/// With a lobe's weights: the radiance it reflects. Outside the probes the nearest face of the grid counts.
/// `behind` is as `facing_share` states it.
fn gather(
    coefficients: texture_3d<f32>,
    weights: array<f32, COUNT>,
    point: vec3f,
    normal: vec3f,
    behind: f32,
) -> vec3f {
    let here = cell(point);
    var sum = vec3f(0.0);
    var shares = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let share = facing_share(coefficients, here, corner, point, normal, behind);
        sum += share * weigh(coefficients, weights, probe_at(here, corner));
        shares += share;
    }
    return sum / shares;
}
