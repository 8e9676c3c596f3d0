//! Counts the surfaces in the image, and those among them that none of the eight probes round them sees.
#import lightgraph::camera::pixel_ray
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::visible_probes::is_lost

var surface_albedo: texture_2d<f32>;
var surface_normal: texture_2d<f32>;
/// Lost and all in the image, lost and all in the captured cubes.
var<storage, read_write> lost_counts: array<atomic<u32>>;

@compute @workgroup_size(8, 8)
fn count_lost_seen(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surface_albedo)) {
        return;
    }
    let albedo = textureLoad(surface_albedo, id.xy, 0);
    if is_lit(albedo) {
        let ray = pixel_ray(id.xy);
        let s = read_record(albedo, textureLoad(surface_normal, id.xy, 0), ray.origin, ray.direction);
        atomicAdd(&lost_counts[0], u32(is_lost(s.position, s.normal)));
        atomicAdd(&lost_counts[1], 1u);
    }
}
