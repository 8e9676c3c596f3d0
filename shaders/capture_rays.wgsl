//! What a probe sees through every texel of its cube, by a ray each: as capture.wgsl has it. With
//! PROBES_KEPT only for probes that are stale; the others' texels stay as they are. With BY_FACE a face is a member, which
//! shows what lies between the planes of its view, and leaves its depths.
#import lightgraph::cube
#import lightgraph::hit
#ifdef PACKED_CAPTURE
#import lightgraph::packed_surface::pack
#endif
#import lightgraph::probes
#import lightgraph::surface::Record
#ifdef BY_FACE
#import lightgraph::probe_views::{depth_of, depths}
#import lightgraph::trace::{Box, FAR, Hit, NOTHING, closest_between, enter, reciprocal}
#else
#import lightgraph::trace::{Hit, closest}
#endif

struct Params {
#ifdef PACKED_CAPTURE
    cube_surface_tile: u32,
    cube_surface_columns: u32,
    cube_surface_count: u32,
#else
    cube_albedo_tile: u32,
    cube_albedo_columns: u32,
    cube_albedo_count: u32,
#endif
}
var<uniform> params: Params;
#ifdef PACKED_CAPTURE
var cube_surface: texture_storage_2d<rgba32uint, write>;

fn tiles() -> vec3u {
    return vec3u(params.cube_surface_tile, params.cube_surface_columns, params.cube_surface_count);
}

fn size() -> vec2u {
    return textureDimensions(cube_surface);
}

fn keep(at: vec2u, r: Record) {
    textureStore(cube_surface, at, pack(r));
}
#else
var cube_albedo: texture_storage_2d<rgba32float, write>;
var cube_normal: texture_storage_2d<rgba32float, write>;

fn tiles() -> vec3u {
    return vec3u(params.cube_albedo_tile, params.cube_albedo_columns, params.cube_albedo_count);
}

fn size() -> vec2u {
    return textureDimensions(cube_albedo);
}

fn keep(at: vec2u, r: Record) {
    textureStore(cube_albedo, at, r.albedo);
    textureStore(cube_normal, at, r.normal);
}
#endif
#ifdef PROBES_KEPT
var<storage, read> stale: array<u32>;
#endif
#ifdef BY_FACE
var cube_far: texture_storage_2d<r32float, write>;
var<storage, read> members: array<u32>;

struct Moved {
    lower: vec3f,
    upper: vec3f,
}
/// Rays that pass by all of these meet what they met.
var<uniform> moved: array<Moved, 4>;

fn is_other(probe: vec3f, ray: vec3f) -> bool {
    let inverse = reciprocal(ray);
    for (var i = 0u; i < 4u; i++) {
        if enter(Box(moved[i].lower, 0u, moved[i].upper, 0u), probe, inverse, FAR) < FAR {
            return true;
        }
    }
    return false;
}
#endif

/// What the ray of a texel meets; `slant`: how far along the face's axis a step along it leads.
fn meet(probe: vec3f, ray: vec3f, slant: f32) -> Hit {
#ifdef BY_FACE
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
    let id = vec3u(
        8u * group.x + (lane >> 3u & 1u) * 4u + (lane & 3u),
        8u * group.y + (lane >> 4u) * 2u + (lane >> 2u & 1u),
        group.z,
    );
    // Edge and columns of the atlas, and how many tiles there are.
    let tiling = tiles();
    let edge = tiling.x;
#ifdef BY_FACE
    let here = cube::Place(members[id.z], id.xy);
    let at = cube::unplace(here.tile, id.xy, edge, tiling.y);
    if any(id.xy >= vec2u(edge)) {
        return;
    }
#else
    let here = cube::place(id.xy, edge, tiling.y);
    let at = id.xy;
    if any(at >= size()) || here.tile >= tiling.z {
        return;
    }
#endif
#ifdef PROBES_KEPT
    if stale[here.tile / 6u] == 0u {
        return;
    }
#endif
    let probe = probes::position(probes::coordinates(here.tile / 6u));
    let face = here.tile % 6u;
    let ray = cube::direction_beside(face, here.texel, edge);
#ifdef BY_FACE
    if !is_other(probe, ray) {
        return;
    }
#endif
    let slant = cube::inward(face, ray).z;
    let hit = meet(probe, ray, slant);
    // The texel's width seen from the probe.
    let spread = sqrt(cube::solid_angle(here.texel, edge));
    keep(at, hit::record(hit::describe(hit, probe, ray, spread)));
#ifdef BY_FACE
    textureStore(cube_far, at, vec4f(depth_of(hit.distance * slant)));
#endif
}
