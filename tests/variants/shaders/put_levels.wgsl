//! One texel of the last level of each texture: of 7 × 5, the last layer of two, the last face of a cube, the highest
//! of 64.
var flat: texture_2d<f32>;
var stack: texture_2d_array<f32>;
var box_below: texture_2d_array<f32>;
var top: texture_2d<f32>;

struct Texels {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Texels {
    let halved = textureLoad(flat, vec2u(0u), 2).r;
    let layer = textureLoad(stack, vec2u(0u), 1u, 2).r;
    let face = textureLoad(box_below, vec2u(1u, 0u), 5u, 0).r;
    return Texels(vec4f(halved, layer, face, textureLoad(top, vec2u(0u), 0).r));
}
