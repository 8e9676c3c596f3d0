//! From where their rays leave, the cells look at emitters: as many points on each as its power says. Rays that met
//! emitters count, too.
#import lightgraph::cells::PLACES
#import lightgraph::emitters::{draw, draw_density}
#import lightgraph::packed_light
#import lightgraph::random::{next, next_pair, scramble}
#import lightgraph::rays::{unpack, unpack_normal}
#import lightgraph::rounds::salt
#import lightgraph::trace::{is_free, leave}

const LINKS: u32 = #{LINKS}u;
const KEPT: u32 = #{KEPT}u;
var<uniform> cell_samples: u32;
var<storage, read> keys: array<u32>;
var<storage, read> met_by: array<vec4u>;
var<storage, read> kept: array<u32>;
var<storage, read> link_rays: array<vec4u>;
/// Before: the emission that a ray met. After: what the place that it leaves has of emitters, as a white surface
/// would send it on.
var<storage, read_write> link_emission: array<vec2u>;

/// Rays end this share before an emitter, which would be in its own way.
const REACH: f32 = 0.9999;

@compute @workgroup_size(64)
fn cell_looks(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
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
        let start = leave(here.position, here.normal);
        var state = scramble(key + scramble(link) + salt());
        var straight = vec3f(0.0);
        for (var i = 0u; i < cell_samples; i++) {
            let choice = (f32(link * cell_samples + i) + next(&state)) / f32(LINKS * cell_samples);
            let p = draw(start, choice, next_pair(&state));
            let cosine = dot(here.normal, p.direction);
            // Both by how likely each finds a point (the balance heuristic): some of the points, and one ray.
            if p.density > 0.0 && cosine > 0.0 && is_free(start, p.direction, REACH * p.distance) {
                straight += p.radiance * cosine / (3.14159265359 * f32(cell_samples) * p.density + cosine);
            }
        }
        // What the ray met that leaves there.
        let index = place * LINKS + link;
        let emission = packed_light::unpack(link_emission[index]);
        if any(emission > vec3f(0.0)) {
            let offset = bitcast<vec3f>(link_rays[2u * index].xyz) - here.position;
            let way = normalize(offset);
            let density = max(dot(here.normal, way), 0.0) / 3.14159265359;
            let faced = -dot(unpack_normal(link_rays[2u * index].w), way);
            let drawn = f32(cell_samples) * draw_density(emission, length(offset), faced);
            straight += emission * (density / max(density + drawn, 1e-20));
        }
        link_emission[index] = packed_light::pack(straight);
    }
}
