//! The mean of what the rounds gathered that show the same.
#import lightgraph::rounds::round

var first_direct: texture_2d<f32>;
var first_indirect: texture_2d<f32>;
#ifdef ENVIRONMENT
/// See share_rays.wgsl.
var shared_sky: texture_2d<f32>;
#endif
var mean_direct_before: texture_2d<f32>;
var mean_indirect_before: texture_2d<f32>;

struct Means {
    @location(0) mean_direct: vec4f,
    @location(1) mean_indirect: vec4f,
}

@fragment
fn add_round(@builtin(position) position: vec4f) -> Means {
    let pixel = vec2u(position.xy);
    let share = 1.0 / f32(round() + 1u);
    var direct = textureLoad(first_direct, pixel, 0);
#ifdef ENVIRONMENT
    direct += vec4f(textureLoad(shared_sky, pixel, 0).rgb, 0.0);
#endif
    return Means(
        mix(textureLoad(mean_direct_before, pixel, 0), direct, share),
        mix(textureLoad(mean_indirect_before, pixel, 0), textureLoad(first_indirect, pixel, 0), share),
    );
}
