//! The coefficients of every probe in one pass: light times factor, summed over the probe's cube.
#import lightgraph::cube::unplace
#import lightgraph::probes
#import lightgraph::sh::COUNT

struct Params {
    grid: vec3u,
    cube_light_tile: u32,
    cube_light_columns: u32,
}
var<uniform> params: Params;
var cube_light: texture_2d<f32>;
var<storage, read> factor_table: array<f32>;
var sh: texture_storage_3d<rgba32float, write>;

/// x: the coefficient; y: the probe.
@compute @workgroup_size(64)
fn project(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= COUNT || id.y >= params.grid.x * params.grid.y * params.grid.z {
        return;
    }
    let edge = params.cube_light_tile;
    var light = vec4f(0.0);
    for (var face = 0u; face < 6u; face++) {
        let corner = unplace(id.y * 6u + face, vec2u(0u), edge, params.cube_light_columns);
        // Row by row, so that no sum grows so long that rounding shows.
        var sum = vec4f(0.0);
        for (var row = 0u; row < edge; row++) {
            var line = vec4f(0.0);
            let first = ((id.x * 6u + face) * edge + row) * edge;
            // Eight a round: a software driver ends an invocation's loops after 65,535 rounds, fewer than a cube has
            // texels.
            for (var start = 0u; start < edge; start += 8u) {
                for (var i = 0u; i < 8u; i++) {
                    let column = start + i;
                    if column < edge {
                        line += factor_table[first + column] * textureLoad(cube_light, corner + vec2u(column, row), 0);
                    }
                }
            }
            sum += line;
        }
        light += sum;
    }
    let probe = probes::coordinates(id.y);
    textureStore(sh, vec3u(probe.xy, probe.z + id.x * params.grid.z), light);
}
