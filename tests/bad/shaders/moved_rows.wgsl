var after: texture_storage_2d<rgba32float, write>;
var<storage, read> members: array<u32>;
var<storage, read> moved: array<vec4f>;

@compute @workgroup_size(8, 8)
fn list(@builtin(global_invocation_id) id: vec3u) {
    textureStore(after, id.xy + 8u * members[id.z], moved[0]);
}
