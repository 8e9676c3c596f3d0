//! Counts the pixels that show a surface, and those among them of whose light no probe knows. One pixel of each square
//! is asked: a share needs no more.
#import lightgraph::camera::pixel_ray
#import lightgraph::seen::{seen_at, surface_albedo}
#import lightgraph::surface::is_lit
#ifdef PROBE_VISIBILITY
#import lightgraph::surface::read_record
#import lightgraph::visible_probes::is_blind
#else
#import lightgraph::probes::is_blind
var sh: texture_3d<f32>;
#endif

/// Pixels along a square.
const EACH: u32 = #{EACH}u;
/// Pixels that show a surface which no probe sees, and all that show a surface.
var<storage, read_write> blind: array<atomic<u32>>;

@compute @workgroup_size(8, 8)
fn count_blind(@builtin(global_invocation_id) id: vec3u) {
    let pixel = EACH * id.xy;
    if any(pixel >= textureDimensions(surface_albedo)) {
        return;
    }
    let seen = seen_at(pixel);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(pixel);
#ifdef PROBE_VISIBILITY
        let lost = is_blind(read_record(seen.albedo, seen.normal, ray.origin, ray.direction));
#else
        let lost = is_blind(sh, ray.origin + seen.normal.w * ray.direction);
#endif
        atomicAdd(&blind[0], u32(lost));
        atomicAdd(&blind[1], 1u);
    }
}
