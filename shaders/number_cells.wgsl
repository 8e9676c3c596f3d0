//! Numbers the cells in the order of their places, so that passes over cells and over their links have as many
//! invocations as there are cells and links.
#import lightgraph::cells::PLACES
#import lightgraph::kept::{LINKS, WORDS}

var<storage, read> keys: array<u32>;
/// Keys at the places before each, and at all.
var<storage, read> numbers: array<u32>;
var<storage, read> cell_count: array<u32>;
/// See `lightgraph::find_cell`.
var<storage, read_write> numbered: array<vec2u>;
/// See `lightgraph::kept`.
var<storage, read_write> kept: array<u32>;
/// Workgroups of 64 over the links.
var<storage, read_write> link_groups: array<u32>;

@compute @workgroup_size(64)
fn number_cells(@builtin(global_invocation_id) id: vec3u) {
    let place = id.x;
    if place >= PLACES {
        return;
    }
    let key = keys[place];
    let number = numbers[place];
    numbered[place] = vec2u(key, number);
    if key != 0u {
        kept[number * WORDS] = key;
    }
    if place == 0u {
        link_groups[0] = (cell_count[0] * LINKS + 63u) / 64u;
        link_groups[1] = 1u;
        link_groups[2] = 1u;
    }
}
