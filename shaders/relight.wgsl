//! Light that every captured texel sends to its probe: its direct light, and what it reflects of the light in the
//! probes round it, as of the bounce before (section 4 of the paper). Alpha is 0 for the backs of single-sided
//! surfaces, else 1.
#import lightgraph::cube
#import lightgraph::probes
#import lightgraph::surface::{is_back, is_lit, read_record}
#import lightgraph::indirect::reflected_probes

struct Params {
    cube_light_tile: u32,
    cube_light_columns: u32,
    cube_light_count: u32,
    behind_captured: f32,
    /// The loop's index.
    bounce: u32,
}
var<uniform> params: Params;
var cube_albedo: texture_2d<f32>;
var cube_normal: texture_2d<f32>;
var cube_direct: texture_2d<f32>;
var sh: texture_3d<f32>;
var cube_light: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn relight(@builtin(global_invocation_id) id: vec3u) {
    let edge = params.cube_light_tile;
    let here = cube::place(id.xy, edge, params.cube_light_columns);
    if any(id.xy >= textureDimensions(cube_light)) || here.tile >= params.cube_light_count {
        return;
    }
    // Backs have none; the environment's is all of it.
    var light = textureLoad(cube_direct, id.xy, 0).rgb;
    let albedo = textureLoad(cube_albedo, id.xy, 0);
    let normal = textureLoad(cube_normal, id.xy, 0);
    // Before the first bounce the probes hold no light.
    if is_lit(albedo) && params.bounce > 0u {
        let probe = probes::position(probes::coordinates(here.tile / 6u));
        let ray = cube::direction_beside(here.tile % 6u, here.texel, edge);
        let s = read_record(albedo, normal, probe, ray);
        light += reflected_probes(sh, s, params.behind_captured);
    }
    textureStore(cube_light, id.xy, vec4f(light, select(1.0, 0.0, is_back(albedo, normal))));
}
