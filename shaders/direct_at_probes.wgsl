//! Light that every captured texel sends to its probe without the help of others: its own, and the lights' first
//! bounce; with EMITTERS_DIRECT that of emitters instead of its own, with ENVIRONMENT_DIRECT that of the environment
//! instead of the environment's own, for graphs that count both where they arrive. With PACKED_SURFACE what the probes
//! see is packed in one texel, and so is the light. A face of a probe is an instance.
#import lightgraph::cube
#ifdef ENVIRONMENT_DIRECT
#import lightgraph::environment_light::reflected_environment
#else
#ifdef ENVIRONMENT
#import lightgraph::environment
#import lightgraph::surface::is_nothing
#endif
#endif
#import lightgraph::instances
#import lightgraph::probes
#import lightgraph::surface::{Record, is_lit, read_record}
#ifdef PACKED_SURFACE
#import lightgraph::packed_light
#import lightgraph::packed_surface::surface_at
#endif
#ifdef LIGHTS
#ifdef LIGHT_CUTS
#import lightgraph::light_cuts::reflected_light
#else
#import lightgraph::lights::reflected_light
#endif
#endif
#ifdef EMITTERS_DIRECT
#import lightgraph::emitters::{BLOCK, reflected_emitters}
#endif
#ifdef RAYS
#import lightgraph::random::{dither, seed}
#import lightgraph::trace::leave
#endif

struct Params {
    cube_direct_tile: u32,
    cube_direct_columns: u32,
#ifdef RAYS
    hit_samples: u32,
#endif
#ifdef LIGHT_CUTS
    error_captured: f32,
#endif
}
var<uniform> params: Params;
#ifndef PACKED_SURFACE
var cube_albedo: texture_2d<f32>;
var cube_normal: texture_2d<f32>;

fn surface_at(at: vec2u) -> Record {
    return Record(textureLoad(cube_albedo, at, 0), textureLoad(cube_normal, at, 0));
}
#endif
#ifdef PACKED_SURFACE
var cube_direct: texture_storage_2d<rg32uint, write>;
#else
var cube_direct: texture_storage_2d<rgba32float, write>;
#endif
@compute @workgroup_size(8, 8)
fn direct_at_probes(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let edge = params.cube_direct_tile;
    let texel = 8u * instances::within(group) + local.xy;
    if any(texel >= vec2u(edge)) {
        return;
    }
    let face = instances::number(group);
    let at = cube::unplace(face, texel, edge, params.cube_direct_columns);
    var light = vec3f(0.0);
    let r = surface_at(at);
    let ray = cube::direction_beside(face % 6u, texel, edge);
    if is_lit(r.albedo) {
        let probe = probes::position(probes::coordinates(face / 6u));
        let s = read_record(r.albedo, r.normal, probe, ray);
#ifdef RAYS
        let start = leave(s.position, s.normal + s.view);
#endif
#ifdef EMITTERS_DIRECT
        let block = seed(at / BLOCK, 0u);
        light = reflected_emitters(s, start, vec2u(params.hit_samples), dither(at, 0u), seed(at, 0u), block);
#else
        light = s.emission;
#endif
#ifdef ENVIRONMENT_DIRECT
        light += reflected_environment(s, start, params.hit_samples, seed(at, 1u));
#endif
#ifdef LIGHTS
#ifdef LIGHT_CUTS
        light += reflected_light(s, params.error_captured);
#else
        light += reflected_light(s);
#endif
#endif
    }
#ifndef ENVIRONMENT_DIRECT
#ifdef ENVIRONMENT
    if is_nothing(r.albedo, r.normal) {
        light = environment::mean_radiance(ray, cube::solid_angle(texel, edge));
    }
#endif
#endif
#ifdef PACKED_SURFACE
    textureStore(cube_direct, at, vec4u(packed_light::pack(light), 0u, 0u));
#else
    textureStore(cube_direct, at, vec4f(light, 1.0));
#endif
}
