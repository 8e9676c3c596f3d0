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
    // Sums over texel centres cancel for constant light up to degree 3, as the cube's symmetries ask. Degree 4 holds a
    // function with these symmetries (x⁴ + y⁴ + z⁴ - 3/5), so there the factor is a finer sum within the texel.
    let parts = select(1u, 4u, id.z / 6u >= 16u);
    var value = 0.0;
    for (var i = 0u; i < parts * parts; i++) {
        let part = id.xy * parts + vec2u(i % parts, i / parts);
        value += term(id.z / 6u, direction(id.z % 6u, part, edge * parts)) * solid_angle(part, edge * parts);
    }
    textureStore(factor, id.xy, id.z, vec4f(value, 0.0, 0.0, 0.0));
}
