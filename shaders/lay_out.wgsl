//! Lays the faces of a probe, a layer each, out in the atlases that hold a tile for each face of every probe.
#import lightgraph::cube::unplace

struct Params {
    probe: u32,
    cube_albedo_tile: u32,
    cube_albedo_columns: u32,
}
var<uniform> params: Params;
var face_albedo: texture_2d_array<f32>;
var face_normal: texture_2d_array<f32>;
var cube_albedo: texture_storage_2d<rgba32float, write>;
var cube_normal: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn lay_out(@builtin(global_invocation_id) id: vec3u) {
    let edge = params.cube_albedo_tile;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let at = unplace(params.probe * 6u + id.z, id.xy, edge, params.cube_albedo_columns);
    textureStore(cube_albedo, at, textureLoad(face_albedo, id.xy, id.z, 0));
    textureStore(cube_normal, at, textureLoad(face_normal, id.xy, id.z, 0));
}
