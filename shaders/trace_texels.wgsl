//! The rows of `bvh` and the corners in `triangles` in textures, for drivers that fetch four numbers of a texture in the
//! time that one of a table takes: two texels a box, three a triangle. What is left of the last row is zero.
#import lightgraph::trace::{bvh, triangles}

struct Params {
    triangles: u32,
}
var<uniform> params: Params;
var box_texels: texture_storage_2d<rgba32uint, write>;
var corner_texels: texture_storage_2d<rgba32uint, write>;

const WIDTH: u32 = 8192u;

fn place(i: u32) -> vec2u {
    return vec2u(i % WIDTH, i / WIDTH);
}

@compute @workgroup_size(64)
fn texels(@builtin(global_invocation_id) id: vec3u) {
    let i = id.y * WIDTH + id.x;
    var box = array<vec4u, 2>();
    if i < arrayLength(&bvh) {
        box[0] = vec4u(bitcast<vec3u>(bvh[i].lower), bvh[i].first);
        box[1] = vec4u(bitcast<vec3u>(bvh[i].upper), bvh[i].count);
    }
    textureStore(box_texels, place(2u * i), box[0]);
    textureStore(box_texels, place(2u * i + 1u), box[1]);
    var corners = array<vec4u, 3>();
    if i < params.triangles {
        corners[0] = vec4u(bitcast<vec3u>(triangles[i].a), 0u);
        corners[1] = vec4u(bitcast<vec3u>(triangles[i].b), 0u);
        corners[2] = vec4u(bitcast<vec3u>(triangles[i].c), 0u);
    }
    textureStore(corner_texels, place(3u * i), corners[0]);
    textureStore(corner_texels, place(3u * i + 1u), corners[1]);
    textureStore(corner_texels, place(3u * i + 2u), corners[2]);
}
