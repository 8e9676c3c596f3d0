//! What a probe sees through the faces of its cube.
#define_import_path lightgraph::probe_views

struct Box {
    bounds_min: vec3f,
    bounds_max: vec3f,
    grid_min: vec3f,
    grid_max: vec3f,
}
var<uniform> box: Box;

/// The least corner of the box round scene and probes.
fn low() -> vec3f {
    return min(box.bounds_min, box.grid_min);
}

/// Its greatest corner.
fn high() -> vec3f {
    return max(box.bounds_max, box.grid_max);
}

/// Depths along a face's axis of the nearest and the farthest that is seen, metres.
fn depths() -> vec2f {
    // From any probe the whole scene lies within the diagonal of the box round scene and probes.
    let far = distance(low(), high()) * 1.01;
    return vec2f(far * 0.001, far);
}

/// What a draw through such a view leaves as depth, 0 to 1, of something so far along the face's axis.
fn depth_of(along: f32) -> f32 {
    let d = depths();
    let depth = max(along, d.x);
    return min(d.y * (depth - d.x) / ((d.y - d.x) * depth), 1.0);
}
