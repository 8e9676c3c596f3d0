//! The rows of `bvh` and the corners in `triangles` in textures, for drivers that fetch four numbers of a texture in the
//! time that one of a table takes: two texels a box, three a triangle.
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
    if i < arrayLength(&bvh) {
        let box = bvh[i];
        textureStore(box_texels, place(2u * i), vec4u(bitcast<vec3u>(box.lower), box.first));
        textureStore(box_texels, place(2u * i + 1u), vec4u(bitcast<vec3u>(box.upper), box.count));
    }
    if i < params.triangles {
        textureStore(corner_texels, place(3u * i), vec4u(bitcast<vec3u>(triangles[i].a), 0u));
        textureStore(corner_texels, place(3u * i + 1u), vec4u(bitcast<vec3u>(triangles[i].b), 0u));
        textureStore(corner_texels, place(3u * i + 2u), vec4u(bitcast<vec3u>(triangles[i].c), 0u));
    }
}
