//! Numbers the cells in the order of their places, so that passes over them, and over their links, have as many
//! invocations as there are cells.
#import lightgraph::cells::PLACES

const LINKS: u32 = #{LINKS}u;
const KEPT: u32 = #{KEPT}u;
var<storage, read> keys: array<u32>;
/// Places before each that hold a key.
var<storage, read> numbers: array<u32>;
/// See `lightgraph::find_cell`.
var<storage, read_write> numbered: array<vec2u>;
/// See `lightgraph::kept`.
var<storage, read_write> kept: array<u32>;
var<storage, read_write> cell_count: array<u32>;
/// Workgroups of 64 over the cells, and over their links.
var<storage, read_write> cell_groups: array<u32>;
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
        kept[number * (KEPT + 1u)] = key;
    }
    if place == PLACES - 1u {
        let count = number + u32(key != 0u);
        cell_count[0] = count;
        cell_groups[0] = (count + 63u) / 64u;
        cell_groups[1] = 1u;
        cell_groups[2] = 1u;
        link_groups[0] = (count * LINKS + 63u) / 64u;
        link_groups[1] = 1u;
        link_groups[2] = 1u;
    }
}
