//! Counts the captured surfaces, and those among them that none of the eight probes round them sees.
#import lightgraph::cube
#import lightgraph::probes
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::visible_probes::is_lost

struct Params {
    cube_albedo_tile: u32,
    cube_albedo_columns: u32,
    cube_albedo_count: u32,
}
var<uniform> params: Params;
var cube_albedo: texture_2d<f32>;
var cube_normal: texture_2d<f32>;
/// Lost and all in the image, lost and all in the captured cubes.
var<storage, read_write> lost_counts: array<atomic<u32>>;

@compute @workgroup_size(8, 8)
fn count_lost_captured(@builtin(global_invocation_id) id: vec3u) {
    let edge = params.cube_albedo_tile;
    let here = cube::place(id.xy, edge, params.cube_albedo_columns);
    if any(id.xy >= textureDimensions(cube_albedo)) || here.tile >= params.cube_albedo_count {
        return;
    }
    let albedo = textureLoad(cube_albedo, id.xy, 0);
    if is_lit(albedo) {
        let probe = probes::position(probes::coordinates(here.tile / 6u));
        let ray = cube::direction_beside(here.tile % 6u, here.texel, edge);
        let s = read_record(albedo, textureLoad(cube_normal, id.xy, 0), probe, ray);
        atomicAdd(&lost_counts[2], u32(is_lost(s)));
        atomicAdd(&lost_counts[3], 1u);
    }
}
