//! The cells that the cells' rays met, and the first light: the rays met some of what lights and emitters light, and
//! each looks at a source, too. What both bring goes with what the ray met.
#import lightgraph::cells::NO_CELL
#import lightgraph::find_cell::find_near
#import lightgraph::kept::{LINKS, NO_KEY, key_of_cell, leaves, link_place}
#import lightgraph::photons::{RAYS_A_SOURCE, form, from_source, halves_of, share_of_ray, sum_of}
#import lightgraph::packed_light
#import lightgraph::random::scramble
#import lightgraph::rays::unpack
#import lightgraph::rounds::salt
#import lightgraph::source_texels::source_at
#import lightgraph::sources::{CANDIDATES, choose, sees, source_count}
#import lightgraph::trace::leave

var<storage, read> emitted: array<vec4f>;
var<storage, read> link_rays: array<vec4u>;
var link_texels: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(64)
fn connect_cells(@builtin(global_invocation_id) id: vec3u) {
    let cell = id.x / LINKS;
    let link = id.x % LINKS;
    let key = key_of_cell(cell);
    if key == NO_KEY {
        return;
    }
    let here = leaves(cell, link);
    let packed = link_rays[2u * id.x + 1u];
    let met = unpack(link_rays[2u * id.x], packed);
    var next = NO_CELL;
    if met.cell == 0u {
        next = find_near(met.position, met.normal);
    }
    var there = vec4f(0.0);
    if next != NO_CELL {
        there = emitted[next];
    }
    let arrived = met.lit + there.rgb;
    let evenly = exp2(met.evenly) * sum_of(met.lit) + sum_of(there.rgb);
    let found = form(met.position - here.position, here.normal, met.flat_normal);
    let share = share_of_ray(found, halves_of(evenly, there.a), source_count[0].scale, RAYS_A_SOURCE);
    var first_light = met.albedo * arrived * share;
    if source_count[0].count > 0u {
        let first = scramble(key + salt()) + link * CANDIDATES;
        let choice = choose(here.position, here.normal, first, scramble(first));
        let source = source_at(choice.row);
        let light = choice.weight * from_source(source, here.position, here.normal, RAYS_A_SOURCE);
        if any(light > vec3f(0.0)) && sees(leave(here.position, here.flat_normal), source) {
            first_light += light;
        }
    }
    textureStore(link_texels, link_place(id.x), vec4u(packed_light::pack(first_light), packed.z, next));
}
