//! Which probes see what the camera sees, and how much of it none does.
#import lightgraph::camera::pixel_ray
#import lightgraph::seen::seen_at
#import lightgraph::probes
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::visible_probes::sight

/// As `lightgraph::visible_probes::sight` has it.
var surface_sight: texture_storage_2d<r32uint, write>;
/// Pixels that show a surface which no probe sees, and all that show a surface.
var<storage, read_write> blind: array<atomic<u32>>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surface_sight)) {
        return;
    }
    var seen = 0u;
    let surface = seen_at(id.xy);
    if is_lit(surface.albedo) {
        let ray = pixel_ray(id.xy);
        let s = read_record(surface.albedo, surface.normal, ray.origin, ray.direction);
        seen = sight(probes::cell(s.position), s);
        atomicAdd(&blind[0], u32(seen == 0u));
        atomicAdd(&blind[1], 1u);
    }
    textureStore(surface_sight, id.xy, vec4u(seen, 0u, 0u, 0u));
}
