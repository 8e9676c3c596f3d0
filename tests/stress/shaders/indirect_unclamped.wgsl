//! Indirect light in the image as the series says, not cut off below zero.
#import lightgraph::camera::pixel_ray
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::indirect::reflected_probes

var<uniform> behind_seen: f32;
var surface_albedo: texture_2d<f32>;
var surface_normal: texture_2d<f32>;
var sh: texture_3d<f32>;
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
        let s = read_record(albedo, textureLoad(surface_normal, id.xy, 0), ray.origin, ray.direction);
        light = reflected_probes(sh, s, behind_seen);
    }
    textureStore(indirect, id.xy, vec4f(light, 1.0));
}
