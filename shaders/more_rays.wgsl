//! Rays beside those that all points of the image have, where the image is in doubt.
#import lightgraph::camera::pixel_ray
#import lightgraph::image_rays::{end_of, pack_end}
#import lightgraph::random::{even_pair, seed}
#import lightgraph::rays::Ray
#import lightgraph::rounds::salt
#import lightgraph::sampling::cosine_direction
#import lightgraph::seen::seen_at
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::tiles::{NO_POINT, point_pixel, points_across}

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
        found = end_of(s, direction);
    }
    let packed = pack_end(found);
    gathered[2u * (BEFORE + id.x)] = packed[0];
    gathered[2u * (BEFORE + id.x) + 1u] = packed[1];
}
