//! Rows for the rays that points have beside those that all have.
#import lightgraph::tiles::points_across

const MORE: u32 = #{MORE}u;
const LANES: u32 = 64u;

var<storage, read> in_square: array<vec2u>;
var<storage, read> square_rays: array<u32>;
/// The first row of a point's rays, and their number.
var<storage, read_write> more: array<vec2u>;
/// The point of each ray.
var<storage, read_write> more_points: array<u32>;
var<workgroup> sums: array<u32, LANES>;

@compute @workgroup_size(8, 8)
fn hand_out(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    var own = 0u;
    for (var i = lane; i < group.y * groups.x + group.x; i += LANES) {
        own += square_rays[i];
    }
    sums[lane] = own;
    for (var step = LANES / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if lane < step {
            sums[lane] += sums[lane + step];
        }
    }
    workgroupBarrier();
    let across = points_across();
    if any(id.xy >= across) {
        return;
    }
    let point = id.y * across.x + id.x;
    let asked = in_square[point];
    let first = min(sums[0] + asked.x, MORE);
    let count = min(asked.y, MORE - first);
    more[point] = vec2u(first, count);
    for (var i = 0u; i < count; i++) {
        more_points[first + i] = point;
    }
}
