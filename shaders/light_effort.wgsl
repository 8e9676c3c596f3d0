//! What direct light takes at each pixel: lights and groups of lights that are lit as one, each with a ray, and rows of
//! the tree that are looked at to find them.
#import lightgraph::camera::pixel_ray
#import lightgraph::seen::seen_at
#import lightgraph::light_cuts::effort
#import lightgraph::surface::{is_lit, read_record}

var<uniform> error_seen: f32;
var light_effort: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn count(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(light_effort)) {
        return;
    }
    var found = vec2u(0u);
    let seen = seen_at(id.xy);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(id.xy);
        found = effort(read_record(seen.albedo, seen.normal, ray.origin, ray.direction), error_seen);
    }
    textureStore(light_effort, id.xy, vec4f(vec2f(found), 0.0, 1.0));
}
