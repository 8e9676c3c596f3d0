//! Rays beside those that all points of the image have, where the image is in doubt.
#import lightgraph::camera::pixel_ray
#import lightgraph::cells::key_of
#import lightgraph::gloss::as_matte
#import lightgraph::hit::{flat_side, look_from}
#import lightgraph::random::{even_pair, seed}
#import lightgraph::rays::{Ray, pack}
#import lightgraph::rounds::salt
#import lightgraph::sampling::cosine_direction
#import lightgraph::seen::seen_at
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::tiles::{NO_POINT, point_pixel, points_across}
#import lightgraph::trace::leave
#ifdef ENVIRONMENT
#import lightgraph::sky_rays::pack_sky
#import lightgraph::trace::FAR
#endif
#ifdef LIGHTS
#import lightgraph::irradiance::irradiance
#endif

const MORE: u32 = #{MORE}u;
/// Rows of `gathered` before these rays.
const BEFORE: u32 = #{BEFORE}u;
var<storage, read> more_points: array<u32>;
/// See hand_out.wgsl.
var<storage, read> more: array<vec2u>;
var<storage, read_write> gathered: array<vec4u>;

@compute @workgroup_size(64)
fn more_rays(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= MORE {
        return;
    }
    var found = Ray();
#ifdef ENVIRONMENT
    var in_sky = false;
#endif
    let point = more_points[id.x];
    if point != NO_POINT {
        let across = points_across();
        let at = vec2u(point % across.x, point / across.x);
        let pixel = point_pixel(at);
        let seen = seen_at(pixel);
        let ray = pixel_ray(pixel);
        let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
        // A point's rays are a run of one sequence, whatever the other points have.
        let number = id.x - more[point].x;
        let direction = cosine_direction(s.normal, even_pair(number, seed(at, 3u + salt())));
        let met = look_from(leave(s.position, s.normal + s.view), s.position, s.normal, direction);
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
    gathered[2u * (BEFORE + id.x)] = packed[0];
    gathered[2u * (BEFORE + id.x) + 1u] = packed[1];
}
