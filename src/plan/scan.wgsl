//! Built in: prefix sums, in blocks. The sums of blocks, sums over those, and within each block its elements on top of
//! what comes before it. The same order of additions each time.

#ifdef FLOATS
alias Number = f32;
#else
alias Number = u32;
#endif

var<storage, read> source: array<Number>;
var<storage, read_write> result: array<Number>;
/// Of each block.
var<storage, read_write> sums: array<Number>;

struct Scan {
    /// Elements.
    count: u32,
    /// Not 0: with the element itself.
    inclusive: u32,
    blocks: u32,
}
var<uniform> scan: Scan;

const LANES: u32 = 256u;
/// Elements of a lane. A block has 2048: `BLOCK` of the planner.
const EACH: u32 = 8u;

var<workgroup> shared_sums: array<Number, LANES>;

/// The sum of what the lanes before have. Afterwards the last of `shared_sums` is that of all.
fn of_lanes_before(lane: u32, own: Number) -> Number {
    shared_sums[lane] = own;
    workgroupBarrier();
    for (var reach = 1u; reach < LANES; reach *= 2u) {
        var more = Number(0);
        if lane >= reach {
            more = shared_sums[lane - reach];
        }
        workgroupBarrier();
        shared_sums[lane] += more;
        workgroupBarrier();
    }
    var sum = Number(0);
    if lane > 0u {
        sum = shared_sums[lane - 1u];
    }
    return sum;
}

fn block_of(group: vec3u, groups: vec3u) -> u32 {
    return group.y * groups.x + group.x;
}

@compute @workgroup_size(LANES)
fn add_up(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = block_of(group, groups);
    let first = (block * LANES + lane) * EACH;
    var own = Number(0);
    for (var i = first; i < min(first + EACH, scan.count); i++) {
        own += source[i];
    }
    let before = of_lanes_before(lane, own);
    if lane == LANES - 1u && block < scan.blocks {
        sums[block] = before + own;
    }
}

@compute @workgroup_size(LANES)
fn come_before(@builtin(local_invocation_index) lane: u32) {
    var before_all = Number(0);
    for (var start = 0u; start < scan.blocks; start += LANES * EACH) {
        let first = start + lane * EACH;
        let end = min(first + EACH, scan.blocks);
        var own = Number(0);
        for (var i = first; i < end; i++) {
            own += sums[i];
        }
        var sum = before_all + of_lanes_before(lane, own);
        for (var i = first; i < end; i++) {
            let next = sum + sums[i];
            sums[i] = sum;
            sum = next;
        }
        before_all += workgroupUniformLoad(&shared_sums[LANES - 1u]);
    }
}

@compute @workgroup_size(LANES)
fn place(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = block_of(group, groups);
    place_on(sums[min(block, scan.blocks - 1u)], block, lane);
}

/// Of a single block.
@compute @workgroup_size(LANES)
fn place_alone(@builtin(local_invocation_index) lane: u32) {
    place_on(Number(0), 0u, lane);
}

fn place_on(before: Number, block: u32, lane: u32) {
    let first = (block * LANES + lane) * EACH;
    let end = min(first + EACH, scan.count);
    var own = Number(0);
    for (var i = first; i < end; i++) {
        own += source[i];
    }
    var sum = before + of_lanes_before(lane, own);
    for (var i = first; i < end; i++) {
        let next = sum + source[i];
        result[i] = select(sum, next, scan.inclusive != 0u);
        sum = next;
    }
}
