var after: texture_storage_2d<rgba32float, write>;
var<storage, read> instances: array<f32>;

@compute @workgroup_size(8, 8)
fn list(@builtin(global_invocation_id) id: vec3u) {
    textureStore(after, id.xy, vec4f(instances[id.z]));
}
