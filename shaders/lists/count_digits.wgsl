//! Counts how often each digit stands in each block of keys. All blocks of digit 0 come first.
#import lists::digits::{BLOCK, DIGITS, digit_of}

var<storage, read> key: array<u32>;
var<storage, read_write> counts: array<u32>;

struct Round {
    digit: u32,
}
var<uniform> round: Round;

var<workgroup> found: array<atomic<u32>, DIGITS>;

@compute @workgroup_size(64)
fn count_digits(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    for (var i = lane; i < BLOCK; i += 64u) {
        let at = group.x * BLOCK + i;
        if at < arrayLength(&key) {
            atomicAdd(&found[digit_of(key[at], round.digit)], 1u);
        }
    }
    workgroupBarrier();
    if lane < DIGITS {
        counts[lane * groups.x + group.x] = atomicLoad(&found[lane]);
    }
}
