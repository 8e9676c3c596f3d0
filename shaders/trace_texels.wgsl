//! The rows of `bvh` and the corners in `triangles` in textures, for drivers that fetch four numbers of a texture in
//! the time that one of a table takes: two texels a box, three a triangle. An instance is a row of texels, TRACE_PIECE
//! triangles and twice as many boxes. What is left of the last row is zero.
#import lightgraph::instances
#import lightgraph::trace::{bvh, triangles}

struct Params {
    triangles: u32,
}
var<uniform> params: Params;
var box_texels: texture_storage_2d<rgba32uint, write>;
var corner_texels: texture_storage_2d<rgba32uint, write>;

const PIECE: u32 = #{TRACE_PIECE}u;

@compute @workgroup_size(64)
fn texels(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let row = instances::number(group);
    let column = instances::within(group).x * 64u + lane;
    let b = row * 2u * PIECE + column;
    var box = array<vec4u, 2>();
    if b < arrayLength(&bvh) {
        box[0] = vec4u(bitcast<vec3u>(bvh[b].lower), bvh[b].first);
        box[1] = vec4u(bitcast<vec3u>(bvh[b].upper), bvh[b].count);
    }
    textureStore(box_texels, vec2u(2u * column, row), box[0]);
    textureStore(box_texels, vec2u(2u * column + 1u, row), box[1]);
    if column >= PIECE {
        return;
    }
    let t = row * PIECE + column;
    var corners = array<vec4u, 3>();
    if t < params.triangles {
        corners[0] = vec4u(bitcast<vec3u>(triangles[t].a), 0u);
        corners[1] = vec4u(bitcast<vec3u>(triangles[t].b), 0u);
        corners[2] = vec4u(bitcast<vec3u>(triangles[t].c), 0u);
    }
    textureStore(corner_texels, vec2u(3u * column, row), corners[0]);
    textureStore(corner_texels, vec2u(3u * column + 1u, row), corners[1]);
    textureStore(corner_texels, vec2u(3u * column + 2u, row), corners[2]);
}
