//! A quarter of the gathered rays go on from where they ended, four times: what they meet is lit by what the image
//! shows, and lights it in turn, so that it has cells, too. Cells keep places that others see, not those alone that the
//! image's points see, and their rays seldom end where no cell is: those that the image sees are the brighter ones,
//! mostly, and can't stand for the others.
#import lightgraph::cell_keys::insert
#import lightgraph::cells::{key_of, large_key_of}
#import lightgraph::hit::look_from
#import lightgraph::random::{next_pair, scramble}
#import lightgraph::ray_ends::end_on
#import lightgraph::rays::{Ray, SKY, pack, unpack}
#import lightgraph::rounds::salt
#import lightgraph::sampling::cosine_direction
#import lightgraph::trace::leave

/// Rays gathered, and every how many goes on.
const COUNT: u32 = #{COUNT}u;
const EACH: u32 = #{EACH}u;
/// Segments of one that goes on.
const SEGMENTS: u32 = 4u;
var<storage, read_write> gathered: array<vec4u>;

@compute @workgroup_size(64)
fn scout_rays(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= COUNT / EACH {
        return;
    }
    let index = id.x * EACH + id.x % EACH;
    var here = unpack(gathered[2u * index], gathered[2u * index + 1u]);
    var state = scramble(index + salt());
    for (var i = 0u; i < SEGMENTS; i++) {
        var found = Ray();
        if here.cell != 0u && here.cell != SKY {
            let direction = cosine_direction(here.normal, next_pair(&state));
            let start = leave(here.position, here.flat_normal);
            let met = look_from(start, here.position, here.flat_normal, direction);
            if met.lit {
                found = end_on(met);
                found.cell = key_of(found.position, found.normal);
                insert(found.cell);
                insert(large_key_of(found.position, found.normal));
            }
        }
        let row = COUNT + id.x * SEGMENTS + i;
        let packed = pack(found);
        gathered[2u * row] = packed[0];
        gathered[2u * row + 1u] = packed[1];
        here = found;
    }
}
