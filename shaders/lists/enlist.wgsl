//! Puts the number of each element whose flag is 1 at its place in a list, and says how long that is.

var<storage, read> flags: array<u32>;
/// How many flags are set before each.
var<storage, read> places: array<u32>;
var<storage, read_write> list: array<u32>;
var<storage, read_write> count: array<u32>;
var<storage, read_write> dispatch: array<u32>;
var<storage, read_write> draw: array<u32>;

struct Params {
    workgroup: u32,
    corners: u32,
}
var<uniform> params: Params;

@compute @workgroup_size(256)
fn enlist(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let all = arrayLength(&flags);
    let element = id.y * 256u * groups.x + id.x;
    if element >= all {
        return;
    }
    let place = places[element];
    if flags[element] == 1u {
        list[place] = element;
    }
    if element == all - 1u {
        let found = place + flags[element];
        count[0] = found;
        dispatch[0] = (found + params.workgroup - 1u) / params.workgroup;
        dispatch[1] = 1u;
        dispatch[2] = 1u;
        draw[0] = params.corners;
        draw[1] = found;
        draw[2] = 0u;
        draw[3] = 0u;
    }
}
