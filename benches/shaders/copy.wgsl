//! One texel a lane.
var before: texture_2d<f32>;
var after: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn copy(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < textureDimensions(after)) {
        textureStore(after, id.xy, textureLoad(before, id.xy, 0));
    }
}
