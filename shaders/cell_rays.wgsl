//! Rays from the cells: LINKS from each, of the surface where rays met it. They bring light of the cells that they
//! meet, bounce by bounce; connect_cells.wgsl finds those.
#import lightgraph::cells::NO_CELL
#import lightgraph::hit::look_from
#import lightgraph::kept::{LINKS, NO_KEY, key_of_cell, leaves, link_direction}
#import lightgraph::lit_ray_ends::lit_end_on
#import lightgraph::rays::{Ray, SKY, pack}
#import lightgraph::trace::{FAR, leave}

#ifdef EMITTERS
#import lightgraph::emitters
#import lightgraph::hit::Met
#import lightgraph::looks::{cell_samples, points_each}
#import lightgraph::packed_light
/// What rays bring of emitters, beside what their cells look at; see cell_looks.wgsl.
var<storage, read_write> link_emission: array<vec2u>;

/// The emission that a ray along `direction` met, by how likely the ray found it and the cell's looks do (the balance
/// heuristic).
fn brought(met: Met, normal: vec3f, direction: vec3f) -> vec3f {
    let emission = met.surface.emission;
    if all(emission <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    let cosine = -dot(met.flat_normal, direction);
#ifdef EMISSION_MAPS
    let point = emitters::density_of(met.emitter, met.distance, cosine);
#else
    let point = emitters::draw_density(emission, met.distance, cosine);
#endif
    let density = max(dot(normal, direction), 0.0) / 3.14159265359;
    return emission * (density / max(density + f32(cell_samples * points_each()) * point, 1e-20));
}
#endif

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
    let direction = link_direction(here, key, link);
    let start = leave(here.position, here.flat_normal);
    let met = look_from(start, here.position, here.flat_normal, direction);
    var found = Ray();
    found.cell = select(NO_CELL, SKY, met.distance >= FAR);
    if met.lit {
        found = lit_end_on(met);
    }
#ifdef EMITTERS
    link_emission[id.x] = packed_light::pack(brought(met, here.normal, direction));
#endif
    let packed = pack(found);
    link_rays[2u * id.x] = packed[0];
    link_rays[2u * id.x + 1u] = packed[1];
}
