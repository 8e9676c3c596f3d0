//! How many more rays each point of the image has: its share of all by its doubt, rounded by chance.
#import lightgraph::random::{seed, unit}
#import lightgraph::rounds::salt
#import lightgraph::tiles::points_across

const MORE: u32 = #{MORE}u;
/// Of a point at most.
const MOST: f32 = 64.0;
/// Chance hardly ever asks for more than there are.
const SURE: f32 = 0.98;
const LANES: u32 = 64u;

var<storage, read> wanted: array<f32>;
/// See sum_doubts.wgsl.
var<storage, read> square_sums: array<vec4f>;
/// The first row of a point's rays within its square, and their number.
var<storage, read_write> in_square: array<vec2u>;
var<storage, read_write> square_rays: array<u32>;
var<workgroup> sums: array<vec4f, LANES>;
var<workgroup> counts: array<u32, LANES>;

@compute @workgroup_size(8, 8)
fn share_out(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    var own = vec4f(0.0);
    for (var i = lane; i < groups.x * groups.y; i += LANES) {
        own += square_sums[i];
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
    let here = all(id.xy < across);
    var count = 0u;
    let image = sums[0];
    if here && image.x > 0.0 {
        // Tiles that wait leave their part of the rays.
        let rows = SURE * f32(MORE) * image.y / (image.y + image.z);
        let share = wanted[id.y * across.x + id.x] / image.x * rows;
        count = u32(min(floor(share + unit(seed(id.xy, 5u + salt()))), MOST));
    }
    counts[lane] = count;
    workgroupBarrier();
    var first = 0u;
    for (var i = 0u; i < lane; i++) {
        first += counts[i];
    }
    if here {
        in_square[id.y * across.x + id.x] = vec2u(first, count);
    }
    if lane == LANES - 1u {
        square_rays[group.y * groups.x + group.x] = first + count;
    }
}
