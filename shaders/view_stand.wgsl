//! Where the grid that follows the camera is: before it, so that the camera itself is just inside.

struct View {
    camera_position: vec3f,
    camera_view: mat4x4f,
    fine: vec3u,
    spacing: f32,
    fade: f32,
}
var<uniform> view: View;

/// In distances between probes.
struct Stand {
    middle: vec3f,
    first: vec3i,
}
var<storage, read_write> view_stand: Stand;

@compute @workgroup_size(1)
fn stand() {
    let half = vec3f(view.fine / 2u);
    let forward = -vec3f(view.camera_view[0].z, view.camera_view[1].z, view.camera_view[2].z);
    let ahead = max(half - 1.0 - view.fade, vec3f(0.0)) * forward;
    let middle = view.camera_position / view.spacing + ahead;
    view_stand.middle = middle;
    view_stand.first = vec3i(floor(middle) - half) + 1;
}
