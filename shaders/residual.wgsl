//! What paths say of the light that surfaces receive beyond what was gathered, and how sure it is.
#import lightgraph::progress::Progress
#import lightgraph::camera::{camera, pixel_ray}
#import lightgraph::gathered_light::GatheredLight
#import lightgraph::means::place
#import lightgraph::residual::{color_of, gray_of}
#import lightgraph::seen::seen_at
#import lightgraph::surface::{is_lit, read_record}

var<storage, read> progress: Progress;
var<storage, read> gathered_light: array<GatheredLight>;
/// In alpha the mean of the squares of paths, each the sum of its channels.
var path_indirect: texture_2d<f32>;
/// What is missing, over the albedo; in alpha the variance of its mean over the channels.
var residual: texture_storage_2d<rgba32float, write>;
var settled: texture_storage_2d<rgba32float, write>;

/// Fewer paths tell too little of how far they scatter.
const ENOUGH: u32 = 6u;

/// A path may miss what lights a pixel: its light scatters by as much as there is, at least.
const SCATTER: f32 = 1.0;

@compute @workgroup_size(8, 8)
fn find_residual(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= camera.screen) {
        return;
    }
    var found = vec4f(0.0);
    let seen = seen_at(id.xy);
    if progress.next >= ENOUGH && is_lit(seen.albedo) {
        let ray = pixel_ray(id.xy);
        let albedo = color_of(read_record(seen.albedo, seen.normal, ray.origin, ray.direction));
        let gathered = gathered_light[place(id.xy)].light;
        let traced = textureLoad(path_indirect, id.xy, 0);
        let bright = dot(traced.rgb, vec3f(1.0));
        let expected = dot(albedo * gathered, vec3f(1.0));
        let variance = max(traced.a - bright * bright, SCATTER * expected * expected) / f32(progress.next);
        found = vec4f(traced.rgb / albedo - gathered, variance / (9.0 * gray_of(albedo) * gray_of(albedo)));
    }
    textureStore(residual, id.xy, found);
    textureStore(settled, id.xy, vec4f(0.0));
}
