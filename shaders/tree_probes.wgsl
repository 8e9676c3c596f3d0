//! Chooses the leaves, and gives the corners of those with surfaces their probes: cells are halved that are worth more
//! than a threshold, and the threshold is the least with which the probes find room.
#import lightgraph::probe_tree::{NO_PROBE, OPEN, Sketch, cells, level_start, pack, points, tree, unpack}

/// Probes at most.
var<uniform> room: u32;

var<storage, read> tree_sketch: array<Sketch>;
var<storage, read> tree_areas: array<f32>;
var<storage, read> tree_gain: array<f32>;
/// For each cell of the lattice the edge of the leaf it lies in, in cells.
var<storage, read_write> leaf_edges: array<u32>;
/// For each point of the lattice its probe, or `NO_PROBE`.
var<storage, read_write> point_probes: array<u32>;
/// For each probe its point; `NO_PROBE` past the last. One more at the end: the number of probes.
var<storage, read_write> probe_points: array<u32>;

const LANES: u32 = 256u;
var<workgroup> sums: array<u32, LANES>;
var<workgroup> total: u32;

/// Edge of the leaf that a cell lies in.
fn leaf_edge(cell: vec3u, threshold: f32) -> u32 {
    for (var level = 0u; level < tree.levels; level++) {
        let edge = 1u << (tree.levels - level);
        if tree_gain[level_start(level) + pack(cell / edge, tree.roots << vec3u(level))] <= threshold {
            return edge;
        }
    }
    return 1u;
}

fn has_surface(base: vec3u, edge: u32) -> bool {
    for (var i = 0u; i < edge * edge * edge; i++) {
        if tree_areas[pack(base + vec3u(i % edge, i / edge % edge, i / (edge * edge)), cells())] > 0.0 {
            return true;
        }
    }
    return false;
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
        let edge = leaf_edge(cell, threshold);
        if all(point % edge == vec3u(0u)) && has_surface(cell / edge * edge, edge) {
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

    // Bits of floats above 0 ascend as the floats do.
    var low = 0u;
    var high = 0x7f000000u;
    while low < high {
        let middle = (low + high) / 2u;
        if count(lane, first, last, bitcast<f32>(middle)) <= room {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    let threshold = bitcast<f32>(high);
    let placed = count(lane, first, last, threshold);

    var probe = 0u;
    for (var i = 0u; i < lane; i++) {
        probe += sums[i];
    }
    for (var i = first; i < last; i++) {
        point_probes[i] = NO_PROBE;
        if stands(i, threshold) && probe < room {
            point_probes[i] = probe;
            probe_points[probe] = i;
            probe++;
        }
    }
    for (var i = placed + lane; i < room; i += LANES) {
        probe_points[i] = NO_PROBE;
    }
    if lane == 0u {
        probe_points[room] = min(placed, room);
    }
    let all_cells = cells().x * cells().y * cells().z;
    for (var i = lane; i < all_cells; i += LANES) {
        leaf_edges[i] = leaf_edge(unpack(i, cells()), threshold);
    }
}
