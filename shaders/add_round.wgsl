//! The mean of what the frames gathered that show the same; of indirect light and of the sky's, also of those before in
//! which only the camera moved.
#import lightgraph::camera::{camera, pixel_ray}
#import lightgraph::gathered_light::GatheredLight
#ifdef SPECULAR
#import lightgraph::gloss::shines
#endif
#import lightgraph::means::place
#import lightgraph::points::has_point
#import lightgraph::rays::pack_normal
#import lightgraph::residual::color_of
#import lightgraph::rounds::round
#import lightgraph::seen::{finished, seen_at}
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::tiles::NO_POINT

var first_direct: texture_2d<f32>;
var first_indirect: texture_2d<f32>;
#ifdef ENVIRONMENT
var first_sky: texture_2d<f32>;
#endif
/// See recall.wgsl.
var<storage, read> recalled: array<GatheredLight>;
var<storage, read_write> gathered_light: array<GatheredLight>;
#ifdef ENVIRONMENT
var<storage, read> recalled_sky: array<vec4f>;
var<storage, read_write> gathered_sky: array<vec4f>;
#endif
/// Of frames that show the same.
var<storage, read_write> direct_means: array<vec4f>;

@compute @workgroup_size(8, 8)
fn add_round(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= camera.screen) {
        return;
    }
    let direct = textureLoad(first_direct, id.xy, 0);
    let index = place(id.xy);
    let rounds = round();
    // Not even numbers that are none come over from what showed something else.
    let direct_before = select(direct, direct_means[index], rounds > 0u);
    direct_means[index] = mix(direct_before, direct, 1.0 / f32(rounds + 1u));
    let seen = seen_at(id.xy);
    if !is_lit(seen.albedo) {
        gathered_light[index] = GatheredLight(vec3f(0.0), 0.0, vec3f(0.0), NO_POINT);
        return;
    }
    let ray = pixel_ray(id.xy);
    let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
    let light = textureLoad(first_indirect, id.xy, 0).rgb / color_of(s);
    var before = recalled[index];
    if rounds > 0u {
        before = gathered_light[index];
    }
    // Where a tile waits there is nothing new.
    let new_frames = f32(has_point(id.xy));
    let share = new_frames / (before.frames + 1.0);
    let mean = mix(before.light, light, share);
    let middle = mix(before.position, s.position, share);
#ifdef ENVIRONMENT
    let sky = textureLoad(first_sky, id.xy, 0) / vec4f(color_of(s), 1.0);
    let sky_before = select(recalled_sky[index], gathered_sky[index], rounds > 0u);
    gathered_sky[index] = mix(sky_before, sky, share);
#endif
    var normal = pack_normal(seen.normal.xyz);
#ifdef SPECULAR
    // See recall.wgsl.
    if shines(finished(s, id.xy)) {
        normal = NO_POINT;
    }
#endif
    gathered_light[index] = GatheredLight(mean, before.frames + new_frames, middle, normal);
}
