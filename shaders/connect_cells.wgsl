//! The first light of the cells: their rays met some of what lights and emitters light, and each looks at a source,
//! too. What both bring takes the place of what the ray met.
#import lightgraph::cells::{NO_CELL, PLACES}
#import lightgraph::photons::{RAYS_A_SOURCE, density_of, form, from_source, share_of_ray, sum_of}
#import lightgraph::packed_light
#import lightgraph::random::scramble
#import lightgraph::rays::unpack
#import lightgraph::rounds::salt
#import lightgraph::source_texels::source_at
#import lightgraph::sources::{CANDIDATES, choose, sees, source_count}
#import lightgraph::trace::leave

const LINKS: u32 = #{LINKS}u;
const KEPT: u32 = #{KEPT}u;
var<storage, read> keys: array<u32>;
var<storage, read> met_by: array<vec4u>;
var<storage, read> kept: array<u32>;
var<storage, read> emitted: array<vec4f>;
var<storage, read_write> link_rays: array<vec4u>;

@compute @workgroup_size(64)
fn connect_cells(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let at_once = 64u * groups.x / LINKS;
    if id.x >= at_once * LINKS {
        return;
    }
    let link = id.x % LINKS;
    for (var place = id.x / LINKS; place < PLACES; place += at_once) {
        let key = keys[place];
        if key == 0u {
            continue;
        }
        let row = kept[place * KEPT + link % KEPT] & 0x3fffffu;
        let here = unpack(met_by[2u * row], met_by[2u * row + 1u]);
        let at = 2u * (place * LINKS + link);
        let met = unpack(link_rays[at], link_rays[at + 1u]);
        var arrived = met.lit;
        if met.cell != NO_CELL {
            arrived += emitted[met.cell].rgb;
        }
        let density = density_of(sum_of(arrived), source_count.scale);
        let found = form(met.position - here.position, here.normal, met.normal);
        var first_light = met.albedo * arrived * share_of_ray(found, density, RAYS_A_SOURCE);
        if source_count.count > 0u {
            let first = scramble(key + salt()) + link * CANDIDATES;
            let choice = choose(here.position, here.normal, first, scramble(first));
            let source = source_at(choice.row);
            let light = choice.weight * from_source(source, here.position, here.normal, RAYS_A_SOURCE);
            if any(light > vec3f(0.0)) && sees(leave(here.position, here.normal), source) {
                first_light += light;
            }
        }
        let packed = packed_light::pack(first_light);
        link_rays[at + 1u] = vec4u(packed, link_rays[at + 1u].zw);
    }
}
