//! Rays from the cells: LINKS from each, of the surface where rays met it. What they meet are cells again, the light of
//! which they bring, bounce by bounce.
#import lightgraph::cells::{PLACES, NO_CELL}
#import lightgraph::find_cell::{find_near, keys}
#import lightgraph::gloss::matte
#import lightgraph::hit::look
#import lightgraph::random::{even_pair, scramble}
#import lightgraph::rays::{Ray, pack, unpack}
#import lightgraph::rounds::round
#import lightgraph::sampling::cosine_direction
#import lightgraph::trace::leave
#ifdef LIGHTS
#import lightgraph::irradiance::irradiance
#endif

#ifdef EMITTERS
#import lightgraph::packed_light
/// The emission that rays met.
var<storage, read_write> link_emission: array<vec2u>;
#endif

const LINKS: u32 = #{LINKS}u;
const KEPT: u32 = #{KEPT}u;
/// What met the cells, and which of it each keeps.
var<storage, read> met_by: array<vec4u>;
var<storage, read> kept: array<u32>;
var<storage, read_write> link_rays: array<vec4u>;

@compute @workgroup_size(64)
fn cell_rays(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
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
        // A cell's rays follow from its key.
        let direction = cosine_direction(here.normal, even_pair(round() * LINKS + link, scramble(key)));
        let met = look(leave(here.position, here.normal), direction);
        var found = Ray();
        found.cell = NO_CELL;
        if met.lit {
            found.position = met.surface.position;
            found.normal = met.surface.normal;
            found.albedo = matte(met.surface);
            found.cell = find_near(met.surface.position, met.surface.normal);
#ifdef LIGHTS
            found.lit = irradiance(met.surface.position, met.surface.normal, met.start);
#endif
        }
#ifdef EMITTERS
        link_emission[place * LINKS + link] = packed_light::pack(met.surface.emission);
#endif
        let packed = pack(found);
        link_rays[2u * (place * LINKS + link)] = packed[0];
        link_rays[2u * (place * LINKS + link) + 1u] = packed[1];
    }
}
