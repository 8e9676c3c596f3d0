//! Which probes must be captured anew: those that stand elsewhere than when they were captured, and all when something
//! in the scene has moved.
#import lightgraph::digest::add_matrix
#import lightgraph::geometry::{node_count, nodes}
#import lightgraph::probes

struct Params {
    /// How many there are.
    probes: u32,
}
var<uniform> params: Params;

struct Held {
    /// Where the probe stood, metres.
    position: vec3f,
    /// A hash of where everything stood; 0 before the first capture.
    content: u32,
}
var<storage, read_write> held: array<Held>;
/// 1 for each probe that must be captured.
var<storage, read_write> stale: array<u32>;
var<storage, read_write> stale_count: array<atomic<u32>>;

const LANES: u32 = 64u;
var<workgroup> content: u32;

@compute @workgroup_size(LANES)
fn choose(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    if lane == 0u {
        var hash = 1u;
        for (var i = 0u; i < node_count(); i++) {
            hash = add_matrix(hash, nodes[i].transform);
        }
        content = max(hash, 1u);
    }
    let now = workgroupUniformLoad(&content);
    if id.x >= params.probes {
        return;
    }
    let position = probes::position(probes::coordinates(id.x));
    let kept = held[id.x].content == now && all(bitcast<vec3u>(held[id.x].position) == bitcast<vec3u>(position));
    let again = select(1u, 0u, kept);
    stale[id.x] = again;
    held[id.x] = Held(position, now);
    atomicAdd(&stale_count[0], again);
}
