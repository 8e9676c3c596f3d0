//! Rays of the first bounce from points that the camera sees: one pixel of each tile.
#import lightgraph::camera::pixel_ray
#import lightgraph::cell_keys::insert
#import lightgraph::cells::large_key_of
#import lightgraph::image_rays::{end_of, pack_end}
#import lightgraph::points::points
#import lightgraph::random::{even_pair, seed}
#import lightgraph::rays::{Ray, SKY}
#import lightgraph::rounds::frame
#import lightgraph::sampling::cosine_direction
#import lightgraph::seen::seen_at
#import lightgraph::surface::read_record
#import lightgraph::tiles::{NO_POINT, point_pixel, points_across}

var<uniform> rays: u32;
var<storage, read_write> gathered: array<vec4u>;

/// Points of each 4x4 share one even sequence, each with a stretch of it.
@compute @workgroup_size(8, 8)
fn gather_rays(@builtin(global_invocation_id) id: vec3u) {
    let across = points_across();
    if any(id.xy >= across) {
        return;
    }
    let point = id.y * across.x + id.x;
    let index = point * rays + id.z;
    var found = Ray();
    if points[point].w != NO_POINT {
        let pixel = point_pixel(id.xy);
        let seen = seen_at(pixel);
        let ray = pixel_ray(pixel);
        let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
        let place = id.x % 4u + 4u * (id.y % 4u);
        let u = even_pair((16u * frame() + place) * rays + id.z, seed(id.xy / 4u, 0u));
        found = end_of(s, cosine_direction(s.normal, u));
        if found.cell != 0u && found.cell != SKY {
            insert(found.cell);
            insert(large_key_of(found.position, found.normal));
        }
    }
    let packed = pack_end(found);
    gathered[2u * index] = packed[0];
    gathered[2u * index + 1u] = packed[1];
}
