//! Which probes see what the camera sees.
#import lightgraph::camera::pixel_ray
#import lightgraph::probes
#import lightgraph::surface::is_lit
#import lightgraph::visible_probes::sight

var surface_albedo: texture_2d<f32>;
var surface_normal: texture_2d<f32>;
/// As `lightgraph::visible_probes::sight` has it.
var surface_sight: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surface_sight)) {
        return;
    }
    var seen = 0u;
    if is_lit(textureLoad(surface_albedo, id.xy, 0)) {
        let ray = pixel_ray(id.xy);
        let normal = textureLoad(surface_normal, id.xy, 0);
        let point = ray.origin + normal.w * ray.direction;
        seen = sight(probes::cell(point), point, normal.xyz);
    }
    textureStore(surface_sight, id.xy, vec4u(seen, 0u, 0u, 0u));
}
