//! What each triangle, and each group of them, may cover of the shadow maps.
#import lightgraph::raster::bounds
#import lightgraph::shadow_texels::{Covered, GROUP, LightView, Triangle, light_views, params, seen, triangles}

var<storage, read_write> shadow_bounds: array<Covered>;
var<storage, read_write> shadow_groups: array<Covered>;

/// First texels, as what is left to a map's end; then those past the last.
var<workgroup> together: array<atomic<u32>, 4>;

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
    if covered.z > 0u {
        atomicMax(&together[0], params.shadow_size - covered.x);
        atomicMax(&together[1], params.shadow_size - covered.y);
        atomicMax(&together[2], covered.z);
        atomicMax(&together[3], covered.w);
    }
    workgroupBarrier();
    if lane == 0u {
        let first = params.shadow_size - vec2u(atomicLoad(&together[0]), atomicLoad(&together[1]));
        let end = vec2u(atomicLoad(&together[2]), atomicLoad(&together[3]));
        shadow_groups[here] = Covered(first.x | first.y << 16u, end.x | end.y << 16u);
    }
}
