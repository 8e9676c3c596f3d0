//! How much each point of the image is in doubt, from its own doubt and that of the points beside it.
#import lightgraph::tiles::{WAITS, points_across}

/// Variance of each point's light.
var<storage, read> doubts: array<f32>;
/// Standard error, smoothed.
var<storage, read_write> wanted: array<f32>;
/// Of each square of tiles: the sum of errors, the number of points, and the number of tiles that wait.
var<storage, read_write> square_sums: array<vec4f>;
var<workgroup> sums: array<vec4f, 64>;

@compute @workgroup_size(8, 8)
fn sum_doubts(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let across = points_across();
    var found = vec4f(0.0);
    if all(id.xy < across) {
        var sum = vec2f(0.0);
        for (var y = -1; y <= 1; y++) {
            for (var x = -1; x <= 1; x++) {
                let at = vec2u(clamp(vec2i(id.xy) + vec2i(x, y), vec2i(0), vec2i(across) - 1));
                let doubt = doubts[at.y * across.x + at.x];
                sum += select(vec2f(0.0), vec2f(doubt, 1.0), doubt >= 0.0);
            }
        }
        // Points that show nothing have no doubt of their own.
        let own = doubts[id.y * across.x + id.x];
        let there = own >= 0.0;
        let error = select(0.0, sqrt(sum.x / max(sum.y, 1.0)), there);
        wanted[id.y * across.x + id.x] = error;
        found = vec4f(error, f32(there), f32(own == WAITS), 0.0);
    }
    sums[lane] = found;
    for (var step = 32u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if lane < step {
            sums[lane] += sums[lane + step];
        }
    }
    if lane == 0u {
        square_sums[group.y * groups.x + group.x] = sums[0];
    }
}
