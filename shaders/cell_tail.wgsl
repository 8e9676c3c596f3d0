//! What the bounces to come would add, all together: changes shrink by the same share from bounce to bounce in the
//! end.
var<storage, read> cell_count: array<u32>;
var<storage, read> before: array<vec4f>;
var<storage, read> after: array<vec4f>;
var<storage, read_write> change: array<f32>;

struct Rounds {
    /// The loop's index, and how often it goes round.
    bounce: u32,
    rounds: u32,
}
var<uniform> params: Rounds;

const LANES: u32 = 128u;
/// Walls that keep more than this of the light are taken for ones that do not: the share is known to a few millionths.
const MOST: f32 = 0.9995;
var<workgroup> sums: array<f32, LANES>;

/// Element 0: the share; 1: the sum over the cells of what an earlier bounce changed, which is kept.
@compute @workgroup_size(LANES)
fn cell_tail(@builtin(local_invocation_id) id: vec3u) {
    // The last and the last but two say it: between walls that face each other light goes to and fro, and changes of
    // one bounce and the next differ.
    let left = params.rounds - 1u - params.bounce;
    if left != 0u && left != 2u {
        return;
    }
    var sum = 0.0;
    for (var i = id.x; i < cell_count[0]; i += LANES) {
        sum += dot(after[i].rgb - before[i].rgb, vec3f(1.0));
    }
    sums[id.x] = sum;
    for (var step = LANES / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if id.x < step {
            sums[id.x] += sums[id.x + step];
        }
    }
    if id.x == 0u {
        let earlier = change[1];
        change[0] = clamp(sqrt(max(select(0.0, sums[0] / earlier, earlier > 0.0), 0.0)), 0.0, MOST);
        change[1] = sums[0];
    }
}
