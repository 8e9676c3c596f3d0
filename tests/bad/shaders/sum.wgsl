// Halves an image.
var source: texture_2d<f32>;
var result: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn sum(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < textureDimensions(result)) {
        textureStore(result, id.xy, textureLoad(source, id.xy * 2u, 0));
    }
}
