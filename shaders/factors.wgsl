//! The factor textures: for coefficient k and face f, layer 6k + f holds Y_k(direction) times the solid angle of
//! every texel, so that a projection is a product and a sum (section 3.2 of the paper).
#import lightgraph::cube::{direction, solid_angle}
#import lightgraph::sh::term

var factor: texture_storage_2d_array<r32float, write>;

@compute @workgroup_size(8, 8)
fn factors(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(factor).x;
    if any(id.xy >= vec2u(edge)) || id.z >= textureNumLayers(factor) {
        return;
    }
    let value = term(id.z / 6u, direction(id.z % 6u, id.xy, edge)) * solid_angle(id.xy, edge);
    textureStore(factor, id.xy, id.z, vec4f(value, 0.0, 0.0, 0.0));
}
