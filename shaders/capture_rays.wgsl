//! What a probe sees through every texel of its cube, by a ray each: as capture.wgsl has it. With PROBES_KEPT only for
//! probes that are stale; the others' texels stay as they are. With DEPTHS a face shows what lies between the planes of
//! its view, and leaves its depths. A face is an instance.
#import lightgraph::cube
#import lightgraph::hit
#import lightgraph::instances
#ifdef PACKED_CAPTURE
#import lightgraph::packed_surface::pack
#endif
#import lightgraph::probes
#import lightgraph::surface::Record
#ifdef DEPTHS
#import lightgraph::moved::{ROWS, is_any, moved}
#import lightgraph::probe_views::{depth_of, depths}
#import lightgraph::trace::{Box, FAR, Hit, NOTHING, closest_between, reciprocal, span}
#else
#import lightgraph::trace::{Hit, closest}
#endif

struct Params {
#ifdef PACKED_CAPTURE
    cube_surface_tile: u32,
    cube_surface_columns: u32,
#else
    cube_albedo_tile: u32,
    cube_albedo_columns: u32,
#endif
}
var<uniform> params: Params;
#ifdef PACKED_CAPTURE
var cube_surface: texture_storage_2d<rgba32uint, write>;

/// Edge and columns of the atlas.
fn tiles() -> vec2u {
    return vec2u(params.cube_surface_tile, params.cube_surface_columns);
}

fn keep(at: vec2u, r: Record) {
    textureStore(cube_surface, at, pack(r));
}
#else
var cube_albedo: texture_storage_2d<rgba32float, write>;
var cube_normal: texture_storage_2d<rgba32float, write>;

/// Edge and columns of the atlas.
fn tiles() -> vec2u {
    return vec2u(params.cube_albedo_tile, params.cube_albedo_columns);
}

fn keep(at: vec2u, r: Record) {
    textureStore(cube_albedo, at, r.albedo);
    textureStore(cube_normal, at, r.normal);
}
#endif
#ifdef PROBES_KEPT
var<storage, read> stale: array<u32>;
#endif
#ifdef DEPTHS
var cube_far: texture_storage_2d<r32float, write>;

/// Whether a ray passes by all that moved: it meets what it met.
fn is_as_before(probe: vec3f, ray: vec3f) -> bool {
    let inverse = reciprocal(ray);
    for (var i = 0u; i < ROWS; i++) {
        let within = span(Box(moved[i].lower, 0u, moved[i].upper, 0u), probe, inverse, inverse < vec3f(0.0), FAR);
        if is_any(i) && within.first <= within.last {
            return false;
        }
    }
    return true;
}
#endif

/// What the ray of a texel meets; `slant`: how far along the face's axis a step along it leads.
fn meet(probe: vec3f, ray: vec3f, slant: f32) -> Hit {
#ifdef DEPTHS
    let planes = depths() / slant;
    var hit = closest_between(probe, ray, planes.x, planes.y);
    if hit.triangle == NOTHING {
        hit.distance = FAR;
    }
    return hit;
#else
    return closest(probe, ray);
#endif
}

@compute @workgroup_size(8, 8)
fn capture(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    // Lanes that follow on each other take texels next to each other, four by two: such rays take the same ways.
    let block = vec2u((lane >> 3u & 1u) * 4u + (lane & 3u), (lane >> 4u) * 2u + (lane >> 2u & 1u));
    let texel = 8u * instances::within(group) + block;
    let tiling = tiles();
    let edge = tiling.x;
    if any(texel >= vec2u(edge)) {
        return;
    }
    let tile = instances::number(group);
    let at = cube::unplace(tile, texel, edge, tiling.y);
#ifdef PROBES_KEPT
    if stale[tile / 6u] == 0u {
        return;
    }
#endif
    let probe = probes::position(probes::coordinates(tile / 6u));
    let face = tile % 6u;
    let ray = cube::direction_beside(face, texel, edge);
#ifdef DEPTHS
    if instances::in_part() && is_as_before(probe, ray) {
        return;
    }
#endif
    let slant = cube::inward(face, ray).z;
    let hit = meet(probe, ray, slant);
    // The texel's width seen from the probe.
    let spread = sqrt(cube::solid_angle(texel, edge));
    keep(at, hit::record(hit::describe(hit, probe, ray, spread)));
#ifdef DEPTHS
    textureStore(cube_far, at, vec4f(depth_of(hit.distance * slant)));
#endif
}
