//! Indirect light in the image: what each surface reflects of the light in the probes round it. With PACKED_PROBES as they
//! are packed for few fetches.
#import lightgraph::camera::pixel_ray
#ifdef PACKED_PROBES
#import lightgraph::packed_indirect::reflected_probes
#import lightgraph::surface::{Record, is_lit}
#else
#import lightgraph::indirect::reflected_probes
#import lightgraph::surface::{is_lit, read_record}
#endif

var<uniform> behind_seen: f32;
var surface_albedo: texture_2d<f32>;
var surface_normal: texture_2d<f32>;
#ifndef PACKED_PROBES
var sh: texture_3d<f32>;
#endif
var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn indirect_light(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(indirect)) {
        return;
    }
    var light = vec3f(0.0);
    let albedo = textureLoad(surface_albedo, id.xy, 0);
    if is_lit(albedo) {
        let ray = pixel_ray(id.xy);
        let normal = textureLoad(surface_normal, id.xy, 0);
#ifdef PACKED_PROBES
        light = reflected_probes(Record(albedo, normal), ray.origin, ray.direction, behind_seen);
#else
        light = reflected_probes(sh, read_record(albedo, normal, ray.origin, ray.direction), behind_seen);
#endif
        light = max(light, vec3f(0.0));
    }
    textureStore(indirect, id.xy, vec4f(light, 1.0));
}
