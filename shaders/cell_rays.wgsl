//! Rays from the cells: LINKS from each, of the surface where rays met it. What they meet are cells again, the light of
//! which they bring, bounce by bounce.
#import lightgraph::cells::NO_CELL
#import lightgraph::find_cell::find_near
#import lightgraph::hit::look_from
#import lightgraph::kept::{NO_KEY, key_of_cell, leaves}
#import lightgraph::lit_ray_ends::lit_end_on
#import lightgraph::random::{even_pair, scramble}
#import lightgraph::rays::{Ray, pack}
#import lightgraph::rounds::frame
#import lightgraph::sampling::cosine_direction
#import lightgraph::trace::leave

#ifdef EMITTERS
#import lightgraph::packed_light
/// The emission that rays met.
var<storage, read_write> link_emission: array<vec2u>;
#endif

const LINKS: u32 = #{LINKS}u;
var<storage, read_write> link_rays: array<vec4u>;

@compute @workgroup_size(64)
fn cell_rays(@builtin(global_invocation_id) id: vec3u) {
    let cell = id.x / LINKS;
    let link = id.x % LINKS;
    let key = key_of_cell(cell);
    if key == NO_KEY {
        return;
    }
    let here = leaves(cell, link);
    // A cell's rays follow from its key.
    let direction = cosine_direction(here.normal, even_pair(frame() * LINKS + link, scramble(key)));
    let start = leave(here.position, here.flat_normal);
    let met = look_from(start, here.position, here.flat_normal, direction);
    var found = Ray();
    found.cell = NO_CELL;
    if met.lit {
        found = lit_end_on(met);
        found.cell = find_near(found.position, found.normal);
    }
#ifdef EMITTERS
    link_emission[id.x] = packed_light::pack(met.surface.emission);
#endif
    let packed = pack(found);
    link_rays[2u * id.x] = packed[0];
    link_rays[2u * id.x + 1u] = packed[1];
}
