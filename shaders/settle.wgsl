//! The image of a scene that stays as it is: the mean of what its frames gathered, with what their paths say beyond it.
#import lightgraph::progress::Progress
#import lightgraph::camera::pixel_ray
#import lightgraph::residual::color_of
#import lightgraph::seen::seen_at
#import lightgraph::surface::{is_lit, read_record}

var<storage, read> progress: Progress;
var mean_direct: texture_2d<f32>;
var mean_indirect: texture_2d<f32>;
var path_direct: texture_2d<f32>;
var settled: texture_2d<f32>;

/// Paths that are worth a frame's own direct light.
const ALIKE: u32 = 16u;

struct Image {
    @location(0) direct: vec4f,
    @location(1) indirect: vec4f,
    @location(2) color: vec4f,
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> Image {
    let pixel = vec2u(position.xy);
#ifdef PATHS_ALONE
    // Gathered light has no lobes, and pixels share what rays see of the environment: paths take its place.
    let alike = ALIKE;
#else
    let alike = ALIKE * (progress.round + 1u);
#endif
    let share = f32(progress.next) / f32(progress.next + alike);
    let direct = mix(textureLoad(mean_direct, pixel, 0).rgb, textureLoad(path_direct, pixel, 0).rgb, share);
    var indirect = textureLoad(mean_indirect, pixel, 0).rgb;
    let seen = seen_at(pixel);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(pixel);
        let albedo = color_of(read_record(seen.albedo, seen.normal, ray.origin, ray.direction));
        indirect = max(indirect + albedo * textureLoad(settled, pixel, 0).rgb, vec3f(0.0));
    }
    return Image(vec4f(direct, 1.0), vec4f(indirect, 1.0), vec4f(direct + indirect, 1.0));
}
