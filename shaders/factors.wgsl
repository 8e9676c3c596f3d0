//! The factor textures: for coefficient k and face f, layer 6k + f holds what every texel counts in it, Y_k(direction)
//! times the solid angle, so that a projection is a product and a sum (section 3.2 of the paper).
#import lightgraph::projection

var factor: texture_storage_2d_array<r32float, write>;

@compute @workgroup_size(8, 8)
fn factors(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(factor).x;
    if any(id.xy >= vec2u(edge)) || id.z >= textureNumLayers(factor) {
        return;
    }
    var shares = projection::factors(id.z % 6u, id.xy, edge);
    textureStore(factor, id.xy, id.z, vec4f(shares[id.z / 6u], 0.0, 0.0, 0.0));
}
