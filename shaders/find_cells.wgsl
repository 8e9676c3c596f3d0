//! The cells that rays met: a ray's key becomes its cell's number, and each cell keeps some of the rays that met it,
//! chosen by chance: the smallest of their scrambled numbers, whoever comes first.
#import lightgraph::cells::{NO_CELL, large_key_of}
#import lightgraph::find_cell::find
#ifdef KEEPS
#import lightgraph::kept::{KEPT, WORDS}
#endif
#import lightgraph::random::scramble
#import lightgraph::rays::{SKY, unpack}
#import lightgraph::rounds::salt

const COUNT: u32 = #{COUNT}u;
const SCOUTS: u32 = #{SCOUTS}u;
var<storage, read_write> gathered: array<vec4u>;
#ifdef KEEPS
/// See `lightgraph::kept`; chance in the upper 10 bits of a row.
var<storage, read_write> kept: array<atomic<u32>>;

/// A ray that met a cell.
fn keep(cell: u32, index: u32) {
    if cell == NO_CELL {
        return;
    }
    for (var i = 0u; i < KEPT; i++) {
        let first = select(0x80000000u, 0u, index >= SCOUTS || i < KEPT / 2u);
        let chance = scramble(index + (i << 24u) + salt()) & 0x7fc00000u;
        atomicMin(&kept[cell * WORDS + 1u + i], first | chance | index);
    }
}
#endif

@compute @workgroup_size(64)
fn find_cells(@builtin(global_invocation_id) id: vec3u) {
    let index = id.x;
    if index >= COUNT {
        return;
    }
    let key = gathered[2u * index + 1u].w;
    if key == SKY {
        return;
    }
    if key == 0u {
        gathered[2u * index + 1u].w = NO_CELL;
        return;
    }
    let cell = find(key);
    gathered[2u * index + 1u].w = cell;
#ifdef KEEPS
    let ray = unpack(gathered[2u * index], gathered[2u * index + 1u]);
    keep(cell, index);
    keep(find(large_key_of(ray.position, ray.normal)), index);
#endif
}
