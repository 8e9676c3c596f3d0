//! How much each point of the image is in doubt, from its own doubt and that of the points beside it, and the sum over
//! each square of points.
#import lightgraph::tiles::points_across

/// Variance of each point's light.
var<storage, read> doubts: array<f32>;
/// Standard error, smoothed.
var<storage, read_write> wanted: array<f32>;
var<storage, read_write> square_sums: array<f32>;
var<workgroup> sums: array<f32, 64>;

@compute @workgroup_size(8, 8)
fn sum_doubts(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let across = points_across();
    var error = 0.0;
    if all(id.xy < across) {
        var sum = 0.0;
        for (var y = -1; y <= 1; y++) {
            for (var x = -1; x <= 1; x++) {
                let at = vec2u(clamp(vec2i(id.xy) + vec2i(x, y), vec2i(0), vec2i(across) - 1));
                sum += max(doubts[at.y * across.x + at.x], 0.0);
            }
        }
        // Points that show nothing have no doubt of their own.
        let own = doubts[id.y * across.x + id.x];
        error = select(0.0, sqrt(sum / 9.0), own >= 0.0);
        wanted[id.y * across.x + id.x] = error;
    }
    sums[lane] = error;
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
