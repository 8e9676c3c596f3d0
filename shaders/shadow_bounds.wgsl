//! What each triangle, and each group of them, may cover of the shadow maps.
#import lightgraph::raster::bounds
#import lightgraph::shadow_texels::{Covered, GROUP, LightView, Triangle, light_views, params, seen, triangles}

var<storage, read_write> shadow_bounds: array<Covered>;
var<storage, read_write> shadow_groups: array<Covered>;

/// By lane: what it covers, then with what others cover: the least of the first, the most of the end.
var<workgroup> together: array<vec4u, GROUP>;

struct Light {
    /// 2: directional.
    kind: u32,
    position: vec3f,
    /// Of travel.
    direction: vec3f,
}
var<storage, read> lights: array<Light>;

/// Whether a triangle lies in a side of the box round everything, of which the light is on the inner side: then it
/// comes between the light and nothing.
fn hides_nothing(t: Triangle, view: LightView) -> bool {
    let light = lights[view.light];
    // Where it is (w above 0), or the direction to it (w 0).
    let eye = select(vec4f(light.position, 1.0), vec4f(-light.direction, 0.0), light.kind == 2u);
    let low = (t.a == view.lower) & (t.b == view.lower) & (t.c == view.lower) & (eye.xyz > view.lower * eye.w);
    let high = (t.a == view.upper) & (t.b == view.upper) & (t.c == view.upper) & (eye.xyz < view.upper * eye.w);
    return any(low | high);
}

@compute @workgroup_size(128)
fn find(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let view = id.y;
    var covered = vec4u(0u);
    if id.x < params.triangles && !hides_nothing(triangles[id.x], light_views[view]) {
        covered = bounds(seen(id.x, view, vec2u(0u)), params.shadow_size);
    }
    let here = view * groups.x + group.x;
    shadow_bounds[here * GROUP + lane] = Covered(covered.x | covered.y << 16u, covered.z | covered.w << 16u);
    together[lane] = select(vec4u(vec2u(params.shadow_size), 0u, 0u), covered, covered.z > 0u);
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if lane < half {
            let one = together[lane];
            let two = together[lane + half];
            together[lane] = vec4u(min(one.xy, two.xy), max(one.zw, two.zw));
        }
    }
    if lane == 0u {
        let all = together[0];
        shadow_groups[here] = Covered(all.x | all.y << 16u, all.z | all.w << 16u);
    }
}
