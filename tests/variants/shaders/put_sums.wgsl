//! The sums as a colour: 3 and 636.
var a: texture_2d<f32>;
var b: texture_2d<f32>;
struct O { @location(0) color: vec4f }
@fragment fn put(@builtin(position) at: vec4f) -> O { return O(vec4f(textureLoad(a, vec2u(1u), 0).r, textureLoad(b, vec2u(15u), 0).r, 0.0, 1.0)); }
