//! Puts one coefficient of every probe, the sum over its six faces, in its place in the grid's texture.
#import lightgraph::cube::unplace

struct Params {
    /// The coefficient.
    member: u32,
    grid: vec3u,
    total_columns: u32,
}
var<uniform> params: Params;
/// One texel a face.
var total: texture_2d<f32>;
var sh: texture_storage_3d<rgba32float, write>;

@compute @workgroup_size(8, 4, 2)
fn place(@builtin(global_invocation_id) id: vec3u) {
    if any(id >= params.grid) {
        return;
    }
    let probe = (id.z * params.grid.y + id.y) * params.grid.x + id.x;
    var light = vec4f(0.0);
    for (var face = 0u; face < 6u; face++) {
        light += textureLoad(total, unplace(probe * 6u + face, vec2u(0u), 1u, params.total_columns), 0);
    }
    textureStore(sh, vec3u(id.xy, id.z + params.member * params.grid.z), light);
}
