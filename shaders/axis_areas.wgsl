//! Area of surfaces along each axis, for probe_axes.wgsl: in each of 64 parts of the box what a piece of the triangles
//! has there. By pieces, since a software driver ends loops after 65,535 rounds.
struct Row {
    a: vec3f,
    b: vec3f,
    c: vec3f,
}
var<storage, read> triangles: array<Row>;

struct Params {
    grid_min: vec3f,
    grid_max: vec3f,
    /// Triangles of a piece.
    area_piece: u32,
}
var<uniform> params: Params;
/// Square metres: the parts along x, then y, then z, of one piece after another.
var<storage, read_write> axis_areas: array<f32>;

const BINS: u32 = 64u;

/// Area of a triangle's part in one bin, taken as spread evenly over its length along the axis.
fn part(t: Row, axis: u32, low: f32, high: f32) -> f32 {
    let normal = cross(t.b - t.a, t.c - t.a);
    let along = 0.5 * sqrt(max(dot(normal, normal) - normal[axis] * normal[axis], 0.0));
    let first = min(t.a[axis], min(t.b[axis], t.c[axis]));
    let last = max(t.a[axis], max(t.b[axis], t.c[axis]));
    let overlap = min(last, high) - max(first, low);
    return select(0.0, along * overlap / max(last - first, 1e-12), overlap > 0.0);
}

/// One workgroup an axis of a piece, one lane a part of the box.
@compute @workgroup_size(BINS)
fn areas(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let axis = group.x;
    let low = params.grid_min[axis];
    let width = (params.grid_max[axis] - low) / f32(BINS);
    let first = group.y * params.area_piece;
    let end = min(first + params.area_piece, arrayLength(&triangles));
    var sum = 0.0;
    for (var i = first; i < end; i++) {
        sum += part(triangles[i], axis, low + f32(lane) * width, low + f32(lane + 1u) * width);
    }
    axis_areas[(group.y * 3u + axis) * BINS + lane] = sum;
}
