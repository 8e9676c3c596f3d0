//! The first light of the cells: their rays met some of what lights and emitters light, and each looks at a source,
//! too. What both
//! bring takes the place of what the ray met.
#import lightgraph::cells::{NO_CELL, PLACES}
#import lightgraph::photons::{density_of, form, from_source, share_of_ray, sum_of, unpack_source}
#import lightgraph::packed_light
#import lightgraph::random::scramble
#import lightgraph::rays::unpack
#import lightgraph::trace::{is_free, leave}

const LINKS: u32 = #{LINKS}u;
const KEPT: u32 = #{KEPT}u;
struct Count {
    count: u32,
    scale: f32,
}
var<storage, read> source_count: Count;
var<storage, read> keys: array<u32>;
var<storage, read> met_by: array<vec4u>;
var<storage, read> kept: array<u32>;
var<storage, read> emitted: array<vec4f>;
var<storage, read> sources: array<vec4u>;
var<storage, read_write> link_rays: array<vec4u>;

/// Rays end this share before a source, which would be in its own way.
const REACH: f32 = 0.999;

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
        var first = vec3f(0.0);
        if met.cell != NO_CELL {
            let arrived = met.lit + emitted[met.cell].rgb;
            let density = density_of(sum_of(arrived), source_count.scale);
            let found = form(met.position - here.position, here.normal, met.normal);
            first = met.albedo * arrived * share_of_ray(found, density, 1.0);
        } else {
            first = met.albedo * met.lit;
        }
        if source_count.count > 0u {
            let i = (scramble(key) + link) % source_count.count;
            let source = unpack_source(sources[2u * i], sources[2u * i + 1u]);
            let light = from_source(source, here.position, here.normal, 1.0);
            if any(light > vec3f(0.0)) {
                let start = leave(here.position, here.normal);
                let way = source.position - start;
                let end = length(way);
                if is_free(start, way / end, REACH * end) {
                    first += light;
                }
            }
        }
        let packed = packed_light::pack(first);
        link_rays[at + 1u] = vec4u(packed, link_rays[at + 1u].zw);
    }
}
