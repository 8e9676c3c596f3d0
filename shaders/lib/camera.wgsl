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

/// From the camera's axes to the world's.
fn to_world(v: vec3f) -> vec3f {
    let m = camera.camera_view;
    return vec3f(dot(m[0].xyz, v), dot(m[1].xyz, v), dot(m[2].xyz, v));
}

/// The ray through the centre of a pixel (column, row from the top); for perspective and parallel projections.
///
/// From the view and the projection each by itself: the inverse of their product tells directions badly where the near
/// plane is much nearer to the camera than the scene's origin. Without a branch: one that returns takes half a gibibyte
/// of llvmpipe (Mesa 22.3.6).
fn pixel_ray(pixel: vec2u) -> Ray {
    let at = (vec2f(pixel) + 0.5) / vec2f(camera.screen) * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let p = camera.camera_projection;
    // A parallel projection leaves w as it is.
    let parallel = p[2].w == 0.0;
    let across = select(at + p[2].xy, at - p[3].xy, parallel) / vec2f(p[0].x, p[1].y);
    let ahead = to_world(vec3f(select(across, vec2f(0.0), parallel), -1.0));
    let beside = to_world(vec3f(select(vec2f(0.0), across, parallel), 0.0));
    return Ray(camera.camera_position + camera.camera_near * ahead + beside, normalize(ahead));
}
