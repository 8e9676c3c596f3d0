//! The points of the image that rays leave, for the pixels that share them. Where light of enough frames was taken
//! along, every fourth tile has one in a frame.
#import lightgraph::camera::{camera, pixel_ray}
#import lightgraph::gathered_light::GatheredLight
#import lightgraph::means::place
#import lightgraph::rays::pack_normal
#import lightgraph::rounds::counted
#import lightgraph::seen::seen_at
#import lightgraph::surface::is_lit
#import lightgraph::tiles::{NO_POINT, TILE, point_pixel, points_across}

/// See `lightgraph::points`.
var<storage, read_write> points: array<vec4u>;
/// See recall.wgsl.
var<storage, read> recalled: array<GatheredLight>;

/// Light of fewer frames is too noisy to wait with.
const ENOUGH: f32 = 4.0;

/// Whether all that a tile shows was taken along, and it is another one's turn.
fn waits(tile: vec2u) -> bool {
    let progress = counted();
    let turn = (tile.x % 2u) ^ (3u * (tile.y % 2u));
    var known = progress.round == 0u && turn != progress.frame % 4u;
    for (var i = 0u; known && i < TILE * TILE; i++) {
        let pixel = min(tile * TILE + vec2u(i % TILE, i / TILE), camera.screen - 1u);
        known = recalled[place(pixel)].frames >= ENOUGH || !is_lit(seen_at(pixel).albedo);
    }
    return known;
}

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
    let lit = is_lit(seen.albedo) && !waits(id.xy);
    let normal = pack_normal(select(vec3f(0.0, 1.0, 0.0), seen.normal.xyz, lit));
    points[id.y * across.x + id.x] = vec4u(bitcast<vec3u>(position), select(NO_POINT, normal, lit));
}
