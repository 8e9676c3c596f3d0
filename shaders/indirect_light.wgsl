//! Indirect light in the image: what each surface reflects of the light in the probes round it. With PACKED_PROBES as
//! they are packed for few fetches.
#import lightgraph::camera::pixel_ray
#import lightgraph::report::check
#import lightgraph::seen::seen_at
#ifdef PACKED_PROBES
#import lightgraph::packed_indirect::{ALL, reflected_probes}
#import lightgraph::surface::is_lit
#else
#import lightgraph::indirect::reflected_probes
#import lightgraph::surface::{is_lit, read_record}
#endif

var<uniform> behind_seen: f32;
#ifdef PACKED_PROBES
#ifdef PROBE_VISIBILITY
/// What sees each pixel's surface; see surface_sight.wgsl.
var surface_sight: texture_2d<u32>;
#endif
#else
var sh: texture_3d<f32>;
#endif
/// See count_blind.wgsl.
var<storage, read> blind: array<u32>;
var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn indirect_light(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(indirect)) {
        return;
    }
    if all(id.xy == vec2u(0u)) {
        // Too few for the scene: they know nothing of the light at a tenth of the surfaces in sight.
        check(10u * blind[0] <= blind[1], id, #{HERE}); // no probe sees a tenth of the image: take more probes
    }
    var light = vec3f(0.0);
    let seen = seen_at(id.xy);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(id.xy);
#ifdef PACKED_PROBES
#ifdef PROBE_VISIBILITY
        let sight = textureLoad(surface_sight, id.xy, 0).x;
#else
        let sight = ALL;
#endif
        light = reflected_probes(seen, ray.origin, ray.direction, behind_seen, sight);
#else
        light = reflected_probes(sh, read_record(seen.albedo, seen.normal, ray.origin, ray.direction), behind_seen);
#endif
        light = max(light, vec3f(0.0));
    }
    textureStore(indirect, id.xy, vec4f(light, 1.0));
}
