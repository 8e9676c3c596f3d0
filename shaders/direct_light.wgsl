//! Direct light in the image: emission, and the lights' first bounce.
#import lightgraph::camera::pixel_ray
#import lightgraph::surface::{is_lit, read_record}
#ifdef LIGHTS
#import lightgraph::lights::reflected_light
#endif

var surface_albedo: texture_2d<f32>;
var surface_normal: texture_2d<f32>;
var direct: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn direct_light(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(direct)) {
        return;
    }
    var light = vec3f(0.0);
    let albedo = textureLoad(surface_albedo, id.xy, 0);
    if is_lit(albedo) {
        let ray = pixel_ray(id.xy);
        let s = read_record(albedo, textureLoad(surface_normal, id.xy, 0), ray.origin, ray.direction);
        light = s.emission;
#ifdef LIGHTS
        light += reflected_light(s);
#endif
    }
    textureStore(direct, id.xy, vec4f(light, 1.0));
}
