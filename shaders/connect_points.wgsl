//! Which of a few sources each point of the image sees.
#import lightgraph::camera::pixel_ray
#import lightgraph::photons::{promised, unpack_source}
#import lightgraph::random::{next, seed}
#import lightgraph::seen::seen_at
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::tiles::{NO_POINT, point_pixel, points_across}
#import lightgraph::trace::{is_free, leave}

#ifndef MORE
var<uniform> rays: u32;
#endif
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
/// Global Illumination", 2005).
fn choose(position: vec3f, normal: vec3f, first: u32, chance: u32) -> Choice {
    var state = chance;
    var chosen = Choice();
    var total = 0.0;
    var own = 0.0;
    for (var i = 0u; i < CANDIDATES; i++) {
        let row = (first + i) % source_count.count;
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

/// What a point of the image sees of a source that it chooses from a run of them.
fn looked(at: vec2u, first: u32, salt: u32) -> vec2u {
    let pixel = point_pixel(at);
    let seen = seen_at(pixel);
    if !is_lit(seen.albedo) || source_count.count == 0u {
        return vec2u(0u);
    }
    let ray = pixel_ray(pixel);
    let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
    let choice = choose(s.position, s.normal, first, seed(at, salt));
    let source = unpack_source(sources[2u * choice.row], sources[2u * choice.row + 1u]);
    // What it gives the point may be nothing where neighbours get some.
    let start = leave(s.position, s.normal + s.view);
    let way = source.position - start;
    let end = length(way);
    let free = is_free(start, way / max(end, 1e-20), REACH * end);
    return select(vec2u(0u), vec2u(choice.row, bitcast<u32>(choice.weight)), free);
}

#ifdef MORE
/// Rays, and looks, beside those that all points have.
const MORE: u32 = #{MORE}u;
/// Looks that all points have.
const COUNT: u32 = #{COUNT}u;
var<storage, read> more_points: array<u32>;

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
    shown[COUNT + id.x] = looked(at, seed(at, 4u) + id.x * CANDIDATES, id.x + 1u);
}
#else
@compute @workgroup_size(8, 8)
fn connect_points(@builtin(global_invocation_id) id: vec3u) {
    let across = points_across();
    if any(id.xy >= across) {
        return;
    }
    let index = (id.y * across.x + id.x) * rays + id.z;
    // Points of each 4x4 have runs side by side.
    let place = id.x % 4u + 4u * (id.y % 4u);
    let first = seed(id.xy / 4u, 0u) + (place * rays + id.z) * CANDIDATES;
    shown[index] = looked(id.xy, first, id.z + 1u);
}
#endif
