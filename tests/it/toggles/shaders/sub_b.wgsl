var texel: texture_2d<f32>;
var<uniform> share: f32;
var<storage, read_write> result: array<f32>;

@compute @workgroup_size(1) fn compute() {
    result[0] = 2.0 * textureLoad(texel, vec2u(0), 0).x + share;
}
