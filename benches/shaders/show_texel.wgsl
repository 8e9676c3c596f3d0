//! The first texel.
var texels: texture_2d<f32>;

struct Image {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Image {
    return Image(textureLoad(texels, vec2u(0u), 0));
}
