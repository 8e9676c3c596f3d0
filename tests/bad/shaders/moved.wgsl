var after: texture_storage_2d<rgba32float, write>;
var<storage, read> members: array<u32>;
struct Box {
    lower: vec3f,
    upper: vec3f,
}
var<uniform> moved: array<Box, 4>;

@compute @workgroup_size(8, 8)
fn list(@builtin(global_invocation_id) id: vec3u) {
    textureStore(after, id.xy + 8u * members[id.z], vec4f(moved[0].lower, moved[3].upper.x));
}
