//! Which of a few sources each point of the image sees.
#import lightgraph::camera::pixel_ray
#import lightgraph::photons::{from_source, unpack_source}
#import lightgraph::random::seed
#import lightgraph::seen::seen_at
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::tiles::{point_pixel, points_across}
#import lightgraph::trace::{is_free, leave}

var<uniform> rays: u32;
struct Count {
    count: u32,
    scale: f32,
}
var<storage, read> source_count: Count;
var<storage, read> sources: array<vec4u>;
/// Rows of `sources`, `rays` a point; NONE where one is hidden.
var<storage, read_write> shown: array<u32>;

const NONE: u32 = 0xffffffffu;
const REACH: f32 = 0.999;

@compute @workgroup_size(8, 8)
fn connect_points(@builtin(global_invocation_id) id: vec3u) {
    let across = points_across();
    if any(id.xy >= across) {
        return;
    }
    let index = (id.y * across.x + id.x) * rays + id.z;
    var found = NONE;
    let pixel = point_pixel(id.xy);
    let seen = seen_at(pixel);
    if is_lit(seen.albedo) && source_count.count > 0u {
        let ray = pixel_ray(pixel);
        let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
        // Points of each 4x4 look at a run of sources.
        let place = id.x % 4u + 4u * (id.y % 4u);
        let i = (seed(id.xy / 4u, 0u) + place * rays + id.z) % source_count.count;
        let source = unpack_source(sources[2u * i], sources[2u * i + 1u]);
        // What it gives the point may be nothing where neighbours get some.
        let start = leave(s.position, s.normal + s.view);
        let way = source.position - start;
        let end = length(way);
        if is_free(start, way / max(end, 1e-20), REACH * end) {
            found = i;
        }
    }
    shown[index] = found;
}
