// Reads a 3D image.
var before: texture_3d<f32>;

struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Targets {
    return Targets(textureLoad(before, vec3u(0u), 0));
}
