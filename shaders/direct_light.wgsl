//! Direct light in the image: emission, and the lights' first bounce; with EMITTERS_DIRECT, that of emitters too. With
//! ENVIRONMENT it is seen where nothing else is; with ENVIRONMENT_DIRECT surfaces are lit by it. With FINISH
//! metals shine as rough as they are at each pixel.
#import lightgraph::camera::pixel_ray
#ifdef ENVIRONMENT
#import lightgraph::environment
#import lightgraph::surface::is_nothing
#endif
#ifdef ENVIRONMENT_DIRECT
#import lightgraph::environment_light::reflected_environment
#endif
#import lightgraph::seen::{finished, seen_at}
#import lightgraph::surface::{is_lit, read_record}
#ifdef UNLIT
#import lightgraph::surface::unlit_of
#endif
#ifdef LIGHTS
#ifdef LIGHT_CUTS
#import lightgraph::light_cuts::reflected_light
#else
#import lightgraph::lights::reflected_light
#endif
#endif
#ifdef EMITTERS_DIRECT
#import lightgraph::emitters::{BLOCK, MANY, reflected_emitters}
#endif
#ifdef RAYS
#import lightgraph::random::{dither, seed}
#import lightgraph::trace::leave
#endif

#ifdef EMITTERS_DIRECT
var<uniform> emitter_samples: u32;
#endif
#ifdef ENVIRONMENT_DIRECT
var<uniform> environment_samples: u32;
#endif
#ifdef LIGHT_CUTS
var<uniform> error_seen: f32;
#endif
var direct: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn direct_light(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(direct)) {
        return;
    }
    var light = vec3f(0.0);
    let seen = seen_at(id.xy);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(id.xy);
        let s = finished(read_record(seen.albedo, seen.normal, ray.origin, ray.direction), id.xy);
        light = s.emission;
#ifdef UNLIT
        light += unlit_of(seen.albedo);
#endif
#ifdef LIGHTS
#ifdef LIGHT_CUTS
        light += reflected_light(s, error_seen);
#else
        light += reflected_light(s);
#endif
#endif
#ifdef RAYS
        let start = leave(s.position, s.normal + s.view);
#endif
#ifdef EMITTERS_DIRECT
        let block = seed(id.xy / BLOCK, 0u);
        let samples = vec2u(1u, MANY) * emitter_samples;
        light += reflected_emitters(s, start, samples, dither(id.xy, 0u), seed(id.xy, 0u), block);
#endif
#ifdef ENVIRONMENT_DIRECT
        light += reflected_environment(s, start, environment_samples, seed(id.xy, 1u));
#endif
    }
#ifdef ENVIRONMENT
    if is_nothing(seen.albedo, seen.normal) {
        light = environment::radiance(pixel_ray(id.xy).direction);
    }
#endif
    textureStore(direct, id.xy, vec4f(light, 1.0));
}
