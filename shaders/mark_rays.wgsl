//! Marks where rays ended: the zone, and the parts of the lights' beams that may have lit the place.
#import lightgraph::marks::{PARTS, zone_of}
#import lightgraph::rays::unpack
#ifdef OF_CELLS
#import lightgraph::kept::{LINKS, NO_KEY, key_of_cell}
#endif
#ifdef LIGHTS
#import lightgraph::lights::{arrival, light_count, lights}
#import lightgraph::marks::part_of
#endif

/// Rays of `met`.
const COUNT: u32 = #{COUNT}u;
var<storage, read> met: array<vec4u>;
/// See `lightgraph::marks`.
var<storage, read_write> marks: array<atomic<u32>>;

@compute @workgroup_size(64)
fn mark_rays(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= COUNT {
        return;
    }
#ifdef OF_CELLS
    if key_of_cell(id.x / LINKS) == NO_KEY {
        return;
    }
#endif
    let ray = unpack(met[2u * id.x], met[2u * id.x + 1u]);
    // Black ones send nothing on, and those that met nothing are black.
    if all(ray.albedo <= vec3f(0.0)) {
        return;
    }
    let zone = zone_of(ray.position);
    atomicOr(&marks[PARTS + zone / 32u], 1u << (zone % 32u));
#ifdef LIGHTS
    if all(ray.lit <= vec3f(0.0)) {
        return;
    }
    for (var i = 0u; i < light_count(); i++) {
        let a = arrival(lights[i], ray.position);
        if any(a.irradiance > vec3f(0.0)) && dot(a.direction, ray.normal) > 0.0 {
            atomicMax(&marks[part_of(i, ray.position)], 1u);
        }
    }
#endif
}
