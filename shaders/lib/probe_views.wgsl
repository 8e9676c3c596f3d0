//! What a probe sees through the faces of its cube.
#define_import_path lightgraph::probe_views

struct Box {
    bounds_min: vec3f,
    bounds_max: vec3f,
    grid_min: vec3f,
    grid_max: vec3f,
}
var<uniform> box: Box;

/// Depths along a face's axis of the nearest and the farthest that is seen, metres.
fn depths() -> vec2f {
    // From any probe the whole scene lies within the diagonal of the box round scene and probes.
    let far = distance(min(box.bounds_min, box.grid_min), max(box.bounds_max, box.grid_max)) * 1.01;
    return vec2f(far * 0.001, far);
}
