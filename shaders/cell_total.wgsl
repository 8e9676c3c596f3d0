//! The light of all bounces that each cell holds: of those that ran, and what the changes of the last say of those to
//! come.
#import lightgraph::cells::PLACES

var<storage, read> before: array<vec4f>;
var<storage, read> after: array<vec4f>;
#ifdef TAIL
struct Params {
    bounces: u32,
}
var<uniform> params: Params;
/// See cell_tail.wgsl.
var<storage, read> change: array<f32>;
/// Bounces that the cells already hold.
const DONE: u32 = 14u;
#endif
var<storage, read_write> held: array<vec4f>;

@compute @workgroup_size(64)
fn cell_total(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= PLACES {
        return;
    }
    var sum = after[id.x].rgb;
#ifdef TAIL
    let share = change[0];
    let bounces = f32(params.bounces - DONE);
    sum += max(sum - before[id.x].rgb, vec3f(0.0)) * share * (1.0 - pow(share, bounces)) / (1.0 - share);
#endif
    held[id.x] = vec4f(sum, 1.0);
}
