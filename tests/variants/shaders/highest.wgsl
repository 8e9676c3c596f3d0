//! The highest of four texels, a level down.
var fine: texture_2d<f32>;
var coarse: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn raise(@builtin(global_invocation_id) id: vec3u) {
    var highest = 0.0;
    for (var i = 0u; i < 4u; i++) {
        highest = max(highest, textureLoad(fine, 2u * id.xy + vec2u(i & 1u, i >> 1u), 0).r);
    }
    if all(id.xy < textureDimensions(coarse)) {
        textureStore(coarse, id.xy, vec4f(highest));
    }
}
