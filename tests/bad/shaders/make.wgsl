// Writes an image from nothing.
var after: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn make(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < textureDimensions(after)) {
        textureStore(after, id.xy, vec4f(1.0));
    }
}
