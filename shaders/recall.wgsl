//! Where only the camera moved: what the last frame gathered next to what each pixel shows now.
#import lightgraph::camera::{camera, pixel_ray}
#import lightgraph::gathered_light::GatheredLight
#ifdef SPECULAR
#import lightgraph::gloss::shines
#endif
#import lightgraph::means::place
#import lightgraph::rays::unpack_normal
#import lightgraph::rounds::counted
#import lightgraph::seen::{finished, seen_at}
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::tiles::NO_POINT

struct Params {
    camera_previous_view_projection: mat4x4f,
    /// Frames that light is taken along from, at most.
    recalled_frames: u32,
}
var<uniform> params: Params;
var<storage, read> gathered_light: array<GatheredLight>;
var<storage, read_write> recalled: array<GatheredLight>;
#ifdef ENVIRONMENT
var<storage, read> gathered_sky: array<vec4f>;
var<storage, read_write> recalled_sky: array<vec4f>;
#endif

/// Normals differ by less than acos of this.
const SAME_NORMAL: f32 = 0.97;
/// Places count that lie less than so many pixels beside the ray.
const NEAR: f32 = 1.0;
/// And so many off the surface's plane, at most.
const SAME_PLANE: f32 = 0.25;

@compute @workgroup_size(8, 8)
fn recall(@builtin(global_invocation_id) id: vec3u) {
    let progress = counted();
    if any(id.xy >= camera.screen) || progress.round > 0u {
        return;
    }
    recalled[place(id.xy)] = GatheredLight();
#ifdef ENVIRONMENT
    recalled_sky[place(id.xy)] = vec4f(0.0);
#endif
    let seen = seen_at(id.xy);
    if progress.frame == 0u || params.recalled_frames == 0u || !is_lit(seen.albedo) {
        return;
    }
    let ray = pixel_ray(id.xy);
    let s = read_record(seen.albedo, seen.normal, ray.origin, ray.direction);
#ifdef SPECULAR
    // What a lobe reflects depends on where it is seen from.
    if shines(finished(s, id.xy)) {
        return;
    }
#endif
    let position = s.position;
    let clip = params.camera_previous_view_projection * vec4f(position, 1.0);
    let at = floor((clip.xy / clip.w * vec2f(0.5, -0.5) + 0.5) * vec2f(camera.screen));
    if clip.w <= 0.0 || any(at < vec2f(0.0)) || any(at >= vec2f(camera.screen)) {
        return;
    }
    let beside = pixel_ray(id.xy + vec2u(1u, 0u));
    let footprint = length(beside.origin + seen.normal.w * beside.direction - position);
    var sum = GatheredLight();
    var weights = 0.0;
#ifdef ENVIRONMENT
    var sky = vec4f(0.0);
#endif
    for (var i = 0u; i < 9u; i++) {
        let pixel = vec2i(at) + vec2i(vec2u(i % 3u, i / 3u)) - 1;
        if any(pixel < vec2i(0)) || any(pixel >= vec2i(camera.screen)) {
            continue;
        }
        let index = place(vec2u(pixel));
        let before = gathered_light[index];
        let offset = (before.position - position) / footprint;
        let near = 1.0 - length(cross(offset, ray.direction)) / NEAR;
        if before.normal == NO_POINT || near <= 0.0 || abs(dot(offset, seen.normal.xyz)) > SAME_PLANE
            || dot(unpack_normal(before.normal), seen.normal.xyz) < SAME_NORMAL {
            continue;
        }
        let weight = near * near;
        weights += weight;
        sum.light += weight * before.light;
        sum.frames += weight * before.frames;
        sum.position += weight * before.position;
#ifdef ENVIRONMENT
        sky += weight * gathered_sky[index];
#endif
    }
    if weights > 0.0 {
        let frames = min(sum.frames / weights, f32(params.recalled_frames));
        recalled[place(id.xy)] = GatheredLight(sum.light / weights, frames, sum.position / weights, NO_POINT);
#ifdef ENVIRONMENT
        recalled_sky[place(id.xy)] = sky / weights;
#endif
    }
}
