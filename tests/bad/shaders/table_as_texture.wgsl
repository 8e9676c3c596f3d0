// Takes a table for a texture.
var materials: texture_2d<f32>;

struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Targets {
    return Targets(textureLoad(materials, vec2u(0u), 0));
}
