//! Built in: the draws of the instances whose dirty bit is set; of the others none.

struct Job {
    instances: u32,
    across: u32,
    down: u32,
    most: u32,
    draws: u32,
    place: u32,
}
@group(0) @binding(0) var<uniform> job: Job;
@group(0) @binding(1) var<storage, read> bits: array<u32>;
@group(0) @binding(2) var<storage, read_write> counts: array<atomic<u32>>;
/// The arguments of indexed indirect draws: `job.draws` of each instance.
@group(0) @binding(3) var<storage, read> all: array<u32>;
@group(0) @binding(4) var<storage, read_write> some: array<u32>;
/// The arguments of an indirect draw for each instance, which clears its place.
@group(0) @binding(5) var<storage, read_write> clears: array<vec4u>;

const WORDS: u32 = 5u;

/// A lane an instance.
@compute @workgroup_size(64)
fn choose(@builtin(global_invocation_id) id: vec3u) {
    let instance = id.x;
    if instance >= job.instances {
        return;
    }
    let runs = (bits[instance / 32u] >> (instance % 32u)) & 1u;
    atomicAdd(&counts[job.place], runs);
    clears[instance] = vec4u(3u, runs, 0u, 0u);
    for (var i = WORDS * job.draws * instance; i < WORDS * job.draws * (instance + 1u); i += WORDS) {
        some[i] = all[i];
        some[i + 1u] = all[i + 1u] * runs;
        some[i + 2u] = all[i + 2u];
        some[i + 3u] = all[i + 3u];
        some[i + 4u] = all[i + 4u];
    }
}
