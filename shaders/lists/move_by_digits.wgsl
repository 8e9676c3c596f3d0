//! Moves keys and their values to where they belong by one digit. Those with the same digit stay in their order.
#import lists::digits::{BLOCK, DIGITS, digit_of}

var<storage, read> key: array<u32>;
var<storage, read> value: array<u32>;
/// Keys that come before those of each digit and block.
var<storage, read> places: array<u32>;
var<storage, read_write> moved_key: array<u32>;
var<storage, read_write> moved_value: array<u32>;

struct Round {
    digit: u32,
}
var<uniform> round: Round;

const LANES: u32 = 64u;
/// Keys of a lane, one after the other; also, below, counts of a lane.
const EACH: u32 = BLOCK / LANES;

/// By digit and lane: the keys in the block that come before the next one.
var<workgroup> before: array<u32, BLOCK>;
var<workgroup> of_lane: array<u32, LANES>;
/// By digit: the first of them in the block.
var<workgroup> first: array<u32, DIGITS>;

@compute @workgroup_size(LANES)
fn move_by_digits(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let start = group.x * BLOCK + lane * EACH;
    let end = min(start + EACH, arrayLength(&key));
    for (var i = start; i < end; i++) {
        before[digit_of(key[i], round.digit) * LANES + lane] += 1u;
    }
    workgroupBarrier();
    sum_up(lane);
    if lane < DIGITS {
        first[lane] = before[lane * LANES];
    }
    workgroupBarrier();
    for (var i = start; i < end; i++) {
        let digit = digit_of(key[i], round.digit);
        let place = before[digit * LANES + lane];
        before[digit * LANES + lane] = place + 1u;
        let at = places[digit * groups.x + group.x] + place - first[digit];
        moved_key[at] = key[i];
        moved_value[at] = value[i];
    }
}

/// Each of `before` to the sum of all that come before it.
fn sum_up(lane: u32) {
    var own = 0u;
    for (var i = lane * EACH; i < (lane + 1u) * EACH; i++) {
        own += before[i];
    }
    of_lane[lane] = own;
    workgroupBarrier();
    for (var reach = 1u; reach < LANES; reach *= 2u) {
        var more = 0u;
        if lane >= reach {
            more = of_lane[lane - reach];
        }
        workgroupBarrier();
        of_lane[lane] += more;
        workgroupBarrier();
    }
    var sum = of_lane[lane] - own;
    for (var i = lane * EACH; i < (lane + 1u) * EACH; i++) {
        let here = before[i];
        before[i] = sum;
        sum += here;
    }
    workgroupBarrier();
}
