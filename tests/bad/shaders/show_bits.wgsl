var<storage, read> bits: array<u32>;
var shown: texture_storage_2d<r32float, write>;
@compute @workgroup_size(8, 8) fn show(@builtin(global_invocation_id) id: vec3u) {
    textureStore(shown, id.xy, vec4f(f32(bits[0])));
}
