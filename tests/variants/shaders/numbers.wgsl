//! Each texel its number.
var highest: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn number(@builtin(global_invocation_id) id: vec3u) {
    textureStore(highest, id.xy, vec4f(f32(id.x + 8u * id.y)));
}
