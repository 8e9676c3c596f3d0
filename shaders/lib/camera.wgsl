//! Rays of the camera through the centres of pixels.
#define_import_path lightgraph::camera

struct Camera {
    camera_position: vec3f,
    camera_near: f32,
    camera_view: mat4x4f,
    camera_projection: mat4x4f,
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
///
/// From the view and the projection each by itself: the inverse of their product tells directions badly where the near
/// plane is much nearer to the camera than the scene's origin.
fn pixel_ray(pixel: vec2u) -> Ray {
    let at = (vec2f(pixel) + 0.5) / vec2f(camera.screen) * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let p = camera.camera_projection;
    let scale = vec2f(p[0].x, p[1].y);
    let to_world = transpose(mat3x3f(camera.camera_view[0].xyz, camera.camera_view[1].xyz, camera.camera_view[2].xyz));
    // A parallel projection leaves w as it is.
    if p[2].w == 0.0 {
        let beside = to_world * vec3f((at - p[3].xy) / scale, -camera.camera_near);
        return Ray(camera.camera_position + beside, to_world * vec3f(0.0, 0.0, -1.0));
    }
    let ahead = to_world * vec3f((at + p[2].xy) / scale, -1.0);
    return Ray(camera.camera_position + camera.camera_near * ahead, normalize(ahead));
}
