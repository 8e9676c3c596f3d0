//! 1 - T, where T is what one bounce makes of the coefficients of all probes: light x at the probes is the limit of all
//! bounces of direct light e where x = e + T x.
//!
//! Entry (p, k; q, j) of T is the sum over the texels of probe p of what a texel counts in coefficient k, times what
//! the surface there reflects of coefficient j, times the share of probe q there. Each colour channel has its own.
#import lightgraph::brdf::lambert_weights
#ifdef SPECULAR
#import lightgraph::brdf::phong_weights
#endif
#import lightgraph::cube
#import lightgraph::probes
#import lightgraph::sh::COUNT
#import lightgraph::surface::read_record
#import lightgraph::texel_shares::Shares

struct Params {
    grid: vec3u,
    cube_albedo_tile: u32,
    cube_albedo_columns: u32,
}
var<uniform> params: Params;
var cube_albedo: texture_2d<f32>;
var cube_normal: texture_2d<f32>;
var<storage, read> factor_table: array<f32>;
var<storage, read> texel_shares: array<Shares>;
var<storage, read_write> matrix: array<vec4f>;

/// x: the probe whose light is reflected, and its coefficient; y: the probe that sees. Neighbours share the former, and
/// so leave out the same texels.
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let count = params.grid.x * params.grid.y * params.grid.z;
    if id.x >= count * COUNT || id.y >= count {
        return;
    }
    let giver = probes::coordinates(id.x / COUNT);
    let j = id.x % COUNT;
    let edge = params.cube_albedo_tile;
    let eye = probes::position(probes::coordinates(id.y));
    let texels = 6u * edge * edge;
    var column: array<vec3f, COUNT>;
    for (var i = 0u; i < texels; i++) {
        let shares = texel_shares[id.y * texels + i];
        // Most probes are none of the eight round a surface.
        let side = giver - shares.base;
        if shares.lit != 0u && all(side <= vec3u(1u)) {
            let share = shares.corners[side.z][side.x + 2u * side.y];
            let face = i / (edge * edge);
            let texel = vec2u(i % edge, i / edge % edge);
            let at = cube::unplace(id.y * 6u + face, texel, edge, params.cube_albedo_columns);
            let ray = cube::direction_beside(face, texel, edge);
            let s = read_record(textureLoad(cube_albedo, at, 0), textureLoad(cube_normal, at, 0), eye, ray);
            var weights = lambert_weights(s.normal);
            var reflected = s.albedo * weights[j];
#ifdef SPECULAR
            if s.specular > 0.0 {
                var gloss = phong_weights(reflect(-s.view, s.normal), s.shininess);
                reflected += s.specular * gloss[j];
            }
#endif
            reflected *= share;
            for (var k = 0u; k < COUNT; k++) {
                column[k] += factor_table[k * texels + i] * reflected;
            }
        }
    }
    for (var k = 0u; k < COUNT; k++) {
        let row = id.y * COUNT + k;
        let one = select(0.0, 1.0, id.x == row);
        matrix[row * count * COUNT + id.x] = vec4f(one - column[k], 0.0);
    }
}
