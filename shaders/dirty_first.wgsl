//! Dirty bits of probes whose first bounce may change: they see something else, or look into squares of shadow maps
//! that what moved covers or covered. Without SHADOW_REACH nobody knows into which they look: all are set where any map
//! changed.
#ifdef SHADOWS
#ifdef SHADOW_REACH
#import lightgraph::lights
#import lightgraph::moved::{ROWS, covered}
#endif
#endif

var<storage, read> surface_dirty: array<u32>;
var<storage, read_write> first_dirty: array<atomic<u32>>;
/// Probes along x, y, z.
var<uniform> grid: vec3u;

#ifdef SHADOWS
var<storage, read> light_dirty: array<u32>;
#ifdef SHADOW_REACH
/// As shadow_reach.wgsl has it.
var<storage, read> shadow_reach: array<u32>;

const SQUARES: u32 = 32u;
const WORDS: u32 = 64u;
const LANES: u32 = 64u;

/// The squares of all maps that changed, as a row of `shadow_reach`.
var<workgroup> changed: array<atomic<u32>, WORDS>;

fn mark_changed(lane: u32, words: u32) {
    let size = lights::shadow.shadow_size;
    let run = (lights::view_count() * SQUARES * SQUARES + 32u * words - 1u) / (32u * words);
    for (var i = lane; i < lights::view_count() * ROWS; i += LANES) {
        let view = i / ROWS;
        let c = covered(lights::light_views[view].view_projection, vec2u(size), i % ROWS);
        if any(c.first >= c.end) {
            continue;
        }
        let low = c.first * SQUARES / size;
        let high = (c.end - 1u) * SQUARES / size;
        for (var y = low.y; y <= high.y; y++) {
            for (var x = low.x; x <= high.x; x++) {
                let bit = ((view * SQUARES + y) * SQUARES + x) / run;
                atomicOr(&changed[bit / 32u], 1u << (bit % 32u));
            }
        }
    }
}
#endif
#endif

@compute @workgroup_size(64)
fn dirty_first(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    let probe = id.x;
    let probes = grid.x * grid.y * grid.z;
#ifdef SHADOWS
#ifdef SHADOW_REACH
    let words = arrayLength(&shadow_reach) / probes;
    atomicStore(&changed[lane], 0u);
    workgroupBarrier();
    mark_changed(lane, words);
    workgroupBarrier();
#endif
#endif
    if probe >= probes {
        return;
    }
    var dirty = surface_dirty[probe / 32u] >> (probe % 32u) & 1u;
#ifdef SHADOWS
#ifdef SHADOW_REACH
    for (var word = 0u; word < words; word++) {
        dirty |= u32((shadow_reach[probe * words + word] & atomicLoad(&changed[word])) != 0u);
    }
#else
    for (var word = 0u; word < arrayLength(&light_dirty); word++) {
        dirty |= u32(light_dirty[word] != 0u);
    }
#endif
#endif
    atomicOr(&first_dirty[probe / 32u], dirty << (probe % 32u));
}
