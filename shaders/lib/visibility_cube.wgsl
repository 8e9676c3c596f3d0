//! Whether a probe sees a surface point, by a shadow cube map at the probe (section 6 of the paper).
//!
//! A texel holds the plane of what its centre meets, not a depth alone: a map of few texels then tells a surface that
//! lies before the plane from one behind it, however thin the wall and however grazing the view.
#define_import_path lightgraph::visibility_cube
#import lightgraph::cube
#import lightgraph::probes
#import lightgraph::surface::Surface
#ifdef PACKED_SURFACE
#import lightgraph::packed_surface::surface_at
#ifdef SMOOTH
#import lightgraph::surface::{material_of, materials}
#endif
#endif

struct Test {
#ifdef PACKED_SURFACE
    cube_surface_tile: u32,
    cube_surface_columns: u32,
#else
    probe_distance_tile: u32,
    probe_distance_columns: u32,
#endif
}
var<uniform> test: Test;

/// Metres behind a plane that count as on it, by the width of a texel there: rounding alone asks for a hundredth of
/// that.
const SLACK: f32 = 0.01;

/// What a texel holds.
struct Seen {
    /// Metres along the ray, 0 for nothing.
    distance: f32,
    /// Unit, away from the probe.
    normal: vec3f,
    /// Sine of the angle between it and the normal of the triangle, at most.
    deviation: f32,
}

#ifdef PACKED_SURFACE
fn edge_of_map() -> u32 {
    return test.cube_surface_tile;
}

/// As below, of what the probes see for their light.
fn seen_at(tile: u32, texel: vec2u) -> Seen {
    let seen = surface_at(cube::unplace(tile, texel, test.cube_surface_tile, test.cube_surface_columns));
    var found = Seen(seen.normal.w, -seen.normal.xyz, 0.0);
#ifdef SMOOTH
    found.deviation = materials[material_of(seen.albedo)].normal_deviation;
#endif
    return found;
}
#else
/// As the entry `capture_distance` writes them; tile 6p + f is face f of probe p.
var probe_distance: texture_2d<f32>;

fn edge_of_map() -> u32 {
    return test.probe_distance_tile;
}

fn seen_at(tile: u32, texel: vec2u) -> Seen {
    let at = cube::unplace(tile, texel, test.probe_distance_tile, test.probe_distance_columns);
    let seen = textureLoad(probe_distance, at, 0);
    return Seen(abs(seen.x), seen.yzw, 0.0);
}
#endif

/// Whether what a probe sees in the direction `d` hides a surface at `offset` from it: the surface lies behind the
/// plane that is seen, and what is seen before the surface's own plane. Both by more than `slack` metres, and by more
/// than normals that are not the triangles' may tilt these planes.
fn hides(probe: u32, d: vec3f, offset: vec3f, s: Surface, slack: f32) -> bool {
    let edge = edge_of_map();
    let at = cube::locate(d, edge);
    let seen = seen_at(probe * 6u + at.face, at.texel);
    let behind = offset - seen.distance * cube::direction_beside(at.face, at.texel, edge);
    var slacks = vec2f(slack);
#ifdef SMOOTH
    slacks += length(behind) * vec2f(seen.deviation, s.deviation);
#endif
    return (seen.distance > 0.0) & (dot(behind, seen.normal) > slacks.x) & (dot(behind, s.normal) < -slacks.y);
}

/// Whether a surface faces a probe.
fn faces(probe: vec3u, s: Surface) -> bool {
    return dot(s.position - probes::position(probe), s.normal) < 0.0;
}

/// 1 for a probe that sees the front of a surface, else 0.
///
/// Each of the four texels round it may hide it: one alone would look past the edges of walls thinner than itself. In a
/// corner of a room it lies before the planes of all walls, and on an edge of a solid what the texels see lies behind
/// its own plane, so neither hides anything. A probe inside a solid sees no surface but from within.
fn visibility(probe: vec3u, s: Surface) -> f32 {
    let offset = s.position - probes::position(probe);
    if dot(offset, s.normal) >= 0.0 {
        return 0.0;
    }
    let edge = edge_of_map();
    let face = cube::face_of(offset);
    let inner = cube::inward(face, offset);
    let width = 2.0 * inner.z / f32(edge);
    var hidden = false;
    for (var corner = 0u; corner < 4u && !hidden; corner++) {
        let side = vec2f(vec2u(corner & 1u, corner >> 1u)) - 0.5;
        let d = cube::outward(face, inner + vec3f(width * side, 0.0));
        hidden = hides(probes::number(probe), d, offset, s, SLACK * width);
    }
    return select(1.0, 0.0, hidden);
}
