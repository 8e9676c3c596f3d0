//! Where the planes of a non-uniform grid stand: along each axis at even steps of a distribution, a mixture of the
//! box's length and of the area of the surfaces that the axis runs along.
//!
//! A triangle counts with the sine between its normal and the axis: a wall across the axis says nothing of how light
//! varies along it.

struct Row {
    a: vec3f,
    b: vec3f,
    c: vec3f,
}
var<storage, read> triangles: array<Row>;

struct Params {
    grid: vec3u,
    grid_min: vec3f,
    grid_max: vec3f,
    /// Distance of the outer probes from the box, in mean distances between probes.
    inset: f32,
    /// Share of the surfaces in the distribution, 0 to 1.
    crowding: f32,
}
var<uniform> params: Params;
var<storage, read_write> probe_axes: array<f32>;

const BINS: u32 = 64u;
const LANES: u32 = 64u;
/// Area of surfaces in each part of the box along the axis, square metres.
var<workgroup> area: array<f32, BINS>;

/// Area of a triangle's part in one bin, taken as spread evenly over its length along the axis.
fn part(t: Row, axis: u32, low: f32, high: f32) -> f32 {
    let normal = cross(t.b - t.a, t.c - t.a);
    let along = 0.5 * sqrt(max(dot(normal, normal) - normal[axis] * normal[axis], 0.0));
    let first = min(t.a[axis], min(t.b[axis], t.c[axis]));
    let last = max(t.a[axis], max(t.b[axis], t.c[axis]));
    let overlap = min(last, high) - max(first, low);
    return select(0.0, along * overlap / max(last - first, 1e-12), overlap > 0.0);
}

/// One workgroup an axis, one lane a bin.
@compute @workgroup_size(LANES)
fn axes(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let axis = group.x;
    let low = params.grid_min[axis];
    let width = (params.grid_max[axis] - low) / f32(BINS);
    var sum = 0.0;
    for (var i = 0u; i < arrayLength(&triangles); i++) {
        sum += part(triangles[i], axis, low + f32(lane) * width, low + f32(lane + 1u) * width);
    }
    area[lane] = sum;
    workgroupBarrier();
    if lane != 0u {
        return;
    }
    var total = 0.0;
    for (var bin = 0u; bin < BINS; bin++) {
        total += area[bin];
    }
    let count = params.grid[axis];
    let first = select(0u, params.grid.x, axis > 0u) + select(0u, params.grid.y, axis > 1u);
    var bin = 0u;
    // The distribution below the bin.
    var below = 0.0;
    for (var i = 0u; i < count; i++) {
        let steps = max(f32(count - 1u) + 2.0 * params.inset, 1e-20);
        let share = select((f32(i) + params.inset) / steps, 0.5, count == 1u);
        var here = density(bin, total);
        while bin + 1u < BINS && below + here < share {
            below += here;
            bin += 1u;
            here = density(bin, total);
        }
        probe_axes[first + i] = low + (f32(bin) + clamp((share - below) / max(here, 1e-12), 0.0, 1.0)) * width;
    }
}

/// Share of the distribution in a bin; all bins sum to 1.
fn density(bin: u32, total: f32) -> f32 {
    let even = 1.0 / f32(BINS);
    return select(mix(even, area[bin] / max(total, 1e-20), params.crowding), even, total <= 0.0);
}
