//! Counts the points of a net that lie in a cell: a column of the image for each cell, seven rows for each net's grids,
//! from 64 columns to 64 rows.
#import lightgraph::random::{sobol_pair, scramble}

var color: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn count_in_cells(@builtin(global_invocation_id) id: vec3u) {
    let across = 1u << (6u - id.y % 7u);
    let cells = vec2u(across, 64u / across);
    let cell = vec2u(id.x % across, id.x / across);
    var count = 0u;
    for (var i = 0u; i < 64u; i++) {
        let at = vec2u(sobol_pair(i, scramble(id.y / 7u)) * vec2f(cells));
        count += select(0u, 1u, all(at == cell));
    }
    textureStore(color, id.xy, vec4f(f32(count)));
}
