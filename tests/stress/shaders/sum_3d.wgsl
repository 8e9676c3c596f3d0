//! Sums up to 2x2x2 texels: one stage of a reduction over a volume.
var source: texture_3d<f32>;
var result: texture_storage_3d<rgba32float, write>;

@compute @workgroup_size(4, 4, 4)
fn sum(@builtin(global_invocation_id) id: vec3u) {
    if any(id >= textureDimensions(result)) {
        return;
    }
    var total = vec4f(0.0);
    for (var i = 0u; i < 8u; i++) {
        let texel = id * 2u + vec3u(i & 1u, (i >> 1u) & 1u, i >> 2u);
        if all(texel < textureDimensions(source)) {
            total += textureLoad(source, texel, 0);
        }
    }
    textureStore(result, id, total);
}
