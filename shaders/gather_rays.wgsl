//! Rays of the first bounce from points that the camera sees: one pixel of each tile.
#import lightgraph::camera::pixel_ray
#import lightgraph::cell_keys::insert
#import lightgraph::cells::{key_of, large_key_of}
#import lightgraph::gloss::as_matte
#import lightgraph::hit::{flat_side, look_from}
#import lightgraph::random::{even_pair, seed}
#import lightgraph::rays::{Ray, pack}
#import lightgraph::rounds::round
#import lightgraph::sampling::cosine_direction
#import lightgraph::seen::seen_at
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::tiles::{point_pixel, points_across}
#import lightgraph::trace::leave
#ifdef ENVIRONMENT
#import lightgraph::sky_rays::pack_sky
#import lightgraph::trace::FAR
#endif
#ifdef LIGHTS
#import lightgraph::irradiance::irradiance
#endif

var<uniform> rays: u32;
var<storage, read_write> gathered: array<vec4u>;

/// Points of each 4x4 share one even sequence, each with a stretch of it.
@compute @workgroup_size(8, 8)
fn gather_rays(@builtin(global_invocation_id) id: vec3u) {
    let across = points_across();
    if any(id.xy >= across) {
        return;
    }
    let index = (id.y * across.x + id.x) * rays + id.z;
    var found = Ray();
#ifdef ENVIRONMENT
    var in_sky = false;
#endif
    let pixel = point_pixel(id.xy);
    let seen = seen_at(pixel);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(pixel);
        let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
        let place = id.x % 4u + 4u * (id.y % 4u);
        let u = even_pair((16u * round() + place) * rays + id.z, seed(id.xy / 4u, 0u));
        let direction = cosine_direction(s.normal, u);
        let met = look_from(leave(s.position, s.normal + s.view), s.position, s.normal, direction);
        // Where nothing is met the way it went, as if from far away.
        found.position = s.position + min(met.distance, 1e4) * direction;
        found.normal = -direction;
        found.flat_normal = -direction;
#ifdef ENVIRONMENT
        in_sky = met.distance >= FAR;
#endif
        if met.lit {
            found.position = met.surface.position;
            found.normal = met.surface.normal;
            found.flat_normal = flat_side(met);
            found.albedo = as_matte(met.surface);
            found.cell = key_of(met.surface.position, met.surface.normal);
            insert(found.cell);
            insert(large_key_of(found.position, found.normal));
#ifdef LIGHTS
            found.lit = irradiance(met.surface.position, met.surface.normal, met.start);
#endif
        }
    }
    var packed = pack(found);
#ifdef ENVIRONMENT
    if in_sky {
        packed = pack_sky(found.position, -found.normal);
    }
#endif
    gathered[2u * index] = packed[0];
    gathered[2u * index + 1u] = packed[1];
}
