//! Which probes see what the probes see: once for all bounces, and for as long as nothing but light moves. A workgroup
//! for each face of each probe, a face of all probes after the other: in one direction all look at the same surfaces,
//! and what sees those is asked about them again and again.
#import lightgraph::cube
#import lightgraph::packed_surface::surface_at
#import lightgraph::probes
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::visible_probes::sight

struct Params {
    grid: vec3u,
    cube_sight_tile: u32,
    cube_sight_columns: u32,
}
var<uniform> params: Params;
/// As `lightgraph::visible_probes::sight` has it.
var cube_sight: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let edge = params.cube_sight_tile;
    let face = u32((f32(group.z) + 0.5) / f32(params.grid.z));
    let probe = vec3u(group.xy, group.z - face * params.grid.z);
    let eye = probes::position(probe);
    let corner = cube::corner(probes::number(probe) * 6u + face, edge, params.cube_sight_columns);
    for (var y = local.y; y < edge; y += 8u) {
        for (var x = local.x; x < edge; x += 8u) {
            let texel = vec2u(x, y);
            let r = surface_at(corner + texel);
            var seen = 0u;
            if is_lit(r.albedo) {
                let s = read_record(r.albedo, r.normal, eye, cube::direction_beside(face, texel, edge));
                seen = sight(probes::cell(s.position), s);
            }
            textureStore(cube_sight, corner + texel, vec4u(seen, 0u, 0u, 0u));
        }
    }
}
