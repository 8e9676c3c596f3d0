//! One bounce's own share of the image: light from the probes now, less light from the probes a bounce before. With
//! PACKED_PROBES as they are packed for few fetches: 1 where there was no light before, else 3.
#import lightgraph::camera::pixel_ray
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
/// What sees each pixel's surface.
var surface_sight: texture_2d<u32>;
#endif
#else
var sh: texture_3d<f32>;
var sh_before: texture_3d<f32>;
#endif

struct Image {
    @location(0) bounce_images: vec4f,
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> Image {
    let pixel = vec2u(position.xy);
    let seen = seen_at(pixel);
    if !is_lit(seen.albedo) {
        return Image(vec4f(0.0, 0.0, 0.0, 1.0));
    }
    let ray = pixel_ray(pixel);
#ifdef PACKED_PROBES
#ifdef PROBE_VISIBILITY
    let sight = textureLoad(surface_sight, pixel, 0).x;
#else
    let sight = ALL;
#endif
    let light = reflected_probes(seen, ray.origin, ray.direction, behind_seen, sight);
#else
    let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
    let light = reflected_probes(sh, s, behind_seen) - reflected_probes(sh_before, s, behind_seen);
#endif
    return Image(vec4f(light, 1.0));
}
