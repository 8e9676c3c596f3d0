//! Light that comes to the cells straight from the environment, told from where their rays leave. Directions are drawn
//! by its light, and rays that left the scene count too.
#import lightgraph::environment::{draw, draw_density, radiance}
#import lightgraph::kept::{LINKS, NO_KEY, key_of_cell, leaves, link_direction}
#import lightgraph::packed_light
#import lightgraph::random::{scramble, sobol_pair}
#import lightgraph::rays::SKY
#import lightgraph::rounds::salt
#import lightgraph::trace::{FAR, is_free, leave}

var<uniform> cell_samples: u32;
var<storage, read> link_rays: array<vec4u>;
/// What the place that a ray leaves has of the environment, as a white surface would send it on.
var<storage, read_write> link_emission: array<vec2u>;

/// Of drawing a direction by the cosine, in 1/sr.
fn cosine_density(normal: vec3f, direction: vec3f) -> f32 {
    return max(dot(normal, direction), 0.0) / 3.14159265359;
}

@compute @workgroup_size(64)
fn cell_sky(@builtin(global_invocation_id) id: vec3u) {
    let cell = id.x / LINKS;
    let link = id.x % LINKS;
    let key = key_of_cell(cell);
    if key == NO_KEY {
        return;
    }
    let here = leaves(cell, link);
    let start = leave(here.position, here.flat_normal);
    let shift = scramble(scramble(scramble(key) + link + salt()));
    let drawn = f32(cell_samples);
    // All directions are weighed against each other (the balance heuristic).
    var straight = vec3f(0.0);
    for (var i = 0u; i < cell_samples; i++) {
        let d = draw(sobol_pair(i, shift));
        let density = cosine_density(here.normal, d.direction);
        if d.density > 0.0 && density > 0.0 && any(d.radiance > vec3f(0.0)) && is_free(start, d.direction, FAR) {
            straight += density * d.radiance / (drawn * d.density + density);
        }
    }
    if link_rays[2u * id.x + 1u].w == SKY {
        let direction = link_direction(here, key, link);
        let density = cosine_density(here.normal, direction);
        straight += radiance(direction) * (density / max(density + drawn * draw_density(direction), 1e-20));
    }
    link_emission[id.x] = packed_light::pack(straight);
}
