//! Built in: from one dirty bit an instance to what of a step runs.

struct Job {
    instances: u32,
    /// Workgroups of an instance along x and y.
    across: u32,
    down: u32,
    /// The most workgroups along an axis.
    most: u32,
    /// Indirect draws of each instance.
    draws: u32,
    /// Where in `counts` the step says how many instances run.
    place: u32,
}
@group(0) @binding(0) var<uniform> job: Job;
@group(0) @binding(1) var<storage, read> bits: array<u32>;
@group(0) @binding(2) var<storage, read_write> counts: array<u32>;
/// Four words on the layout, then the numbers of the instances.
@group(0) @binding(3) var<storage, read_write> list: array<u32>;
/// The workgroups of an indirect dispatch.
@group(0) @binding(4) var<storage, read_write> groups: array<u32>;

const HEADER: u32 = 4u;
const LANES: u32 = 64u;
var<workgroup> ends: array<u32, LANES>;

/// The bits of a word that belong to instances.
fn word(i: u32) -> u32 {
    let left = job.instances - min(32u * i, job.instances);
    return bits[i] & select(0xffffffffu, (1u << left) - 1u, left < 32u);
}

/// Lists the instances whose bits are set, in their order, and sizes a dispatch for them.
@compute @workgroup_size(LANES)
fn compact(@builtin(local_invocation_index) lane: u32) {
    let words = (job.instances + 31u) / 32u;
    let share = (words + LANES - 1u) / LANES;
    let begin = min(lane * share, words);
    let end = min(begin + share, words);
    var mine = 0u;
    for (var i = begin; i < end; i++) {
        mine += countOneBits(word(i));
    }
    ends[lane] = mine;
    workgroupBarrier();
    var at = 0u;
    var all = 0u;
    for (var i = 0u; i < LANES; i++) {
        at += select(0u, ends[i], i < lane);
        all += ends[i];
    }
    for (var i = begin; i < end; i++) {
        var left = word(i);
        while left != 0u {
            list[HEADER + at] = 32u * i + firstTrailingBit(left);
            left &= left - 1u;
            at++;
        }
    }
    storageBarrier();
    workgroupBarrier();
    if lane != 0u {
        return;
    }
    let fold = max((all + job.most - 1u) / job.most, 1u);
    let layers = (all + fold - 1u) / fold;
    // The last one again, where the layers have room for more.
    for (var i = all; i < fold * layers; i++) {
        list[HEADER + i] = list[HEADER + all - 1u];
    }
    list[0] = job.across;
    list[1] = fold;
    list[2] = 1u;
    list[3] = all;
    groups[0] = select(0u, job.across * fold, all > 0u);
    groups[1] = job.down;
    groups[2] = layers;
    counts[job.place] = all;
}
