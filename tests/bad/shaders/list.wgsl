var before: texture_2d<f32>;
var after: texture_storage_2d<rgba32float, write>;
var<storage, read> instances: array<u32>;

@compute @workgroup_size(8, 8)
fn list(@builtin(global_invocation_id) id: vec3u) {
    textureStore(after, id.xy + 8u * instances[4u + id.z], textureLoad(before, id.xy, 0));
}
