//! The rows of `bvh` and the corners in `triangles` in textures, for drivers that fetch four numbers of a texture in the
//! time that one of a table takes: two texels a box, three a triangle. A member is a row of texels, TRACE_PIECE triangles and twice
//! as many boxes. What is left of the last row is zero.
#import lightgraph::trace::{bvh, triangles}

struct Params {
    triangles: u32,
}
var<uniform> params: Params;
var<storage, read> members: array<u32>;
var box_texels: texture_storage_2d<rgba32uint, write>;
var corner_texels: texture_storage_2d<rgba32uint, write>;

const PIECE: u32 = #{TRACE_PIECE}u;

@compute @workgroup_size(64)
fn texels(@builtin(global_invocation_id) id: vec3u) {
    let row = members[id.z];
    let b = row * 2u * PIECE + id.x;
    var box = array<vec4u, 2>();
    if b < arrayLength(&bvh) {
        box[0] = vec4u(bitcast<vec3u>(bvh[b].lower), bvh[b].first);
        box[1] = vec4u(bitcast<vec3u>(bvh[b].upper), bvh[b].count);
    }
    textureStore(box_texels, vec2u(2u * id.x, row), box[0]);
    textureStore(box_texels, vec2u(2u * id.x + 1u, row), box[1]);
    if id.x >= PIECE {
        return;
    }
    let t = row * PIECE + id.x;
    var corners = array<vec4u, 3>();
    if t < params.triangles {
        corners[0] = vec4u(bitcast<vec3u>(triangles[t].a), 0u);
        corners[1] = vec4u(bitcast<vec3u>(triangles[t].b), 0u);
        corners[2] = vec4u(bitcast<vec3u>(triangles[t].c), 0u);
    }
    textureStore(corner_texels, vec2u(3u * id.x, row), corners[0]);
    textureStore(corner_texels, vec2u(3u * id.x + 1u, row), corners[1]);
    textureStore(corner_texels, vec2u(3u * id.x + 2u, row), corners[2]);
}
