//! The share of each of the eight probes round what a texel of a probe's cube shows: once for all that is reflected
//! there.
#import lightgraph::cube
#import lightgraph::probes
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::texel_shares::Shares

struct Params {
    grid: vec3u,
    cube_albedo_tile: u32,
    cube_albedo_columns: u32,
    behind_captured: f32,
}
var<uniform> params: Params;
var cube_albedo: texture_2d<f32>;
var cube_normal: texture_2d<f32>;
var openness: texture_3d<f32>;
var<storage, read_write> texel_shares: array<Shares>;

/// x: the texel of a cube; y: the probe.
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let edge = params.cube_albedo_tile;
    let texels = 6u * edge * edge;
    if id.x >= texels || id.y >= params.grid.x * params.grid.y * params.grid.z {
        return;
    }
    let face = id.x / (edge * edge);
    let texel = vec2u(id.x % edge, id.x / edge % edge);
    let at = cube::unplace(id.y * 6u + face, texel, edge, params.cube_albedo_columns);
    let albedo = textureLoad(cube_albedo, at, 0);
    var found: Shares;
    if is_lit(albedo) {
        let eye = probes::position(probes::coordinates(id.y));
        let s = read_record(albedo, textureLoad(cube_normal, at, 0), eye, cube::direction_beside(face, texel, edge));
        let here = probes::cell(s.position);
        var shares: array<f32, 8>;
        var sum = 0.0;
        for (var corner = 0u; corner < 8u; corner++) {
            let share = probes::facing_share(openness, here, corner, s.position, s.normal, params.behind_captured);
            shares[corner] = share;
            sum += share;
        }
        let near = vec4f(shares[0], shares[1], shares[2], shares[3]) / sum;
        let far = vec4f(shares[4], shares[5], shares[6], shares[7]) / sum;
        found = Shares(here.base, 1u, array<vec4f, 2>(near, far));
    }
    texel_shares[id.y * texels + id.x] = found;
}
