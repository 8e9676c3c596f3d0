//! Whether a probe sees a surface point, by a shadow cube map at the probe (section 6 of the paper).
#define_import_path lightgraph::visibility_cube
#import lightgraph::cube
#import lightgraph::probes
#ifdef PACKED_SURFACE
#import lightgraph::packed_surface::cube_surface
#endif

struct Test {
#ifdef PACKED_SURFACE
    cube_surface_tile: u32,
    cube_surface_columns: u32,
#else
    probe_distance_tile: u32,
    probe_distance_columns: u32,
#endif
    /// Offset along the normal that keeps a surface out of its own shadow, in texels of the cube map.
    probe_bias: f32,
}
var<uniform> test: Test;
#ifdef PACKED_SURFACE
fn edge_of_map() -> u32 {
    return test.cube_surface_tile;
}

/// As below, of what the probes see for their light.
fn seen_at(tile: u32, texel: vec2u) -> f32 {
    let at = cube::unplace(tile, texel, test.cube_surface_tile, test.cube_surface_columns);
    let words = textureLoad(cube_surface, at, 0);
    return select(-1.0, 1.0, (words.y >> 16u) != 0u) * abs(bitcast<f32>(words.w));
}
#else
/// Signed distances, as the entry `capture_distance` writes them; tile 6p + f is face f of probe p.
var probe_distance: texture_2d<f32>;

fn edge_of_map() -> u32 {
    return test.probe_distance_tile;
}

/// Metres along the ray; negative for the back of a single-sided surface, 0 for nothing.
fn seen_at(tile: u32, texel: vec2u) -> f32 {
    let at = cube::unplace(tile, texel, test.probe_distance_tile, test.probe_distance_columns);
    return textureLoad(probe_distance, at, 0).r;
}
#endif

/// 1 for a probe that sees the front of the surface at `point`, else 0. A probe inside a solid sees nothing.
///
/// Depths along the face's axis are compared. A plane stays clear of its own map when the point looked up is moved
/// along the normal by half a texel's diagonal times the sine between the normal and the axis: 0.71 texels at most.
/// A tenth of a texel covers the rounding where the sine vanishes.
fn visibility(probe: vec3u, point: vec3f, normal: vec3f) -> f32 {
    let eye = probes::position(probe);
    let offset = point - eye;
    if dot(offset, normal) >= 0.0 {
        return 0.0;
    }
    let edge = edge_of_map();
    let axis = cube::axes(cube::locate(offset, edge).face).forward;
    let cosine = dot(normal, axis);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let texel = 2.0 * dot(offset, axis) / f32(edge);
    let moved = offset + test.probe_bias * texel * max(sine, 0.1) * normal;

    let at = cube::locate(moved, edge);
    let tile = probes::number(probe) * 6u + at.face;
    let seen = seen_at(tile, at.texel);
    let forward = cube::axes(at.face).forward;
    let depth = seen * dot(cube::direction(at.face, at.texel, edge), forward);
    return select(0.0, 1.0, seen == 0.0 || dot(moved, forward) <= depth);
}
