//! 1 - T, where T is what one bounce makes of the coefficients of all probes: light x at the probes is the limit of all
//! bounces of direct light e where x = e + T x.
//!
//! Entry (p, k; q, j) of T is the sum over the texels of probe p of what a texel counts in coefficient k, times what the
//! surface there reflects of coefficient j, times the share of probe q there. Each colour channel has its own.
#import lightgraph::brdf::lambert_weights
#ifdef SPECULAR
#import lightgraph::brdf::phong_weights
#endif
#import lightgraph::cube
#import lightgraph::probes
#import lightgraph::sh::COUNT
#import lightgraph::surface::{is_lit, read_record}

struct Params {
    grid: vec3u,
    cube_albedo_tile: u32,
    cube_albedo_columns: u32,
    behind_captured: f32,
}
var<uniform> params: Params;
var cube_albedo: texture_2d<f32>;
var cube_normal: texture_2d<f32>;
var<storage, read> factor_table: array<f32>;
var openness: texture_3d<f32>;
var<storage, read_write> matrix: array<vec4f>;

/// x: the probe that sees; y: the probe whose light is reflected; z: its coefficient.
@compute @workgroup_size(4, 4, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let count = params.grid.x * params.grid.y * params.grid.z;
    if id.x >= count || id.y >= count || id.z >= COUNT {
        return;
    }
    let edge = params.cube_albedo_tile;
    let eye = probes::position(probes::coordinates(id.x));
    let giver = probes::coordinates(id.y);
    let texels = 6u * edge * edge;
    var column: array<vec3f, COUNT>;
    for (var i = 0u; i < texels; i++) {
        let face = i / (edge * edge);
        let texel = vec2u(i % edge, i / edge % edge);
        let at = cube::unplace(id.x * 6u + face, texel, edge, params.cube_albedo_columns);
        let albedo = textureLoad(cube_albedo, at, 0);
        if is_lit(albedo) {
            let ray = cube::direction_beside(face, texel, edge);
            let s = read_record(albedo, textureLoad(cube_normal, at, 0), eye, ray);
            let here = probes::cell(s.position);
            // Most probes are none of the eight round a surface.
            if all(giver >= here.base) && all(giver <= here.base + 1u) {
                var mine = 0.0;
                var all_shares = 0.0;
                for (var corner = 0u; corner < 8u; corner++) {
                    let share = probes::facing_share(
                        openness, here, corner, s.position, s.normal, params.behind_captured);
                    all_shares += share;
                    mine += select(0.0, share, all(probes::probe_at(here, corner) == giver));
                }
                var weights = lambert_weights(s.normal);
                var reflected = s.albedo * weights[id.z];
#ifdef SPECULAR
                if s.specular > 0.0 {
                    var gloss = phong_weights(reflect(-s.view, s.normal), s.shininess);
                    reflected += s.specular * gloss[id.z];
                }
#endif
                reflected *= mine / all_shares;
                for (var k = 0u; k < COUNT; k++) {
                    column[k] += factor_table[k * texels + i] * reflected;
                }
            }
        }
    }
    for (var k = 0u; k < COUNT; k++) {
        let one = select(0.0, 1.0, id.x == id.y && k == id.z);
        matrix[(id.x * COUNT + k) * count * COUNT + id.y * COUNT + id.z] = vec4f(one - column[k], 0.0);
    }
}
