//! One scale of what paths say beyond what was gathered: what differs from the neighbours counts as far as it is more
//! than chance, the rest goes to the next scale, twice as wide (after the wavelets of Dammertz et al., "Edge-Avoiding
//! A-Trous Wavelet Transform for fast Global Illumination Filtering", 2010, each weighed as Wiener has it).
#import lightgraph::camera::{camera, pixel_ray}
#import lightgraph::progress::Progress
#import lightgraph::residual::{color_of, gray_of}
#import lightgraph::seen::seen_at
#import lightgraph::surface::{is_lit, read_record}

struct Params {
    /// Scales finer than this.
    scale: u32,
    scales: u32,
}
var<uniform> params: Params;
var<storage, read> progress: Progress;
var finer: texture_2d<f32>;
var settled: texture_2d<f32>;
var coarser: texture_storage_2d<rgba32float, write>;
var settled_more: texture_storage_2d<rgba32float, write>;

const SAME_NORMAL: f32 = 0.8;
const SAME_PLANE: f32 = 0.2;
/// Of one bright path among dark ones the scatter is not known: this over what n * UNSURE_PATHS paths have by n + 1 is
/// taken for chance beside what the paths' scatter tells.
const UNSURE: f32 = 8.0;
const UNSURE_PATHS: f32 = 16.0;

/// Neighbours' errors go together from the second scale on: how much more of the variance is left than if they did not.
fn together(scale: u32) -> f32 {
    return array<f32, 3>(1.0, 1.494, 1.75)[min(scale, 2u)];
}

/// The share of what was found with an energy that is not chance.
fn sure_share(energy: f32, chance: f32) -> f32 {
    let known = f32(progress.next) / UNSURE_PATHS + 1.0;
    let doubt = 1.0 + UNSURE / known;
    return clamp(1.0 - doubt * chance / max(energy, 1e-30), 0.0, 1.0);
}

@compute @workgroup_size(8, 8)
fn smooth_residual(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= camera.screen) {
        return;
    }
    let own = textureLoad(finer, id.xy, 0);
    let seen = seen_at(id.xy);
    if !is_lit(seen.albedo) || own.a == 0.0 {
        textureStore(coarser, id.xy, own);
        textureStore(settled_more, id.xy, vec4f(0.0));
        return;
    }
    let ray = pixel_ray(id.xy);
    let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
    let albedo = color_of(s);
    let tone = albedo / (3.0 * gray_of(albedo));
    let step = 1 << params.scale;
    var sum = vec4f(0.0);
    var bright = 0.0;
    var squares = 0.0;
    var variance = 0.0;
    var kept = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let at = vec2i(id.xy) + step * vec2i(x, y);
            if any(at < vec2i(0)) || any(at >= vec2i(camera.screen)) {
                continue;
            }
            let there = seen_at(vec2u(at));
            if !is_lit(there.albedo) || dot(there.normal.xyz, s.normal) < SAME_NORMAL {
                continue;
            }
            let way = pixel_ray(vec2u(at));
            let offset = way.origin + there.normal.w * way.direction - s.position;
            if abs(dot(offset, s.normal)) > SAME_PLANE * length(offset) {
                continue;
            }
            let weight = f32((2 - abs(x)) * (2 - abs(y)));
            let found = textureLoad(finer, at, 0);
            let light = dot(found.rgb, tone);
            sum += weight * vec4f(found.rgb, 1.0);
            bright += weight * light;
            squares += weight * light * light;
            variance += weight * found.a;
            kept += weight * weight * found.a;
        }
    }
    let mean = sum.rgb / sum.a;
    let energy = squares / sum.a - (bright / sum.a) * (bright / sum.a);
    let each = variance / sum.a;
    let left = min(kept / (sum.a * sum.a) * together(params.scale), each);
    var settled_here = textureLoad(settled, id.xy, 0).rgb + sure_share(energy, each - left) * (own.rgb - mean);
    if params.scale + 1u == params.scales {
        let all = dot(mean, tone);
        settled_here += sure_share(all * all, left) * mean;
    }
    textureStore(coarser, id.xy, vec4f(mean, left));
    textureStore(settled_more, id.xy, vec4f(settled_here, 1.0));
}
