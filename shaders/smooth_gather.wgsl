//! Indirect light in the image from what its pixels gathered: each takes the mean over its neighbours on the same
//! surface. In a window of 5x5 whose outermost rows and columns count half, each of the sixteen places of a pixel in a
//! 4x4 block counts alike (Keller and Heidrich, "Interleaved Sampling", 2001).
#import lightgraph::camera::pixel_ray
#import lightgraph::seen::seen_at
#import lightgraph::surface::{albedo_of, is_lit}

/// What first_bounce.wgsl leaves.
var gathered: texture_2d_array<f32>;
var indirect: texture_storage_2d<rgba32float, write>;

/// Neighbours count whose normals differ by less than acos(0.95), and whose planes lie closer than this share of
/// their distance.
const SAME_NORMAL: f32 = 0.95;
const SAME_PLANE: f32 = 0.1;

@compute @workgroup_size(8, 8)
fn smooth_gather(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(indirect)) {
        return;
    }
    var light = vec3f(0.0);
    let seen = seen_at(id.xy);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(id.xy);
        let here = ray.origin + seen.normal.w * ray.direction;
        var sum = vec4f(0.0);
        for (var i = 0u; i < 25u; i++) {
            let step = vec2i(vec2u(i % 5u, i / 5u)) - 2;
            let pixel = vec2i(id.xy) + step;
            if any(pixel < vec2i(0)) || any(pixel >= vec2i(textureDimensions(indirect))) {
                continue;
            }
            let other = seen_at(vec2u(pixel));
            if !is_lit(other.albedo) || dot(other.normal.xyz, seen.normal.xyz) < SAME_NORMAL {
                continue;
            }
            let there_ray = pixel_ray(vec2u(pixel));
            let offset = there_ray.origin + other.normal.w * there_ray.direction - here;
            if abs(dot(offset, seen.normal.xyz)) > SAME_PLANE * length(offset) {
                continue;
            }
            let weight = select(1.0, 0.5, abs(step.x) == 2) * select(1.0, 0.5, abs(step.y) == 2);
            sum += weight * vec4f(textureLoad(gathered, pixel, 0, 0).rgb, 1.0);
        }
        light = albedo_of(seen.albedo) * sum.rgb / sum.a;
#ifdef SPECULAR
        light += textureLoad(gathered, id.xy, 1, 0).rgb;
#endif
    }
    textureStore(indirect, id.xy, vec4f(light, 1.0));
}
