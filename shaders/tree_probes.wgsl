//! Chooses the leaves, and gives the corners of those with surfaces their probes: cells are halved that are worth more
//! than a threshold, and the threshold is the least with which the probes find room.
//!
//! It is found by halving a range, a step for each member but the last, which places the probes: all steps in one would
//! have more rounds of loops than software drivers grant an invocation.
#import lightgraph::probe_tree::{NO_PROBE, OPEN, Sketch, cells, level_start, pack, points, tree, unpack}

struct Params {
    /// Probes at most.
    room: u32,
    /// Numbers that there are for them.
    probes: u32,
    member: u32,
    /// Steps that halve the range.
    halvings: u32,
}
var<uniform> params: Params;

var<storage, read> tree_sketch: array<Sketch>;
var<storage, read> tree_areas: array<f32>;
var<storage, read> tree_gain: array<f32>;
/// For each cell of the lattice the edge of the leaf it lies in, in cells.
var<storage, read_write> leaf_edges: array<u32>;
/// For each point of the lattice its probe, or `NO_PROBE`.
var<storage, read_write> point_probes: array<u32>;
/// For each probe its point; `NO_PROBE` past the last. One more at the end: the number of probes.
var<storage, read_write> probe_points: array<u32>;
/// The range that the threshold lies in, as the bits of floats above 0, which ascend as the floats do.
var<storage, read_write> tree_range: array<u32>;

const LANES: u32 = 256u;
/// The bits of 2^127, with which no cell is halved.
const LARGEST: u32 = 0x7f000000u;
var<workgroup> sums: array<u32, LANES>;
var<workgroup> total: u32;

struct Leaf {
    /// In cells.
    edge: u32,
    has_surface: bool,
}

/// The leaf that a cell lies in.
fn leaf(cell: vec3u, threshold: f32) -> Leaf {
    for (var level = 0u; level < tree.levels; level++) {
        let edge = 1u << (tree.levels - level);
        let gain = tree_gain[level_start(level) + pack(cell / edge, tree.roots << vec3u(level))];
        if gain <= threshold {
            return Leaf(edge, gain >= 0.0);
        }
    }
    return Leaf(1u, tree_areas[pack(cell, cells())] > 0.0);
}

/// Whether a probe stands at a point: an open corner of a leaf with surfaces.
fn stands(number: u32, threshold: f32) -> bool {
    if tree_sketch[number].open < OPEN {
        return false;
    }
    let point = unpack(number, points());
    for (var side = 0u; side < 8u; side++) {
        let step = vec3u(side & 1u, (side >> 1u) & 1u, side >> 2u);
        if any(point < step) || any(point - step >= cells()) {
            continue;
        }
        let cell = point - step;
        let here = leaf(cell, threshold);
        if here.has_surface && all(point % here.edge == vec3u(0u)) {
            return true;
        }
    }
    return false;
}

/// How many probes a threshold makes; `sums` then holds each lane's.
fn count(lane: u32, first: u32, last: u32, threshold: f32) -> u32 {
    var found = 0u;
    for (var i = first; i < last; i++) {
        found += u32(stands(i, threshold));
    }
    sums[lane] = found;
    workgroupBarrier();
    if lane == 0u {
        total = 0u;
        for (var i = 0u; i < LANES; i++) {
            total += sums[i];
        }
    }
    return workgroupUniformLoad(&total);
}

/// One workgroup; each lane has a stretch of the lattice's points, so that probes are numbered in their order.
@compute @workgroup_size(LANES)
fn place(@builtin(local_invocation_index) lane: u32) {
    let all_points = points().x * points().y * points().z;
    let stretch = (all_points + LANES - 1u) / LANES;
    let first = min(lane * stretch, all_points);
    let last = min(first + stretch, all_points);

    var low = 0u;
    var high = LARGEST;
    if params.member > 0u {
        low = tree_range[0];
        high = tree_range[1];
    }
    if params.member < params.halvings {
        let middle = (low + high) / 2u;
        let fits = count(lane, first, last, bitcast<f32>(middle)) <= params.room;
        if lane == 0u {
            tree_range[0] = select(middle + 1u, low, fits || low == high);
            tree_range[1] = select(high, middle, fits);
        }
        return;
    }
    let threshold = bitcast<f32>(high);
    let placed = count(lane, first, last, threshold);

    var probe = 0u;
    for (var i = 0u; i < lane; i++) {
        probe += sums[i];
    }
    for (var i = first; i < last; i++) {
        point_probes[i] = NO_PROBE;
        if stands(i, threshold) && probe < params.room {
            point_probes[i] = probe;
            probe_points[probe] = i;
            probe++;
        }
    }
    for (var i = placed + lane; i < params.probes; i += LANES) {
        probe_points[i] = NO_PROBE;
    }
    if lane == 0u {
        probe_points[params.probes] = min(placed, params.room);
    }
    let all_cells = cells().x * cells().y * cells().z;
    for (var i = lane; i < all_cells; i += LANES) {
        leaf_edges[i] = leaf(unpack(i, cells()), threshold).edge;
    }
}
