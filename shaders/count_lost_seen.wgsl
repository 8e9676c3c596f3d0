//! Counts the surfaces in the image, and those among them that none of the eight probes round them sees.
#import lightgraph::camera::pixel_ray
#import lightgraph::seen::{seen_at, surface_albedo}
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::visible_probes::is_lost

/// Lost and all in the image, lost and all in the captured cubes.
var<storage, read_write> lost_counts: array<atomic<u32>>;

@compute @workgroup_size(8, 8)
fn count_lost_seen(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surface_albedo)) {
        return;
    }
    let seen = seen_at(id.xy);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(id.xy);
        let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
        atomicAdd(&lost_counts[0], u32(is_lost(s)));
        atomicAdd(&lost_counts[1], 1u);
    }
}
