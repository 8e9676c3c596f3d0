//! The first bounce gathered at each pixel by rays: what they meet sends its direct light, and the light of further
//! bounces that the probes round it hold.
#import lightgraph::camera::pixel_ray
#import lightgraph::seen::seen_at
#import lightgraph::surface::{Surface, is_lit, read_record}
#import lightgraph::hit::{look_from, record}
#ifdef MORE_BOUNCES
#import lightgraph::packed_indirect
#endif
#import lightgraph::random::{even_pair, scramble, seed, unit}
#import lightgraph::sampling::{cosine_direction, lobe_direction}
#import lightgraph::trace::leave
#ifdef LIGHTS
#import lightgraph::lights::reflected_light
#endif
#ifdef EMITTERS_DIRECT
#import lightgraph::emitters::reflected_emitters
#endif
#ifdef ENVIRONMENT_DIRECT
#import lightgraph::environment_light::reflected_environment
#endif

struct Params {
    /// Rays of a pixel, along a side of the square they are spread over.
    directions: u32,
#ifdef MORE_BOUNCES
    behind_captured: f32,
#endif
#ifdef RAYS
    hit_samples: u32,
#endif
}
var<uniform> params: Params;
/// Irradiance over pi; then the radiance that the Phong lobe reflects.
var gathered: texture_storage_2d_array<rgba32float, write>;

/// Radiance that arrives at a surface along a ray from others than emitters and the environment.
fn arriving(s: Surface, direction: vec3f, shift: u32) -> vec3f {
    let start = leave(s.position, s.normal + s.view);
    let met = look_from(start, s.position, s.normal, direction);
    if !met.lit {
        return vec3f(0.0);
    }
    var light = vec3f(0.0);
#ifdef MORE_BOUNCES
    let probes = packed_indirect::reflected_probes(record(met), start, direction, params.behind_captured, packed_indirect::ALL);
    light = max(probes, vec3f(0.0));
#endif
#ifdef LIGHTS
    light += reflected_light(met.surface);
#endif
#ifdef EMITTERS_DIRECT
    light += reflected_emitters(met.surface, met.start, vec2u(params.hit_samples), unit(scramble(shift)), shift, shift);
#endif
#ifdef ENVIRONMENT_DIRECT
    light += reflected_environment(met.surface, met.start, params.hit_samples, shift + 1u);
#endif
    return light;
}

/// Pixels of each 4x4 share one even sequence, each with a stretch of it.
@compute @workgroup_size(8, 8)
fn first_bounce(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(gathered)) {
        return;
    }
    var sum = vec3f(0.0);
    var shine = vec3f(0.0);
    let seen = seen_at(id.xy);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(id.xy);
        let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
        let rays = params.directions * params.directions;
        let place = id.x % 4u + 4u * (id.y % 4u);
        for (var i = 0u; i < rays; i++) {
            let u = even_pair(place * rays + i, seed(id.xy / 4u, 0u));
            let shift = seed(id.xy, i);
            sum += arriving(s, cosine_direction(s.normal, u), shift) / f32(rays);
#ifdef SPECULAR
            if s.specular > 0.0 {
                let direction = lobe_direction(reflect(-s.view, s.normal), s.shininess, u);
                if dot(direction, s.normal) > 0.0 {
                    shine += s.specular * arriving(s, direction, shift) / f32(rays);
                }
            }
#endif
        }
    }
    textureStore(gathered, id.xy, 0u, vec4f(sum, 1.0));
#ifdef SPECULAR
    textureStore(gathered, id.xy, 1u, vec4f(shine, 1.0));
#endif
}
