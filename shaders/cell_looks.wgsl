//! From where their rays leave, the cells look at emitters: each time at one of a few points drawn by power, chosen by
//! what it gives unshadowed (Talbot, Cline and Egbert, "Importance Resampling for Global Illumination", 2005). Rays
//! that met emitters count, too.
#import lightgraph::emitters::{Sample, draw, emitters}
#import lightgraph::kept::{LINKS, NO_KEY, key_of_cell, leaves}
#import lightgraph::looks::{cell_samples, points_each}
#import lightgraph::packed_light
#import lightgraph::random::{next, next_pair, scramble}
#import lightgraph::rounds::salt
#import lightgraph::trace::{is_free, leave}

/// Before: what the ray brings. After: what the place that it leaves has of emitters, as a white surface would send it
/// on.
var<storage, read_write> link_emission: array<vec2u>;

@compute @workgroup_size(64)
fn cell_looks(@builtin(global_invocation_id) id: vec3u) {
    let cell = id.x / LINKS;
    let link = id.x % LINKS;
    let key = key_of_cell(cell);
    if key == NO_KEY {
        return;
    }
    let here = leaves(cell, link);
    let start = leave(here.position, here.flat_normal);
    var state = scramble(key + scramble(link) + salt());
    var straight = vec3f(0.0);
    let each = points_each();
    let candidates = cell_samples * each;
    // Every other link covers all emitters evenly, and so do the rest: see cell_emission.wgsl.
    let strata = f32((LINKS + 1u - link % 2u) / 2u * candidates);
    for (var i = 0u; i < cell_samples; i++) {
        var chosen: Sample;
        var own = 0.0;
        var total = 0.0;
        for (var k = 0u; k < each; k++) {
            let number = link / 2u * candidates + i * each + k;
            let choice = (f32(number) + next(&state)) / strata;
            let p = draw(start, choice, next_pair(&state));
            let cosine = dot(here.normal, p.direction);
            if p.density > 0.0 && cosine > 0.0 {
                let light = cosine * dot(p.radiance, vec3f(1.0));
                total += light / p.density;
                if next(&state) * total * p.density < light {
                    chosen = p;
                    own = light;
                }
            }
        }
        // Both by how likely each finds a point (the balance heuristic), as if all candidates counted: some of the
        // points, and one ray.
        if own > 0.0 && is_free(start, chosen.direction, chosen.distance) {
            let density = dot(here.normal, chosen.direction) / 3.14159265359;
            let drawn = f32(candidates) * chosen.density;
            straight += chosen.radiance * (density * total / (own * f32(candidates)) * drawn / (drawn + density));
        }
    }
    link_emission[id.x] = packed_light::pack(straight + packed_light::unpack(link_emission[id.x]));
}
