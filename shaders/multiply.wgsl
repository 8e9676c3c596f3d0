//! One coefficient's share of every texel: its light (and alpha) times the factor texture.
#import lightgraph::cube::place

struct Params {
    /// The coefficient.
    member: u32,
    product_tile: u32,
    product_columns: u32,
    product_count: u32,
}
var<uniform> params: Params;
var cube_light: texture_2d<f32>;
var factor: texture_2d_array<f32>;
var product: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn multiply(@builtin(global_invocation_id) id: vec3u) {
    let here = place(id.xy, params.product_tile, params.product_columns);
    if any(id.xy >= textureDimensions(product)) || here.tile >= params.product_count {
        return;
    }
    let share = textureLoad(factor, here.texel, params.member * 6u + here.tile % 6u, 0).r;
    textureStore(product, id.xy, textureLoad(cube_light, id.xy, 0) * share);
}
