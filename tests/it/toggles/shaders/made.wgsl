#define_import_path made

var texel: texture_2d<f32>;
var<uniform> share: f32;

fn made(at: vec2f) -> vec4f {
    let there = textureLoad(texel, vec2u(at) % textureDimensions(texel), 0);
    return there * (1.0 + at.x * 0.37) + vec4f(share, at.y, #{STEP}, 1.0);
}
