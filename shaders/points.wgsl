//! The points of the image that rays leave, for the pixels that share them: where each lies, and its normal.
#import lightgraph::camera::pixel_ray
#import lightgraph::rays::pack_normal
#import lightgraph::seen::seen_at
#import lightgraph::surface::is_lit
#import lightgraph::tiles::{NO_POINT, point_pixel, points_across}

/// Four words a point; NO_POINT in the last where a tile has none.
var<storage, read_write> points: array<vec4u>;

@compute @workgroup_size(8, 8)
fn write_points(@builtin(global_invocation_id) id: vec3u) {
    let across = points_across();
    if any(id.xy >= across) {
        return;
    }
    let pixel = point_pixel(id.xy);
    let seen = seen_at(pixel);
    let ray = pixel_ray(pixel);
    let position = ray.origin + seen.normal.w * ray.direction;
    let lit = is_lit(seen.albedo);
    let normal = pack_normal(select(vec3f(0.0, 1.0, 0.0), seen.normal.xyz, lit));
    points[id.y * across.x + id.x] = vec4u(bitcast<vec3u>(position), select(NO_POINT, normal, lit));
}
