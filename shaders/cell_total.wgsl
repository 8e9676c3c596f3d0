//! The light of all bounces that each cell holds: of those that ran, and what the changes of the last say of those to
//! come.
#import lightgraph::cells::PLACES

var<storage, read> before: array<vec4f>;
var<storage, read> after: array<vec4f>;
#ifdef TAIL
var<storage, read> change: array<f32>;
#endif
var<storage, read_write> held: array<vec4f>;

@compute @workgroup_size(64)
fn cell_total(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= PLACES {
        return;
    }
    var sum = after[id.x].rgb;
#ifdef TAIL
    sum += max(sum - before[id.x].rgb, vec3f(0.0)) * change[0] / (1.0 - change[0]);
#endif
    held[id.x] = vec4f(sum, 1.0);
}
