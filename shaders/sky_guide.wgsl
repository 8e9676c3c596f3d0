//! Counts by direction the rays that left the scene, of each block of points and of half a block on each side.
#import lightgraph::points::points
#import lightgraph::rays::SKY
#import lightgraph::sky_guide::{BLOCK, COUNTS, EDGE, FIRST, bin_of}
#import lightgraph::tiles::{NO_POINT, points_across}

const BINS: u32 = EDGE * EDGE;
/// Where more than this share of the rays leaves the scene, none need a guide.
const OPEN: f32 = 0.25;

var<uniform> rays: u32;
var<storage, read> gathered: array<vec4u>;
var<storage, read_write> guide: array<f32>;
/// Rays that left the scene, and all.
var<workgroup> found: atomic<u32>;
var<workgroup> traced: atomic<u32>;
var<workgroup> bins: array<atomic<u32>, BINS>;
var<workgroup> sums: array<f32, COUNTS>;

/// Counts the rays of a point.
fn count_point(point: u32) {
    if points[point].w == NO_POINT {
        return;
    }
    atomicAdd(&traced, rays);
    let place = bitcast<vec3f>(points[point].xyz);
    for (var i = point * rays; i < (point + 1u) * rays; i++) {
        if gathered[2u * i + 1u].w == SKY {
            let way = normalize(bitcast<vec3f>(gathered[2u * i].xyz) - place);
            atomicAdd(&bins[bin_of(way)], 1u);
            atomicAdd(&found, 1u);
        }
    }
}

/// What few rays tell of a direction they tell of those beside it, too.
fn smoothed(bin: vec2i) -> f32 {
    var sum = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let at = bin + vec2i(x, y);
            if all(at >= vec2i(0)) && all(at < vec2i(i32(EDGE))) {
                let weight = select(1.0, 4.0, x == 0) * select(1.0, 4.0, y == 0);
                sum += weight * f32(atomicLoad(&bins[u32(at.y) * EDGE + u32(at.x)]));
            }
        }
    }
    return sum;
}

@compute @workgroup_size(BINS)
fn count_sky(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let across = points_across();
    let corner = max(group.xy * BLOCK, vec2u(BLOCK / 2u)) - BLOCK / 2u;
    let size = min(group.xy * BLOCK + BLOCK + BLOCK / 2u, across) - corner;
    let points_here = size.x * size.y;
    for (var i = lane; i < points_here; i += BINS) {
        count_point((corner.y + i / size.x) * across.x + corner.x + i % size.x);
    }
    workgroupBarrier();
    let open = f32(atomicLoad(&found)) > OPEN * f32(atomicLoad(&traced));
    sums[FIRST + lane] = select(smoothed(vec2i(vec2u(lane % EDGE, lane / EDGE))), 0.0, open);
    var first = FIRST;
    for (var edge = EDGE / 2u; edge > 0u; edge /= 2u) {
        workgroupBarrier();
        let finer = first;
        first = (edge * edge - 1u) / 3u;
        if lane < edge * edge {
            let at = finer + 4u * edge * (lane / edge) + 2u * (lane % edge);
            sums[first + lane] = sums[at] + sums[at + 1u] + sums[at + 2u * edge] + sums[at + 2u * edge + 1u];
        }
    }
    workgroupBarrier();
    let block = COUNTS * (group.y * groups.x + group.x);
    for (var i = lane; i < COUNTS; i += BINS) {
        guide[block + i] = sums[i];
    }
}
