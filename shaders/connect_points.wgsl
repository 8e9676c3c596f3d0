//! Which of a few sources each point of the image sees.
#import lightgraph::camera::pixel_ray
#import lightgraph::photons::{promised, unpack_source}
#import lightgraph::random::{next, seed}
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
/// Rows of `sources`, `rays` a point, and what each counts; 0 where one is hidden.
var<storage, read_write> shown: array<vec2u>;

const REACH: f32 = 0.999;

/// Sources that one is chosen from.
const CANDIDATES: u32 = #{CANDIDATES}u;

struct Choice {
    row: u32,
    /// One over how likely it was chosen, as if there were one source.
    weight: f32,
}

/// One of a run of sources, by what it gives the point unshadowed (Talbot, Cline and Egbert, "Importance Resampling for
/// Global Illumination", 2005). Points of each 4x4 have runs side by side.
fn choose(position: vec3f, normal: vec3f, id: vec3u, count: u32) -> Choice {
    let place = id.x % 4u + 4u * (id.y % 4u);
    let first = seed(id.xy / 4u, 0u) + (place * rays + id.z) * CANDIDATES;
    var state = seed(id.xy, id.z + 1u);
    var chosen = Choice();
    var total = 0.0;
    var own = 0.0;
    for (var i = 0u; i < CANDIDATES; i++) {
        let row = (first + i) % count;
        let promise = promised(unpack_source(sources[2u * row], sources[2u * row + 1u]), position, normal);
        total += promise;
        if next(&state) * total < promise {
            chosen.row = row;
            own = promise;
        }
    }
    chosen.weight = select(0.0, total / (own * f32(CANDIDATES)), own > 0.0);
    return chosen;
}

@compute @workgroup_size(8, 8)
fn connect_points(@builtin(global_invocation_id) id: vec3u) {
    let across = points_across();
    if any(id.xy >= across) {
        return;
    }
    let index = (id.y * across.x + id.x) * rays + id.z;
    var found = vec2u(0u);
    let pixel = point_pixel(id.xy);
    let seen = seen_at(pixel);
    if is_lit(seen.albedo) && source_count.count > 0u {
        let ray = pixel_ray(pixel);
        let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
        let choice = choose(s.position, s.normal, id, source_count.count);
        let source = unpack_source(sources[2u * choice.row], sources[2u * choice.row + 1u]);
        // What it gives the point may be nothing where neighbours get some.
        let start = leave(s.position, s.normal + s.view);
        let way = source.position - start;
        let end = length(way);
        if is_free(start, way / max(end, 1e-20), REACH * end) {
            found = vec2u(choice.row, bitcast<u32>(choice.weight));
        }
    }
    shown[index] = found;
}
