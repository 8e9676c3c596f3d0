//! What a probe sees through the centre of every texel of its cube, by a ray each: as capture.wgsl has it. With
//! PROBES_KEPT only for probes that are stale; the others' texels stay as they are.
#import lightgraph::cube
#import lightgraph::hit
#import lightgraph::probes
#import lightgraph::trace::closest

struct Params {
    cube_albedo_tile: u32,
    cube_albedo_columns: u32,
    cube_albedo_count: u32,
}
var<uniform> params: Params;
var cube_albedo: texture_storage_2d<rgba32float, write>;
var cube_normal: texture_storage_2d<rgba32float, write>;
#ifdef PROBES_KEPT
var<storage, read> stale: array<u32>;
#endif

@compute @workgroup_size(8, 8)
fn capture(@builtin(global_invocation_id) id: vec3u) {
    let edge = params.cube_albedo_tile;
    let here = cube::place(id.xy, edge, params.cube_albedo_columns);
    if any(id.xy >= textureDimensions(cube_albedo)) || here.tile >= params.cube_albedo_count {
        return;
    }
#ifdef PROBES_KEPT
    if stale[here.tile / 6u] == 0u {
        return;
    }
#endif
    let probe = probes::position(probes::coordinates(here.tile / 6u));
    let ray = cube::direction(here.tile % 6u, here.texel, edge);
    // The texel's width seen from the probe.
    let spread = sqrt(cube::solid_angle(here.texel, edge));
    let r = hit::record(hit::describe(closest(probe, ray), probe, ray, spread));
    textureStore(cube_albedo, id.xy, r.albedo);
    textureStore(cube_normal, id.xy, r.normal);
}
