//! Sums up to 4x4 texels within each tile: one stage of the reduction to a texel a face (section 3.2 of the paper).
#import lightgraph::cube::{place, unplace}

struct Params {
    source_tile: u32,
    source_columns: u32,
    result_tile: u32,
    result_columns: u32,
    result_count: u32,
}
var<uniform> params: Params;
var source: texture_2d<f32>;
var result: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn sum(@builtin(global_invocation_id) id: vec3u) {
    let here = place(id.xy, params.result_tile, params.result_columns);
    if any(id.xy >= textureDimensions(result)) || here.tile >= params.result_count {
        return;
    }
    var total = vec4f(0.0);
    for (var i = 0u; i < 16u; i++) {
        let texel = here.texel * 4u + vec2u(i % 4u, i / 4u);
        if all(texel < vec2u(params.source_tile)) {
            total += textureLoad(source, unplace(here.tile, texel, params.source_tile, params.source_columns), 0);
        }
    }
    textureStore(result, id.xy, total);
}
