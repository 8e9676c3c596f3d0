//! The solid angle of every texel of a cube's face.
#import lightgraph::cube::solid_angle

var angles: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn fill(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(angles).x;
    if all(id.xy < vec2u(edge)) {
        textureStore(angles, id.xy, vec4f(solid_angle(id.xy, edge)));
    }
}
