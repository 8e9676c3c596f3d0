//! What each triangle, and each group of them, may cover of the shadow maps.
#import lightgraph::raster::bounds
#import lightgraph::shadow_texels::{Covered, GROUP, LightView, Triangle, light_views, params, seen, triangles}

var<storage, read_write> shadow_bounds: array<Covered>;
var<storage, read_write> shadow_groups: array<Covered>;

/// By lane: what it covers, then with what others cover: the least of the first, the most of the end.
var<workgroup> together: array<vec4u, GROUP>;

/// Where the lines of sight of a view begin: a point (w above 0), or the direction to it (w 0).
fn eye_of(rows: mat4x4f) -> vec4f {
    let a = rows[0];
    let b = rows[1];
    let c = rows[3];
    let meet = a.w * cross(b.xyz, c.xyz) + b.w * cross(c.xyz, a.xyz) + c.w * cross(a.xyz, b.xyz);
    let eye = vec4f(-meet, dot(a.xyz, cross(b.xyz, c.xyz)));
    // Depths fall towards it.
    return select(eye, -eye, dot(rows[2], eye) > 0.0);
}

/// Whether a triangle lies in a side of the box round everything, of which the eye is on the inner side: then it comes
/// between the eye and nothing.
fn hides_nothing(t: Triangle, view: LightView) -> bool {
    let eye = eye_of(transpose(view.view_projection));
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
