//! Rays of the camera through the centres of pixels.
#define_import_path lightgraph::camera

struct Camera {
    camera_inverse_view_projection: mat4x4f,
    /// The image's width and height in pixels.
    screen: vec2u,
}
var<uniform> camera: Camera;

struct Ray {
    /// On the near plane.
    origin: vec3f,
    /// Unit.
    direction: vec3f,
}

/// The ray through the centre of a pixel (column, row from the top); for perspective and parallel projections.
fn pixel_ray(pixel: vec2u) -> Ray {
    let at = (vec2f(pixel) + 0.5) / vec2f(camera.screen) * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let near = camera.camera_inverse_view_projection * vec4f(at, 0.0, 1.0);
    let far = camera.camera_inverse_view_projection * vec4f(at, 1.0, 1.0);
    // The difference of the two points, times both w: it holds for an infinite far plane too, where far.w is 0.
    return Ray(near.xyz / near.w, normalize(far.xyz * near.w - near.xyz * far.w));
}
