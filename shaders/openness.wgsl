//! How open each probe is: alpha 1 in every direction but those that show the back of a single-sided surface, projected
//! on coefficient (0, 0).
#import lightgraph::cube::unplace
#import lightgraph::probes
#import lightgraph::surface::is_back

struct Params {
    cube_albedo_tile: u32,
    cube_albedo_columns: u32,
}
var<uniform> params: Params;
var cube_albedo: texture_2d<f32>;
var cube_normal: texture_2d<f32>;
var<storage, read> factor_table: array<f32>;
var openness: texture_storage_3d<rgba32float, write>;

@compute @workgroup_size(8, 4, 2)
fn main(@builtin(global_invocation_id) probe: vec3u) {
    if any(probe >= textureDimensions(openness)) {
        return;
    }
    let edge = params.cube_albedo_tile;
    var sum = 0.0;
    for (var i = 0u; i < 6u * edge * edge; i++) {
        let face = i / (edge * edge);
        let texel = vec2u(i % edge, i / edge % edge);
        let at = unplace(probes::number(probe) * 6u + face, texel, edge, params.cube_albedo_columns);
        if !is_back(textureLoad(cube_albedo, at, 0), textureLoad(cube_normal, at, 0)) {
            sum += factor_table[i];
        }
    }
    textureStore(openness, probe, vec4f(0.0, 0.0, 0.0, sum));
}
