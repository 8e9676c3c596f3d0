//! Keeps the camera's view for the next frame.
var<uniform> camera_view_projection: mat4x4f;
var<storage, read_write> last_view: array<mat4x4f>;

@compute @workgroup_size(1)
fn keep() {
    last_view[0] = camera_view_projection;
}
