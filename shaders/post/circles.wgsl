//! By pixel: the radius of the circle that the lens makes of it, pixels, and its distance, metres.
var depth: texture_depth_2d;

struct Params {
    camera_projection: mat4x4f,
    focus: f32,
    aperture: f32,
    widest: f32,
}
var<uniform> params: Params;

struct Out {
    @location(0) circles: vec2f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Out {
    let size = vec2f(textureDimensions(depth));
    let p = params.camera_projection;
    let z = textureLoad(depth, vec2u(at.xy), 0);
    // Along the view: clip.z / clip.w = z, for a projection of a pinhole.
    let away = select(p[3].z / (z + p[2].z), 1e6, z >= 1.0);
    let tangent = params.aperture * abs(away - params.focus) / (2.0 * away * params.focus);
    return Out(vec2f(min(tangent * p[1].y * 0.5 * size.y, params.widest), away));
}
