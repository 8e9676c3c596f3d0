//! Dirty bits of probes whose second bounce may change: they see something else, their first bounce is another one, or
//! that of a probe from which the surfaces round them take light.
const WORDS: u32 = #{REACH_WORDS}u;
/// Probes to a bit of `reach`.
const RUN: u32 = #{REACH_RUN}u;

var<storage, read> surface_dirty: array<u32>;
var<storage, read> first_changed: array<u32>;
/// As probe_reach.wgsl has it.
var<storage, read> reach: array<u32>;
var<storage, read_write> second_dirty: array<atomic<u32>>;
/// Probes along x, y, z.
var<uniform> grid: vec3u;

const LANES: u32 = 64u;

/// The probes whose first bounce is another one, as a row of `reach`.
var<workgroup> changed: array<atomic<u32>, WORDS>;

@compute @workgroup_size(LANES)
fn dirty_second(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    let probes = grid.x * grid.y * grid.z;
    if lane < WORDS {
        atomicStore(&changed[lane], 0u);
    }
    workgroupBarrier();
    for (var word = lane; word < arrayLength(&first_changed); word += LANES) {
        var left = first_changed[word];
        while left != 0u {
            let bit = (32u * word + firstTrailingBit(left)) / RUN;
            left &= left - 1u;
            atomicOr(&changed[bit / 32u], 1u << (bit % 32u));
        }
    }
    workgroupBarrier();
    let probe = id.x;
    if probe >= probes {
        return;
    }
    var dirty = (surface_dirty[probe / 32u] | first_changed[probe / 32u]) >> (probe % 32u) & 1u;
    for (var word = 0u; word < WORDS; word++) {
        dirty |= u32((reach[probe * WORDS + word] & atomicLoad(&changed[word])) != 0u);
    }
    atomicOr(&second_dirty[probe / 32u], dirty << (probe % 32u));
}
