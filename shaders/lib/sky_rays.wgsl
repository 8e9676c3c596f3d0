//! Rays that left the scene, as other rays are kept.
#define_import_path lightgraph::sky_rays
#import lightgraph::environment
#import lightgraph::rays::{Ray, SKY, pack}

/// Keeps the environment's radiance along a direction, and in place of a normal the density with which the
/// environment's light draws that direction. `position` is a place far away, where the ray leads.
fn pack_sky(position: vec3f, direction: vec3f) -> array<vec4u, 2> {
    var sky = Ray();
    sky.lit = environment::radiance(direction);
    sky.cell = SKY;
    var packed = pack(sky);
    packed[0] = vec4u(bitcast<vec3u>(position), bitcast<u32>(environment::draw_density(direction)));
    return packed;
}
