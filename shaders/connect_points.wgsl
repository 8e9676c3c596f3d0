//! Which of a few sources each point of the image sees.
#import lightgraph::camera::pixel_ray
#ifndef MORE
#import lightgraph::points::points
#endif
#import lightgraph::random::seed
#import lightgraph::rounds::salt
#import lightgraph::seen::seen_at
#import lightgraph::source_texels::source_at
#import lightgraph::sources::{CANDIDATES, choose, sees, source_count}
#import lightgraph::surface::read_record
#import lightgraph::tiles::{NO_POINT, point_pixel, points_across}
#import lightgraph::trace::leave

#ifndef MORE
var<uniform> rays: u32;
#endif
/// Rows of `sources`, `rays` a point, and what each counts; 0 where one is hidden.
var<storage, read_write> shown: array<vec2u>;

/// What a point of the image sees of a source that it chooses from a run of them.
fn looked(at: vec2u, first: u32, chance: u32) -> vec2u {
    let pixel = point_pixel(at);
    let seen = seen_at(pixel);
    if source_count[0].count == 0u {
        return vec2u(0u);
    }
    let ray = pixel_ray(pixel);
    let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
    let choice = choose(s.position, s.normal, first, seed(at, chance + salt()));
    // What it gives the point may be nothing where neighbours get some.
    let free = sees(leave(s.position, s.normal + s.view), source_at(choice.row));
    return select(vec2u(0u), vec2u(choice.row, bitcast<u32>(choice.weight)), free);
}

#ifdef MORE
/// Beyond the numbers of looks that all points have.
const MOST_RAYS: u32 = 257u;
/// Rays, and looks, beside those that all points have.
const MORE: u32 = #{MORE}u;
/// Looks that all points have.
const COUNT: u32 = #{COUNT}u;
var<storage, read> more_points: array<u32>;
/// See hand_out.wgsl.
var<storage, read> more: array<vec2u>;

@compute @workgroup_size(64)
fn connect_points(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= MORE {
        return;
    }
    let point = more_points[id.x];
    if point == NO_POINT {
        return;
    }
    let across = points_across();
    let at = vec2u(point % across.x, point / across.x);
    // Its choices follow from its place and their number, not from how many the other points have.
    let number = id.x - more[point].x;
    shown[COUNT + id.x] = looked(at, seed(at, 4u + salt()) + number * CANDIDATES, MOST_RAYS + number);
}
#else
@compute @workgroup_size(8, 8)
fn connect_points(@builtin(global_invocation_id) id: vec3u) {
    let across = points_across();
    if any(id.xy >= across) {
        return;
    }
    let point = id.y * across.x + id.x;
    let index = point * rays + id.z;
    if points[point].w == NO_POINT {
        shown[index] = vec2u(0u);
        return;
    }
    // Points of each 4x4 have runs side by side.
    let place = id.x % 4u + 4u * (id.y % 4u);
    let first = seed(id.xy / 4u, salt()) + (place * rays + id.z) * CANDIDATES;
    shown[index] = looked(id.xy, first, id.z + 1u);
}
#endif
