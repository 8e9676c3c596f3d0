//! Direct light in the image, with traced shadows: emission, and the first bounce from lights, emitters and the
//! environment. The environment's matte light goes to `drawn_sky`, without the part that pixels share by their rays:
//! share_rays.wgsl adds the two. With FINISH metals shine as rough as they are at each pixel.
#import lightgraph::camera::pixel_ray
#import lightgraph::random::seed
#import lightgraph::rounds::salt
#import lightgraph::seen::{finished, seen_at}
#import lightgraph::surface::{is_lit, is_nothing, read_record}
#import lightgraph::trace::leave
#ifdef UNLIT
#import lightgraph::surface::unlit_of
#endif
#ifdef LIGHTS
#import lightgraph::traced_lights::traced_light
#endif
#ifdef ENVIRONMENT
#import lightgraph::environment
#import lightgraph::environment_light::drawn_environment
#ifdef SPECULAR
#import lightgraph::environment_light::mirrored_environment
#import lightgraph::gloss::shines
#endif
#import lightgraph::points::has_point
#import lightgraph::sky_guide::block_of
var<uniform> environment_samples: u32;
#endif
#ifdef EMITTERS
#import lightgraph::emitters::{BLOCK, MANY, reflected_emitters}
#import lightgraph::random::{dither, scramble}
var<uniform> emitter_samples: u32;
#endif

var direct: texture_storage_2d<rgba32float, write>;
#ifdef ENVIRONMENT
var drawn_sky: texture_storage_2d<rgba32float, write>;
#endif

@compute @workgroup_size(8, 8)
fn traced_direct(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(direct)) {
        return;
    }
    var light = vec3f(0.0);
#ifdef ENVIRONMENT
    var sky = vec3f(0.0);
#endif
    let seen = seen_at(id.xy);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(id.xy);
        let s = finished(read_record(seen.albedo, seen.normal, ray.origin, ray.direction), id.xy);
        let start = leave(s.position, s.normal + s.view);
        light = s.emission;
#ifdef UNLIT
        light += unlit_of(seen.albedo);
#endif
#ifdef LIGHTS
        light += traced_light(s, start);
#endif
#ifdef EMITTERS
        let first = dither(id.xy, scramble(salt()));
        let shift = seed(id.xy, salt());
        let block = seed(id.xy / BLOCK, salt());
        light += reflected_emitters(s, start, vec2u(1u, MANY) * emitter_samples, first, shift, block);
#endif
#ifdef ENVIRONMENT
        if has_point(id.xy) {
            sky = drawn_environment(s, start, environment_samples, seed(id.xy, 1u + salt()), block_of(id.xy));
        }
#ifdef SPECULAR
        if shines(s) {
            light += mirrored_environment(s, start, environment_samples, seed(id.xy, 1u + salt()));
        }
#endif
#endif
    }
#ifdef ENVIRONMENT
    if is_nothing(seen.albedo, seen.normal) {
        light = environment::radiance(pixel_ray(id.xy).direction);
    }
    textureStore(drawn_sky, id.xy, vec4f(sky, 1.0));
#endif
    textureStore(direct, id.xy, vec4f(light, 1.0));
}
