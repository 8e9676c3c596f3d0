var<storage, read_write> bits: array<u32>;
var after: texture_storage_2d<rgba32float, write>;
@compute @workgroup_size(64) fn mark(@builtin(global_invocation_id) id: vec3u) {
    bits[id.x] = 1u;
    textureStore(after, id.xy, vec4f(1.0));
}
