var texel: texture_2d<f32>;
var screened: texture_2d<f32>;
var depth: texture_depth_2d;
var soften: sampler;
var deeper: sampler_comparison;

@fragment fn shade(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let soft = textureSampleLevel(screened, soften, at.xy / 8.0 + 0.55, 0.0);
    let deep = textureSampleCompareLevel(depth, deeper, at.xy / 8.0, 0.97);
    return vec4f(soft.xy, deep, textureLoad(texel, vec2u(0), 0).x);
}
