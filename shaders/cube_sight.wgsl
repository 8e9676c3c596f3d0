//! Which probes see what the probes see: once for all bounces, and for as long as nothing but light moves.
#import lightgraph::cube
#import lightgraph::packed_surface::surface_at
#import lightgraph::probes
#import lightgraph::surface::is_lit
#import lightgraph::visible_probes::sight

struct Params {
    cube_sight_tile: u32,
    cube_sight_columns: u32,
    cube_sight_count: u32,
}
var<uniform> params: Params;
/// As `lightgraph::visible_probes::sight` has it.
var cube_sight: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let edge = params.cube_sight_tile;
    let here = cube::place(id.xy, edge, params.cube_sight_columns);
    if any(id.xy >= textureDimensions(cube_sight)) || here.tile >= params.cube_sight_count {
        return;
    }
    let r = surface_at(id.xy);
    var seen = 0u;
    if is_lit(r.albedo) {
        let eye = probes::position(probes::coordinates(here.tile / 6u));
        let point = eye + r.normal.w * cube::direction(here.tile % 6u, here.texel, edge);
        seen = sight(probes::cell(point), point, r.normal.xyz);
    }
    textureStore(cube_sight, id.xy, vec4u(seen, 0u, 0u, 0u));
}
