//! The image of a scene that stays as it is: the mean of what its frames gathered, with what their paths say beyond it.
#import lightgraph::progress::Progress
#import lightgraph::camera::{camera, pixel_ray}
#import lightgraph::gathered_light::GatheredLight
#import lightgraph::means::place
#import lightgraph::residual::color_of
#import lightgraph::seen::seen_at
#import lightgraph::surface::{is_lit, read_record}

var<storage, read> progress: Progress;
var<storage, read> gathered_light: array<GatheredLight>;
var<storage, read> direct_means: array<vec4f>;
#ifdef ENVIRONMENT
var<storage, read> gathered_sky: array<vec4f>;
#endif
#ifdef PATHS_ALONE
/// In alpha 0 where a pixel sees through something.
var path_direct: texture_2d<f32>;
#endif
var path_indirect: texture_2d<f32>;
var settled: texture_2d<f32>;
var direct: texture_storage_2d<rgba32float, write>;
var indirect: texture_storage_2d<rgba32float, write>;
var color: texture_storage_2d<rgba32float, write>;

#ifdef PATHS_ALONE
/// Paths that are worth the frames' own direct light, and their light where a pixel sees through something.
const ALIKE: u32 = 16u;
const ALIKE_THROUGH: u32 = 4u;
#endif

@compute @workgroup_size(8, 8)
fn settle(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= camera.screen) {
        return;
    }
    let index = place(id.xy);
    var gathered = direct_means[index].rgb;
    // Behind what paths see in part there may be nothing that gathers light.
    var rest = textureLoad(path_indirect, id.xy, 0).rgb;
    let seen = seen_at(id.xy);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(id.xy);
        let albedo = color_of(read_record(seen.albedo, seen.normal, ray.origin, ray.direction));
        rest = albedo * max(gathered_light[index].light + textureLoad(settled, id.xy, 0).rgb, vec3f(0.0));
#ifdef ENVIRONMENT
        gathered += albedo * gathered_sky[index].rgb;
#endif
    }
#ifdef PATHS_ALONE
    // Pixels share what rays see of the environment: paths take its place. Where a pixel sees through something, they
    // do so sooner, and for all light.
    let by_paths = textureLoad(path_direct, id.xy, 0);
    let through = by_paths.a == 0.0;
    let share = f32(progress.next) / f32(progress.next + select(ALIKE, ALIKE_THROUGH, through));
    if through {
        rest = mix(rest, textureLoad(path_indirect, id.xy, 0).rgb, share);
    }
    let first = mix(gathered, by_paths.rgb, share);
#else
    let first = gathered;
#endif
    textureStore(direct, id.xy, vec4f(first, 1.0));
    textureStore(indirect, id.xy, vec4f(rest, 1.0));
    textureStore(color, id.xy, vec4f(first + rest, 1.0));
}
