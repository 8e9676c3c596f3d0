//! The rows of `lights` and `light_views` in a texture, for drivers that fetch four numbers of a texture in the time that
//! one of a table takes: light i in the first four texels of row i, the columns of view i's matrix in the last four.
#import lightgraph::lights::{lights, light_views}

struct Params {
    lights: u32,
    light_views: u32,
}
var<uniform> params: Params;
var light_texels: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8)
fn rows(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i < params.lights {
        let l = lights[i];
        textureStore(light_texels, vec2u(0u, i), vec4f(l.position, l.range));
        textureStore(light_texels, vec2u(1u, i), vec4f(l.direction, l.cos_inner));
        textureStore(light_texels, vec2u(2u, i), vec4f(l.intensity, l.cos_outer));
        textureStore(light_texels, vec2u(3u, i), vec4f(f32(l.kind), f32(l.first_view), f32(l.views), 0.0));
    }
    if i < params.light_views {
        let m = light_views[i].view_projection;
        for (var column = 0u; column < 4u; column++) {
            textureStore(light_texels, vec2u(4u + column, i), m[column]);
        }
    }
}
