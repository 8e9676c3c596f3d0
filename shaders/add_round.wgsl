//! The mean of what the rounds gathered that show the same.
#import lightgraph::camera::camera
#import lightgraph::means::{Mean, place}
#import lightgraph::rounds::round

var first_direct: texture_2d<f32>;
var first_indirect: texture_2d<f32>;
#ifdef ENVIRONMENT
/// See share_rays.wgsl.
var shared_sky: texture_2d<f32>;
#endif
var<storage, read_write> means: array<Mean>;

@compute @workgroup_size(8, 8)
fn add_round(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= camera.screen) {
        return;
    }
    let share = 1.0 / f32(round() + 1u);
    var direct = textureLoad(first_direct, id.xy, 0);
#ifdef ENVIRONMENT
    direct += vec4f(textureLoad(shared_sky, id.xy, 0).rgb, 0.0);
#endif
    let before = means[place(id.xy)];
    means[place(id.xy)] = Mean(
        mix(before.direct, direct, share),
        mix(before.indirect, textureLoad(first_indirect, id.xy, 0), share),
    );
}
